"""The scale of a crossing: what acts between yarns, solved for both of them together."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.fem.linear.lu import factorise
from knitstudy.fem.linear.structure import KnitStructure


class CrossingScale:
    """Sparse LU over the unknowns around all crossings; they fall apart into patches by themselves."""

    def __init__(self, structure: KnitStructure) -> None:
        self.unknowns = (3 * structure.patch[:, None] + np.arange(3)).ravel()

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Factorise the patches of a matrix."""
        if not len(self.unknowns):
            return
        rows = _block_rows(matrix, self.unknowns[::3] // 3)
        self._rows = rows  # (patch, size): by symmetry also the columns
        self._factors = factorise(rows.tocsc()[:, self.unknowns])

    def correct(self, residual: np.ndarray, correction: np.ndarray) -> None:
        """Add the patches' correction and take its effect off the residual, both (size,) in place."""
        if not len(self.unknowns):
            return
        local = self._factors.solve(residual[self.unknowns])
        correction[self.unknowns] += local
        residual -= self._rows.T @ local


def _block_rows(matrix: sp.bsr_matrix, nodes: np.ndarray) -> sp.csr_matrix:
    """Return the rows of all unknowns of some nodes as CSR."""
    count = np.diff(matrix.indptr)[nodes]
    start = np.repeat(matrix.indptr[nodes] - np.concatenate([[0], np.cumsum(count)[:-1]]), count)
    entries = start + np.arange(count.sum())
    indptr = np.concatenate([[0], np.cumsum(count)])
    part = sp.bsr_matrix(
        (matrix.data[entries], matrix.indices[entries], indptr), shape=(3 * len(nodes), matrix.shape[1])
    )
    return part.tocsr()
