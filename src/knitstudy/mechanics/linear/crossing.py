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
        self.release()
        patch = np.union1d(self._tied, neighbours(matrix, touching))
        self.unknowns = (3 * patch[:, None] + np.arange(3)).ravel()
        if not len(self.unknowns):
            return
        columns = _block_rows(matrix, patch).T.tobsr(blocksize=(3, 3))  # (size, patch): by symmetry the rows
        if unsymmetric is not None and unsymmetric.nnz:
            columns = columns + _block_columns(unsymmetric, patch)
        own = _block_rows(columns, patch).tocsr()
        reached = np.flatnonzero(np.diff(columns.indptr))  # nodes
        self._reached = (3 * reached[:, None] + np.arange(3)).ravel()
        ends = columns.indptr[np.append(0, reached + 1)]  # rows that are left out have no entries
        self._columns = Rows.of(
            sp.bsr_matrix((columns.data, columns.indices, ends), shape=(3 * len(reached), own.shape[1]))
        )
        self._groups = _groups(own)
        self._factors = [None] * len(self._groups)

        def make(number: int) -> None:
            group = self._groups[number]
            self._factors[number] = factorise(own[group][:, group])

        share(make, len(self._groups))

    def release(self) -> None:
        """Forget the factors, so that their memory can serve for new ones."""
        self._columns, self._factors = None, []

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


def _block_rows(matrix: sp.bsr_matrix, nodes: np.ndarray) -> sp.bsr_matrix:
    """Return the rows of all unknowns of some nodes."""
    entries = block_entries(matrix, nodes)
    indptr = np.concatenate([[0], np.cumsum(np.diff(matrix.indptr)[nodes])])
    return sp.bsr_matrix(
        (matrix.data[entries], matrix.indices[entries], indptr), shape=(3 * len(nodes), matrix.shape[1])
    )


def _block_columns(matrix: sp.bsr_matrix, nodes: np.ndarray) -> sp.bsr_matrix:
    """Return the columns of all unknowns of some nodes, ascending."""
    place = np.full(matrix.shape[1] // 3, -1)
    place[nodes] = np.arange(len(nodes))
    column = place[matrix.indices]
    chosen = column >= 0
    indptr = np.concatenate([[0], np.cumsum(chosen)])[matrix.indptr]
    return sp.bsr_matrix(
        (matrix.data[chosen], column[chosen], indptr), shape=(matrix.shape[0], 3 * len(nodes))
    )
