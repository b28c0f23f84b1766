"""Conjugate gradients that keep a preconditioner over many matrices, as long as it pays."""

from __future__ import annotations

import logging
import time
from typing import Protocol

import numpy as np
import pyamg
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.fem.linear import Solution
from knitstudy.fem.three_scale import KnitStructure, rigid_modes

log = logging.getLogger(__name__)

MOST_ITERATIONS = 400
"""Iterations after which a solve counts as failed."""

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


class AlgebraicMultigrid:
    """Plain pyamg: smoothed aggregation with the rigid modes and block smoothing (Vanek et al. 1996)."""

    def __init__(self, structure: KnitStructure) -> None:
        self._nullspace = rigid_modes(structure)

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Build the hierarchy of a matrix."""
        smoother = ("block_gauss_seidel", {"sweep": "symmetric", "blocksize": 3})
        self._cycle = pyamg.smoothed_aggregation_solver(
            matrix,
            B=self._nullspace,
            presmoother=smoother,
            postsmoother=smoother,
            max_coarse=2000,
            coarse_solver="splu",
        ).aspreconditioner(cycle="V")

    def apply(self, matrix: sp.bsr_matrix, residual: np.ndarray) -> np.ndarray:
        """Return one V-cycle's correction (size,)."""
        return self._cycle @ residual


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
        if not np.any(rhs):
            return Solution(np.zeros_like(rhs), 0)
        if self._waste > WASTE:
            self._renew()
        spent = 0
        while True:
            x, iterations, reached, problem = self._iterate(rhs, tolerance)
            spent += iterations
            if problem is None:
                break
            if self._fresh:
                raise ConvergenceError(f"conjugate gradients: {problem}")
            self._renew()
        self._book(iterations, reached)
        return Solution(x, spent)

    def _renew(self) -> None:
        started = time.perf_counter()
        self.preconditioner.update(self._matrix)
        self.setups += 1
        self._fresh, self._waste, self._rate = True, 0.0, 0.0
        self.setup_seconds += time.perf_counter() - started

    def _book(self, iterations: int, reached: float) -> None:
        decades = -np.log10(max(reached, 1e-16))
        rate = decades / max(iterations, 1)
        if self._rate == 0.0 or rate > self._rate:
            self._rate = rate
        self._waste += iterations - decades / self._rate

    def _iterate(self, rhs: np.ndarray, tolerance: float) -> tuple[np.ndarray, int, float, str | None]:
        """Return iterate, iterations, relative residual and what went wrong, if anything."""
        matrix, apply = self._matrix, self.preconditioner.apply
        goal = tolerance * np.linalg.norm(rhs)
        x = np.zeros_like(rhs)
        residual = rhs.copy()
        direction = image = None
        curvature = 0.0
        for iteration in range(1, MOST_ITERATIONS + 1):
            correction = apply(matrix, residual)
            if direction is None:
                direction = correction
            else:
                # Orthogonal to the last direction itself, not by a formula that presumes symmetry.
                direction = correction - (correction @ image) / curvature * direction
            image = matrix @ direction
            curvature = direction @ image
            if not curvature > 0:
                return (
                    x,
                    iteration,
                    1.0,
                    "the stiffness matrix is not positive definite (a buckling or a mechanism)",
                )
            length = (direction @ residual) / curvature
            x += length * direction
            residual -= length * image
            norm = np.linalg.norm(residual)
            if norm <= goal:
                return x, iteration, norm / np.linalg.norm(rhs), None
        reached = norm / np.linalg.norm(rhs)
        return (
            x,
            iteration,
            reached,
            (
                f"{MOST_ITERATIONS} iterations reached a relative residual of {reached:.1e}, wanted {tolerance:.1e}"
            ),
        )
