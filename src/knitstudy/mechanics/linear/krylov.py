"""Krylov methods that keep a preconditioner over many matrices, as long as it pays."""

from __future__ import annotations

import time
from contextlib import nullcontext
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.linear.conjugate import INDEFINITE, conjugate_gradients
from knitstudy.mechanics.linear.minimal_residual import minimal_residuals
from knitstudy.mechanics.linear.rows import Rows
from knitstudy.mechanics.linear.solver import NOWHERE, Iterate, Solution
from knitstudy.mechanics.pattern_sum import lacking

MOST_ITERATIONS = 400
"""Iterations with a fresh preconditioner after which a solve counts as failed."""

PATIENCE = 60
"""Most iterations that one solve may take with a preconditioner made for an earlier matrix."""

WASTE = 15
"""Iterations beyond those of a fresh preconditioner that may add up before it is made anew: as many as making one costs
(16 on 30 x 30 loops), so that never more than twice the least is spent (docs/performance.md)."""


class Preconditioner(Protocol):
    """An approximate inverse that can be older than the matrix it is applied for."""

    def update(
        self,
        matrix: sp.bsr_matrix,
        unsymmetric: sp.bsr_matrix | None,
        touching: np.ndarray,
        moved: np.ndarray | None,
    ) -> None:
        """Make it anew for the sum of a symmetric positive matrix and of what makes it unsymmetric, if anything.

        The matrix changes afterwards: what is to be kept of it has to be copied.
        """
        ...

    def apply(self, matrix: Rows, residual: np.ndarray) -> np.ndarray:
        """Return an approximate solution (size,) for a right-hand side (size,); `matrix` is that of the system."""
        ...


class Krylov:
    """A `LinearSolver`: conjugate gradients for symmetric matrices, minimal residuals for others.

    The preconditioner, of the symmetric positive part, serves on for later matrices of an increment until the
    iterations that it costs more than a fresh one add up to `WASTE`, or contact acts on nodes that it does not know.
    The decision depends on counts only, so that runs repeat, also those that go on from a restart file.

    Parameters
    ----------
    preconditioner : Preconditioner
    truncates : bool
        Whether an indefinite matrix ends conjugate gradients with what they have found, a step that lowers the energy:
        where a predicted state presses what will be pulled, as in large knits that turn, Newton's method gets on by it.
    """

    def __init__(self, preconditioner: Preconditioner, truncates: bool = False) -> None:
        self.preconditioner = preconditioner
        self._truncates = truncates
        self.setup_seconds = 0.0
        self.setups = 0
        self._matrix: sp.bsr_matrix | None = None
        self._unsymmetric: sp.bsr_matrix | None = None
        self._rows: Rows | None = None
        self._touching = self._known = NOWHERE
        self._moved: np.ndarray | None = None
        self._fresh = False
        self._rate = 0.0  # decades an iteration of the fresh preconditioner
        self._waste = np.inf

    def begin(self) -> None:
        """Begin an increment: the next solve makes the preconditioner anew."""
        self._waste = np.inf

    def use(
        self,
        matrix: sp.bsr_matrix,
        unsymmetric: sp.bsr_matrix | None = None,
        touching: np.ndarray = NOWHERE,
        moved: np.ndarray | None = None,
    ) -> None:
        """Take over a new matrix; the preconditioner stays."""
        self._matrix, self._unsymmetric, self._fresh = matrix, unsymmetric, False
        self._touching, self._moved = touching, moved
        self._rows = Rows.of(matrix)

    def release(self) -> None:
        """Forget the matrix; the preconditioner stays."""
        self._matrix = self._unsymmetric = self._rows = None

    def solve(self, rhs: np.ndarray, tolerance: float) -> Solution:
        """Solve to a true relative residual of `tolerance`.

        Raises
        ------
        ConvergenceError
            If that takes too many iterations, or a symmetric matrix is not positive definite and that is not allowed.
        """
        self.setup_seconds = 0.0
        state = Iterate(np.zeros_like(rhs), rhs.copy(), float(np.linalg.norm(rhs)))
        if self._waste > WASTE or not np.isin(self._touching, self._known).all():
            self._renew()
        problem = self._iterate(state, tolerance)
        if problem is INDEFINITE and self._truncates and state.x.any():
            return Solution(state.x, state.iterations)
        if problem and not self._fresh:
            self._renew()
            problem = self._iterate(state, tolerance)
        if problem:
            raise ConvergenceError(f"the linear solver failed: {problem}")
        return Solution(state.x, state.iterations)

    def _renew(self) -> None:
        started = time.perf_counter()
        self._waste = np.inf  # one that fails here leaves none that could stay
        unsymmetric = self._unsymmetric
        some = unsymmetric is not None and unsymmetric.nnz
        with lacking(self._matrix, unsymmetric) if some else nullcontext():
            self.preconditioner.update(self._matrix, unsymmetric, self._touching, self._moved)
        self._known = self._touching
        self.setups += 1
        self._fresh, self._waste, self._rate = True, 0.0, 0.0
        self.setup_seconds += time.perf_counter() - started

    def _book(self, iterations: int, decades: float) -> None:
        rate = decades / max(iterations, 1)
        self._rate = max(self._rate, rate)
        if self._rate > 0:
            self._waste += iterations - decades / self._rate

    def _patience(self, tolerance: float) -> int:
        """Return the iterations that one solve may take with a preconditioner made for an earlier matrix."""
        fresh = -np.log10(tolerance) / self._rate if self._rate > 0 else 0.0
        return min(round(fresh) + WASTE, PATIENCE)

    def _iterate(self, state: Iterate, tolerance: float) -> str | None:
        """Improve an iterate in place; return what went wrong, if anything."""
        matrix, goal = self._rows, tolerance * state.level
        most = MOST_ITERATIONS if self._fresh else self._patience(tolerance)
        start, before = np.linalg.norm(state.residual), state.iterations
        method = conjugate_gradients if self._unsymmetric is None else minimal_residuals

        def apply(residual: np.ndarray) -> np.ndarray:
            return self.preconditioner.apply(matrix, residual)

        problem = method(matrix, apply, state, goal, most)
        reached = np.linalg.norm(state.residual)
        if problem:
            return problem
        if reached > goal:
            return (
                f"{most} iterations reached a relative residual of {reached / state.level:.1e}, "
                f"wanted {tolerance:.1e}"
            )
        decades = np.log10(max(start, 1e-300) / max(reached, 1e-16 * start, 1e-300))
        self._book(state.iterations - before, decades)
        return None
