"""The yarn surface as a smooth tube of the true radius around its centreline."""

from __future__ import annotations

import numpy as np

from knitstudy.geometry.spline import Centreline


def project(centreline: Centreline, points: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """Return the spline parameters (k,) of the nearest points of a centreline.

    Newton's method on (x - r(u)) . r'(u) = 0; where the curve bends away so strongly that its slope loses its
    sign, the step of a straight line is taken.

    Parameters
    ----------
    centreline : Centreline
    points : ndarray, shape (k, 3)
        Points within a radius of curvature of the centreline [m].
    guess : ndarray, shape (k,)
        Spline parameters near the nearest points.
    """
    curve = centreline.curve
    u = np.array(guess, dtype=float)
    for _ in range(30):
        gap, along = points - curve.value(u), curve.d1(u)
        square = np.einsum("ki,ki->k", along, along)
        slope = square - np.einsum("ki,ki->k", gap, curve.d2(u))
        move = np.einsum("ki,ki->k", gap, along) / np.maximum(slope, 0.1 * square)
        u = u + move
        if np.max(np.abs(move), initial=0.0) < 1e-12 * curve.period:
            break
    return u


def distance(centreline: Centreline, points: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """Return the distances (k,) [m] of points (k, 3) to a centreline; `guess` as in `project`."""
    u = project(centreline, points, guess)
    return np.linalg.norm(points - centreline.curve.value(u), axis=1)
