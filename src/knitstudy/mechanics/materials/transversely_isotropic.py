"""Transversely isotropic elasticity about the yarn's axis, linear in logarithmic strain."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.materials import FULL, MATERIALS, Axes, Field, Stress, rotate_strain
from knitstudy.mechanics.materials.isotropic import Resolvent, add_pairs, components, crossed, product

TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])  # engineering components over components of the tensor


@MATERIALS.register
@dataclass(frozen=True)
class TransverselyIsotropic:
    """W = L : c L / 2, L = ln(C) / 2, C = 1 + 2 E; of equal constants this is Hencky's law.

    The stiffness c of small strains has five constants about the first of the local axes, in the undeformed yarn.
    With A(t) = (1 + t (C - 1))^-1 the derivative of L along H is the integral of A H A over t from 0 to 1, so that

        S = int A T A dt,  T = c L,    dS = int A (c dL) A dt - 2 int t (A dE B + B dE A) dt,  B = A T A

    by the quadrature of `isotropic.Resolvent` (Higham 2008, Functions of Matrices, section 11.5).

    Raises ConfigurationError for constants without a positive strain energy.
    """

    youngs_modulus: float  # E_a, along the axis [Pa]
    transverse_modulus: float  # E_t, across it [Pa]
    poisson_ratio: float  # nu_a, contraction across the axis over the stretch along it
    transverse_poisson_ratio: float  # nu_t, the same along another line across it
    axial_shear_modulus: float  # G_a, of planes that hold the axis [Pa]: torsion of the yarn

    name: ClassVar[str] = "transversely_isotropic"
    meaning: ClassVar[str] = "five constants about the yarn's axis"
    directional: ClassVar[bool] = True
    logarithmic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        for name in ("youngs_modulus", "transverse_modulus", "axial_shear_modulus"):
            if not getattr(self, name) > 0:
                raise ConfigurationError(f"{name} is {getattr(self, name):g} and has to be positive")
        nu_t = self.transverse_poisson_ratio
        if not abs(nu_t) < 1:
            raise ConfigurationError(f"transverse_poisson_ratio is {nu_t:g} and has to lie in (-1, 1)")
        least = 1 - nu_t - 2 * self.poisson_ratio**2 * self.transverse_modulus / self.youngs_modulus
        if not least > 0:
            raise ConfigurationError(
                f"poisson_ratio is {self.poisson_ratio:g} and stores no positive energy with the other "
                f"constants: 1 - nu_t - 2 nu_a^2 E_t / E_a is {least:.3g} and has to be positive"
            )

    @classmethod
    def of(cls, yarn: Any) -> Self:
        """Return the material of a scene's section `yarn`; open constants are as for an isotropic yarn."""
        modulus, ratio = yarn.youngs_modulus, yarn.poisson_ratio
        given = yarn.transverse_modulus, yarn.transverse_poisson_ratio, yarn.axial_shear_modulus
        isotropic = modulus, ratio, modulus / (2 * (1 + ratio))
        across, sideways, twist = (i if g is None else g for g, i in zip(given, isotropic, strict=True))
        return cls(modulus, across, ratio, sideways, twist)

    @property
    def shear_modulus(self) -> float:
        """G_a [Pa]."""
        return self.axial_shear_modulus

    @property
    def across(self) -> tuple[float, float]:
        """E_t [Pa] and nu_t, within the bounds of an isotropic solid."""
        return self.transverse_modulus, min(self.transverse_poisson_ratio, 0.49)

    def without_dilatation(self) -> tuple[TransverselyIsotropic, float]:
        """Return a law with the bulk modulus 2/3 G_t, if this one has more, and the difference [Pa].

        Of equal constants that is the first Lame constant. The bulk modulus is the pressure over the dilatation that it
        causes; a stiffness less a smaller one than that stays positive definite.
        """
        stiffness = self.stiffness[:3, :3]
        shear = 0.5 * self.transverse_modulus / (1 + self.transverse_poisson_ratio)
        lame = max(0.0, 1 / np.linalg.inv(stiffness).sum() - 2 / 3 * shear)
        s = np.linalg.inv(stiffness - lame)
        constants = 1 / s[0, 0], 1 / s[1, 1], -s[0, 1] / s[0, 0], -s[1, 2] / s[1, 1]
        return type(self)(*constants, self.axial_shear_modulus), lame

    @cached_property
    def stiffness(self) -> Floats:
        """c (6, 6) [Pa]: stress over engineering strain, the axis first."""
        e_a, e_t, shear = self.youngs_modulus, self.transverse_modulus, self.axial_shear_modulus
        nu_t = self.transverse_poisson_ratio
        compliance = np.diag([1 / e_a, 1 / e_t, 1 / e_t, 1 / shear, 2 * (1 + nu_t) / e_t, 1 / shear])
        compliance[0, 1:3] = compliance[1:3, 0] = -self.poisson_ratio / e_a
        compliance[1, 2] = compliance[2, 1] = -nu_t / e_t
        return np.linalg.inv(compliance)

    def respond(self, strain: Floats, tangent: bool, axes: Axes = None, pressure: Field = 0.0) -> Stress:
        """Return the response to Green strains (e, 3, 3), with local axes (e, 3, 3) in columns.

        Raises ConfigurationError without local axes.
        """
        if axes is None:
            raise ConfigurationError("transversely isotropic elasticity needs the local axes of every strain")
        local = np.swapaxes(axes, 1, 2) @ strain @ axes
        x = 2 * components(local)
        resolvent = Resolvent(x)
        logs = TWICE[:, None] * (0.5 * product(x, resolvent.sum(resolvent.weights)))
        force = self.stiffness @ logs  # T
        slope = _moduli(0.5 * resolvent.pairs(resolvent.weights))  # dL over engineering strains (e, 6, 6)
        stress = (slope @ (TWICE[:, None] * force).T[:, :, None])[:, FULL, 0]
        stress += (pressure * resolvent.inverse)[FULL].transpose(2, 0, 1)
        full = axes @ stress @ np.swapaxes(axes, 1, 2)
        energy = 0.5 * np.einsum("pe,pe->e", force, logs)
        if not tangent:
            return Stress(energy, full, None)
        moduli = slope @ (TWICE[:, None] * self.stiffness * TWICE) @ slope
        pairs = self._second_order(resolvent, force)
        add_pairs(pairs, -0.5 * pressure * resolvent.inverse, resolvent.inverse)
        moduli += _moduli(pairs)
        turn = rotate_strain(axes)
        return Stress(energy, full, np.swapaxes(turn, 1, 2) @ moduli @ turn)

    def _second_order(self, resolvent: Resolvent, force: Floats) -> Floats:
        """Return the pairs (21, e) of -int t (A B + B A) dt, B = A T A."""
        pairs = np.zeros((21, force.shape[1]))
        for number, (node, weight) in enumerate(zip(resolvent.nodes, resolvent.weights, strict=True)):
            a = resolvent.sum(np.eye(len(resolvent.nodes))[number])
            full = a[FULL].transpose(2, 0, 1)
            b = components(full @ force[FULL].transpose(2, 0, 1) @ full)
            add_pairs(pairs, -weight * node * a, b)
        return pairs


def _moduli(pairs: Floats) -> Floats:
    """Return A_ik A_jl + A_il A_jk (e, 6, 6) of pairs (21, e), every matrix one run of memory."""
    return np.ascontiguousarray(crossed(pairs).transpose(2, 0, 1))
