"""Linear solvers behind one interface: sparse LU here, preconditioned conjugate gradients in their own files."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from knitstudy.errors import ConvergenceError


@dataclass(frozen=True)
class Solution:
    """Solution of a linear system and the Krylov iterations that it took (0 for a direct solver)."""

    x: np.ndarray
    iterations: int


class LinearSolver(Protocol):
    """Solves systems whose matrix changes slowly.

    Attributes
    ----------
    setup_seconds : float
        Time that the last call of `solve` spent on factors.
    """

    setup_seconds: float

    def use(self, matrix: sp.bsr_matrix | sp.csr_matrix) -> None:
        """Take over a new matrix; factors are made when they are needed."""
        ...

    def release(self) -> None:
        """Forget the matrix, so that its memory can serve for the next one."""
        ...

    def solve(self, rhs: np.ndarray, tolerance: float) -> Solution:
        """Solve to a relative residual of `tolerance`; raises ConvergenceError if that is not reached."""
        ...


class LU:
    """Sparse LU of SciPy (SuperLU), with the options that suit symmetric stiffness matrices."""

    def __init__(self) -> None:
        self.setup_seconds = 0.0
        self._matrix: sp.csc_matrix | None = None
        self._factors = None

    def use(self, matrix: sp.bsr_matrix | sp.csr_matrix) -> None:
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
