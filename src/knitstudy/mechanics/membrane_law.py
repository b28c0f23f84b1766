"""Laws of a fabric as a membrane: energy over undeformed area by the strains in its plane.

Strains are Green's, E = (E_11, E_22, 2 E_12), in axes of the undeformed fabric (1 course, 2 wale); stresses (second
Piola-Kirchhoff, times thickness) are forces per width S = dW/dE [N/m]. Cells of an endless fabric have stretches
e = U - 1 instead, and the forces per width T = (dE/de)^T S that do work on them: `green` leads from one to the other.

An energy that is convex in E has a positive tangent wherever principal stresses are not negative: F^T F is convex in
F (Ogden 1997, Non-linear elastic deformations, section 6.2). Where one is negative a fabric wrinkles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Parts = tuple[np.ndarray, np.ndarray, np.ndarray]
"""W (...) [J/m2], S (..., 3) [N/m] and dS/dE (..., 3, 3) [N/m] at strains (..., 3)."""


class MembraneLaw:
    """An energy over area with its derivatives; a law has `respond`."""

    def respond(self, strain: np.ndarray) -> Parts:
        """Return energy, stress and tangent at strains (..., 3)."""
        raise NotImplementedError

    def energy(self, strain: np.ndarray) -> np.ndarray:
        """Return W (...) [J/m2]."""
        return self.respond(strain)[0]

    def stress(self, strain: np.ndarray) -> np.ndarray:
        """Return S = dW/dE (..., 3) [N/m]."""
        return self.respond(strain)[1]

    def tangent(self, strain: np.ndarray) -> np.ndarray:
        """Return dS/dE (..., 3, 3) [N/m]."""
        return self.respond(strain)[2]


@dataclass(frozen=True, eq=False)
class ExponentialLaw(MembraneLaw):
    """W = E . A E / 2 + sum of w (exp(a . E) - 1 - a . E) with A >= 0 and w > 0: free of stress at rest, and convex.

    A term stiffens where a . E > 0 and its stress saturates where that is negative, so that such sums come near any
    curve that rises.
    """

    form: np.ndarray  # A (3, 3), symmetric [N/m]
    weight: np.ndarray  # (k,) w [N/m]
    slope: np.ndarray  # (k, 3) a

    def respond(self, strain: np.ndarray) -> Parts:
        """Return energy, stress and tangent at strains (..., 3)."""
        along, linear = strain @ self.slope.T, strain @ self.form
        growth = np.expm1(along)
        energy = 0.5 * (strain * linear).sum(axis=-1) + (growth - along) @ self.weight
        factor = self.weight * (1 + growth)
        tangent = self.form + np.einsum("...k,ki,kj->...ij", factor, self.slope, self.slope, optimize=True)
        return energy, linear + (self.weight * growth) @ self.slope, tangent


STEP = 1e-6 * np.eye(3)  # of the difference quotients for the tangent of `StretchLaw`


@dataclass(frozen=True, eq=False)
class StretchLaw(MembraneLaw):
    """W = e . M e / 2 of the stretches e = U - 1, shear doubled: forces per width are linear in them."""

    membrane: np.ndarray  # M (3, 3), symmetric [N/m]

    def respond(self, strain: np.ndarray) -> Parts:
        """Return energy, stress and tangent (by central differences) at strains (..., 3)."""
        energy, stress = self._stress(strain)
        ahead, behind = (self._stress(strain[..., None, :] + step)[1] for step in (STEP, -STEP))
        return energy, stress, np.swapaxes((ahead - behind) / (2 * STEP[0, 0]), -1, -2)

    def _stress(self, strain: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return energy and stress: of 2 x 2 matrices C = U U, U = (C + J 1) / tr U with J = sqrt(det C).

        (Hoger and Carlson 1984, Quarterly of Applied Mathematics 42.)
        """
        first, second, mixed = np.moveaxis(strain * [2, 2, 1] + [1, 1, 0], -1, 0)  # C
        jacobian = np.sqrt(first * second - mixed**2)
        trace = np.sqrt(first + second + 2 * jacobian)[..., None]
        stretch = np.stack([first + jacobian, second + jacobian, 2 * mixed], axis=-1) / trace - [1, 1, 0]
        force = stretch @ self.membrane
        stress = np.linalg.solve(green(stretch)[1].mT, force[..., None])[..., 0]
        return 0.5 * (stretch * force).sum(axis=-1), stress


def green(stretch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return Green's strains (..., 3) of stretches e = U - 1 (..., 3), shear doubled, and dE/de (..., 3, 3).

    Examples
    --------
    >>> green(np.array([0.1, 0.0, 0.0]))[0].round(12)  # (1.1^2 - 1) / 2
    array([0.105, 0.   , 0.   ])
    """
    one, two, half = 1 + stretch[..., 0], 1 + stretch[..., 1], 0.5 * stretch[..., 2]
    both, none = one + two, np.zeros_like(one)
    strain = np.stack([(one**2 + half**2 - 1) / 2, (two**2 + half**2 - 1) / 2, half * both], axis=-1)
    rows = ((one, none, half / 2), (none, two, half / 2), (half, half, both / 2))
    return strain, np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def forces_per_width(law: MembraneLaw, stretch: np.ndarray) -> np.ndarray:
    """Return the forces per undeformed width T (..., 3) [N/m] at stretches e = U - 1 (..., 3).

    Examples
    --------
    >>> forces_per_width(StretchLaw(np.diag([100.0, 50.0, 10.0])), np.array([0.1, 0.0, 0.0])).round(9)
    array([10.,  0.,  0.])
    """
    strain, derivative = green(stretch)
    return np.einsum("...i,...ij->...j", law.stress(strain), derivative)
