"""Conjugate gradients that keep a preconditioner over many matrices, as long as it pays."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.fem.linear.solver import Solution

MOST_ITERATIONS = 400
"""Iterations with a fresh preconditioner after which a solve counts as failed."""

PATIENCE = 60
"""Iterations that one solve may take with a preconditioner made for an earlier matrix."""

WASTE = 30
"""Iterations beyond those of a fresh preconditioner that may add up before it is made anew."""


class Preconditioner(Protocol):
    """An approximate inverse that can be older than the matrix it is applied for."""

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Make it anew for a matrix."""
        ...

    def apply(self, matrix: sp.bsr_matrix, residual: np.ndarray) -> np.ndarray:
        """Return an approximate solution (size,) for a right-hand side (size,)."""
        ...


class ConjugateGradients:
    """Flexible preconditioned conjugate gradients (Notay 2000) as a `LinearSolver`.

    The preconditioner of an earlier matrix serves on until the iterations that it costs more than a fresh one
    add up to `WASTE`; the decision depends on counts only, so that runs repeat.
    """

    def __init__(self, preconditioner: Preconditioner) -> None:
        self.preconditioner = preconditioner
        self.setup_seconds = 0.0
        self.setups = 0
        self._matrix: sp.bsr_matrix | None = None
        self._fresh = False
        self._rate = 0.0  # decades an iteration of the fresh preconditioner
        self._waste = np.inf

    def use(self, matrix: sp.bsr_matrix) -> None:
        """Take over a new matrix; the preconditioner stays."""
        self._matrix, self._fresh = matrix, False

    def release(self) -> None:
        """Forget the matrix; the preconditioner stays."""
        self._matrix = None

    def solve(self, rhs: np.ndarray, tolerance: float) -> Solution:
        """Solve to a true relative residual of `tolerance`.

        Raises
        ------
        ConvergenceError
            If that takes too many iterations, or the matrix is not positive definite.
        """
        self.setup_seconds = 0.0
        state = _Iterate(np.zeros_like(rhs), rhs.copy(), np.linalg.norm(rhs))
        if self._waste > WASTE:
            self._renew()
        problem = self._iterate(state, tolerance)
        if problem and not self._fresh:
            self._renew()
            problem = self._iterate(state, tolerance)
        if problem:
            raise ConvergenceError(f"conjugate gradients: {problem}")
        return Solution(state.x, state.iterations)

    def _renew(self) -> None:
        started = time.perf_counter()
        self.preconditioner.update(self._matrix)
        self.setups += 1
        self._fresh, self._waste, self._rate = True, 0.0, 0.0
        self.setup_seconds += time.perf_counter() - started

    def _book(self, iterations: int, decades: float) -> None:
        rate = decades / max(iterations, 1)
        self._rate = max(self._rate, rate)
        if self._rate > 0:
            self._waste += iterations - decades / self._rate

    def _iterate(self, state: _Iterate, tolerance: float) -> str | None:
        """Improve an iterate in place; return what went wrong, if anything."""
        matrix, apply = self._matrix, self.preconditioner.apply
        goal = tolerance * state.level
        most = MOST_ITERATIONS if self._fresh else PATIENCE
        norm = start = np.linalg.norm(state.residual)
        direction = image = None
        curvature = 0.0
        iterations = 0
        while norm > goal:
            if iterations == most:
                reached = norm / state.level
                return (
                    f"{most} iterations reached a relative residual of {reached:.1e}, wanted {tolerance:.1e}"
                )
            iterations += 1
            state.iterations += 1
            correction = apply(matrix, state.residual)
            if direction is None:
                direction = correction
            else:
                # Orthogonal to the last direction itself, not by a formula that presumes symmetry.
                direction = correction - (correction @ image) / curvature * direction
            image = matrix @ direction
            curvature = direction @ image
            if not curvature > 0:
                return "the stiffness matrix is not positive definite (a buckling or a mechanism)"
            length = (direction @ state.residual) / curvature
            state.x += length * direction
            state.residual -= length * image
            norm = np.linalg.norm(state.residual)
        self._book(iterations, np.log10(max(start, 1e-300) / max(norm, 1e-16 * start, 1e-300)))
        return None


@dataclass
class _Iterate:
    """Approximate solution, its residual, the norm of the right-hand side, and iterations so far."""

    x: np.ndarray
    residual: np.ndarray
    level: float
    iterations: int = 0
