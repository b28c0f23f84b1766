"""The scale of a crossing: what acts between yarns, solved for both of them together."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from knitstudy.mechanics.linear.lu import factorise
from knitstudy.mechanics.linear.rows import Rows
from knitstudy.mechanics.linear.solver import NOWHERE
from knitstudy.mechanics.linear.structure import KnitStructure
from knitstudy.mechanics.parallel import share
from knitstudy.mechanics.pattern_sum import block_entries

GROUPS = 8
"""Parts that threads share: patches that do not act on each other, of about as many unknowns each."""


class CrossingScale:
    """Sparse LU over the unknowns around all crossings, which fall apart into patches."""

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
        columns = _block_rows(matrix, patch).T  # (size, patch): by symmetry the rows
        if unsymmetric is not None and unsymmetric.nnz:
            columns = columns + unsymmetric.tocsc()[:, self.unknowns]
        columns = sp.csr_matrix(columns)
        own = columns[self.unknowns]
        reached = np.unique(np.flatnonzero(np.diff(columns.indptr)) // 3)  # nodes
        self._reached = (3 * reached[:, None] + np.arange(3)).ravel()
        self._columns = Rows(columns[self._reached].tobsr(blocksize=(3, 3)))
        self._groups = _groups(own)
        self._factors = [None] * len(self._groups)

        def make(number: int) -> None:
            group = self._groups[number]
            self._factors[number] = factorise(own[group][:, group])

        share(make, len(self._groups))

    def correct(self, residual: np.ndarray, correction: np.ndarray) -> None:
        """Add the patches' correction and take its effect off the residual, both (size,) in place."""
        if not len(self.unknowns):
            return
        given = residual[self.unknowns]
        local = np.empty_like(given)

        def solve(number: int) -> None:
            group = self._groups[number]
            local[group] = self._factors[number].solve(given[group])

        share(solve, len(self._groups))
        correction[self.unknowns] += local
        residual[self._reached] -= self._columns @ local


def _groups(matrix: sp.csr_matrix) -> list[np.ndarray]:
    """Return the unknowns of at most `GROUPS` groups of patches; no entry of the matrix joins two of them."""
    count, patch = connected_components(matrix, directed=False)
    size = np.bincount(patch, minlength=count)
    group = (np.cumsum(size) - size) * GROUPS // len(patch)
    return [np.flatnonzero(group[patch] == number) for number in np.unique(group)]


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
