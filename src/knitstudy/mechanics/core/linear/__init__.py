"""The interface of all linear solvers, and direct ones: banded Cholesky and sparse LU factors."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from scipy.linalg import cython_lapack

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.pattern_sum import lacking

NOWHERE = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class System:
    """A matrix, with data for preconditioners."""

    matrix: sp.bsr_matrix | sp.csr_matrix  # (size, size)
    # (size, size), part of it without which it is symmetric and positive definite
    unsymmetric: sp.bsr_matrix | None = None
    touching: Ints = field(default_factory=lambda: NOWHERE)  # nodes that contact acts on
    # (n, 3), displacement of the nodes [m]: rigid motions are about where they are
    moved: np.ndarray | None = None

    def symmetric(self) -> AbstractContextManager[None]:
        """Return a context in which the matrix is without its unsymmetric part."""
        part = self.unsymmetric
        return nullcontext() if part is None or not part.nnz else lacking(self.matrix, part)


@dataclass(frozen=True)
class Solution:
    """Solution of a linear system and the Krylov iterations that it took (0 for a direct solver)."""

    x: Floats
    iterations: int


class LinearSolver(Protocol):
    """Solves systems whose matrix changes slowly."""

    setup_seconds: float  # time that the last call of `solve` spent on factors

    def forget(self) -> None:
        """Forget the state of earlier increments: a run that resumes from a file has no matrices of them."""

    def use(self, system: System) -> None:
        """Take over a new matrix; factors are made when they are needed."""

    def release(self) -> None:
        """Forget the matrix, so that its memory can serve for the next one."""

    def solve(self, rhs: Floats, tolerance: float) -> Solution:
        """Solve to a relative residual of `tolerance`; raises ConvergenceError if that is not reached."""

    def negative_eigenvalues(self) -> int | None:
        """Return how many negative eigenvalues the last solve has met, or None if that is not known.

        Of an unsymmetric matrix it is 1 where the number of real ones is odd, and its determinant negative; else 0.
        """


# Banded Cholesky factors by LAPACK, outside of the interpreter's lock
# SciPy's own wrappers of these routines keep the lock, so that threads wait for each other; the addresses that SciPy
# gives to Cython, called through `ctypes`, do not.


def factorise_band(
    band: np.ndarray,  # (bandwidth + 1, n), diagonal and lower diagonals in single or double precision
) -> int:
    """Replace a lower band by its Cholesky factor; return 0, or the order of the minor that is not positive."""
    rows, n = band.shape
    info = ctypes.c_int()
    _PBTRF[band.dtype](b"L", _int(n), _int(rows - 1), band.ctypes.data, _int(rows), ctypes.byref(info))
    return info.value


def solve_band(factor: np.ndarray, rhs: np.ndarray) -> None:
    """Replace a right-hand side (n,) by the solution for a factor that `factorise_band` has left, in its precision.

    Examples
    --------
    >>> band, rhs = np.array([[4.0, 4.0], [2.0, 0.0]], order="F"), np.array([6.0, 6.0])
    >>> factorise_band(band)
    0
    >>> solve_band(band, rhs)
    >>> rhs.round(12).tolist()  # [[4, 2], [2, 4]] [1, 1] = [6, 6]
    [1.0, 1.0]
    """
    rows, n = factor.shape
    info = ctypes.c_int()
    band, right = (factor.ctypes.data, _int(rows)), (rhs.ctypes.data, _int(n))
    _PBTRS[factor.dtype](b"L", _int(n), _int(rows - 1), _int(1), *band, *right, ctypes.byref(info))


def _int(value: int) -> Any:
    return ctypes.byref(ctypes.c_int(value))


def _routine(name: str, arguments: int) -> Callable[..., None]:
    capsule = cython_lapack.__pyx_capi__[name]
    name_of = ctypes.pythonapi.PyCapsule_GetName
    name_of.restype = ctypes.c_char_p
    name_of.argtypes = [ctypes.py_object]
    address_of = ctypes.pythonapi.PyCapsule_GetPointer
    address_of.restype = ctypes.c_void_p
    address_of.argtypes = [ctypes.py_object, ctypes.c_char_p]
    kind = ctypes.CFUNCTYPE(None, ctypes.c_char_p, *[ctypes.c_void_p] * (arguments - 1))
    return kind(address_of(capsule, name_of(capsule)))


_LETTERS = {np.dtype(np.float32): "s", np.dtype(np.float64): "d"}  # LAPACK's letter of a precision
_PBTRF = {dtype: _routine(f"{letter}pbtrf", 6) for dtype, letter in _LETTERS.items()}
_PBTRS = {dtype: _routine(f"{letter}pbtrs", 9) for dtype, letter in _LETTERS.items()}


# Sparse LU for matrices of symmetric structure

REFINEMENTS = 3  # most steps of iterative refinement

# Difference of a row of U and the column of D L over the largest entry, up to which factors count as symmetric: beams
# that are out of balance by 1e-6 make 1e-6, friction 1e-2 and more
SYMMETRIC = 1e-4


SHIFT = 1e-12  # of the mean stiffness, added to find what moves without any


class SingularStiffness(ConvergenceError):
    """A stiffness matrix without an inverse.

    Attributes
    ----------
    unknown : int
        The one that moves most where nothing resists.
    """

    def __init__(self, unknown: int) -> None:
        super().__init__(f"the stiffness matrix is singular: nothing resists a motion of unknown {unknown}")
        self.unknown = unknown

    @classmethod
    def of(cls, matrix: sp.bsr_matrix | sp.csr_matrix) -> SingularStiffness:
        """Return the error of a matrix (n, n), from its answer to random forces with a faint stiffness beside it.

        Examples
        --------
        >>> SingularStiffness.of(sp.csr_matrix(np.diag([1.0, 0.0, 2.0]))).unknown
        1
        """
        diagonal = matrix.diagonal()
        faint = SHIFT * max(float(np.abs(diagonal).mean()), np.finfo(float).tiny)
        force = np.random.default_rng(0).standard_normal(len(diagonal))
        moved = factorise(sp.csc_matrix(matrix) + faint * sp.identity(len(diagonal), format="csc")).solve(
            force
        )
        return cls(int(np.argmax(np.abs(moved))))


class LU:
    """Sparse LU of SciPy (SuperLU), with the options that suit symmetric stiffness matrices."""

    def __init__(self) -> None:
        self.setup_seconds = 0.0
        self._matrix: sp.bsr_matrix | sp.csr_matrix | None = None
        self._factors: spla.SuperLU | NodeFactors | None = None

    def use(self, system: System) -> None:
        """Take over a new matrix."""
        self._matrix = system.matrix
        self._factors = None

    def release(self) -> None:
        """Forget the matrix and its factors."""
        self._matrix = self._factors = None

    forget = release

    def solve(self, rhs: Floats, tolerance: float) -> Solution:
        """Solve directly; `tolerance` is met by far, or SingularStiffness is raised."""
        started = time.perf_counter()
        self.setup_seconds = 0.0
        matrix = self._matrix
        assert matrix is not None, "no matrix to solve with: it was released"
        if self._factors is None:
            try:
                self._factors = NodeFactors(matrix) if matrix.format == "bsr" else factorise(matrix)
            except ConvergenceError:
                raise SingularStiffness.of(matrix) from None
            self.setup_seconds = time.perf_counter() - started
        x = self._factors.solve(rhs)
        level = np.linalg.norm(rhs)
        for _ in range(REFINEMENTS):
            residual = rhs - matrix @ x
            # Without pivoting, factors of an unsymmetric matrix may need a step of refinement.
            if np.linalg.norm(residual) <= min(tolerance, 1e-10) * level:
                break
            x += self._factors.solve(residual)
        if not np.all(np.isfinite(x)):
            raise SingularStiffness.of(matrix)
        return Solution(x, 0)

    def negative_eigenvalues(self) -> int | None:
        """Return the number of negative eigenvalues; None without factors, or where rows were exchanged.

        Factors K = L D U with pivots on the diagonal have L = U^T where K is symmetric: D has K's inertia (Sylvester).
        Friction makes K unsymmetric, and two negative pivots may stand for a pair of complex eigenvalues: the sign of
        the determinant alone tells of a bifurcation.

        Examples
        --------
        >>> solver = LU()
        >>> solver.use(System(sp.csr_matrix([[1.0, 2.0], [2.0, 1.0]])))  # eigenvalues 3 and -1
        >>> solver.solve(np.ones(2), 1e-10).x.round(12).tolist(), solver.negative_eigenvalues()
        ([0.333333333333, 0.333333333333], 1)
        """
        if self._factors is None:
            return None
        factors = self._factors.factors if isinstance(self._factors, NodeFactors) else self._factors
        if not np.array_equal(factors.perm_r, factors.perm_c):
            return None
        U = factors.U
        pivots = U.diagonal()
        (negative,) = np.nonzero(pivots < 0)
        if len(negative) < 2:
            return len(negative)
        rows = U[negative]
        columns = factors.L[:, negative].multiply(pivots[negative]).T
        asymmetry = abs(rows - columns).max(axis=1).toarray() / abs(rows).max(axis=1).toarray()
        return len(negative) if np.all(asymmetry < SYMMETRIC) else len(negative) % 2


class NodeFactors:
    """SuperLU factors of a structurally symmetric matrix of blocks, whose nodes have an order of least degree.

    The graph of the nodes has a block's share of the entries. Its order costs next to nothing, and that of all unknowns
    a fifth of their factors; the fill is the same. Rows of the matrix are columns of its transpose, whose factors serve
    as well.
    """

    def __init__(self, matrix: sp.bsr_matrix) -> None:
        size = matrix.blocksize[0]
        nodes = len(matrix.indptr) - 1
        row = np.repeat(np.arange(nodes), np.diff(matrix.indptr))
        # SciPy gives an order along with factors only: those of a matrix that surely has some.
        graph = np.where(row == matrix.indices, float(nodes), -1.0)
        pattern = matrix.indices, matrix.indptr
        order = np.argsort(factorise(sp.csc_matrix((graph, *pattern), shape=(nodes, nodes))).perm_c)
        blocks = sp.csr_matrix((np.arange(len(row)), *pattern), shape=(nodes, nodes))[order][:, order]
        blocks.sort_indices()
        ordered = matrix.data[blocks.data], blocks.indices, blocks.indptr
        rows = sp.bsr_matrix(ordered, shape=matrix.shape).tocsr()
        transposed = sp.csc_matrix((rows.data, rows.indices, rows.indptr), shape=rows.shape)
        self.factors = factorise(transposed, "NATURAL")
        self.order = (size * order[:, None] + np.arange(size)).ravel()  # of the unknowns

    def solve(self, rhs: Floats) -> Floats:
        """Return the solution (n,) for a right-hand side (n,).

        Examples
        --------
        >>> matrix = np.array([[2.0, 1.0], [0.0, 4.0]])
        >>> NodeFactors(sp.bsr_matrix(matrix, blocksize=(1, 1))).solve(np.array([5.0, 4.0])).tolist()
        [2.0, 1.0]
        """
        x = np.empty_like(rhs)
        x[self.order] = self.factors.solve(rhs[self.order], trans="T")
        return x


def factorise(matrix: sp.spmatrix, order: str = "MMD_AT_PLUS_A") -> spla.SuperLU:
    """Return SuperLU factors of a structurally symmetric matrix, whose unknowns are eliminated in an order of SciPy's.

    Raises ConvergenceError if the matrix is singular.

    Examples
    --------
    >>> factorise(sp.csr_matrix(2 * np.eye(2))).solve(np.ones(2)).tolist()
    [0.5, 0.5]
    """
    try:
        return spla.splu(
            sp.csc_matrix(matrix),
            permc_spec=order,
            diag_pivot_thresh=0.0,
            relax=1,  # fronts of yarns that touch at few points are narrow: three quarters of the time
            panel_size=2,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise ConvergenceError(f"the stiffness matrix cannot be factorised ({error})") from None
