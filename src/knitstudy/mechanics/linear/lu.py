"""Sparse LU for matrices of symmetric structure."""

from __future__ import annotations

import time

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.linear.solver import NOWHERE, Solution

REFINEMENTS = 3
"""Most steps of iterative refinement."""


class LU:
    """Sparse LU of SciPy (SuperLU), with the options that suit symmetric stiffness matrices."""

    def __init__(self) -> None:
        self.setup_seconds = 0.0
        self._matrix: sp.csc_matrix | None = None
        self._factors = None

    def begin(self) -> None:
        """Begin an increment: nothing is kept anyway."""

    def use(
        self,
        matrix: sp.bsr_matrix | sp.csr_matrix,
        unsymmetric: sp.bsr_matrix | None = None,
        touching: np.ndarray = NOWHERE,
        moved: np.ndarray | None = None,
    ) -> None:
        """Take over a new matrix."""
        self._matrix, self._factors = matrix, None

    def release(self) -> None:
        """Forget the matrix and its factors."""
        self._matrix = self._factors = None

    def solve(self, rhs: np.ndarray, tolerance: float) -> Solution:
        """Solve directly; `tolerance` is met by far or the matrix is reported as singular."""
        started = time.perf_counter()
        self.setup_seconds = 0.0
        if self._factors is None:
            self._factors = factorise(self._matrix)
            self.setup_seconds = time.perf_counter() - started
        x = self._factors.solve(rhs)
        level = np.linalg.norm(rhs)
        for _ in range(REFINEMENTS):
            residual = rhs - self._matrix @ x
            # Without pivoting, factors of an unsymmetric matrix may need a step of refinement.
            if np.linalg.norm(residual) <= min(tolerance, 1e-10) * level:
                break
            x += self._factors.solve(residual)
        if not np.all(np.isfinite(x)):
            raise ConvergenceError(
                "the stiffness matrix is singular: something is free to move as a rigid body"
            )
        return Solution(x, 0)


def factorise(matrix: sp.spmatrix):
    """Return SuperLU factors of a structurally symmetric matrix.

    Raises
    ------
    ConvergenceError
        If the matrix is singular.
    """
    try:
        return spla.splu(
            sp.csc_matrix(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise ConvergenceError(f"the stiffness matrix cannot be factorised ({error})") from None
