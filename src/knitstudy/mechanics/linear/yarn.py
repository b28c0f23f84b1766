"""The scale of a yarn: numbered along itself it is a narrow band, whose Cholesky factor costs next to nothing."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.linear import band as banded
from knitstudy.mechanics.linear.structure import KnitStructure
from knitstudy.mechanics.parallel import share

WIDER = 1.5
"""Most that a band may be widened by: factors cost its square. Of solid yarns, a tie reaches one station further."""

CHUNK = 2048
"""Nodes at a time; bounds the index arrays."""


class YarnScale:
    """Banded Cholesky factors of every yarn's diagonal block.

    Single precision halves memory and time and costs no iteration: the factors only precondition. What
    lies outside of the elements' band, which only ties and contact bring in, is held by a wider band if that is at
    most `WIDER` times as wide; otherwise it is left out, and its magnitude is added to the diagonal, so that the block
    stays positive definite (Ajiz and Jennings 1984).
    """

    def __init__(self, structure: KnitStructure, dtype: type = np.float32) -> None:
        counts = np.bincount(structure.yarn)
        self._bounds = 3 * np.concatenate([[0], np.cumsum(counts)])
        self._nodes = self._bounds // 3
        self._bandwidth = structure.bandwidth
        self._dtype = dtype
        self._factors: list[np.ndarray | None] = []
        self._lumps: list[np.ndarray | None] = []

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Factorise the yarns of a matrix; raises ConvergenceError if one is not positive definite."""
        count = len(self._nodes) - 1
        self._factors = self._factors or [None] * count
        self._lumps = [None] * count
        share(lambda yarn: self._factorise(matrix, yarn), count)
        bandwidths = np.array([len(factor) // 3 - 1 for factor in self._factors])
        self._outside = _outside(matrix, self._nodes, bandwidths, np.concatenate(self._lumps))

    def _factorise(self, matrix: sp.bsr_matrix, yarn: int) -> None:
        for dtype in (self._dtype, np.float64):
            # In single precision a yarn that hardly anything holds cannot be told from one that nothing holds.
            band, self._lumps[yarn] = self._band(matrix, yarn, dtype)
            minor = banded.factorise(band)
            if minor == 0:
                self._factors[yarn] = band
                return
        raise ConvergenceError(f"the stiffness of yarn {yarn} is not positive definite (minor {minor})")

    def _band(self, matrix: sp.bsr_matrix, yarn: int, dtype: type) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower band (bandwidth + 1, unknowns) of a yarn in LAPACK's order.

        And what was added to the diagonal of every node (nodes, 3) for what lies outside of it.
        """
        first, last = self._nodes[yarn : yarn + 2]
        bandwidth = self._reach(matrix, first, last)
        width = 3 * (bandwidth + 1)
        band = self._empty(yarn, (last - first) * 3 * width, dtype)
        lumps = np.zeros((last - first, 3))
        for low in range(first, last, CHUNK):
            high = min(low + CHUNK, last)
            entries = slice(matrix.indptr[low], matrix.indptr[high])
            row = np.repeat(np.arange(low, high), np.diff(matrix.indptr[low : high + 1]))
            column, data = matrix.indices[entries], matrix.data[entries]
            apart = row - column
            inside = (apart > 0) & (apart <= bandwidth) & (column >= first)
            self._put(band, row[inside] - first, column[inside] - first, data[inside], width)
            diagonal = data[apart == 0]
            dropped = (np.abs(apart) > bandwidth) & (column >= first) & (column < last)
            if dropped.any():
                lump = np.abs(data[dropped]).sum(axis=2)  # (entries, 3)
                diagonal = diagonal.copy()
                for axis in range(3):
                    added = np.bincount(row[dropped] - low, lump[:, axis], high - low)
                    diagonal[:, axis, axis] += added
                    lumps[low - first : high - first, axis] = added
            node = np.arange(low, high) - first
            for i in range(3):
                for k in range(i + 1):
                    band[(3 * node + k) * width + i - k] = diagonal[:, i, k]
        return band.reshape((width, (last - first) * 3), order="F"), lumps

    def _empty(self, yarn: int, size: int, dtype: type) -> np.ndarray:
        """Return zeros (size,), in the place of the yarn's last factor if they fit."""
        last = self._factors[yarn]
        if last is None or last.size != size or last.dtype != dtype:
            self._factors[yarn] = None
            return np.zeros(size, dtype=dtype)
        flat = last.reshape(-1, order="F")
        flat[:] = 0
        return flat

    def _reach(self, matrix: sp.bsr_matrix, first: int, last: int) -> int:
        """Return the bandwidth of nodes first .. last: what they need of each other, or the elements' own."""
        reach = self._bandwidth
        for low in range(first, last, CHUNK):
            high = min(low + CHUNK, last)
            row = np.repeat(np.arange(low, high), np.diff(matrix.indptr[low : high + 1]))
            column = matrix.indices[matrix.indptr[low] : matrix.indptr[high]]
            reach = max(reach, int((row - column).max(where=column >= first, initial=0)))
        return reach if reach <= WIDER * self._bandwidth else self._bandwidth

    @staticmethod
    def _put(band: np.ndarray, row: np.ndarray, column: np.ndarray, data: np.ndarray, width: int) -> None:
        for k in range(3):
            start = (3 * column + k) * width + 3 * (row - column) - k
            for i in range(3):
                band[start + i] = data[:, i, k]

    def correct(self, residual: np.ndarray, correction: np.ndarray) -> None:
        """Add the correction of all yarns and take its effect off the residual, both (size,) in place.

        What remains of the residual is the effect of what the factors leave out: no product with the whole matrix.
        """
        along = np.empty_like(residual)

        def solve(yarn: int) -> None:
            part = slice(*self._bounds[yarn : yarn + 2])
            local = residual[part].astype(self._factors[yarn].dtype)
            banded.solve(self._factors[yarn], local)
            along[part] = local

        share(solve, len(self._factors))
        correction += along
        np.negative(self._outside @ along, out=residual)


def _outside(
    matrix: sp.bsr_matrix, nodes: np.ndarray, bandwidth: np.ndarray, lumps: np.ndarray
) -> sp.csr_matrix:
    """Return a matrix without the bands of its yarns, and without what was added to them."""
    parts = []
    for first, last, reach in zip(nodes[:-1], nodes[1:], bandwidth, strict=True):
        for low in range(first, last, CHUNK):
            high = min(low + CHUNK, last)
            row = np.repeat(np.arange(low, high), np.diff(matrix.indptr[low : high + 1]))
            column = matrix.indices[matrix.indptr[low] : matrix.indptr[high]]
            out = np.flatnonzero((np.abs(row - column) > reach) | (column < first) | (column >= last))
            indptr = np.concatenate([[0], np.cumsum(np.bincount(row[out] - low, minlength=high - low))])
            data = matrix.data[matrix.indptr[low] + out]
            part = sp.bsr_matrix(
                (data, column[out], indptr), shape=(3 * (high - low), matrix.shape[1])
            ).tocsr()
            part.eliminate_zeros()  # of links, blocks are diagonal
            parts.append(part)
    return sp.vstack(parts, format="csr") - sp.diags(lumps.ravel(), format="csr")
