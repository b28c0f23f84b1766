"""Adds a matrix of few blocks to one of many, whose pattern has most of them."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp


class PatternSum:
    """The sum of two BSR matrices of fixed patterns: found once, blocks of the large one are copied in runs.

    Parameters
    ----------
    large, small : bsr matrix, shape (size, size)
        Any with the patterns, columns sorted in every row and none there twice.
    """

    def __init__(self, large: sp.bsr_matrix, small: sp.bsr_matrix) -> None:
        self._large, self._small = large.indices, (small.indptr, small.indices)
        nodes = len(large.indptr) - 1
        count = np.diff(small.indptr)
        row = np.repeat(np.arange(nodes), count)
        rows = np.flatnonzero(count)
        entries = block_entries(large, rows)
        keys = np.repeat(rows, np.diff(large.indptr)[rows]) * np.int64(nodes) + large.indices[entries]
        wanted = row * np.int64(nodes) + small.indices
        place = np.searchsorted(keys, wanted)
        known = np.zeros(len(wanted), dtype=bool)
        inside = place < len(keys)
        known[inside] = keys[place[inside]] == wanted[inside]
        # New blocks go before the first one of their row with a larger column, or to its end.
        before = np.concatenate([[0], np.cumsum(np.diff(large.indptr)[rows])])
        target = large.indptr[row] + place - before[np.searchsorted(rows, row)]
        shift = np.cumsum(~known) - ~known
        self._at = target + shift
        self._known, self._new = known, ~known
        inserted = target[~known]
        self.indices = np.insert(large.indices, inserted, small.indices[~known])
        added = np.bincount(row[~known], minlength=nodes)
        self.indptr = (large.indptr + np.concatenate([[0], np.cumsum(added)])).astype(large.indptr.dtype)
        edge, many = np.unique(inserted, return_counts=True)
        starts = np.concatenate([[0], edge])
        ends = np.concatenate([edge, [len(large.indices)]])
        self._runs = list(
            zip(starts.tolist(), ends.tolist(), np.concatenate([[0], np.cumsum(many)]).tolist(), strict=True)
        )

    def fits(self, large: sp.bsr_matrix, small: sp.bsr_matrix) -> bool:
        """Return whether two matrices have the patterns that this was made for."""
        indptr, indices = self._small
        same = np.array_equal(small.indices, indices) and np.array_equal(small.indptr, indptr)
        return same and (large.indices is self._large or np.array_equal(large.indices, self._large))

    def add(self, large: sp.bsr_matrix, small: sp.bsr_matrix) -> sp.bsr_matrix:
        """Return the sum; if the large pattern has all blocks already, the large matrix with the small one added."""
        if not self._new.any():
            large.data[self._at] += small.data
            return large
        data = np.empty((len(self.indices), *large.data.shape[1:]))
        for start, end, shift in self._runs:
            data[start + shift : end + shift] = large.data[start:end]
        data[self._at[self._new]] = small.data[self._new]
        data[self._at[self._known]] += small.data[self._known]
        return sp.bsr_matrix((data, self.indices, self.indptr), shape=large.shape)


def block_entries(matrix: sp.bsr_matrix, nodes: np.ndarray) -> np.ndarray:
    """Return the positions of the blocks of some block rows, row by row."""
    count = np.diff(matrix.indptr)[nodes]
    start = np.repeat(matrix.indptr[nodes] - np.cumsum(count) + count, count)
    return start + np.arange(count.sum())
