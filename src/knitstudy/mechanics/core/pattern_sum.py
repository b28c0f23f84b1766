"""Adds a BSR matrix of few blocks to one of many, whose pattern has most of them, and takes it off again."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.batches import by_parts, parts, share

# Block rows in which places are looked for at once, and blocks that are added at once: both bound the memory.
ROWS, FEW = 8_192, 32_768


class PatternSum:
    """The sum of two BSR matrices of fixed patterns: found once, blocks of the large one are moved in runs.

    Columns are sorted and unique in every row.
    """

    def __init__(self, large: sp.bsr_matrix, small: sp.bsr_matrix) -> None:
        self._large = large.indices
        self._small = (small.indptr, small.indices)
        target, known = _places(large, small)
        self._new = ~known
        # Blocks that the small pattern alone has: before every one of its blocks, and all of them
        inserted = np.concatenate([[0], np.cumsum(self._new)]).astype(large.indptr.dtype)
        self.inserted = int(inserted[-1])
        self._at = target + inserted[:-1]
        before = target[self._new]
        self.indices = np.insert(large.indices, before, small.indices[self._new])
        self.indptr = large.indptr + inserted[small.indptr]
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
        """Return the sum; it takes the place of the large matrix if that has room for the entries to insert.

        Room is the rest of the array whose first part is `large.data`.
        """
        if not self.inserted:
            _add(large.data, self._at, small.data)
            return large
        block = math.prod(large.data.shape[1:])
        source = large.data.reshape(-1)
        total = _from_its_start(source)
        if total is None or total.size < len(self.indices) * block:
            total = np.empty(len(self.indices) * block)
        # From the last run to the first: within one array, no run overwrites one that has yet to be moved.
        for start, end, shift in reversed(self._runs):
            total[(start + shift) * block : (end + shift) * block] = source[start * block : end * block]
        data = total[: len(self.indices) * block].reshape(-1, *large.data.shape[1:])
        data[self._at[self._new]] = 0
        _add(data, self._at, small.data)
        return sp.bsr_matrix((data, self.indices, self.indptr), shape=large.shape)


@contextmanager
def lacking(matrix: sp.bsr_matrix, part: sp.bsr_matrix) -> Iterator[None]:
    """Take a part, all of whose blocks a matrix has, off that matrix for a while; rounding of its blocks stays.

    Examples
    --------
    >>> matrix, part = (sp.bsr_matrix(number * np.eye(3), blocksize=(3, 3)) for number in (5.0, 2.0))
    >>> with lacking(matrix, part):
    ...     matrix.diagonal().tolist()
    [3.0, 3.0, 3.0]
    """
    places, _ = _places(matrix, part)
    _add(matrix.data, places, part.data, np.subtract)
    try:
        yield
    finally:
        _add(matrix.data, places, part.data)


def _add(total: Floats, place: np.ndarray, blocks: Floats, add: np.ufunc = np.add) -> None:
    """Add blocks (k, b, b) to the blocks of a total at different places (k,), few at a time."""
    some = parts(len(place), FEW)

    def put(number: int) -> None:
        here = place[some[number]]
        total[here] = add(total[here], blocks[some[number]])

    share(put, len(some))


def _places(large: sp.bsr_matrix, small: sp.bsr_matrix) -> tuple[np.ndarray, Bools]:
    """Return where the large pattern has, or would have, every block of a small one, and whether it has it.

    Blocks that it does not have go before the first block of the row with a larger column, or to the row's end.
    """
    nodes = len(large.indptr) - 1

    def places(part: slice) -> tuple[np.ndarray, Bools]:
        low, high, _ = part.indices(nodes)
        count = np.diff(small.indptr[low : high + 1])
        row = low + np.repeat(np.arange(high - low), count)
        rows = low + np.flatnonzero(count)
        width = large.indptr[rows + 1] - large.indptr[rows]
        keys = np.repeat(rows, width) * np.int64(nodes) + large.indices[block_entries(large, rows)]
        wanted = row * np.int64(nodes) + small.indices[small.indptr[low] : small.indptr[high]]
        place = np.searchsorted(keys, wanted)
        known = np.zeros(len(wanted), dtype=bool)
        inside = place < len(keys)
        known[inside] = keys[place[inside]] == wanted[inside]
        before = np.concatenate([[0], np.cumsum(width)])
        place += large.indptr[row] - before[np.searchsorted(rows, row)]
        return place.astype(large.indptr.dtype), known

    return by_parts(places, nodes, ROWS)


def _from_its_start(part: Floats) -> Floats | None:
    """Return the array, flat, that a flat array is the first part of; None if it is another part or not a part."""
    whole = part.base
    if not isinstance(whole, np.ndarray) or not whole.flags.c_contiguous or whole.dtype != part.dtype:
        return None
    return whole.reshape(-1) if whole.ctypes.data == part.ctypes.data else None


def block_entries(matrix: sp.bsr_matrix, nodes: Ints) -> Ints:
    """Return the positions of the blocks of some block rows, row by row.

    Examples
    --------
    >>> blocks = sp.bsr_matrix(np.kron([[1, 1], [0, 1]], np.ones((3, 3))), blocksize=(3, 3))
    >>> block_entries(blocks, np.array([0])).tolist()  # of three blocks
    [0, 1]
    """
    count = matrix.indptr[nodes + 1] - matrix.indptr[nodes]
    start = np.repeat(matrix.indptr[nodes] - np.cumsum(count) + count, count)
    return start + np.arange(count.sum())
