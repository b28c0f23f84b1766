"""Laws of a fabric as a membrane: energy over undeformed area by the strains in its plane.

Strains are Green's, E = (E_11, E_22, 2 E_12), in axes of the undeformed fabric (1 course, 2 wale); stresses (second
Piola-Kirchhoff, times thickness) are forces per width S = dW/dE [N/m]. Cells of an endless fabric have stretches
e = U - 1 instead, and the forces per width T = (dE/de)^T S that do work on them: `green` leads from one to the other.

An energy that is convex in E has a positive tangent wherever principal stresses are not negative: F^T F is convex in
F (Ogden 1997, Non-linear elastic deformations, section 6.2). Where one is negative a fabric wrinkles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np


class MembraneLaw(Protocol):
    """An energy over area with its derivatives, of any number of strains (..., 3)."""

    def energy(self, strain: np.ndarray) -> np.ndarray:
        """Return W (...) [J/m2]."""

    def stress(self, strain: np.ndarray) -> np.ndarray:
        """Return S = dW/dE (..., 3) [N/m]."""

    def tangent(self, strain: np.ndarray) -> np.ndarray:
        """Return dS/dE (..., 3, 3) [N/m]."""


@dataclass(frozen=True, eq=False)
class ExponentialLaw:
    """W = E . A E / 2 + sum of w (exp(a . E) - 1 - a . E) with A >= 0 and w > 0: free of stress at rest, and convex.

    A term stiffens where a . E > 0 and its stress saturates where that is negative, so that such sums come near any
    curve that rises.
    """

    form: np.ndarray  # A (3, 3), symmetric [N/m]
    weight: np.ndarray  # (k,) w [N/m]
    slope: np.ndarray  # (k, 3) a

    def energy(self, strain: np.ndarray) -> np.ndarray:
        """Return W (...) [J/m2]."""
        along = strain @ self.slope.T
        form = 0.5 * np.einsum("...i,ij,...j->...", strain, self.form, strain)
        return form + (np.expm1(along) - along) @ self.weight

    def stress(self, strain: np.ndarray) -> np.ndarray:
        """Return S (..., 3) [N/m]."""
        return strain @ self.form + (self.weight * np.expm1(strain @ self.slope.T)) @ self.slope

    def tangent(self, strain: np.ndarray) -> np.ndarray:
        """Return dS/dE (..., 3, 3) [N/m]."""
        factor = self.weight * np.exp(strain @ self.slope.T)
        return self.form + np.einsum("...k,ki,kj->...ij", factor, self.slope, self.slope)


@dataclass(frozen=True, eq=False)
class FungLaw:
    """W = c / 2 (exp(E . b E) - 1) with a positive form b (Fung 1993, Biomechanics, section 7.10): Abaqus has it."""

    stiffness: float  # c [N/m]
    form: np.ndarray  # b (3, 3), symmetric and positive

    def energy(self, strain: np.ndarray) -> np.ndarray:
        """Return W (...) [J/m2]."""
        return 0.5 * self.stiffness * np.expm1(np.einsum("...i,ij,...j->...", strain, self.form, strain))

    def stress(self, strain: np.ndarray) -> np.ndarray:
        """Return S (..., 3) [N/m]."""
        return self._factor(strain)[..., None] * (strain @ self.form)

    def tangent(self, strain: np.ndarray) -> np.ndarray:
        """Return dS/dE (..., 3, 3) [N/m]."""
        along = strain @ self.form
        dyad = self.form + 2 * along[..., :, None] * along[..., None, :]
        return self._factor(strain)[..., None, None] * dyad

    def _factor(self, strain: np.ndarray) -> np.ndarray:
        return self.stiffness * np.exp(np.einsum("...i,ij,...j->...", strain, self.form, strain))


STEP = 1e-6  # of the difference quotients for the tangent of `StretchLaw`


@dataclass(frozen=True, eq=False)
class StretchLaw:
    """W = e . M e / 2 of the stretches e = U - 1, shear doubled: forces per width are linear in them."""

    membrane: np.ndarray  # M (3, 3), symmetric [N/m]

    def energy(self, strain: np.ndarray) -> np.ndarray:
        """Return W (...) [J/m2]."""
        stretch, _ = stretches(_square(strain))
        return 0.5 * np.einsum("...i,ij,...j->...", stretch, self.membrane, stretch)

    def stress(self, strain: np.ndarray) -> np.ndarray:
        """Return S (..., 3) [N/m]."""
        stretch, derivative = stretches(_square(strain))
        return np.einsum("...i,ij,...jk->...k", stretch, self.membrane, derivative) * [2, 2, 1]

    def tangent(self, strain: np.ndarray) -> np.ndarray:
        """Return dS/dE (..., 3, 3) [N/m], by central differences."""
        ahead, behind = (self.stress(strain[..., None, :] + step) for step in STEP * np.stack([EYE, -EYE]))
        return np.swapaxes((ahead - behind) / (2 * STEP), -1, -2)


EYE = np.eye(3)


def _square(strain: np.ndarray) -> np.ndarray:
    """Return U U (..., 3) as 11, 22, 12."""
    return strain * [2, 2, 1] + [1, 1, 0]


def stretches(square: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return U - 1 as (k, 3), shear doubled, and its derivative (k, 3, 3) by C = U U, each as 11, 22, 12.

    Of two-by-two matrices U = (C + J 1) / t with J = sqrt(det C) and t = tr U (Hoger and Carlson 1984, Quarterly of
    Applied Mathematics 42).
    """
    first, second, mixed = np.moveaxis(square, -1, 0)
    jacobian = np.sqrt(first * second - mixed**2)
    trace = np.sqrt(first + second + 2 * jacobian)[..., None]
    stretch = np.stack([first + jacobian, second + jacobian, 2 * mixed], axis=-1) / trace
    by_jacobian = np.stack([second, first, -2 * mixed], axis=-1) / (2 * jacobian[..., None])
    by_trace = (np.array([1.0, 1.0, 0.0]) + 2 * by_jacobian) / (2 * trace)
    slope = np.array([[1.0, 1.0, 0.0]]).T * by_jacobian[..., None, :] + np.diag([1.0, 1.0, 2.0])
    derivative = (slope - stretch[..., None] * by_trace[..., None, :]) / trace[..., None]
    return stretch - [1.0, 1.0, 0.0], derivative


def green(stretch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return Green's strains (..., 3) of stretches e = U - 1 (..., 3), shear doubled, and dE/de (..., 3, 3)."""
    one, two, half = 1 + stretch[..., 0], 1 + stretch[..., 1], 0.5 * stretch[..., 2]
    both, none = one + two, np.zeros_like(one)
    strain = np.stack([(one**2 + half**2 - 1) / 2, (two**2 + half**2 - 1) / 2, half * both], axis=-1)
    rows = ((one, none, half / 2), (none, two, half / 2), (half, half, both / 2))
    return strain, np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def forces_per_width(law: MembraneLaw, stretch: np.ndarray) -> np.ndarray:
    """Return the forces per undeformed width T (..., 3) [N/m] at stretches e = U - 1 (..., 3)."""
    strain, derivative = green(stretch)
    return np.einsum("...i,...ij->...j", law.stress(strain), derivative)
