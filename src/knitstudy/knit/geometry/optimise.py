"""Cost function of the yarn geometry, Eqs. (1) to (6) of the paper, with exact gradients.

Lengths are in yarn radii R, so that the terms carry no unit. A term is a function from the control points of the
loops to its value and gradient. Where the paper leaves a choice:

- F is summed over the loops of a repeat: one of a plain knit, r rows of k loops of others.
- F_Distance (Eq. 2) has one term for every crossing of the cell, aims at D = 2 + c0 and takes the true minimum D.
- L_l^0 (Eq. 6) is the arc length of Bezier curve l at the start. The printed one is its chord, which would shrink the
  yarn however well it fits.
- theta (Eq. 5) is the angle between the chords of the control polygon, pi where it is straight: the angle between
  tangents would be pi everywhere on a C1 curve. tau and rho follow from K_join being C1 at theta = pi/4.
- sigma (Eq. 5) is the mean of the two chords at the start, constant as the rest length of Breen et al. (1994) is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.crossings import Approach, crossings_of_loop, windows_of_loop
from knitstudy.knit.geometry.loop import Loop
from knitstudy.knit.geometry.spline import GAUSS_POINTS, GAUSS_WEIGHTS, RowCurves
from knitstudy.knit.geometry.symmetry import symmetric_motions, symmetries
from knitstudy.mechanics.core.arrays import Floats, Ints

# Two-point Gauss rule: exact for the square of C'', which is linear on a segment.
CURVATURE_POINTS = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3)


class CostFunction:
    """F of Eq. (1) for the loops of a repeat of a periodic knit, in units of the radius.

    The loop at the start, in radii, gives the rest lengths, sigma, and the windows in which crossings are looked for;
    for the weights and samples see `optimise`.
    """

    def __init__(self, loop: Loop, settings: Any) -> None:
        self.loop = loop
        self.target = loop.target
        self.settings = settings
        self.row, self.place, self.windows = windows_of_loop(loop)
        rows, segment = np.divmod(np.arange(len(loop.control_points)), loop.curve.period)
        self.rest_length = np.concatenate([curve.segment_lengths() for curve in loop.curves])
        self._tangent, self._tangent_offset = self._operator(rows, segment[:, None] + GAUSS_POINTS, 1)
        self._bend, self._bend_offset = self._operator(rows, segment[:, None] + CURVATURE_POINTS, 2)
        chord = np.linalg.norm(self._chords(loop.control_points), axis=1)
        self.sigma = 0.5 * (chord + self._roll(chord, 1))

    def curves(self, points: Floats, row: Ints) -> RowCurves:
        """Return curves through control points (P, 3); place k lies on row `row[k]`."""
        return RowCurves(points, self.loop.advance, self.loop.rows, row % self.loop.rows)

    def _operator(self, row: Ints, u: Floats, order: int) -> tuple[Floats, Floats]:
        """Return a derivative at u (k, m) on rows (k,) as a linear map of the control points."""
        row = np.repeat(row, u.shape[1])
        return self.curves(self.loop.control_points, row).operator(u.ravel(), order)

    def _roll(self, values: Floats, by: int) -> Floats:
        """Return the values (P, ...) of the control points `by` places before on the same row."""
        return np.roll(values.reshape(self.loop.rows, -1, *values.shape[1:]), by, axis=1).reshape(
            values.shape
        )

    def _chords(self, points: Floats) -> Floats:
        """Return the edges P_k+1 - P_k (P, 3) of the control polygons."""
        following = self._roll(points, -1)
        following[self.loop.curve.period - 1 :: self.loop.curve.period] += self.loop.advance
        return following - points

    def value(self, points: Floats, share: float = 1.0) -> tuple[float, Floats]:
        """Return F with a share of alpha, which may be 0, and its gradient (P, 3), at points (P, 3) in radii."""
        w = self.settings
        alpha = share * w.alpha
        distance, d_distance = self.distance(points) if share else (0.0, 0.0)
        continuous, d_continuous = self.continuous(points)
        join, d_join = self.join(points)
        length, d_length = self.length(points)
        value = alpha * distance + w.beta * (continuous + w.beta_0 * join) + w.gamma * length  # Eqs. (1), (3)
        gradient = alpha * d_distance + w.beta * (d_continuous + w.beta_0 * d_join) + w.gamma * d_length
        return value, gradient

    def terms(self, points: Floats) -> dict[str, float]:
        """Return the terms of F without their weights, and F, at points (P, 3)."""
        continuous, join = self.continuous(points)[0], self.join(points)[0]
        return {
            "distance": self.distance(points)[0],
            "continuous": continuous,
            "join": join,
            "bending": continuous + self.settings.beta_0 * join,
            "length": self.length(points)[0],
            "total": self.value(points)[0],
        }

    def approach(self, points: Floats) -> Approach:
        """Return the closest approach of the yarns at the crossings, by row, column and zone, at points (P, 3)."""
        loop = replace(self.loop, control_points=points)
        return crossings_of_loop(loop, self.row, self.windows, self.settings.samples)

    def distance(self, points: Floats) -> tuple[float, Floats]:
        """Return F_Distance, Eq. (2), summed over the crossings, and its gradient (P, 3)."""
        near = self.approach(points)
        error = near.distance - self.target
        return float(error @ error), np.einsum("k,kpi->pi", 2 * error, self.distance_slope(points, near))

    def distance_slope(self, points: Floats, near: Approach, row: Ints | None = None) -> Floats:
        """Return the gradients (K, P, 3) of the shortest distances (K,) at points (P, 3).

        To first order only the motion of the curves at fixed parameters changes the shortest distance. Closest points
        lie on rows (K, 2) where these are given, else at the crossings.
        """
        row = np.column_stack([self.row, self.row + 1]) if row is None else row
        normal = (near.point[:, 1] - near.point[:, 0]) / near.distance[:, None]
        on_lower, on_upper = (
            self.curves(points, row[:, side]).operator(near.parameter[:, side])[0] for side in (0, 1)
        )
        return (on_upper - on_lower)[:, :, None] * normal[:, None]

    def continuous(self, points: Floats) -> tuple[float, Floats]:
        """Return F_cont, Eq. (4), with t the parameter of a Bezier segment, and its gradient (P, 3)."""
        second = self._bend @ points + self._bend_offset
        share = 1 / len(CURVATURE_POINTS)
        return share * (second**2).sum(), 2 * share * self._bend.T @ second

    def join(self, points: Floats) -> tuple[float, Floats]:
        """Return the sum of K_join^2, Eq. (5), over the control points, and its gradient (P, 3)."""
        chord = self._chords(points)
        size = np.linalg.norm(chord, axis=1, keepdims=True)
        after = chord / size
        before = self._roll(after, 1)
        square, slope = squared_join_curvature((before * after).sum(axis=1), self.sigma)
        d_unit = slope[:, None] * before + self._roll(slope, -1)[:, None] * self._roll(after, -1)
        d_chord = (d_unit - after * (d_unit * after).sum(axis=1, keepdims=True)) / size
        return square.sum(), self._roll(d_chord, 1) - d_chord

    def length(self, points: Floats) -> tuple[float, Floats]:
        """Return F_Length, Eq. (6), with arc lengths, and its gradient (P, 3)."""
        tangent, speed = self._velocity(points)
        error = self.rest_length - speed @ GAUSS_WEIGHTS
        slope = -2 * error[:, None, None] * GAUSS_WEIGHTS[:, None] * tangent / speed[..., None]
        return error @ error, self._tangent.T @ slope.reshape(-1, 3)

    def arc_length(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the length of yarn in every row (r,), and the gradients (r, P, 3), at points (P, 3)."""
        tangent, speed = self._velocity(points)
        slope = (GAUSS_WEIGHTS[:, None] * tangent / speed[..., None]).reshape(-1, 3)
        rows = np.arange(len(slope)) // (len(slope) // self.loop.rows)
        by_row = np.stack(
            [self._tangent.T @ (slope * (rows == row)[:, None]) for row in range(self.loop.rows)]
        )
        return (speed @ GAUSS_WEIGHTS).reshape(self.loop.rows, -1).sum(axis=1), by_row

    def _velocity(self, points: Floats) -> tuple[Floats, Floats]:
        """Return C' (P, g, 3) at the Gauss points of all segments, and its norm (P, g)."""
        tangent = (self._tangent @ points + self._tangent_offset).reshape(len(points), -1, 3)
        return tangent, np.linalg.norm(tangent, axis=-1)


def squared_join_curvature(cosine: Floats, sigma: Floats) -> tuple[Floats, Floats]:
    """Return K_join^2 (P,) of Eq. (5), and its derivative (P,) with respect to the cosine.

    The cosine (P,) is that of the angle by which the control polygon turns, -cos(theta); sigma (P,) is the local
    spacing of the control points.

    Examples
    --------
    >>> float(squared_join_curvature(np.array([1.0]), np.array([1.0]))[0][0])  # of a straight line
    0.0
    """
    # theta > pi/4: (2/sigma)^2 cos^2(theta/2) = (2/sigma^2)(1 + cos(theta)), smooth where it is straight too.
    square = 2 * (1 - cosine) / sigma**2
    derivative = -2 / sigma**2
    sharp = cosine < -np.cos(np.pi / 4)
    if sharp.any():
        s = sigma[sharp]
        theta = np.arccos(np.clip(-cosine[sharp], -1, 1 - 1e-12))  # a folded polygon costs much, not infinity
        tau = 2 / s * np.cos(np.pi / 8)
        rho = -np.sin(np.pi / 8) / s
        k_join = -((np.pi / 4) ** 2) * rho / theta + tau + np.pi / 4 * rho
        square[sharp] = k_join**2
        derivative[sharp] = 2 * k_join * (np.pi / 4) ** 2 * rho / theta**2 / np.sin(theta)
    return square, derivative


# ---- Minimisation. It is unconstrained: the periodic cell and the symmetries of the loop are kept by parametrisation.


CONTACT_TOLERANCE = 1e-3  # |D - 2R - c0| / R that every crossing must meet
SMALLEST_DISTANCE = 1e-6  # of centrelines, in radii, from which on the direction between them is known

CONTINUATION = (1e-4, 1e-2, 1.0)  # shares of alpha in turn: a stiff valley is entered from its wide end
# A loop that the yarn fits into needs 10 to 30 iterations a share; more would only delay the error.
QUASI_NEWTON = {"gtol": 1e-6, "maxiter": 60}
NEWTON_STEPS = 12
GRADIENT_TOLERANCE = 1e-6  # largest gradient component at a minimum, over the bending terms' at the start
DIFFERENCE = 1e-5  # step, in radii, of the central differences of the gradient that make the Hessian


@dataclass(frozen=True)
class Optimum:
    """Outcome of an optimisation, in units of the radius."""

    points: Floats  # (P, 3)
    before: dict[str, float]  # the terms of F without their weights, and F, at the start
    after: dict[str, float]  # and at the end
    iterations: int  # of the quasi-Newton method
    gradient: float  # largest component that remains, over the largest of the bending terms' at the start


def optimise(loop: Loop, settings: Any) -> tuple[Loop, Optimum]:
    """Return the loop whose free components minimise F, and the outcome of the minimisation.

    Arc lengths of the initial loop are the rest lengths. `settings` are the section ``geometry`` of a scene: the
    weights alpha, beta, gamma and beta_0 of Eqs. (1) and (3); `free`, the components ("", "z", "yz", "xyz", ...) of
    each of the P control points that may move; `samples` a Bezier segment in the search of closest points.
    Raises GeometryError when the minimisation does not converge, or a crossing misses its distance by more than
    `CONTACT_TOLERANCE` there.
    """
    start = loop.in_radii()
    cost = CostFunction(start, settings)
    check_interlock(cost, start.control_points)
    free = np.array([[axis in names for axis in "xyz"] for names in settings.free])  # (P, 3)
    motions = symmetric_motions(free, symmetries(start))
    optimum = minimise(cost, start.control_points, motions)
    check_contact(cost, optimum.points)
    check_interlock(cost, optimum.points)
    return replace(loop, control_points=optimum.points * loop.radius), optimum


def minimise(cost: CostFunction, points: Floats, motions: Floats) -> Optimum:
    """Minimise F from points (P, 3) over motions (P, 3, n): quasi-Newton (BFGS), then Newton until rounding.

    Raises GeometryError when the gradient does not vanish.
    """
    before = cost.terms(points)
    # F is divided by a slope of the bending terms, so that tolerances do not depend on a factor of the weights.
    w = cost.settings
    slopes = (w.beta * cost.continuous(points)[1], w.beta * w.beta_0 * cost.join(points)[1])
    unit = max(np.abs(slope).max() for slope in slopes) or w.alpha
    q = np.zeros(motions.shape[-1])
    iterations = 0

    def function(q: Floats, share: float = 1.0) -> tuple[float, Floats]:
        value, gradient = cost.value(points + motions @ q, share)
        return value / unit, np.einsum("kai,ka->i", motions, gradient) / unit

    for share in CONTINUATION:
        result = minimize(function, q, args=(share,), jac=True, method="BFGS", options=QUASI_NEWTON)
        q = result.x
        iterations = iterations + result.nit
    q, gradient = _polish(function, q)
    if gradient > GRADIENT_TOLERANCE:
        raise GeometryError(
            f"the optimisation of the loop stopped with a gradient of {gradient:.2e} times the bending "
            f"terms', allowed is {GRADIENT_TOLERANCE:g}: take a smaller yarn.diameter, free more in "
            "geometry.free, or change the weights in geometry"
        )
    final = points + motions @ q
    return Optimum(final, before, cost.terms(final), iterations, gradient)


def _polish(function: Callable[[Floats], tuple[float, Floats]], q: Floats) -> tuple[Floats, float]:
    """Take Newton steps with a Hessian by central differences of the exact gradient, while the gradient falls."""
    gradient = function(q)[1]
    steps = DIFFERENCE * np.eye(len(q))
    for _ in range(NEWTON_STEPS):
        hessian = np.array([function(q + e)[1] - function(q - e)[1] for e in steps]) / (2 * DIFFERENCE)
        # Least squares: some motions do not change F, such as a shift of the whole knit along z.
        trial = q - np.linalg.lstsq(0.5 * (hessian + hessian.T), gradient, rcond=1e-12)[0]
        better = function(trial)[1]
        if np.abs(better).max() >= np.abs(gradient).max():
            break
        q, gradient = trial, better
    return q, float(np.abs(gradient).max())


def check_contact(cost: CostFunction, points: Floats) -> None:
    """Refuse control points with which a crossing is not at its distance; raises GeometryError."""
    near = cost.approach(points)
    error = np.abs(near.distance - cost.target)
    zone = int(error.argmax())
    if error[zone] > CONTACT_TOLERANCE or not near.interior.all():
        raise GeometryError(
            f"after the optimisation the yarns are {near.distance[zone]:.5f} radii apart in crossing "
            f"zone {zone}, allowed is {cost.target:g} within {CONTACT_TOLERANCE:g} (closest points inside "
            f"their windows: {near.interior.tolist()}): take a smaller yarn.diameter, raise geometry.alpha "
            "or free more in geometry.free"
        )


def interlocked(cost: CostFunction) -> bool:
    """Return whether the yarns of a cost function's loops pass in front of each other as their stitches require."""
    lower, upper = (
        cost.curves(cost.loop.control_points, cost.row + side).value(cost.place[:, side])[:, 2]
        for side in (0, 1)
    )
    return np.array_equal(upper > lower, cost.loop.upper_in_front.ravel())


def check_interlock(cost: CostFunction, points: Floats) -> None:
    """Refuse yarns that cut each other, or do not pass each other as their stitches require; raises GeometryError."""
    near = cost.approach(points)
    in_front = near.point[:, 1, 2] > near.point[:, 0, 2]
    if (in_front != cost.loop.upper_in_front.ravel()).any() or (near.distance < SMALLEST_DISTANCE).any():
        raise GeometryError(
            "pattern.control_points: the yarns do not interlock: the upper row's yarn passes in front of the lower "
            f"row's at the crossing zones {np.flatnonzero(in_front).tolist()}, {near.distance.min():.2e} radii away "
            f"at least; allowed is in front at {np.flatnonzero(cost.loop.upper_in_front).tolist()} alone, at a "
            f"distance of more than {SMALLEST_DISTANCE:g}"
        )
