"""Ties in matrices of few blocks: T^T K T, of the tangent of contact between surfaces whose nodes may be tied."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp


class TiedBlocks:
    """Collects matrices over all nodes to retained ones.

    Parameters
    ----------
    transformation : csr matrix, shape (N, n)
        T: every node as a weighted sum of retained nodes.
    """

    def __init__(self, transformation: sp.csr_matrix) -> None:
        self._transformation, self._kept = transformation, transformation.shape[1]
        # The retained node that a node is, or -1 if it depends on several.
        self._itself = np.full(transformation.shape[0], -1)
        single = np.flatnonzero(np.diff(transformation.indptr) == 1)
        entry = transformation.indptr[single]
        same = transformation.data[entry] == 1
        self._itself[single[same]] = transformation.indices[entry[same]]

    def collect(self, matrix: sp.bsr_matrix) -> sp.bsr_matrix:
        """Return T^T K T (3 n, 3 n) of K (3 N, 3 N), columns sorted in every row and none there twice."""
        row = np.flatnonzero(np.diff(matrix.indptr))
        kept = self._itself[row]
        alone = kept.min(initial=0) >= 0 and self._itself[matrix.indices].min(initial=0) >= 0
        if (
            alone
            and np.all(np.diff(kept) > 0)
            and np.all(np.diff(self._itself[np.unique(matrix.indices)]) > 0)
        ):
            # Nothing among them is tied: the same blocks under other numbers.
            indptr = np.zeros(self._kept + 1, dtype=np.int32)
            indptr[kept + 1] = np.diff(matrix.indptr)[row]
            indices = self._itself[matrix.indices].astype(np.int32)
            return self._matrix(matrix.data, indices, np.cumsum(indptr, dtype=np.int32))
        return self._spread(matrix)

    def _spread(self, matrix: sp.bsr_matrix) -> sp.bsr_matrix:
        """Collect blocks of nodes that may depend on several."""
        count = len(matrix.indices)
        row = np.repeat(np.arange(len(matrix.indptr) - 1), np.diff(matrix.indptr))
        first, second = self._transformation[row], self._transformation[matrix.indices]
        width = np.diff(second.indptr)
        many = np.diff(first.indptr) * width
        entry = np.repeat(np.arange(count), many)
        within = np.arange(len(entry)) - np.repeat(np.cumsum(many) - many, many)
        i = first.indptr[entry] + within // width[entry]
        j = second.indptr[entry] + within % width[entry]
        key = first.indices[i].astype(np.int64) * self._kept + second.indices[j]
        key, place = np.unique(key, return_inverse=True)
        weights = first.data[i] * second.data[j]
        total = sp.csr_matrix((weights, (place, entry)), shape=(len(key), count))
        data = (total @ matrix.data.reshape(count, 9)).reshape(-1, 3, 3)
        indptr = np.searchsorted(key, self._kept * np.arange(self._kept + 1, dtype=np.int64))
        return self._matrix(data, (key % self._kept).astype(np.int32), indptr.astype(np.int32))

    def _matrix(self, data: np.ndarray, indices: np.ndarray, indptr: np.ndarray) -> sp.bsr_matrix:
        return sp.bsr_matrix((data, indices, indptr), shape=(3 * self._kept, 3 * self._kept))
