"""Rotation-minimising frames along a curve."""

from __future__ import annotations

from itertools import accumulate

import numpy as np


def rotation_minimising(position: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Frames that do not spin about the curve, by double reflection; the first d1 is nearest to z.

    Every frame is the one before it, mirrored first at the plane that halves the chord and then at the plane
    that brings the tangent into place: fourth order in the distance of the points (Wang, Juettler, Zheng and
    Liu 2008, "Computation of rotation minimizing frames", ACM Transactions on Graphics 27(1), algorithm 1).

    Parameters
    ----------
    position : ndarray (S, 3)
        Points along the curve, m.
    tangent : ndarray (S, 3)
        Unit tangents.

    Returns
    -------
    ndarray (S, 3, 3)
        Rows d1, d2 and the tangent, right-handed and orthonormal.
    """
    chord = np.diff(position, axis=0)
    first = _reflection(chord)
    mirrored = np.einsum("sij,sj->si", first, tangent[:-1])
    step = _reflection(tangent[1:] - mirrored) @ first  # (S - 1, 3, 3)
    d1 = np.array(list(accumulate(step, lambda d, turn: turn @ d, initial=_start(tangent[0]))))
    # Rounding accumulates along the yarn: keep d1 a unit normal.
    d1 -= np.einsum("si,si->s", d1, tangent)[:, None] * tangent
    d1 /= np.linalg.norm(d1, axis=1, keepdims=True)
    return np.stack([d1, np.cross(tangent, d1), tangent], axis=1)


def _reflection(normal: np.ndarray) -> np.ndarray:
    """Householder reflections (S, 3, 3) at the planes normal to ``normal`` (S, 3); the identity for 0."""
    square = np.einsum("si,si->s", normal, normal)
    factor = np.divide(2.0, square, out=np.zeros_like(square), where=square > 0)
    return np.eye(3) - factor[:, None, None] * normal[:, :, None] * normal[:, None, :]


def _start(tangent: np.ndarray) -> np.ndarray:
    """Unit normal to ``tangent`` nearest to z, or to y where the tangent is almost parallel to that."""
    axis = np.array([0.0, 0.0, 1.0])
    if np.linalg.norm(np.cross(tangent, axis)) < 0.1:
        axis = np.array([0.0, 1.0, 0.0])
    normal = axis - (axis @ tangent) * tangent
    return normal / np.linalg.norm(normal)
