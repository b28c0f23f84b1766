"""Eight-node hexahedra in total Lagrangian form, in batches: one-point with hourglass control, and a reference.

Nodes are in VTK order. An element maps its displacements u (e, 8, 3) to nodal forces (e, 8, 3), energies and, if
asked, stiffness blocks (e, 64, 9): pair of nodes (a, b), then components (i, k).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from knitstudy.errors import MeshError
from knitstudy.mechanics.material import FULL, Material

CORNERS = np.array(
    [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
    dtype=float,
)
"""Natural coordinates (8, 3) of the nodes."""

GAUSS = CORNERS / np.sqrt(3)
"""The eight Gauss points (8, 3); all weights are 1."""

HOURGLASS = np.stack(
    [
        CORNERS[:, 1] * CORNERS[:, 2],
        CORNERS[:, 0] * CORNERS[:, 2],
        CORNERS[:, 0] * CORNERS[:, 1],
        CORNERS[:, 0] * CORNERS[:, 1] * CORNERS[:, 2],
    ]
)
"""The four hourglass vectors (4, 8) of Flanagan and Belytschko (1981)."""


@dataclass(frozen=True)
class ElementResponse:
    """Batch of element forces (e, 8, 3) [N], energies (e,) [J] and stiffness (e, 64, 9) [N/m] or None."""

    force: np.ndarray
    internal: np.ndarray
    hourglass: np.ndarray
    stiffness: np.ndarray | None


class Hexahedron(Protocol):
    """A batch of elements that answers for any slice of itself."""

    def respond(self, batch: slice, displacement: np.ndarray, stiffness: bool) -> ElementResponse:
        """Return the response of the elements `batch` to their displacements (e, 8, 3) [m]."""
        ...


def shape_gradient(point: np.ndarray) -> np.ndarray:
    """Return the gradient (8, 3) of the trilinear shape functions at a natural coordinate (3,)."""
    factor = 1 + CORNERS * point  # (8, 3)
    others = factor[:, [1, 0, 0]] * factor[:, [2, 2, 1]]
    return 0.125 * CORNERS * others


GRADIENTS = np.stack([shape_gradient(point) for point in GAUSS])
"""Natural gradients (8 points, 8 nodes, 3) at the Gauss points."""


def jacobians(corners: np.ndarray, gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return determinant (e,) and spatial gradients (e, 8, 3) of elements (e, 8, 3) at one point.

    Raises
    ------
    MeshError
        If an element is folded there.
    """
    jacobian = np.swapaxes(corners, 1, 2) @ gradient  # dX_i / dxi_j
    determinant = np.linalg.det(jacobian)
    if np.any(determinant <= 0):
        worst = int(np.argmin(determinant))
        raise MeshError(
            f"element {worst} is folded: its Jacobian is {determinant[worst]:.3g} m3 and has to be positive; "
            "refine the mesh or use a smaller yarn.diameter"
        )
    return determinant, gradient @ np.linalg.inv(jacobian)


def deformation_gradient(displacement: np.ndarray, gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return H = du/dX and Green's strain E (e, 3, 3); E keeps the digits of small strains."""
    h = np.swapaxes(displacement, 1, 2) @ gradient
    transposed = np.swapaxes(h, 1, 2)
    return h, 0.5 * (h + transposed + transposed @ h)


def tangent_moduli(deformation: np.ndarray, stress: np.ndarray, moduli: np.ndarray) -> np.ndarray:
    """Return A[J, L, i, k] = F_iI C_IJKL F_kK + S_JL delta_ik as (e, 9, 9), rows (J, L), columns (i, k)."""
    e = len(deformation)
    full = moduli[:, FULL[:, :, None, None], FULL[None, None, :, :]]  # (e, I, J, K, L)
    # C has the minor symmetries, so I and J, and K and L, may change places.
    half = (deformation @ full.reshape(e, 3, 27)).reshape(e, 3, 9, 3)  # (i, (J, L), K)
    both = half @ np.swapaxes(deformation, 1, 2)[:, None]  # (i, (J, L), k)
    result = np.ascontiguousarray(np.swapaxes(both, 1, 2)).reshape(e, 9, 9)
    result[:, :, 0::4] += stress.reshape(e, 9, 1)
    return result


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
