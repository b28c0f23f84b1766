"""The interface of all linear solvers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp


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
