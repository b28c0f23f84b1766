"""Section of beams that follow a curved yarn: the law of a curved rod, by the curvature of every element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.mechanics.beam import SLENDERNESS
from knitstudy.mechanics.curved_rod import TIGHTEST, compliances


@dataclass(frozen=True)
class CurvedSection:
    """Solid circular sections of one isotropic material, in rods that are bent without stress.

    Where a rod is straight this is `Section.circular`, with the shear factor of the strain energy (0.847 at nu = 0.42)
    for 0.89.

    Attributes
    ----------
    radius : float
        [m]
    youngs_modulus : float
        [Pa]
    poisson_ratio : float
    curvature : ndarray, shape (E, 3)
        Mean curvature vector t x dt/ds of the undeformed rod over every element: along the binormal [1/m].
    slenderness : float
        See `Section`.
    """

    radius: float
    youngs_modulus: float
    poisson_ratio: float
    curvature: np.ndarray
    slenderness: float = SLENDERNESS

    def stiffness(self, chord: np.ndarray) -> np.ndarray:
        """Return the law C (E, 6, 6) of elements with the reference chords (E, 3) [m], see `SectionLaw`.

        Raises
        ------
        GeometryError
            If a rod is bent more tightly than the law is known for.
        """
        length = np.linalg.norm(chord, axis=1)
        frame, bend = self._frames(chord / length[:, None])
        S = compliances(bend, self.poisson_ratio)
        S[:, :2, :2] *= (1 + self.slenderness * (length / self.radius) ** 2 / 3)[
            :, None, None
        ]  # R^2 EA = 4 EI
        scale = np.repeat([1.0, self.radius], 3)
        law = self.youngs_modulus * self.radius**2 * np.outer(scale, scale) * np.linalg.inv(S)
        turn = np.zeros_like(law)
        turn[:, :3, :3] = turn[:, 3:, 3:] = frame
        return turn.swapaxes(1, 2) @ law @ turn

    def _frames(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows N, B, t (E, 3, 3) of elements along t, and their curvature over 1 / radius (E,)."""
        across = self.curvature - np.einsum("ei,ei->e", self.curvature, t)[:, None] * t
        bend = self.radius * np.linalg.norm(across, axis=1)
        if not np.all(bend <= TIGHTEST):
            worst = int(np.argmax(np.nan_to_num(bend, nan=np.inf)))
            raise GeometryError(
                f"beam element {worst} is bent to a radius of {self.radius / bend[worst]:.4g} m, and the law of a "
                f"curved rod is known down to {self.radius / TIGHTEST:.4g} m, {1 / TIGHTEST:g} yarn radii: "
                "mesh.section_law straight does without it"
            )
        # Where a rod is straight any normal will do.
        any_normal = np.eye(3)[np.argmin(np.abs(t), axis=1)]
        B = np.where((bend > 1e-12)[:, None], across, np.cross(t, any_normal))
        B /= np.linalg.norm(B, axis=1)[:, None]
        return np.stack([np.cross(B, t), B, t], axis=1), bend
