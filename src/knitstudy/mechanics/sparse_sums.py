"""Sums of element matrices into sparse matrices."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

# Adds a matrix of few blocks to one of many, whose pattern has most of them, and takes it off again


class PatternSum:
    """The sum of two BSR matrices of fixed patterns: found once, blocks of the large one are moved in runs.

    Columns are sorted in every row and none is there twice.
    """

    def __init__(self, large: sp.bsr_matrix, small: sp.bsr_matrix) -> None:
        self._large, self._small = large.indices, (small.indptr, small.indices)
        nodes = len(large.indptr) - 1
        target, self._known = _places(large, small)
        self._new = ~self._known
        self.inserted = int(self._new.sum())  # blocks that the small pattern alone has
        self._at = target + np.cumsum(self._new) - self._new
        before = target[self._new]
        self.indices = np.insert(large.indices, before, small.indices[self._new])
        row = np.repeat(np.arange(nodes), np.diff(small.indptr))
        added = np.bincount(row[self._new], minlength=nodes)
        self.indptr = (large.indptr + np.concatenate([[0], np.cumsum(added)])).astype(large.indptr.dtype)
        edge, many = np.unique(before, return_counts=True)
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
        """Return the sum; it takes the place of the large matrix if behind that is room for what is inserted.

        Room is what the array whose first part `large.data` is has besides.
        """
        if not self.inserted:
            large.data[self._at] += small.data
            return large
        block = math.prod(large.data.shape[1:])
        source = large.data.reshape(-1)
        total = _from_its_start(source)
        if total is None or total.size < len(self.indices) * block:
            total = np.empty(len(self.indices) * block)
        for start, end, shift in reversed(
            self._runs
        ):  # from behind: in one array, what is moved is not yet covered
            total[(start + shift) * block : (end + shift) * block] = source[start * block : end * block]
        data = total[: len(self.indices) * block].reshape(-1, *large.data.shape[1:])
        data[self._at[self._new]] = small.data[self._new]
        data[self._at[self._known]] += small.data[self._known]
        return sp.bsr_matrix((data, self.indices, self.indptr), shape=large.shape)


@contextmanager
def lacking(matrix: sp.bsr_matrix, part: sp.bsr_matrix) -> Iterator[None]:
    """Take a part, all of whose blocks a matrix has, off that matrix for a while, without a copy of it."""
    places, known = _places(matrix, part)
    places = places[known]
    blocks = matrix.data[places]
    matrix.data[places] -= part.data[known]
    try:
        yield
    finally:
        matrix.data[places] = blocks


def _places(large: sp.bsr_matrix, small: sp.bsr_matrix) -> tuple[np.ndarray, np.ndarray]:
    """Return where the large pattern has, or would have, every block of a small one, and whether it has it.

    What it has not goes before the first block of the row with a larger column, or to the row's end.
    """
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
    before = np.concatenate([[0], np.cumsum(np.diff(large.indptr)[rows])])
    return large.indptr[row] + place - before[np.searchsorted(rows, row)], known


def _from_its_start(part: np.ndarray) -> np.ndarray | None:
    """Return the array, flat, that a flat array is the first part of; None if it is another part or not a part."""
    whole = part.base
    if not isinstance(whole, np.ndarray) or not whole.flags.c_contiguous or whole.dtype != part.dtype:
        return None
    return whole.reshape(-1) if whole.ctypes.data == part.ctypes.data else None


def block_entries(matrix: sp.bsr_matrix, nodes: np.ndarray) -> np.ndarray:
    """Return the positions of the blocks of some block rows, row by row."""
    count = np.diff(matrix.indptr)[nodes]
    start = np.repeat(matrix.indptr[nodes] - np.cumsum(count) + count, count)
    return start + np.arange(count.sum())


# Sums stiffness blocks of elements whose nodes have consecutive numbers: no table of pairs, but one of first
# entries
# In a row of the pattern the columns of such an element stand one after the other, since all of them are there. So an
# element of a nodes needs a numbers to find its a^2 places.


class SpanSum:
    """The sum of one batch."""

    def __init__(
        self,
        nodes: np.ndarray,  # int (e, a), of the elements, which rise
        indptr: np.ndarray,  # of the pattern, which has all pairs of nodes of an element, columns sorted
        indices: np.ndarray,  # likewise
    ) -> None:
        rows, local = np.unique(nodes, return_inverse=True)
        local = local.reshape(nodes.shape)
        count = np.diff(indptr)[rows]
        start = np.concatenate([[0], np.cumsum(count)])  # of the rows, among the entries of the batch
        within = entries_at(indptr, indices, nodes, nodes[:, :1]) - indptr[nodes]
        self._place = (start[local] + within).astype(np.int32)
        self._size = int(start[-1])
        self._rounds = _rounds(nodes[:, 0], nodes.shape[1])
        ends = np.flatnonzero(np.diff(rows) != 1) + 1
        # Runs of rows, among the entries of the batch and in the pattern.
        self._runs = [
            (slice(start[low], start[high]), slice(indptr[rows[low]], indptr[rows[high - 1] + 1]))
            for low, high in pairwise([0, *ends, len(rows)])
        ]

    def of(self, blocks: np.ndarray) -> np.ndarray:
        """Return the sums (k, b) of blocks (e a^2, b) at the entries of the batch."""
        total = np.zeros((self._size, blocks.shape[1]))
        width = self._place.shape[1]
        blocks = blocks.reshape(len(self._place), -1, blocks.shape[1])
        for number in range(self._rounds):  # of elements that share no node
            chosen = slice(number, None, self._rounds)
            places = self._place[chosen][:, :, None] + np.arange(width)
            total[places.reshape(len(places), -1)] += blocks[chosen]
        return total

    def add(self, data: np.ndarray, total: np.ndarray) -> None:
        """Add what `of` has returned to all entries (entries, b)."""
        for here, there in self._runs:
            data[there] += total[here]


def consecutive(connectivity: np.ndarray) -> bool:
    """Return whether nodes (E, a) of all elements have consecutive numbers, and the elements rising ones."""
    return bool(np.all(np.diff(connectivity, axis=1) == 1) and np.all(np.diff(connectivity[:, 0]) > 0))


def span_pattern(groups: Sequence[np.ndarray], nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Return row pointers and sorted columns (int32) of all pairs of nodes that share an element."""
    low, high = np.arange(nodes), np.arange(nodes)
    for connectivity in groups:
        np.minimum.at(low, connectivity, connectivity[:, :1])
        np.maximum.at(high, connectivity, connectivity[:, -1:])
    count = high - low + 1
    indptr = np.concatenate([[0], np.cumsum(count)])
    indices = np.arange(indptr[-1], dtype=np.int32)
    indices += np.repeat((low - indptr[:-1]).astype(np.int32), count)
    return indptr.astype(np.int32), indices


def entries_at(indptr: np.ndarray, indices: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Return the positions of pairs (row, column) in a pattern with sorted columns that has all of them."""
    low, high = int(row.min()), int(row.max()) + 1
    start, stop = indptr[low], indptr[high]
    rows = np.repeat(np.arange(low, high, dtype=np.int64), np.diff(indptr[low : high + 1]))
    size = np.int64(len(indptr))
    keys = rows * size + indices[start:stop]
    return start + np.searchsorted(keys, row.astype(np.int64) * size + column)


def _rounds(first: np.ndarray, width: int) -> int:
    """Return the least number such that elements that stand so far apart share no node."""
    for apart in range(1, len(first)):
        if np.all(first[apart:] >= first[:-apart] + width):
            return apart
    return max(len(first), 1)
