"""Flexible conjugate gradients, for symmetric positive definite matrices."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.linear.rows import Rows
from knitstudy.mechanics.linear.solver import Apply, Iterate

INDEFINITE = "the stiffness matrix is not positive definite (a buckling or a mechanism)"


def conjugate_gradients(matrix: Rows, apply: Apply, state: Iterate, goal: float, most: int) -> str | None:
    """Improve an iterate in place by preconditioned conjugate gradients (Notay 2000).

    Parameters
    ----------
    matrix : Rows, shape (size, size)
        Symmetric positive definite.
    apply : callable
        The preconditioner.
    state : Iterate
    goal : float
        Norm of the residual to reach.
    most : int
        Iterations to try.

    Returns
    -------
    str or None
        What went wrong; `INDEFINITE` if a direction has no stiffness. What was found before then lowers the energy
        all the same (Steihaug 1983).
    """
    direction = image = None
    curvature = 0.0
    for _ in range(most):
        if np.linalg.norm(state.residual) <= goal:
            return None
        state.iterations += 1
        correction = apply(state.residual)
        if direction is None:
            direction = correction
        else:
            # Orthogonal to the last direction itself, not by a formula that presumes a constant preconditioner.
            direction = correction - (correction @ image) / curvature * direction
        image = matrix @ direction
        curvature = direction @ image
        if not curvature > 0:
            return INDEFINITE
        length = (direction @ state.residual) / curvature
        state.x += length * direction
        state.residual -= length * image
    return None
