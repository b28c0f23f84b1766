"""What eight-node hexahedra in total Lagrangian form share: shape functions, strains and tangent moduli, in batches."""

from __future__ import annotations

import numpy as np

from knitstudy.errors import MeshError
from knitstudy.mechanics.determinant import determinant, inverse
from knitstudy.mechanics.materials.material import FULL
from knitstudy.mechanics.scratch import SCRATCH

CORNERS = np.array(
    [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
    dtype=float,
)
"""Natural coordinates (8, 3) of the nodes."""

GAUSS = CORNERS / np.sqrt(3)
"""The eight Gauss points (8, 3); all weights are 1."""


def shape(natural: np.ndarray) -> np.ndarray:
    """Return the trilinear shape functions (k, 8) at natural coordinates (k, 3)."""
    return 0.125 * (1 + CORNERS * natural[:, None]).prod(axis=2)


def shape_gradient(natural: np.ndarray) -> np.ndarray:
    """Return their gradients (k, 8, 3) at natural coordinates (k, 3)."""
    factor = 1 + CORNERS * natural[:, None]  # (k, 8, 3)
    return 0.125 * CORNERS * factor[:, :, [1, 0, 0]] * factor[:, :, [2, 2, 1]]


GRADIENTS = shape_gradient(GAUSS)
"""Natural gradients (8 points, 8 nodes, 3) at the Gauss points."""


def jacobians(corners: np.ndarray, gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return determinant (e,) and spatial gradients (e, 8, 3) of elements (e, 8, 3) at one point.

    Raises
    ------
    MeshError
        If an element is folded there.
    """
    jacobian = np.swapaxes(corners, 1, 2) @ gradient  # dX_i / dxi_j
    size = determinant(jacobian)
    if np.any(size <= 0):
        worst = int(np.argmin(size))
        raise MeshError(
            f"element {worst} is folded: its Jacobian is {size[worst]:.3g} m3 and has to be positive; "
            "refine the mesh or use a smaller yarn.diameter"
        )
    return size, gradient @ inverse(jacobian)[0]


def deformation_gradient(displacement: np.ndarray, gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return H = du/dX and Green's strain E (e, 3, 3); E keeps the digits of small strains."""
    h = np.swapaxes(displacement, 1, 2) @ gradient
    transposed = np.swapaxes(h, 1, 2)
    return h, 0.5 * (h + transposed + transposed @ h)


def tangent_moduli(deformation: np.ndarray, stress: np.ndarray, moduli: np.ndarray, out: np.ndarray) -> None:
    """Put A[J, L, i, k] = F_iI C_IJKL F_kK + S_JL delta_ik into `out` (e, 9, 9), rows (J, L), columns (i, k)."""
    e = len(deformation)
    full = SCRATCH.array("moduli", e, 81)  # (J, L), (I, K)
    np.take(moduli.reshape(e, 36), _PAIRS, axis=1, out=full, mode="clip")
    both = SCRATCH.array("deformation twice", e, 3, 3, 3, 3)  # F_iI F_kK, (I, K), (i, k)
    columns = np.swapaxes(deformation, 1, 2)
    np.multiply(columns[:, :, None, :, None], columns[:, None, :, None, :], out=both)
    np.matmul(full.reshape(e, 9, 9), both.reshape(e, 9, 9), out=out)
    for diagonal in (0, 4, 8):
        out[:, :, diagonal] += stress.reshape(e, 9)


_PAIRS = (6 * FULL.T[:, None, :, None] + FULL.T[None, :, None, :]).ravel()
"""Position of C_IJKL among 6 x 6 moduli in the order J, L, I, K."""


def gradient_stiffness(
    gradient: np.ndarray, weighted: np.ndarray, moduli: np.ndarray, out: np.ndarray
) -> None:
    """Put K[a, b, i, k] = sum over points of g_aJ A[J, L, i, k] w_bL into `out`, in two products.

    Parameters
    ----------
    gradient : ndarray, shape (e, a, q 3)
        Spatial gradients g at q points.
    weighted : ndarray, shape (e, q, b, 3)
        Gradients times the volumes of the points, w.
    moduli : ndarray, shape (e, q, 9, 9)
        A of `tangent_moduli`.
    out : ndarray, shape (e, a b, 9)
    """
    e, q, b, _ = weighted.shape
    half = SCRATCH.array("half of the stiffness", e, q, 3, b, 9)  # J, b, (i, k)
    np.matmul(weighted[:, :, None], moduli.reshape(e, q, 3, 3, 9), out=half)
    np.matmul(gradient, half.reshape(e, 3 * q, 9 * b), out=out.reshape(e, gradient.shape[1], 9 * b))
