"""The scale of a crossing: what acts between yarns, solved for both of them together."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.linear.lu import factorise
from knitstudy.mechanics.linear.solver import NOWHERE
from knitstudy.mechanics.linear.structure import KnitStructure
from knitstudy.mechanics.pattern_sum import block_entries


class CrossingScale:
    """Sparse LU over the unknowns around all crossings; they fall apart into patches by themselves."""

    def __init__(self, structure: KnitStructure) -> None:
        self._tied = structure.patch
        self.unknowns = np.empty(0, dtype=np.int64)

    def update(
        self,
        matrix: sp.bsr_matrix,
        unsymmetric: sp.bsr_matrix | None = None,
        touching: np.ndarray = NOWHERE,
    ) -> None:
        """Factorise the patches of a matrix: around ties, and around the nodes where contact acts.

        What friction adds lies within the patches, whose factors need no symmetry.
        """
        patch = np.union1d(self._tied, neighbours(matrix, touching))
        self.unknowns = (3 * patch[:, None] + np.arange(3)).ravel()
        if not len(self.unknowns):
            return
        self._columns = _block_rows(matrix, patch).T  # (size, patch): by symmetry the rows
        if unsymmetric is not None and unsymmetric.nnz:
            self._columns = self._columns + unsymmetric.tocsc()[:, self.unknowns]
        self._columns = sp.csr_matrix(self._columns)
        self._factors = factorise(self._columns[self.unknowns])

    def correct(self, residual: np.ndarray, correction: np.ndarray) -> None:
        """Add the patches' correction and take its effect off the residual, both (size,) in place."""
        if not len(self.unknowns):
            return
        local = self._factors.solve(residual[self.unknowns])
        correction[self.unknowns] += local
        residual -= self._columns @ local


def neighbours(matrix: sp.bsr_matrix, nodes: np.ndarray) -> np.ndarray:
    """Return nodes and those that share an element or a contact with them."""
    return np.union1d(nodes, matrix.indices[block_entries(matrix, nodes)])


def _block_rows(matrix: sp.bsr_matrix, nodes: np.ndarray) -> sp.csr_matrix:
    """Return the rows of all unknowns of some nodes as CSR."""
    entries = block_entries(matrix, nodes)
    indptr = np.concatenate([[0], np.cumsum(np.diff(matrix.indptr)[nodes])])
    part = sp.bsr_matrix(
        (matrix.data[entries], matrix.indices[entries], indptr), shape=(3 * len(nodes), matrix.shape[1])
    )
    return part.tocsr()
