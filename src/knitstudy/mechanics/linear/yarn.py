"""The scale of a yarn: numbered along itself it is a narrow band, whose Cholesky factor costs next to nothing."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.linear import band as banded
from knitstudy.mechanics.linear.structure import KnitStructure
from knitstudy.mechanics.parallel import share


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
        self._factors: list[np.ndarray | None] = []

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Factorise the yarns of a matrix; raises ConvergenceError if one is not positive definite."""
        self._factors = [None] * (len(self._nodes) - 1)
        share(lambda yarn: self._factorise(matrix, yarn), len(self._factors))

    def _factorise(self, matrix: sp.bsr_matrix, yarn: int) -> None:
        for dtype in (self._dtype, np.float64):
            # In single precision a yarn that hardly anything holds cannot be told from one that nothing holds.
            band = self._band(matrix, *self._nodes[yarn : yarn + 2], dtype)
            minor = banded.factorise(band)
            if not minor:
                self._factors[yarn] = band
                return
        raise ConvergenceError(f"the stiffness of yarn {yarn} is not positive definite (minor {minor})")

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

        def solve(yarn: int) -> None:
            part = slice(*self._bounds[yarn : yarn + 2])
            local = residual[part].astype(self._factors[yarn].dtype)
            banded.solve(self._factors[yarn], local)
            result[part] = local

        share(solve, len(self._factors))
        return result
