"""Hexahedron with one integration point and hourglass control."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.elements.element import ElementResponse, element
from knitstudy.mechanics.elements.hexahedron import (
    CORNERS,
    GRADIENTS,
    deformation_gradient,
    jacobians,
    tangent_moduli,
)
from knitstudy.mechanics.materials import Material

HOURGLASS = np.stack(
    [
        CORNERS[:, 1] * CORNERS[:, 2],
        CORNERS[:, 0] * CORNERS[:, 2],
        CORNERS[:, 0] * CORNERS[:, 1],
        CORNERS[:, 0] * CORNERS[:, 1] * CORNERS[:, 2],
    ]
)
"""The four hourglass vectors (4, 8) of Flanagan and Belytschko (1981)."""


@element("one_point", "with hourglass control", hourglass=True, abaqus="C3D8R", calculix="C3D8R")
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
        # gamma_m = (Gamma_m - (Gamma_m . X_i) dN_i) / sqrt(8): orthogonal to all linear fields
        gamma = HOURGLASS - (HOURGLASS @ corners) @ np.swapaxes(self.gradient, 1, 2)
        self.gamma = gamma / np.sqrt(8)
        size = np.einsum("eai,eai->e", self.gradient, self.gradient)
        self.hourglass_stiffness = coefficient * material.shear_modulus * self.volume * size

    def respond(self, batch: slice, displacement: np.ndarray, stiffness: bool) -> ElementResponse:
        """Return the response of the elements `batch` to their displacements (e, 8, 3) [m]."""
        gradient, volume = self.gradient[batch], self.volume[batch]
        gamma, hourglass = self.gamma[batch], self.hourglass_stiffness[batch]
        h, strain = deformation_gradient(displacement, gradient)
        answer = self.material.respond(strain, stiffness)
        deformation = h + np.eye(3)
        first = volume[:, None, None] * (deformation @ answer.stress)  # V P
        mode = gamma @ displacement  # (e, 4, 3)
        force = gradient @ np.swapaxes(first, 1, 2)
        force += np.swapaxes(hourglass[:, None, None] * gamma, 1, 2) @ mode
        # An element turned inside out has no energy in terms of E: let the load path see it.
        force[np.linalg.det(deformation) <= 0] = np.nan
        blocks = None
        if stiffness:
            blocks = self._stiffness(gradient, volume, gamma, hourglass, deformation, answer)
        return ElementResponse(
            force=force,
            internal=volume * answer.energy,
            hourglass=0.5 * hourglass * np.einsum("emi,emi->e", mode, mode),
            stiffness=blocks,
        )

    @staticmethod
    def _stiffness(gradient, volume, gamma, hourglass, deformation, answer) -> np.ndarray:
        e = len(volume)
        moduli = tangent_moduli(deformation, answer.stress, answer.tangent)
        # One product gives all blocks: columns dN_aJ dN_bL meet A_JL, a last column meets the identity.
        left = np.empty((e, 8, 8, 10))
        left[..., :9] = (gradient[:, :, None, :, None] * gradient[:, None, :, None, :]).reshape(e, 8, 8, 9)
        left[..., 9] = np.swapaxes(gamma, 1, 2) @ gamma
        right = np.empty((e, 10, 9))
        right[:, :9] = volume[:, None, None] * moduli
        right[:, 9] = hourglass[:, None] * np.eye(3).ravel()
        return left.reshape(e, 64, 10) @ right
