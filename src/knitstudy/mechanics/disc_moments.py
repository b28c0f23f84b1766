"""The moments by which discs on yarns are joined, and points that they are summed up at."""

from __future__ import annotations

import numpy as np


def polar_rule(rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (q, 2) and weights (q,) of the mean over the unit disc, on so many rings.

    Gauss points in the square of the radius and equal angles; exact for polynomials of degree 4 rings - 1.
    """
    square, weight = np.polynomial.legendre.leggauss(rings)
    count = 4 * rings
    angle = 2 * np.pi * (np.arange(count) + 0.5 * (np.arange(rings) % 2)[:, None]) / count
    radius = np.sqrt(0.5 * (square + 1))[:, None]
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    return points.reshape(-1, 2), np.repeat(weight / 2 / count, count)


def moments(rule: np.ndarray) -> np.ndarray:
    """Return the functions (3, q) whose means over the disc are joined: 1, and both coordinates at unit mean square."""
    return np.stack([np.ones(len(rule)), 2 * rule[:, 0], 2 * rule[:, 1]])
