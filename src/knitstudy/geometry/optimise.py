"""Cost function of the yarn geometry, Eqs. (1) to (6) of the paper, with exact gradients.

Lengths are in yarn radii R, so that the terms carry no unit. A term is a function from the control points of one loop
to its value and gradient. Where the paper leaves a choice:

- F_Distance (Eq. 2) has one term for every crossing of the cell, aims at D = 2 + c0 and takes the true minimum D.
- L_l^0 (Eq. 6) is the arc length of Bezier curve l at the start. The printed one is its chord, which would shrink the
  yarn however well it fits.
- theta (Eq. 5) is the angle between the chords of the control polygon, pi where it is straight: the angle between
  tangents would be pi everywhere on a C1 curve. tau and rho follow from K_join being C1 at theta = pi/4.
- sigma (Eq. 5) is the mean of the two chords at the start, constant as the rest length of Breen et al. (1994) is.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from knitstudy.errors import GeometryError
from knitstudy.geometry.crossings import closest_points, windows_of_loop
from knitstudy.geometry.loop import symmetric_motions, symmetries
from knitstudy.geometry.spline import GAUSS_POINTS, GAUSS_WEIGHTS, CatmullRom

# Two-point Gauss rule: exact for the square of C'', which is linear on a segment.
CURVATURE_POINTS = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3)


class CostFunction:
    """F of Eq. (1) for one loop of a periodic knit, in units of the radius.

    Parameters
    ----------
    loop : Loop
        At the start, in radii; it gives the rest lengths, sigma, and the windows in which crossings are looked for.
    settings : object
        Its weights and samples; see `optimise`.
    """

    def __init__(self, loop, settings):
        start = loop.curve
        self.advance = start.advance
        self.rise = loop.rise
        self.target = loop.target
        self.settings = settings
        self.windows = windows_of_loop(start, loop.rise)
        self.rest_length = start.segment_lengths()
        segments = np.arange(start.period)[:, None]
        self._tangent, self._tangent_offset = start.operator((segments + GAUSS_POINTS).ravel(), 1)
        self._bend, self._bend_offset = start.operator((segments + CURVATURE_POINTS).ravel(), 2)
        chord = np.linalg.norm(_chords(loop.control_points, self.advance), axis=1)
        self.sigma = 0.5 * (chord + np.roll(chord, 1))

    def value(self, points, share=1.0):
        """F with a share of alpha, which may be 0, and its gradient: (P, 3) -> float, (P, 3)."""
        w = self.settings
        alpha = share * w.alpha
        distance, d_distance = self.distance(points) if share else (0.0, 0.0)
        continuous, d_continuous = self.continuous(points)
        join, d_join = self.join(points)
        length, d_length = self.length(points)
        value = alpha * distance + w.beta * (continuous + w.beta_0 * join) + w.gamma * length  # Eqs. (1), (3)
        gradient = alpha * d_distance + w.beta * (d_continuous + w.beta_0 * d_join) + w.gamma * d_length
        return value, gradient

    def terms(self, points):
        """Each term of F without its weight, and F: (P, 3) -> dict of floats."""
        continuous, join = self.continuous(points)[0], self.join(points)[0]
        return {
            "distance": self.distance(points)[0],
            "continuous": continuous,
            "join": join,
            "bending": continuous + self.settings.beta_0 * join,
            "length": self.length(points)[0],
            "total": self.value(points)[0],
        }

    def approach(self, points):
        """Closest approach of the yarns at the four crossings: (P, 3) -> Approach."""
        curve = CatmullRom(points, self.advance)
        return closest_points(curve, curve.shifted(self.rise), self.windows, self.settings.samples)

    def distance(self, points):
        """F_Distance, Eq. (2), summed over the crossings, and its gradient."""
        found = self.approach(points)
        error = found.distance - self.target
        return error @ error, np.einsum("k,kpi->pi", 2 * error, self.distance_slope(points, found))

    def distance_slope(self, points, found):
        """Gradient of the shortest distance at each crossing: (P, 3), Approach -> (4, P, 3).

        To first order only the motion of the curves at fixed parameters changes the shortest distance.
        """
        normal = (found.point[:, 1] - found.point[:, 0]) / found.distance[:, None]
        curve = CatmullRom(points, self.advance)
        on_lower, _ = curve.operator(found.parameter[:, 0])
        on_upper, _ = curve.operator(found.parameter[:, 1])
        return (on_upper - on_lower)[:, :, None] * normal[:, None]

    def continuous(self, points):
        """F_cont, Eq. (4), with t the parameter of each Bezier segment, and its gradient."""
        second = self._bend @ points + self._bend_offset
        share = 1 / len(CURVATURE_POINTS)
        return share * (second**2).sum(), 2 * share * self._bend.T @ second

    def join(self, points):
        """Sum of K_join^2, Eq. (5), over the control points of a loop, and its gradient."""
        chord = _chords(points, self.advance)
        size = np.linalg.norm(chord, axis=1, keepdims=True)
        after = chord / size
        before = np.roll(after, 1, axis=0)
        square, slope = squared_join_curvature((before * after).sum(axis=1), self.sigma)
        d_unit = slope[:, None] * before + np.roll(slope[:, None], -1, axis=0) * np.roll(after, -1, axis=0)
        d_chord = (d_unit - after * (d_unit * after).sum(axis=1, keepdims=True)) / size
        return square.sum(), np.roll(d_chord, 1, axis=0) - d_chord

    def length(self, points):
        """F_Length, Eq. (6), with arc lengths, and its gradient."""
        tangent, speed = self._velocity(points)
        error = self.rest_length - speed @ GAUSS_WEIGHTS
        slope = -2 * error[:, None, None] * GAUSS_WEIGHTS[:, None] * tangent / speed[..., None]
        return error @ error, self._tangent.T @ slope.reshape(-1, 3)

    def arc_length(self, points):
        """Length of yarn in a loop, and its gradient: (P, 3) -> float, (P, 3)."""
        tangent, speed = self._velocity(points)
        slope = GAUSS_WEIGHTS[:, None] * tangent / speed[..., None]
        return (speed @ GAUSS_WEIGHTS).sum(), self._tangent.T @ slope.reshape(-1, 3)

    def _velocity(self, points):
        """C' at the Gauss points of all segments, and its size: (P, g, 3), (P, g)."""
        tangent = (self._tangent @ points + self._tangent_offset).reshape(len(points), -1, 3)
        return tangent, np.linalg.norm(tangent, axis=-1)


def squared_join_curvature(cosine, sigma):
    """K_join^2 (P,) of Eq. (5), and its derivative (P,) with respect to the cosine.

    The cosine (P,) is that of the angle by which the control polygon turns, -cos(theta); sigma (P,) is the local
    spacing of the control points.
    """
    # theta > pi/4: (2/sigma)^2 cos^2(theta/2) = (2/sigma^2)(1 + cos(theta)), smooth where it is straight too.
    square, derivative = 2 * (1 - cosine) / sigma**2, -2 / sigma**2
    sharp = cosine < -np.cos(np.pi / 4)
    if sharp.any():
        s = sigma[sharp]
        theta = np.arccos(np.clip(-cosine[sharp], -1, 1 - 1e-12))  # a folded polygon costs much, not infinity
        tau, rho = 2 / s * np.cos(np.pi / 8), -np.sin(np.pi / 8) / s
        k_join = -((np.pi / 4) ** 2) * rho / theta + tau + np.pi / 4 * rho
        square[sharp] = k_join**2
        derivative[sharp] = 2 * k_join * (np.pi / 4) ** 2 * rho / theta**2 / np.sin(theta)
    return square, derivative


def _chords(points, advance):
    """Edges P_k+1 - P_k of the control polygon: (P, 3)."""
    return np.vstack([points[1:], points[0] + advance]) - points


# ---- Minimisation. It is unconstrained: the periodic cell and the symmetries of the loop are kept by parametrisation.


CONTACT_TOLERANCE = 1e-3  # |D - 2R - c0| / R that every crossing must meet
UPPER_IN_FRONT = np.array([False, False, True, True])  # by zone: the upper row's yarn passes in front
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

    points: np.ndarray  # (P, 3)
    before: dict  # the terms of F without their weights, and F, at the start
    after: dict  # and at the end
    iterations: int  # of the quasi-Newton method
    gradient: float  # largest component that remains, over the largest of the bending terms' at the start


def optimise(loop, settings):
    """Move the free components of a loop's control points to where F is smallest: the optimised Loop, and Optimum.

    Parameters
    ----------
    loop : Loop
        The initial loop, whose arc lengths are the rest lengths.
    settings : object
        alpha, beta, gamma, beta_0 : float, weights of Eqs. (1) and (3); free : sequence of P strings, the
        components ("", "z", "yz", "xyz", ...) of each control point that may move; samples : int, samples a
        Bezier segment in the search of closest points.

    Raises
    ------
    GeometryError
        When no minimum is found, or a crossing misses its distance by more than `CONTACT_TOLERANCE` radii
        there.
    """
    start = loop.in_radii()
    cost = CostFunction(start, settings)
    check_interlock(cost, start.control_points)
    motions = symmetric_motions(
        free_components(settings.free, len(start.control_points)), symmetries(start.curve)
    )
    optimum = minimise(cost, start.control_points, motions)
    check_contact(cost, optimum.points)
    check_interlock(cost, optimum.points)
    return replace(loop, control_points=optimum.points * loop.radius), optimum


def free_components(free, count):
    """Which components (count, 3) may move, from their names: an entry a control point, of the letters x, y, z."""
    if len(free) != count or not all(set(names) <= set("xyz") for names in free):
        raise GeometryError(
            f"geometry.free = {list(free)}: allowed is one entry for each of the {count} control points, "
            "made of the letters x, y and z, or empty where the point is held"
        )
    return np.array([[axis in names for axis in "xyz"] for names in free])


def minimise(cost, points, motions):
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

    def function(q, share=1.0):
        value, gradient = cost.value(points + motions @ q, share)
        return value / unit, np.einsum("kai,ka->i", motions, gradient) / unit

    for share in CONTINUATION:
        found = minimize(function, q, args=(share,), jac=True, method="BFGS", options=QUASI_NEWTON)
        q, iterations = found.x, iterations + found.nit
    q, gradient = _polish(function, q)
    if gradient > GRADIENT_TOLERANCE:
        raise GeometryError(
            f"the optimisation of the loop stopped with a gradient of {gradient:.2e} times the bending "
            f"terms', allowed is {GRADIENT_TOLERANCE:g}: take a smaller yarn.diameter, free more in "
            "geometry.free, or change the weights in geometry"
        )
    final = points + motions @ q
    return Optimum(final, before, cost.terms(final), iterations, gradient)


def _polish(function, q):
    """Newton steps with a Hessian by central differences of the exact gradient, while the gradient falls."""
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


def check_contact(cost, points):
    """Refuse control points with which a crossing is not at its distance; raises GeometryError."""
    found = cost.approach(points)
    error = np.abs(found.distance - cost.target)
    zone = int(error.argmax())
    if error[zone] > CONTACT_TOLERANCE or not found.interior.all():
        raise GeometryError(
            f"after the optimisation the yarns are {found.distance[zone]:.5f} radii apart in crossing "
            f"zone {zone}, allowed is {cost.target:g} within {CONTACT_TOLERANCE:g} (closest points inside "
            f"their windows: {found.interior.tolist()}): take a smaller yarn.diameter, raise geometry.alpha "
            "or free more in geometry.free"
        )


def check_interlock(cost, points):
    """Refuse yarns that do not pass each other as in a plain knit, or cut each other; raises GeometryError."""
    found = cost.approach(points)
    in_front = found.point[:, 1, 2] > found.point[:, 0, 2]
    if (in_front != UPPER_IN_FRONT).any() or (found.distance < SMALLEST_DISTANCE).any():
        raise GeometryError(
            "pattern.control_points: the yarns do not interlock: the upper row's yarn passes in front of the lower "
            f"row's at the crossing zones {np.flatnonzero(in_front).tolist()}, {found.distance.min():.2e} radii away "
            "at least; allowed is behind at 0 and 1, in front at 2 and 3, at a distance of more than "
            f"{SMALLEST_DISTANCE:g}"
        )
