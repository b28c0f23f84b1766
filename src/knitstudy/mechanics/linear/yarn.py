"""The scale of a yarn: numbered along itself it is a narrow band, whose Cholesky factor costs next to nothing."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import scipy.sparse as sp
from scipy.linalg import lapack

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.linear.structure import KnitStructure
from knitstudy.mechanics.parallel import threads


class YarnScale:
    """Banded Cholesky factors of every yarn's diagonal block.

    Single precision halves memory and time and costs no iteration: the factors only precondition. Entries outside
    of the band, which only ties bring in, are left out, and their magnitude is added to the diagonal, so that the
    block stays positive definite (Ajiz and Jennings 1984).
    """

    def __init__(self, structure: KnitStructure, dtype: type = np.float32) -> None:
        counts = np.bincount(structure.yarn)
        self._bounds = 3 * np.concatenate([[0], np.cumsum(counts)])
        self._nodes = self._bounds // 3
        self._bandwidth = structure.bandwidth
        self._dtype = dtype
        self._factors: list[np.ndarray] = []

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Factorise the yarns of a matrix; raises ConvergenceError if one is not positive definite."""
        self._factors = []
        with ThreadPoolExecutor(threads()) as pool:
            self._factors = list(pool.map(lambda y: self._factor(matrix, y), range(len(self._nodes) - 1)))

    def _factor(self, matrix: sp.bsr_matrix, yarn: int) -> np.ndarray:
        for dtype in (self._dtype, np.float64):
            # In single precision a yarn that hardly anything holds cannot be told from one that nothing holds.
            band = self._band(matrix, *self._nodes[yarn : yarn + 2], dtype)
            factorise_band = lapack.spbtrf if dtype == np.float32 else lapack.dpbtrf
            factor, info = factorise_band(band, lower=1, overwrite_ab=1)
            if info == 0:
                return factor
        raise ConvergenceError(f"the stiffness of yarn {yarn} is not positive definite (minor {info})")

    def _band(self, matrix: sp.bsr_matrix, first: int, last: int, dtype: type) -> np.ndarray:
        """Return the lower band (bandwidth + 1, unknowns) of nodes first .. last in LAPACK's order."""
        width = 3 * (self._bandwidth + 1)
        band = np.zeros((last - first) * 3 * width, dtype=dtype)
        for low in range(first, last, 2048):  # bounds the index arrays
            high = min(low + 2048, last)
            entries = slice(matrix.indptr[low], matrix.indptr[high])
            row = np.repeat(np.arange(low, high), np.diff(matrix.indptr[low : high + 1]))
            column, data = matrix.indices[entries], matrix.data[entries]
            apart = row - column
            inside = (apart > 0) & (apart <= self._bandwidth) & (column >= first)
            self._put(band, row[inside] - first, column[inside] - first, data[inside], width)
            diagonal = data[apart == 0]
            dropped = (np.abs(apart) > self._bandwidth) & (column >= first) & (column < last)
            if dropped.any():
                lump = np.abs(data[dropped]).sum(axis=2)  # (entries, 3)
                diagonal = diagonal.copy()
                for axis in range(3):
                    diagonal[:, axis, axis] += np.bincount(row[dropped] - low, lump[:, axis], high - low)
            node = np.arange(low, high) - first
            for i in range(3):
                for k in range(i + 1):
                    band[(3 * node + k) * width + i - k] = diagonal[:, i, k]
        return band.reshape((width, (last - first) * 3), order="F")

    @staticmethod
    def _put(band: np.ndarray, row: np.ndarray, column: np.ndarray, data: np.ndarray, width: int) -> None:
        for k in range(3):
            start = (3 * column + k) * width + 3 * (row - column) - k
            for i in range(3):
                band[start + i] = data[:, i, k]

    def solve(self, residual: np.ndarray) -> np.ndarray:
        """Return the correction of all yarns for a residual (size,)."""
        result = np.empty_like(residual)
        for yarn, factor in enumerate(self._factors):
            part = slice(*self._bounds[yarn : yarn + 2])
            solve_band = lapack.spbtrs if factor.dtype == np.float32 else lapack.dpbtrs
            result[part] = solve_band(factor, residual[part].astype(factor.dtype), lower=1)[0]
        return result
