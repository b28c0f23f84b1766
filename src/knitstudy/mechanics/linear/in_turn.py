"""A fast solver, and a robust one for what it cannot solve."""

from __future__ import annotations

import logging

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.linear.krylov import Krylov
from knitstudy.mechanics.linear.lu import LU
from knitstudy.mechanics.linear.solver import NOWHERE, Solution

log = logging.getLogger(__name__)


class InTurn:
    """A `LinearSolver`: iterates, and takes LU for a matrix on which that fails.

    On the way past a limit point a tangent is indefinite: conjugate gradients end there, and a direct solver gives
    Newton's step all the same.

    Attributes
    ----------
    failures : int
        Systems that were left to LU.
    """

    def __init__(self, krylov: Krylov) -> None:
        self._krylov, self._lu = krylov, LU()
        self.failures = 0
        self.setup_seconds = 0.0

    @property
    def preconditioner(self):
        """The preconditioner of the iterations."""
        return self._krylov.preconditioner

    @property
    def setups(self) -> int:
        """How often it was made."""
        return self._krylov.setups

    def begin(self) -> None:
        """Begin an increment."""
        self._krylov.begin()

    def use(
        self,
        matrix: sp.bsr_matrix,
        unsymmetric: sp.bsr_matrix | None = None,
        touching: np.ndarray = NOWHERE,
        moved: np.ndarray | None = None,
    ) -> None:
        """Take over a new matrix."""
        for solver in (self._krylov, self._lu):
            solver.use(matrix, unsymmetric, touching, moved)

    def release(self) -> None:
        """Forget the matrix; the preconditioner stays."""
        self._krylov.release()
        self._lu.release()

    def solve(self, rhs: np.ndarray, tolerance: float) -> Solution:
        """Solve to a relative residual of `tolerance`; raises ConvergenceError if LU fails as well."""
        try:
            solution = self._krylov.solve(rhs, tolerance)
            self.setup_seconds = self._krylov.setup_seconds
        except ConvergenceError as error:
            self.failures += 1
            log.debug("LU solves what iterations do not: %s", error)
            solution = self._lu.solve(rhs, tolerance)
            self.setup_seconds = self._krylov.setup_seconds + self._lu.setup_seconds
        return solution
