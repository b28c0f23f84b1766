"""Catmull-Rom curves, and the arc-length curve of one yarn.

A Catmull-Rom curve runs through its control points P_k; between P_k and P_k+1 it is a cubic Bezier curve
whose inner control points are P_k + (P_k+1 - P_k-1)/6 and P_k+1 - (P_k+2 - P_k)/6, so that neighbours join
with C1 continuity (Catmull and Rom 1974). It is linear in its control points, which is what makes exact
gradients cheap.
"""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from knitstudy.errors import GeometryError
from knitstudy.mechanics.core.arrays import Floats, Ints

STENCIL = np.arange(-1, 3)  # control points that a Bezier segment k depends on, relative to k
# Weight of each stencil point as a polynomial of the segment's t: powers 0 to 3 along the columns.
BASIS = 0.5 * np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1]])
# Gauss rule on [0, 1]: the length of a segment to about 1e-10 of it.
GAUSS_POINTS, GAUSS_WEIGHTS = 0.5 * np.array(np.polynomial.legendre.leggauss(16)) + [[0.5], [0.0]]


class CatmullRom:
    """C1 piecewise cubic curve through control points, periodic up to an advance.

    It passes its control points (P, 3) [m] at the parameters u = 0, 1, ..., P - 1, and moves by the advance (3,) [m]
    when u grows by P: C(u + P) = C(u) + advance.
    Raises GeometryError with fewer than four control points, or points that are not finite or not of shape (P, 3).

    Examples
    --------
    >>> line = CatmullRom([[k, 0, 0] for k in range(4)], [4, 0, 0])
    >>> line.value(np.array([1.5])).tolist(), line.segment_lengths().round(12).tolist()
    ([[1.5, 0.0, 0.0]], [1.0, 1.0, 1.0, 1.0])
    """

    def __init__(self, control_points: ArrayLike, advance: ArrayLike) -> None:
        self.control_points = np.array(control_points, dtype=float)
        self.advance = np.array(advance, dtype=float)
        shape = self.control_points.shape
        if len(shape) != 2 or shape[1] != 3 or shape[0] < 4 or self.advance.shape != (3,):
            raise GeometryError(
                f"control points of shape {shape}, advance of shape {self.advance.shape}: "
                "a curve needs at least 4 points of 3 coordinates and an advance of 3"
            )
        if not (np.isfinite(self.control_points).all() and np.isfinite(self.advance).all()):
            raise GeometryError("control points or advance are not finite: all coordinates must be numbers")

    @property
    def period(self) -> int:
        """Number of Bezier segments, and of control points, in one period."""
        return len(self.control_points)

    def value(self, u: Floats) -> Floats:
        """Return the points (k, 3) [m] at parameters u (k,)."""
        return self._evaluate(u, 0)

    def d1(self, u: Floats) -> Floats:
        """Return the first derivative (k, 3) [m] with respect to u (k,)."""
        return self._evaluate(u, 1)

    def d2(self, u: Floats) -> Floats:
        """Return the second derivative (k, 3) [m] with respect to u (k,), discontinuous at integers."""
        return self._evaluate(u, 2)

    def _evaluate(self, u: Floats, order: int) -> Floats:
        index, weights = stencil(u, order)
        return (weights[..., None] * self.points(index)).sum(axis=-2)

    def jet(self, u: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the points and the first two derivatives with respect to u (k,), (k, 3) each [m]."""
        segment = np.floor(u)
        t = (u - segment)[:, None]
        zero, one, two, three = np.moveaxis(
            BASIS.T @ self.points(segment[:, None].astype(int) + STENCIL), 1, 0
        )
        return (
            zero + t * (one + t * (two + t * three)),
            one + t * (2 * two + 3 * t * three),
            2 * two + 6 * t * three,
        )

    def points(self, index: Ints) -> Floats:
        """Return the control points (..., 3) [m] of integer indices (...), beyond one period as well."""
        turns, k = self._numbers(index)
        return self.control_points[k] + turns[..., None] * self.advance

    def _numbers(self, index: Ints) -> tuple[Ints, Ints]:
        """Return the number of periods passed (...), and the number of the control point (...)."""
        return np.divmod(index, self.period)

    def operator(self, u: Floats, order: int = 0) -> tuple[Floats, Floats]:
        """Return a derivative (order 0 to 2) at u (k,) as a linear map of control points: matrix (k, P), offset (k, 3).

        ``matrix @ control_points + offset`` is the derivative; the offset stems from the advance.
        """
        index, weights = stencil(u, order)
        turns, k = self._numbers(index)
        matrix = np.zeros((len(index), len(self.control_points)))
        np.add.at(matrix, (np.arange(len(index))[:, None], k), weights)
        return matrix, (weights * turns).sum(axis=1)[:, None] * self.advance

    def segment_lengths(self) -> Floats:
        """Return the arc lengths (P,) [m] of the Bezier segments of one period."""
        u = np.arange(self.period)[:, None] + GAUSS_POINTS
        return np.linalg.norm(self.d1(u), axis=-1) @ GAUSS_WEIGHTS

    def curvature(self, u: Floats) -> Floats:
        """Return the curvature |C' x C''| / |C'|^3 (k,) [1/m] at u (k,)."""
        d1 = self.d1(u)
        return np.linalg.norm(np.cross(d1, self.d2(u)), axis=-1) / np.linalg.norm(d1, axis=-1) ** 3

    def square_speed(self) -> Floats:
        """Return |C'|^2 (P, 5) [m2] of the Bezier segments of one period, by powers 0 to 4 of t."""
        points = self.points(np.arange(self.period)[:, None] + STENCIL)
        one, two, three = np.arange(1, 4)[:, None, None] * np.moveaxis(BASIS.T[1:] @ points, 1, 0)
        powers = (one * one, 2 * one * two, 2 * one * three + two * two, 2 * two * three, three * three)
        return np.stack(powers, axis=1).sum(axis=-1)


class RowCurves(CatmullRom):
    """Curves of one period and one advance, evaluated together: every place lies on a curve of its own."""

    def __init__(
        self,
        control_points: ArrayLike,  # (r P, 3), of the r curves, one after the other [m]
        advance: ArrayLike,  # (3,), of each [m]
        rows: int,  # r
        row: Ints,  # (k,), the curve that each of the parameters u (k,) belongs to
    ) -> None:
        super().__init__(control_points, advance)
        self._period = len(self.control_points) // rows
        self._first = self._period * np.asarray(row, dtype=int)[:, None]

    @property
    def period(self) -> int:
        """Number of control points of one curve in one period."""
        return self._period

    def _numbers(self, index: Ints) -> tuple[Ints, Ints]:
        turns, k = np.divmod(index, self._period)
        return turns, k + self._first


def stencil(u: ArrayLike, order: int) -> tuple[Ints, Floats]:
    """Return indices and weights (..., 4) of the control points behind a derivative (order 0 to 2) at u (...).

    Examples
    --------
    >>> stencil(np.array([0.5]), order=0)[1].tolist()  # halfway between two control points
    [[-0.0625, 0.5625, 0.5625, -0.0625]]
    """
    u = np.asarray(u, dtype=float)
    segment = np.floor(u)
    t = u - segment
    one, zero = np.ones_like(t), np.zeros_like(t)
    powers = (
        (one, t, t * t, t * t * t),
        (zero, one, 2 * t, 3 * t * t),
        (zero, zero, 2 * one, 6 * t),
    )[order]
    return segment[..., None].astype(int) + STENCIL, np.stack(powers, axis=-1) @ BASIS.T


class Centreline:
    """Centreline of one yarn as a curve of its arc length, from its left end to its right one."""

    def __init__(
        self,
        curve: CatmullRom,  # the yarn begins at its control point 0
        loops: int,  # number of periods that the yarn is long
        like: Centreline | None = None,  # one that this one is an image of: its arc lengths serve for both
    ) -> None:
        self.curve, self.loops = curve, loops
        self._lengths: _Lengths = _Lengths(curve, loops) if like is None else like._lengths
        self.start = 0.0  # of a part of another yarn, where it begins along that [m]
        self.length = float(self._lengths.knots[-1])  # [m]

    def part(self, start: float, end: float) -> Centreline:
        """Return the yarn between two arc lengths [m] of this yarn, with arc lengths of its own."""
        part = copy(self)
        part.start = self.start + start
        part.length = end - start
        return part

    @property
    def span(self) -> tuple[float, float]:
        """Parameters of the curve at both ends."""
        low, high = self.parameter(np.array([0.0, self.length]))
        return float(low), float(high)

    def position(self, s: Floats) -> Floats:
        """Return the points (k, 3) [m] at arc lengths s (k,) [m]."""
        return self.curve.value(self.parameter(s))

    def tangent(self, s: Floats) -> Floats:
        """Return the unit tangents (k, 3) at arc lengths s (k,) [m]."""
        d1 = self.curve.d1(self.parameter(s))
        return d1 / np.linalg.norm(d1, axis=-1, keepdims=True)

    def curvature(self, s: Floats) -> Floats:
        """Return the curvature (k,) [1/m] at arc lengths s (k,) [m]."""
        return self.curve.curvature(self.parameter(s))

    def arc_length(self, u: ArrayLike) -> Floats:
        """Return the arc lengths (k,) [m] from the left end to parameters u (k,) of the curve."""
        return self._lengths.to(np.asarray(u, dtype=float)) - self.start

    def parameter(self, s: ArrayLike) -> Floats:
        """Return the parameters (k,) of the curve at arc lengths s (k,) [m].

        Raises GeometryError when an arc length lies outside the yarn.
        """
        return self._lengths.parameter(self.start + np.asarray(s, dtype=float))


class _Lengths:
    """Arc length of a curve from its start, as a function of the parameter and the other way round."""

    def __init__(self, curve: CatmullRom, loops: int) -> None:
        self._speed = curve.square_speed()
        self.knots = np.concatenate([[0.0], np.cumsum(np.tile(curve.segment_lengths(), loops))])
        self._last = (np.empty(0), np.empty(0))

    def to(self, u: Floats) -> Floats:
        segment = np.clip(np.floor(u), 0, len(self.knots) - 2).astype(int)
        return self.knots[segment] + self._partial(self._speed[segment % len(self._speed)], u - segment)

    def parameter(self, s: Floats) -> Floats:
        """Newton's method on the length of the part of a segment, in a bracket that is halved where Newton leaves it.

        Places, tangents and the images of a yarn ask for the same arc lengths one after the other: the last are kept.
        """
        length = self.knots[-1]
        slack = 1e-9 * length
        if s.size and not (s.min() >= -slack and s.max() <= length + slack):
            raise GeometryError(f"arc length {s.min()} .. {s.max()} m: allowed is 0 .. {length} m")
        if np.array_equal(s, self._last[0]):
            return self._last[1].copy()
        segment = np.clip(np.searchsorted(self.knots, s, side="right") - 1, 0, len(self.knots) - 2)
        rest = s - self.knots[segment]
        speed = self._speed[segment % len(self._speed)]
        t = np.clip(rest / np.diff(self.knots)[segment], 0, 1)
        low, high = np.zeros_like(t), np.ones_like(t)
        for _ in range(60):
            error = self._partial(speed, t) - rest
            if np.abs(error).max(initial=0.0) <= 1e-14 * length:
                break
            low = np.where(error < 0, t, low)
            high = np.where(error > 0, t, high)
            newton = t - error / np.sqrt(polyval(t, np.moveaxis(speed, -1, 0), tensor=False))
            t = np.where((newton < low) | (newton > high), 0.5 * (low + high), newton)
        self._last = s.copy(), segment + t
        return segment + t

    @staticmethod
    def _partial(speed: Floats, t: Floats) -> Floats:
        """Return the arc lengths (k,) [m] of segments (k, 5) from their start to t (k,)."""
        square = polyval(t[..., None] * GAUSS_POINTS, np.moveaxis(speed[..., None, :], -1, 0), tensor=False)
        return t * (np.sqrt(square) @ GAUSS_WEIGHTS)


def evenly(stops: Floats, counts: Ints) -> Floats:
    """Return places from the first to the last of the stops (m + 1,), in counts (m,) of even steps between them.

    Examples
    --------
    >>> evenly(np.array([0.0, 1.0, 2.0]), np.array([1, 2])).tolist()
    [0.0, 1.0, 1.5, 2.0]
    """
    return np.interp(np.arange(counts.sum() + 1), np.append(0, np.cumsum(counts)), stops)
