"""Sums stiffness blocks of elements whose nodes have consecutive numbers: no table of pairs, but one of first entries.

In a row of the pattern the columns of such an element stand one after the other, since all of them are there. So an
element of a nodes needs a numbers to find its a^2 places.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np


class SpanSum:
    """The sum of one batch.

    Parameters
    ----------
    first : ndarray of int, shape (e,)
        First node of the elements, rising.
    width : int
        a; nodes of an element.
    indptr, indices : ndarray of int
        Of the pattern, which has all pairs of nodes of an element, columns sorted.
    alone : ndarray of bool, shape (n,)
        Rows that no other batch touches.
    """

    def __init__(
        self, first: np.ndarray, width: int, indptr: np.ndarray, indices: np.ndarray, alone: np.ndarray
    ) -> None:
        rows = touched_rows(first, width)
        count = np.diff(indptr)[rows]
        start = np.concatenate([[0], np.cumsum(count)])  # of the rows, among the entries of the batch
        self._size = int(start[-1])
        local = np.searchsorted(rows, first[:, None] + np.arange(width))  # (e, a)
        self._place = (start[local] + _columns(indptr, indices, rows[local], first)).astype(np.int32)
        self._rounds = _rounds(first, width)
        self._width = width
        change = (np.diff(rows) != 1) | (alone[rows[1:]] != alone[rows[:-1]])
        self._own: list[
            tuple[slice, slice]
        ] = []  # runs of rows, among the entries of the batch and in the pattern
        self._joint: list[tuple[slice, slice]] = []
        for low, high in pairwise([0, *(np.flatnonzero(change) + 1).tolist(), len(rows)]):
            here = slice(int(start[low]), int(start[high]))
            there = slice(int(indptr[rows[low]]), int(indptr[rows[high - 1] + 1]))
            (self._own if alone[rows[low]] else self._joint).append((here, there))

    def put(self, data: np.ndarray, blocks: np.ndarray) -> np.ndarray:
        """Write rows of its own into `data` (entries, 9); return what rows at the seams get, from blocks (e a^2, 9)."""
        total = np.zeros((self._size, data.shape[1]))
        blocks = blocks.reshape(len(self._place), -1, data.shape[1])
        for number in range(self._rounds):  # of elements that share no node
            chosen = slice(number, None, self._rounds)
            places = self._place[chosen][:, :, None] + np.arange(self._width)
            total[places.reshape(len(places), -1)] += blocks[chosen]
        for here, there in self._own:
            data[there] = total[here]
        return np.concatenate([total[here] for here, _ in self._joint] or [total[:0]])

    def clear(self, data: np.ndarray) -> None:
        """Set the rows at the seams to zero."""
        for _, there in self._joint:
            data[there] = 0

    def close(self, data: np.ndarray, seam: np.ndarray) -> None:
        """Add what `put` has returned."""
        start = 0
        for _, there in self._joint:
            size = there.stop - there.start
            data[there] += seam[start : start + size]
            start += size


def touched_rows(first: np.ndarray, width: int) -> np.ndarray:
    """Return the nodes of elements whose nodes have consecutive numbers, ascending."""
    return np.unique(first[:, None] + np.arange(width))


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


def _columns(indptr: np.ndarray, indices: np.ndarray, rows: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return where in rows (e, a) the columns `first` (e,) stand: how many entries of the row come before."""
    low, high = rows.min(), rows.max() + 1
    keys = np.repeat(np.arange(low, high, dtype=np.int64), np.diff(indptr[low : high + 1]))
    size = np.int64(len(indptr))
    keys = keys * size + indices[indptr[low] : indptr[high]]
    found = np.searchsorted(keys, rows.astype(np.int64) * size + first[:, None])
    return found + indptr[low] - indptr[rows]


def _rounds(first: np.ndarray, width: int) -> int:
    """Return the least number such that elements that stand so far apart share no node."""
    for apart in range(1, len(first)):
        if np.all(first[apart:] >= first[:-apart] + width):
            return apart
    return max(len(first), 1)
