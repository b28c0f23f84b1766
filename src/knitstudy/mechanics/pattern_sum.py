"""Adds a matrix of few blocks to one of many, whose pattern has most of them, and takes it off again."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import scipy.sparse as sp


class PatternSum:
    """The sum of two BSR matrices of fixed patterns: found once, blocks of the large one are moved in runs.

    Parameters
    ----------
    large, small : bsr matrix, shape (size, size)
        Any with the patterns, columns sorted in every row and none there twice.

    Attributes
    ----------
    inserted : int
        Blocks that the small pattern alone has.
    """

    def __init__(self, large: sp.bsr_matrix, small: sp.bsr_matrix) -> None:
        self._large, self._small = large.indices, (small.indptr, small.indices)
        nodes = len(large.indptr) - 1
        target, self._known = _places(large, small)
        self._new = ~self._known
        self.inserted = int(self._new.sum())
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
