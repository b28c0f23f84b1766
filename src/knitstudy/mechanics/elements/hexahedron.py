"""What eight-node hexahedra in total Lagrangian form share: shape functions, strains and tangent moduli, in batches."""

from __future__ import annotations

import numpy as np

from knitstudy.errors import MeshError
from knitstudy.mechanics.materials.material import FULL

CORNERS = np.array(
    [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
    dtype=float,
)
"""Natural coordinates (8, 3) of the nodes."""

GAUSS = CORNERS / np.sqrt(3)
"""The eight Gauss points (8, 3); all weights are 1."""


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
