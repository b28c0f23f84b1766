"""Optimisation of a loop: the control points that minimise F of Eq. (1).

All lengths are divided by the yarn radius first, so the result does not depend on the unit of length. The
minimiser is unconstrained; the periodic cell and the symmetries of the loop are kept by parametrisation.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from knitstudy.errors import GeometryError
from knitstudy.geometry.crossing import crossings_in_plane, windows
from knitstudy.geometry.energy import CostFunction, Weights
from knitstudy.geometry.symmetry import symmetric_motions, symmetries

CONTACT_TOLERANCE = 1e-3
"""|D - 2R - c0| / R that every crossing must meet."""

UPPER_IN_FRONT = np.array([False, False, True, True])
"""By crossing zone: whether the upper row's yarn passes in front of the lower row's."""
SMALLEST_DISTANCE = 1e-6
"""Distance of centrelines, in radii, from which on the direction between them is known."""

CONTINUATION = (1e-4, 1e-2, 1.0)
"""Shares of alpha with which F is minimised in turn: a stiff valley is entered from its wide end."""

QUASI_NEWTON = {"gtol": 1e-6, "maxiter": 60}
"""A loop that the yarn fits into needs 10 to 30 iterations a share; more would only delay the error."""
NEWTON_STEPS = 12
GRADIENT_TOLERANCE = 1e-6
"""Largest gradient component at which F is called minimal, over the bending terms' at the start."""
DIFFERENCE = 1e-5
"""Step, in radii, of the central differences of the exact gradient that make the Hessian."""


@dataclass(frozen=True)
class Optimum:
    """Outcome of an optimisation, in units of the radius.

    Attributes
    ----------
    points : ndarray (P, 3)
    before, after : dict of floats
        The terms of F without their weights, and F.
    iterations : int
        Quasi-Newton iterations.
    gradient : float
        Largest component of the gradient that remains, over the largest of the bending terms' at the start.
    """

    points: np.ndarray
    before: dict
    after: dict
    iterations: int
    gradient: float


def optimise(loop, settings):
    """Move the free components of a loop's control points to where F is smallest.

    Parameters
    ----------
    loop : Loop
        The initial loop, whose arc lengths are the rest lengths.
    settings : object
        alpha, beta, gamma, beta_0 : float, weights of Eqs. (1) and (3); free : sequence of P strings, the
        components ("", "z", "yz", "xyz", ...) of each control point that may move; samples : int, samples a
        Bezier segment in the search of closest points.

    Returns
    -------
    Loop
        The optimised loop.
    Optimum
        Terms of F before and after.

    Raises
    ------
    GeometryError
        When no minimum is found, or a crossing misses its distance by more than `CONTACT_TOLERANCE` radii
        there.
    """
    start = loop.in_radii()
    cost = cost_function(start, settings)
    check_interlock(cost, start.control_points)
    motions = symmetric_motions(
        free_components(settings.free, len(start.control_points)), symmetries(start.curve)
    )
    optimum = minimise(cost, start.control_points, motions)
    check_contact(cost, optimum.points)
    check_interlock(cost, optimum.points)
    return loop.with_points(optimum.points * loop.radius), optimum


def cost_function(loop, settings):
    """F of a loop given in radii, with the crossings' windows taken from the loop as it stands."""
    window = windows(crossings_in_plane(loop.curve, loop.course_spacing), loop.curve.period)
    weights = Weights(settings.alpha, settings.beta, settings.gamma, settings.beta_0)
    return CostFunction(loop, weights, window, settings.samples)


def free_components(free, count):
    """Which components may move, from their names.

    Parameters
    ----------
    free : sequence of str
        One entry a control point, made of the letters x, y and z.
    count : int
        Number of control points.

    Returns
    -------
    ndarray of bool (count, 3)
    """
    if len(free) != count or not all(set(names) <= set("xyz") for names in free):
        raise GeometryError(
            f"geometry.free = {list(free)}: allowed is one entry for each of the {count} control points, "
            "made of the letters x, y and z, or empty where the point is held"
        )
    return np.array([[axis in names for axis in "xyz"] for names in free])


def minimise(cost, points, motions):
    """Minimise F over displacements: quasi-Newton (BFGS), then Newton until rounding.

    Parameters
    ----------
    cost : CostFunction
    points : ndarray (P, 3)
        Where to start.
    motions : ndarray (P, 3, n)
        The displacements allowed.

    Returns
    -------
    Optimum
    """
    before = cost.terms(points)
    unit = _unit(cost, points)
    q = np.zeros(motions.shape[-1])
    iterations = 0
    for share in CONTINUATION:
        found = minimize(
            _along(cost.softened(share), points, motions, unit),
            q,
            jac=True,
            method="BFGS",
            options=QUASI_NEWTON,
        )
        q, iterations = found.x, iterations + found.nit
    q, gradient = _polish(_along(cost, points, motions, unit), q)
    if gradient > GRADIENT_TOLERANCE:
        raise GeometryError(
            f"the optimisation of the loop stopped with a gradient of {gradient:.2e} times the bending "
            f"terms', allowed is {GRADIENT_TOLERANCE:g}: take a smaller yarn.diameter, free more in "
            "geometry.free, or change the weights in geometry"
        )
    final = points + motions @ q
    return Optimum(final, before, cost.terms(final), iterations, gradient)


def _unit(cost, points):
    """What F is divided by, so that tolerances do not depend on a common factor of the weights."""
    w = cost.weights
    slopes = (w.beta * cost.continuous(points)[1], w.beta * w.beta_0 * cost.join(points)[1])
    return max(np.abs(slope).max() for slope in slopes) or w.alpha


def _along(cost, points, motions, unit):
    """F and its gradient as functions of the displacements' parameters."""

    def function(q):
        value, gradient = cost.value(points + motions @ q)
        return value / unit, np.einsum("kai,ka->i", motions, gradient) / unit

    return function


def _polish(function, q):
    """Newton steps with a Hessian by central differences of the exact gradient, while the gradient falls.

    Least squares take care of motions that do not change F, such as a shift of the whole knit along z.
    """
    gradient = function(q)[1]
    steps = DIFFERENCE * np.eye(len(q))
    for _ in range(NEWTON_STEPS):
        hessian = np.array([function(q + e)[1] - function(q - e)[1] for e in steps]) / (2 * DIFFERENCE)
        trial = q - np.linalg.lstsq(0.5 * (hessian + hessian.T), gradient, rcond=1e-12)[0]
        better = function(trial)[1]
        if np.abs(better).max() >= np.abs(gradient).max():
            break
        q, gradient = trial, better
    return q, float(np.abs(gradient).max())


def check_contact(cost, points):
    """Every crossing is at its distance.

    Raises
    ------
    GeometryError
    """
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
    """The yarns pass each other on the sides that make a plain knit.

    Raises
    ------
    GeometryError
        Also where the centrelines cut each other: the direction in which to part them is not defined then.
    """
    found = cost.approach(points)
    in_front = found.point[:, 1, 2] > found.point[:, 0, 2]
    if (in_front != UPPER_IN_FRONT).any() or (found.distance < SMALLEST_DISTANCE).any():
        raise GeometryError(
            "pattern.control_points: the yarns do not interlock: the upper row's yarn passes in front of the lower "
            f"row's at the crossing zones {np.flatnonzero(in_front).tolist()}, {found.distance.min():.2e} radii away "
            "at least; allowed is behind at 0 and 1, in front at 2 and 3, at a distance of more than "
            f"{SMALLEST_DISTANCE:g}"
        )
