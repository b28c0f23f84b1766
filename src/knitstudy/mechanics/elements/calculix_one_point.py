"""CalculiX's one-point hexahedron, for comparisons with CalculiX only."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.elements.hexahedron import OnePointHexahedron
from knitstudy.mechanics.materials import Material

COEFFICIENT = 0.0005
"""Hourglass stiffness of C3D8R over Young's modulus, in CalculiX 2.20."""


class CalculixHexahedron(OnePointHexahedron):
    """One-point hexahedron with the hourglass control that CalculiX 2.20 has (docs/decks.md).

    Its hourglass vectors are orthogonal to the third coordinate only, so that linear fields and rigid
    rotations of a distorted element meet a small force: it does not pass the patch test, and is no element to
    study knits with.

    Parameters
    ----------
    corners : ndarray, shape (E, 8, 3)
        Undeformed nodes [m].
    material : Material
    """

    def __init__(self, corners: np.ndarray, material: Material) -> None:
        super().__init__(corners, material)
        self.tilt[:, :, :2] = 0
        size = np.einsum("eai,eai->e", self.gradient, self.gradient)
        # CalculiX does not divide the vectors by sqrt(8): the 8 makes up for it.
        self.hourglass_stiffness = 8 * COEFFICIENT * material.youngs_modulus * self.volume * size
