"""The interface of all linear solvers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

NOWHERE = np.empty(0, dtype=np.int64)

Apply = Callable[[np.ndarray], np.ndarray]
"""A preconditioner: approximate solution (size,) for a residual (size,)."""


@dataclass(frozen=True)
class Solution:
    """Solution of a linear system and the Krylov iterations that it took (0 for a direct solver)."""

    x: np.ndarray
    iterations: int


@dataclass
class Iterate:
    """Approximate solution, its residual, the norm of the right-hand side, and iterations so far."""

    x: np.ndarray
    residual: np.ndarray
    level: float
    iterations: int = 0


class LinearSolver(Protocol):
    """Solves systems whose matrix changes slowly.

    Attributes
    ----------
    setup_seconds : float
        Time that the last call of `solve` spent on factors.
    """

    setup_seconds: float

    def begin(self) -> None:
        """Begin an increment: a run that goes on from a file knows nothing of the matrices of those before."""
        ...

    def use(
        self,
        matrix: sp.bsr_matrix | sp.csr_matrix,
        unsymmetric: sp.bsr_matrix | None = None,
        touching: np.ndarray = NOWHERE,
        moved: np.ndarray | None = None,
    ) -> None:
        """Take over a new matrix; factors are made when they are needed.

        Parameters
        ----------
        matrix : bsr or csr matrix, shape (size, size)
        unsymmetric : bsr matrix, shape (size, size), optional
            Part of it without which it is symmetric and positive definite.
        touching : ndarray of int
            Nodes that contact acts on.
        moved : ndarray, shape (n, 3), optional
            How far the nodes are from where they were undeformed [m]: rigid motions are those of where they are.
        """
        ...

    def release(self) -> None:
        """Forget the matrix, so that its memory can serve for the next one."""
        ...

    def solve(self, rhs: np.ndarray, tolerance: float) -> Solution:
        """Solve to a relative residual of `tolerance`; raises ConvergenceError if that is not reached."""
        ...
