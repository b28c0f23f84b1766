"""Krylov solvers: conjugate gradients and minimal residuals with a preconditioner."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, gcrotmk

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.core.batches import share
from knitstudy.mechanics.core.linear import LU, NOWHERE, Solution, System

log = logging.getLogger(__name__)

# Products of a sparse matrix with vectors, in ranges of rows that threads share

ENTRIES = 400_000  # numbers of a matrix a range: enough that taking it in hand costs next to nothing


class RowRanges:
    """A matrix in ranges of rows, with blocks of one height; ``rows @ x`` is the matrix's own product."""

    def __init__(self, parts: Sequence[sp.bsr_matrix]) -> None:
        self._parts = parts
        self.shape = sum(part.shape[0] for part in parts), parts[0].shape[1]

    @classmethod
    def of(cls, matrix: sp.bsr_matrix) -> RowRanges:
        """Return a matrix cut into ranges of some `ENTRIES` numbers, without a copy of them."""
        pieces = max(1, round(matrix.data.size / ENTRIES))
        cuts = np.searchsorted(matrix.indptr, np.linspace(0, matrix.indptr[-1], pieces + 1)[1:-1])
        bounds = np.unique(np.concatenate([[0], cuts, [len(matrix.indptr) - 1]]))
        return cls([_part(matrix, low, high) for low, high in pairwise(bounds)])

    def __matmul__(self, vector: np.ndarray) -> np.ndarray:
        """Return the product (rows,) with a vector (columns,)."""
        return np.concatenate(share(lambda number: self._parts[number] @ vector, len(self._parts)))

    def galerkin(
        self,
        basis: sp.bsr_matrix,  # blocks as high as the matrix's
        dtype: type,  # of K P, no more than a range of which is ever held in the matrix's own, as P^T K P is
    ) -> tuple[RowRanges, sp.csr_matrix]:
        """Return K P, of a square matrix K and a basis P (columns, m), and P^T K P (m, m)."""
        ends = np.cumsum([0, *(len(part.indptr) - 1 for part in self._parts)])

        def multiply(number: int) -> tuple[sp.bsr_matrix, sp.coo_matrix]:
            image = self._parts[number] @ basis
            own = _part(basis, *ends[number : number + 2])
            return image.astype(dtype), (own.T @ image).tocoo()

        images, coarse = zip(*share(multiply, len(self._parts)), strict=True)
        row, column, data = (
            np.concatenate([getattr(piece, name) for piece in coarse]) for name in ("row", "col", "data")
        )
        return RowRanges(images), sp.csr_matrix((data, (row, column)), shape=2 * basis.shape[1:])


def _part(matrix: sp.bsr_matrix, low: int, high: int) -> sp.bsr_matrix:
    """Return the block rows low .. high of a matrix, without a copy of their entries."""
    entries = slice(matrix.indptr[low], matrix.indptr[high])
    return sp.bsr_matrix(
        (matrix.data[entries], matrix.indices[entries], matrix.indptr[low : high + 1] - matrix.indptr[low]),
        shape=(matrix.blocksize[0] * (high - low), matrix.shape[1]),
    )


# A preconditioner: approximate solution (size,) for a residual (size,).
Apply = Callable[[np.ndarray], np.ndarray]


@dataclass
class KrylovIterate:
    """Approximate solution, its residual, the norm of the right-hand side, and iterations so far."""

    x: Floats
    residual: Floats
    level: float
    iterations: int = 0


# Flexible conjugate gradients, for symmetric positive definite matrices

INDEFINITE = "the stiffness matrix is not positive definite (a buckling or a mechanism)"


def conjugate_gradients(
    matrix: RowRanges,  # (size, size), symmetric positive definite
    apply: Apply,  # the preconditioner
    state: KrylovIterate,
    goal: float,  # norm of the residual to reach
    most: int,  # iterations to try
) -> str | None:
    """Improve an iterate in place by preconditioned conjugate gradients (Notay 2000).

    Return what went wrong, if anything: `INDEFINITE` if a direction has no stiffness. The iterate before then
    lowers the energy all the same (Steihaug 1983).

    Examples
    --------
    >>> matrix, now = np.array([[4.0, 1.0], [1.0, 3.0]]), KrylovIterate(np.zeros(2), np.array([5.0, 4.0]), 1.0)
    >>> conjugate_gradients(matrix, np.copy, now, goal=1e-9, most=5)
    >>> now.x.round(9).tolist(), now.iterations
    ([1.0, 1.0], 2)
    """
    direction = image = np.zeros_like(state.x)
    curvature = 1.0
    for _ in range(most):
        if np.linalg.norm(state.residual) <= goal:
            return None
        state.iterations += 1
        correction = apply(state.residual)
        # Orthogonal to the last direction itself, not by a formula that presumes a constant preconditioner.
        direction = correction - (correction @ image) / curvature * direction
        image = matrix @ direction
        curvature = float(direction @ image)
        if not curvature > 0:
            return INDEFINITE
        length = (direction @ state.residual) / curvature
        state.x += length * direction
        state.residual -= length * image
    return None


# Generalised minimal residuals, for matrices that friction has made unsymmetric

RESTART = 30  # iterations after which all search directions but one are dropped; bounds the memory


def minimal_residuals(
    matrix: RowRanges, apply: Apply, state: KrylovIterate, goal: float, most: int
) -> str | None:
    """Improve an iterate in place by flexible GMRES; parameters as of `conjugate_gradients`.

    One direction survives every restart (Hicken and Zingg 2010).

    Examples
    --------
    >>> matrix, now = np.array([[4.0, 1.0], [-1.0, 3.0]]), KrylovIterate(np.zeros(2), np.array([5.0, 2.0]), 1.0)
    >>> minimal_residuals(matrix, np.copy, now, goal=1e-9, most=5)
    >>> now.x.round(9).tolist()
    [1.0, 1.0]
    """

    def counted(residual: Floats) -> Floats:
        state.iterations += 1
        return apply(residual)

    cycles = math.ceil(most / RESTART)
    step, _ = gcrotmk(
        LinearOperator(matrix.shape, matrix.__matmul__, dtype=float),
        state.residual,
        rtol=0.0,
        atol=goal,
        maxiter=cycles,
        M=LinearOperator(matrix.shape, counted, dtype=float),
        m=min(RESTART, math.ceil(most / cycles)),
        k=0,
    )
    state.x += step
    state.residual -= matrix @ step
    return None


# Krylov methods that keep a preconditioner over many matrices, as long as this saves time

MOST_ITERATIONS = 400  # iterations with a fresh preconditioner after which a solve counts as failed
PATIENCE = 60  # most iterations that one solve may take with a preconditioner made for an earlier matrix
# Iterations more than with a fresh preconditioner that may add up before it is made again: as many as making one costs,
# so that never more than twice the least is spent (docs/notes/performance.md).
WASTE = 15


class Preconditioner(Protocol):
    """An approximate inverse that can be older than the matrix it is applied for."""

    def update(self, system: System) -> None:
        """Make the preconditioner again; the matrix changes afterwards: parts that are kept have to be copied."""

    def release(self) -> None:
        """Give up the preconditioner, so that searches and tangents can use its memory before it is made again."""

    def apply(self, residual: Floats) -> Floats:
        """Return an approximate solution (size,) for a right-hand side (size,)."""


class Krylov:
    """A `LinearSolver`: conjugate gradients for symmetric matrices, minimal residuals for others.

    The preconditioner is kept for later matrices of an increment until the additional iterations that its age costs add
    up to `WASTE`, or contact acts on nodes that the preconditioner does not include. The decision depends on counts
    only, so that runs are reproducible, also when they continue from a restart file.
    """

    def __init__(
        self,
        preconditioner: Preconditioner,
        # solves where iterations do not: beyond a limit point a tangent is indefinite. Without it, as in large knits,
        # an indefinite matrix ends conjugate gradients with the step found so far, which lowers the energy: where a
        # predicted state presses yarns that will be pulled, that is enough
        direct: LU | None = None,
    ) -> None:
        self.preconditioner, self._direct = preconditioner, direct
        self.setup_seconds = 0.0
        self.setups = 0  # how often the preconditioner was made
        self._system: System | None = None
        self._known = NOWHERE
        self._fresh = False
        self._rate = 0.0  # decades an iteration of the fresh preconditioner
        self._waste = np.inf
        self._negative: int | None = None  # see `negative_eigenvalues`

    def forget(self) -> None:
        """Give up the matrix and the preconditioner, which the next solve makes again."""
        self._waste = np.inf
        self.release()

    def use(self, system: System) -> None:
        """Take a new matrix; the preconditioner stays."""
        self._system = system
        self._fresh = False
        if self._direct is not None:
            self._direct.use(system)

    def release(self) -> None:
        """Give up the matrix; the preconditioner stays unless it is due to be made again."""
        self._system = None
        if self._waste > WASTE:
            self.preconditioner.release()
        if self._direct is not None:
            self._direct.release()

    def solve(self, rhs: Floats, tolerance: float) -> Solution:
        """Solve to a true relative residual of `tolerance`.

        Raises ConvergenceError if that takes too many iterations, or a symmetric matrix is not positive definite and
        that is not allowed; with a direct solver, if that fails as well.
        """
        try:
            return self._solve(rhs, tolerance)
        except ConvergenceError as error:
            if self._direct is None:
                raise
            log.debug("LU solves what iterations do not: %s", error)
            solution = self._direct.solve(rhs, tolerance)
            self.setup_seconds += self._direct.setup_seconds
            self._negative = self._direct.negative_eigenvalues()
            return solution

    def negative_eigenvalues(self) -> int | None:
        """Return how many negative eigenvalues the last solve has met, or None if that is not known.

        Conjugate gradients are Lanczos's method (Golub and Van Loan 2013, section 10.2): they meet one at most, in the
        directions that they go. Minimal residuals do not tell.
        """
        return self._negative

    def _solve(self, rhs: Floats, tolerance: float) -> Solution:
        self.setup_seconds, self._negative = 0.0, None
        state = KrylovIterate(np.zeros_like(rhs), rhs.copy(), float(np.linalg.norm(rhs)))
        assert self._system is not None, "no matrix to solve with: it was released"
        if self._waste > WASTE or not np.isin(self._system.touching, self._known).all():
            self._renew(self._system)
        problem = self._iterate(self._system, state, tolerance)
        if problem is INDEFINITE and self._direct is None and state.x.any():
            return Solution(state.x, state.iterations)
        if problem and not self._fresh:
            self._renew(self._system)
            problem = self._iterate(self._system, state, tolerance)
        if problem:
            raise ConvergenceError(f"the linear solver failed: {problem}")
        if self._negative is None and self._system.unsymmetric is None:
            self._negative = 0
        return Solution(state.x, state.iterations)

    def _renew(self, system: System) -> None:
        started = time.perf_counter()
        self._waste = np.inf  # one that fails here leaves none that could stay
        self.preconditioner.update(system)
        self._known = system.touching
        self.setups += 1
        self._fresh, self._waste, self._rate = True, 0.0, 0.0
        self.setup_seconds += time.perf_counter() - started

    def _iterate(self, system: System, state: KrylovIterate, tolerance: float) -> str | None:
        """Improve an iterate in place; return what went wrong, if anything."""
        goal = tolerance * state.level
        rows = RowRanges.of(system.matrix)
        # iterations of a fresh preconditioner
        wanted = -np.log10(tolerance) / self._rate if self._rate > 0 else 0.0
        most = MOST_ITERATIONS if self._fresh else min(round(wanted) + WASTE, PATIENCE)
        start = float(np.linalg.norm(state.residual))
        before = state.iterations
        method = conjugate_gradients if system.unsymmetric is None else minimal_residuals
        problem = method(rows, self.preconditioner.apply, state, goal, most)
        if problem is INDEFINITE:
            self._negative = 1
        if problem:
            return problem
        used = state.iterations - before
        reached = float(np.linalg.norm(state.residual))
        if reached > goal:
            return f"{used} iterations reached a relative residual of {reached / state.level:.1e}, not {tolerance:.1e}"
        decades = np.log10(max(start, 1e-300) / max(reached, 1e-16 * start, 1e-300))
        self._rate = max(self._rate, decades / max(used, 1))
        if self._rate > 0:
            self._waste += used - decades / self._rate
        return None
