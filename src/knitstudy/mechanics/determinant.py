"""Determinants and inverses of batches of 3 x 3 matrices in closed form: LAPACK's are made for large ones."""

from __future__ import annotations

import numpy as np


def determinant(matrix: np.ndarray) -> np.ndarray:
    """Return the determinants (e,) of matrices (e, 3, 3)."""
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(matrix, 0, -1)
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)


def inverse(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the inverses (e, 3, 3) of matrices (e, 3, 3), by their cofactors, and the determinants (e,)."""
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(matrix, 0, -1)
    cofactors = (
        (e * i - f * h, c * h - b * i, b * f - c * e),
        (f * g - d * i, a * i - c * g, c * d - a * f),
        (d * h - e * g, b * g - a * h, a * e - b * d),
    )
    size = a * cofactors[0][0] + b * cofactors[1][0] + c * cofactors[2][0]
    result = np.empty_like(matrix)
    for row in range(3):
        for column in range(3):
            np.divide(cofactors[row][column], size, out=result[:, row, column])
    return result, size
