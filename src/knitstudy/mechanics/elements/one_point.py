"""Hexahedron with one integration point and hourglass control."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.determinant import determinant
from knitstudy.mechanics.elements.element import ElementResponse, element
from knitstudy.mechanics.elements.hexahedron import (
    CORNERS,
    GRADIENTS,
    deformation_gradient,
    gradient_stiffness,
    jacobians,
    tangent_moduli,
)
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.scratch import SCRATCH

HOURGLASS = np.stack(
    [
        CORNERS[:, 1] * CORNERS[:, 2],
        CORNERS[:, 0] * CORNERS[:, 2],
        CORNERS[:, 0] * CORNERS[:, 1],
        CORNERS[:, 0] * CORNERS[:, 1] * CORNERS[:, 2],
    ]
)
"""The four hourglass vectors (4, 8) of Flanagan and Belytschko (1981)."""


@element("one_point", "with hourglass control", hourglass=True)
class OnePointHexahedron:
    """Mean-gradient hexahedron with stiffness hourglass control (Flanagan and Belytschko 1981).

    The mean gradient passes the patch test on any mesh. The hourglass force is a constant matrix times the
    positions of the nodes; since it is a scalar for all three components and gamma . X = 0, it is exactly
    objective and cannot do work on a linear field.

    Parameters
    ----------
    corners : ndarray, shape (E, 8, 3)
        Undeformed nodes [m].
    material : Material
    coefficient : float
        Hourglass stiffness over shear stiffness; 0.005 as in C3D8R.
    """

    def __init__(self, corners: np.ndarray, material: Material, coefficient: float = 0.005) -> None:
        self.material = material
        self.volume = np.zeros(len(corners))
        self.gradient = np.zeros(corners.shape)
        for gradient in GRADIENTS:
            determinant, spatial = jacobians(corners, gradient)
            self.volume += determinant
            self.gradient += determinant[:, None, None] * spatial
        self.gradient /= self.volume[:, None, None]
        self.tilt = HOURGLASS @ corners
        """Shares (E, 4, 3) of linear fields in the hourglass patterns [m]: the vectors take 2.7 times as much memory,
        and next to no time to be formed."""
        size = np.einsum("eai,eai->e", self.gradient, self.gradient)
        self.hourglass_stiffness = coefficient * material.shear_modulus * self.volume * size

    def respond(
        self, batch: slice, displacement: np.ndarray, stiffness: bool, out: np.ndarray | None = None
    ) -> ElementResponse:
        """Return the response of the elements `batch` to their displacements (e, 8, 3) [m]."""
        gradient, volume = self.gradient[batch], self.volume[batch]
        gamma, hourglass = self._hourglass_vectors(batch), self.hourglass_stiffness[batch]
        h, strain = deformation_gradient(displacement, gradient)
        answer = self.material.respond(strain, stiffness)
        deformation = h + np.eye(3)
        first = volume[:, None, None] * (deformation @ answer.stress)  # V P
        mode = gamma @ displacement  # (e, 4, 3)
        force = gradient @ np.swapaxes(first, 1, 2)
        force += np.swapaxes(hourglass[:, None, None] * gamma, 1, 2) @ mode
        # An element turned inside out has no energy in terms of E: let the load path see it.
        force[determinant(deformation) <= 0] = np.nan
        blocks = None
        if stiffness:
            blocks = np.empty((len(volume), 64, 9)) if out is None else out
            moduli = SCRATCH.array("tangent moduli", len(volume), 9, 9)
            tangent_moduli(deformation, answer.stress, answer.tangent, moduli)
            gradient_stiffness(gradient, (volume[:, None, None] * gradient)[:, None], moduli[:, None], blocks)
            control = np.swapaxes(hourglass[:, None, None] * gamma, 1, 2) @ gamma
            for diagonal in (0, 4, 8):
                blocks[:, :, diagonal] += control.reshape(-1, 64)
        return ElementResponse(
            force=force,
            internal=volume * answer.energy,
            hourglass=0.5 * hourglass * np.einsum("emi,emi->e", mode, mode),
            stiffness=blocks,
        )

    def _hourglass_vectors(self, batch: slice) -> np.ndarray:
        """Return gamma_m = (Gamma_m - (Gamma_m . X_i) dN_i) / sqrt(8), shape (e, 4, 8): orthogonal to linear fields."""
        linear = self.tilt[batch] @ np.swapaxes(self.gradient[batch], 1, 2)
        return (HOURGLASS - linear) / np.sqrt(8)
