"""Products of a sparse matrix with vectors, in ranges of rows that threads share."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.parallel import share

ENTRIES = 400_000
"""Numbers of a matrix a range: enough that taking it in hand costs next to nothing."""


class Rows:
    """A BSR matrix cut into ranges of rows (no copy); ``rows @ x`` is the matrix's own product.

    Parameters
    ----------
    matrix : bsr matrix, shape (rows, columns)
    """

    def __init__(self, matrix: sp.bsr_matrix) -> None:
        self.shape, self.dtype = matrix.shape, matrix.dtype
        height = matrix.blocksize[0]
        pieces = max(1, round(matrix.data.size / ENTRIES))
        cuts = np.searchsorted(matrix.indptr, np.linspace(0, matrix.indptr[-1], pieces + 1)[1:-1])
        bounds = np.unique(np.concatenate([[0], cuts, [len(matrix.indptr) - 1]]))
        self._ranges = [slice(height * low, height * high) for low, high in pairwise(bounds)]
        self._parts = [_part(matrix, low, high) for low, high in pairwise(bounds)]

    def __matmul__(self, vector: np.ndarray) -> np.ndarray:
        """Return the product (rows,) with a vector (columns,)."""
        product = np.empty(self.shape[0], dtype=np.result_type(self.dtype, vector.dtype))

        def multiply(number: int) -> None:
            product[self._ranges[number]] = self._parts[number] @ vector

        share(multiply, len(self._parts))
        return product


def _part(matrix: sp.bsr_matrix, low: int, high: int) -> sp.bsr_matrix:
    """Return the block rows low .. high of a matrix, without a copy of their entries."""
    entries = slice(matrix.indptr[low], matrix.indptr[high])
    return sp.bsr_matrix(
        (matrix.data[entries], matrix.indices[entries], matrix.indptr[low : high + 1] - matrix.indptr[low]),
        shape=(matrix.blocksize[0] * (high - low), matrix.shape[1]),
    )
