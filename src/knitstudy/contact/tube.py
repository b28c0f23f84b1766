"""The yarn surface as a smooth tube of the true radius around its centreline."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree


class Curve(Protocol):
    """A centreline by arc length; see `knitstudy.geometry.spline.Centreline`."""

    length: float

    def position(self, s: np.ndarray) -> np.ndarray:
        """Points (k, 3) [m]."""

    def tangent(self, s: np.ndarray) -> np.ndarray:
        """Unit tangents (k, 3)."""


def project(curve: Curve, points: np.ndarray, guess: np.ndarray | None = None) -> np.ndarray:
    """Return the arc lengths (k,) [m] of the nearest points of a centreline.

    Parameters
    ----------
    curve : Curve
    points : ndarray, shape (k, 3)
        Points within a radius of curvature of the centreline [m].
    guess : ndarray, shape (k,), optional
        Arc lengths to start from; by default the nearest of dense samples.
    """
    if guess is None:
        samples = np.linspace(0, curve.length, 1 + max(200, round(curve.length / _mean_distance(curve, points))))
        guess = samples[cKDTree(curve.position(samples)).query(points)[1]]
    s = np.array(guess, dtype=float)
    step = 1e-4 * curve.length
    for _ in range(20):
        gap = points - curve.position(s)
        tangent = curve.tangent(s)
        bend = (curve.tangent(np.minimum(s + step, curve.length)) - curve.tangent(np.maximum(s - step, 0))) / (
            np.minimum(s + step, curve.length) - np.maximum(s - step, 0)
        )[:, None]
        slope = 1 - np.einsum("ki,ki->k", gap, bend)
        move = np.einsum("ki,ki->k", gap, tangent) / np.maximum(slope, 0.1)
        s = np.clip(s + move, 0, curve.length)
        if np.max(np.abs(move), initial=0.0) < 1e-12 * curve.length:
            break
    return s


def _mean_distance(curve: Curve, points: np.ndarray) -> float:
    """Sampling distance that cannot miss the nearest stretch: a tenth of the distance to the curve."""
    coarse = curve.position(np.linspace(0, curve.length, 200))
    return 0.1 * max(float(np.median(cKDTree(coarse).query(points)[0])), 1e-3 * curve.length)


def distance(curve: Curve, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return distance (k,) [m] of points (k, 3) to a centreline, and the arc lengths (k,) of its nearest points."""
    s = project(curve, points)
    return np.linalg.norm(points - curve.position(s), axis=1), s
