"""Generalised minimal residuals, for matrices that friction has made unsymmetric."""

from __future__ import annotations

import warnings

import numpy as np
from pyamg.krylov import fgmres
from scipy.sparse.linalg import LinearOperator

from knitstudy.mechanics.linear.rows import Rows
from knitstudy.mechanics.linear.solver import Apply, Iterate

RESTART = 30
"""Iterations after which the search directions are dropped; bounds the memory."""


def minimal_residuals(matrix: Rows, apply: Apply, state: Iterate, goal: float, most: int) -> str | None:
    """Improve an iterate in place by preconditioned flexible GMRES; parameters as of `conjugate_gradients`."""
    operator = LinearOperator(matrix.shape, matvec=matrix.__matmul__, dtype=float)
    preconditioner = LinearOperator(matrix.shape, matvec=apply, dtype=float)
    start = np.linalg.norm(state.residual)
    left = most
    while left > 0 and start > goal:
        inner = min(RESTART, left, len(state.x))
        residuals: list[float] = []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            step, _ = fgmres(
                operator,
                state.residual,
                tol=goal / start,
                restart=inner,
                maxiter=1,
                M=preconditioner,
                residuals=residuals,
            )
        used = max(len(residuals) - 1, 1)
        state.iterations += used
        left -= used
        state.x += step
        state.residual -= matrix @ step
        reached = np.linalg.norm(state.residual)
        if not reached < 0.999 * start:
            return f"minimal residuals stagnate at {reached / state.level:.1e}"
        start = reached
    return None
