"""Generalised minimal residuals, for matrices that friction has made unsymmetric."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.linear.rows import Rows
from knitstudy.mechanics.linear.solver import Apply, Iterate
from knitstudy.mechanics.scratch import SCRATCH

RESTART = 30
"""Iterations after which the search directions are dropped; bounds the memory."""


def minimal_residuals(matrix: Rows, apply: Apply, state: Iterate, goal: float, most: int) -> str | None:
    """Improve an iterate in place by flexible GMRES (Saad 1993); parameters as of `conjugate_gradients`."""
    start = np.linalg.norm(state.residual)
    left = most
    while left > 0 and start > goal:
        step, used = _cycle(matrix, apply, state.residual, goal, min(RESTART, left, len(state.x)))
        state.iterations += used
        left -= used
        state.x += step
        state.residual -= matrix @ step
        reached = np.linalg.norm(state.residual)
        if not reached < 0.999 * start:
            return f"minimal residuals stagnate at {reached / state.level:.1e}"
        start = reached
    return None


def _cycle(
    matrix: Rows, apply: Apply, residual: np.ndarray, goal: float, most: int
) -> tuple[np.ndarray, int]:
    """Return the step (size,) of one cycle of at most so many iterations, and how many it took."""
    level = np.linalg.norm(residual)
    basis = SCRATCH.array("directions", most + 1, len(residual))
    corrections = SCRATCH.array("corrections", most, len(residual))
    hessenberg, target = np.zeros((most + 1, most)), np.zeros(most + 1)
    basis[0], target[0] = residual / level, level
    used, weights = 0, np.empty(0)
    while used < most:
        corrections[used] = apply(basis[used])
        image = matrix @ corrections[used]
        before = basis[: used + 1]
        for _ in range(2):  # Gram-Schmidt twice is enough (Giraud et al. 2005)
            shares = before @ image
            image -= shares @ before
            hessenberg[: used + 1, used] += shares
        rest = np.linalg.norm(image)
        used += 1
        hessenberg[used, used - 1] = rest
        small = hessenberg[: used + 1, :used]
        weights = np.linalg.lstsq(small, target[: used + 1], rcond=None)[0]
        if np.linalg.norm(target[: used + 1] - small @ weights) <= goal or not rest > 0:
            break
        basis[used] = image / rest
    return weights @ corrections[:used], used
