"""Products of a sparse matrix with vectors, in ranges of rows that threads share."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.parallel import share

ENTRIES = 400_000
"""Numbers of a matrix a range: enough that taking it in hand costs next to nothing."""


class Rows:
    """A matrix in ranges of rows; ``rows @ x`` is the matrix's own product.

    Parameters
    ----------
    parts : sequence of bsr matrix, shape (rows of the range, columns)
        From the first row to the last; blocks of one height.
    """

    def __init__(self, parts: Sequence[sp.bsr_matrix]) -> None:
        self._parts = parts
        ends = np.cumsum([0, *(part.shape[0] for part in parts)]).tolist()
        self._ranges = [slice(low, high) for low, high in pairwise(ends)]
        self.shape, self.dtype = (ends[-1], parts[0].shape[1]), parts[0].dtype

    @classmethod
    def of(cls, matrix: sp.bsr_matrix) -> Rows:
        """Return a matrix cut into ranges of some `ENTRIES` numbers, without a copy of them."""
        pieces = max(1, round(matrix.data.size / ENTRIES))
        cuts = np.searchsorted(matrix.indptr, np.linspace(0, matrix.indptr[-1], pieces + 1)[1:-1])
        bounds = np.unique(np.concatenate([[0], cuts, [len(matrix.indptr) - 1]]))
        return cls([_part(matrix, low, high) for low, high in pairwise(bounds)])

    def __matmul__(self, vector: np.ndarray) -> np.ndarray:
        """Return the product (rows,) with a vector (columns,)."""
        product = np.empty(self.shape[0], dtype=np.result_type(self.dtype, vector.dtype))

        def multiply(number: int) -> None:
            product[self._ranges[number]] = self._parts[number] @ vector

        share(multiply, len(self._parts))
        return product

    def galerkin(self, basis: sp.bsr_matrix, dtype: type) -> tuple[Rows, sp.csr_matrix]:
        """Return K P, of a square matrix K and a basis P (columns, m), and P^T K P (m, m).

        Parameters
        ----------
        basis : bsr matrix
            Blocks as high as the matrix's.
        dtype : type
            Of K P, no more than a range of which is ever held in the matrix's own, as P^T K P is.
        """
        images: list[sp.bsr_matrix | None] = [None] * len(self._parts)
        coarse: list[sp.coo_matrix | None] = [None] * len(self._parts)
        height = basis.blocksize[0]

        def multiply(number: int) -> None:
            image = self._parts[number] @ basis
            rows = self._ranges[number]
            own = _part(basis, rows.start // height, rows.stop // height)
            coarse[number] = (own.T @ image).tocoo()
            images[number] = image.astype(dtype)

        share(multiply, len(images))
        row, column, data = (
            np.concatenate([getattr(piece, name) for piece in coarse]) for name in ("row", "col", "data")
        )
        return Rows(images), sp.csr_matrix((data, (row, column)), shape=2 * basis.shape[1:])


def _part(matrix: sp.bsr_matrix, low: int, high: int) -> sp.bsr_matrix:
    """Return the block rows low .. high of a matrix, without a copy of their entries."""
    entries = slice(matrix.indptr[low], matrix.indptr[high])
    return sp.bsr_matrix(
        (matrix.data[entries], matrix.indices[entries], matrix.indptr[low : high + 1] - matrix.indptr[low]),
        shape=(matrix.blocksize[0] * (high - low), matrix.shape[1]),
    )
