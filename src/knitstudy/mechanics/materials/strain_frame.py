"""Engineering strains in another frame."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.materials.material import VOIGT


def rotate_strain(axes: np.ndarray) -> np.ndarray:
    """Return the matrices (e, 6, 6) that take engineering strains to the axes (e, 3, 3) in columns."""
    i, j = VOIGT.T
    # Component (p, q) in the axes is sum over I, J of N_Ip E_IJ N_Jq, with E_IJ = gamma_IJ / 2 off the diagonal.
    left = axes[:, i[None, :], i[:, None]] * axes[:, j[None, :], j[:, None]]
    right = axes[:, j[None, :], i[:, None]] * axes[:, i[None, :], j[:, None]]
    rotation = 0.5 * (left + right)
    rotation[:, 3:] *= 2
    return rotation
