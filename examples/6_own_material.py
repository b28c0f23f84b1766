"""A material of your own: a law that stiffens, W = W0 + k/4 (E:E)^2 E0, in one class that a scene names."""

import matplotlib.pyplot as plt
import numpy as np

from knitstudy import load_scene, simulate
from knitstudy.mechanics.materials import MATERIALS, VOIGT, Stress
from knitstudy.mechanics.materials.isotropic import StVenantKirchhoff

STIFFENING = 100.0  # k


@MATERIALS.register
class Stiffening(StVenantKirchhoff):
    """St Venant and Kirchhoff's law, and an energy of fourth order in Green's strain."""

    name, meaning = "stiffening", "an example"

    def respond(self, strain, tangent, axes=None, pressure=0.0):
        """Return energy, stress and tangent of Green strains (e, 3, 3)."""
        linear = super().respond(strain, tangent, axes, pressure)
        k, square = STIFFENING * self.shear_modulus, np.einsum("eij,eij->e", strain, strain)
        energy, stress = linear.energy + k / 4 * square**2, linear.stress + k * square[:, None, None] * strain
        if not tangent:
            return Stress(energy, stress, None)
        part = strain[:, VOIGT[:, 0], VOIGT[:, 1]]  # (e, 6)
        unit = np.diag([1.0, 1, 1, 0.5, 0.5, 0.5])  # of engineering shears
        added = 2 * k * part[:, :, None] * part[:, None, :] + k * square[:, None, None] * unit
        return Stress(energy, stress, linear.tangent + added)


for law in ("st_venant_kirchhoff", "stiffening"):
    history = simulate(load_scene("cell-course").replace("yarn.material", law)).history
    print(f"{law}: {float(history['force'][-1]):.3f} N")
    plt.plot(100 * history["strain"], history["force"], label=law)
plt.xlabel("strain [%]")
plt.ylabel("force [N]")
plt.legend()
plt.savefig("material.png")
