"""Materials: stored energy, stress and tangent as functions of Green's strain; a file of a law registers its class.

A material is an object with its own constants. It maps a batch of Green strains E (e, 3, 3) to the stored energy
density W (e,), the second Piola-Kirchhoff stress S = dW/dE (e, 3, 3) and the tangent C = dS/dE (e, 6, 6), components
in the order 11, 22, 33, 12, 23, 13 (C maps engineering shears). A frame of space enters only through E, so all of them
are objective. Elements assume no isotropy: they hand over local axes where a material asks for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from knitstudy.mechanics.core.arrays import Floats
from knitstudy.registry import Registry

Axes = np.ndarray | None
Field = np.ndarray | float

# Index pairs of the six independent components.
VOIGT = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)])
FULL = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])  # position (3, 3) of every tensor component among the six


@dataclass(frozen=True)
class Stress:
    """Energy density (e,) [J/m3], second Piola-Kirchhoff stress (e, 3, 3) [Pa], tangent (e, 6, 6) [Pa] or None."""

    energy: Floats
    stress: Floats
    tangent: Floats | None

    @property
    def moduli(self) -> Floats:
        """The tangent of a response that was asked for with it."""
        assert self.tangent is not None, "this response was asked for without its tangent"
        return self.tangent


class Material(Protocol):
    """An elastic material."""

    name: ClassVar[str]  # of its law: the value of the key `yarn.material`, and one line on it
    meaning: ClassVar[str]
    directional: ClassVar[bool]  # whether `respond` needs local axes
    # Whether its dilatation theta is ln det F; else it is the trace of Green's strain
    logarithmic: ClassVar[bool]

    @property
    def youngs_modulus(self) -> float:
        """Along the yarn [Pa]."""

    @property
    def shear_modulus(self) -> float:
        """Of shear along the yarn [Pa]; hourglass control is measured with it."""

    @property
    def across(self) -> tuple[float, float]:
        """Young's modulus [Pa] and Poisson's ratio across the yarn: local indentation is computed with them."""

    @classmethod
    def of(cls, yarn: Any) -> Self:
        """Return the material of a scene's section `yarn`, by the constants that it needs."""

    def without_dilatation(self) -> tuple[Material, float]:
        """Return the law without an energy lame/2 theta^2 of the dilatation, and lame [Pa]."""

    def respond(self, strain: Floats, tangent: bool, axes: Axes = None, pressure: Field = 0.0) -> Stress:
        """Return energy, stress and, if asked, tangent of Green strains (e, 3, 3).

        `axes` (e, 3, 3) are local unit vectors in columns, the first along the yarn. A given `pressure` (e,) [Pa] adds
        pressure d theta / dE to the stress and pressure d2 theta / dE2 to the tangent, with the law's dilatation theta.
        """


MATERIALS: Registry[type[Material]] = Registry("yarn.material", "knitstudy.mechanics.materials")


def material_of(yarn: Any) -> Material:
    """Return the material of a scene's section `yarn`."""
    return MATERIALS.find(yarn.material).of(yarn)


def axes_along(direction: Floats) -> Floats:
    """Return local axes (k, 3, 3) in columns, the first along directions (k, 3) of any length.

    Examples
    --------
    >>> axes_along(np.array([[0.0, 0.0, 2.0]]))[0].round(12).tolist()
    [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
    """
    first = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    away = np.eye(3)[np.abs(first).argmin(axis=1)]
    second = np.cross(first, away)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    return np.stack([first, second, np.cross(first, second)], axis=2)


def rotate_strain(axes: Floats) -> Floats:
    """Return the matrices (e, 6, 6) that take engineering strains to the axes (e, 3, 3) in columns.

    Examples
    --------
    >>> axes = np.array([[[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]])  # y, x, -z
    >>> (rotate_strain(axes)[0] @ [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]).tolist()
    [2.0, 1.0, 3.0, 0.0, 0.0, 0.0]
    """
    i, j = VOIGT.T
    # Component (p, q) in the axes is sum over I, J of N_Ip E_IJ N_Jq, with E_IJ = gamma_IJ / 2 off the diagonal.
    left = axes[:, i[None, :], i[:, None]] * axes[:, j[None, :], j[:, None]]
    right = axes[:, j[None, :], i[:, None]] * axes[:, i[None, :], j[:, None]]
    rotation = 0.5 * (left + right)
    rotation[:, 3:] *= 2
    return rotation
