"""What a loop is like in its knit: lengths, gaps, curvature, and the angles of the honeycomb of its contact points.

A tube of radius R about a curve overlaps itself or another one exactly where the radius of curvature is below R, or
where two points that are closest to each other are nearer than 2R (Litherland, Simon, Durumeric and Rawdon 1999,
"Thickness of knots"). So all local minima of the distance are listed, between one loop and everything around it in an
endless knit: a finite one has no other pairs.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from knitstudy.errors import GeometryError
from knitstudy.geometry.crossings import closest_points, refine, windows_of_loop

APPROACH_SAMPLES = 12  # a Bezier segment in which other local minima are looked for, before these are refined
REACH = 8.0  # distance of centrelines in radii up to which local minima are listed
CURVATURE_SAMPLES = 200  # a Bezier segment for the largest curvature, which often lies at the end of one


@dataclass(frozen=True)
class Survey:
    """Measures of one loop in its knit."""

    length: float  # arc length of yarn. [m]
    radius_of_curvature: float  # the smallest one. [m]
    distance: np.ndarray  # (4,) shortest distance of the centrelines at each crossing. [m]
    gap: float  # smallest between pieces that are no neighbours along a yarn; negative where yarns penetrate. [m]
    other_gap: float  # smallest away from the closest points of the crossings. [m]
    # Angles to x, in the plane: of the segment between the two contact points of one side of an interlock, and of the
    # leg between two interlocks (Table 4 prints 66 and 80). [deg]
    interlock_angle: float
    leg_angle: float

    @property
    def penetration(self):
        """Deepest penetration of two yarns, zero if there is none. [m]"""
        return max(0.0, -self.gap)


def survey(loop):
    """Measure a loop: Survey."""
    unit = loop.in_radii()
    curve = unit.curve
    found = closest_points(curve, curve.shifted(unit.rise), windows_of_loop(curve, unit.rise))
    near = approaches(unit)
    others = away_from_crossings(near, found.parameter)["distance"].min()  # nan if there are none
    interlock, leg = honeycomb_angles(found.point.mean(axis=1), unit.course_spacing)
    shortest = np.fmin(found.distance.min(), near["distance"].min())
    return Survey(
        length=unit.length * loop.radius,
        radius_of_curvature=smallest_radius_of_curvature(curve) * loop.radius,
        distance=found.distance * loop.radius,
        gap=float(shortest - 2) * loop.radius,
        other_gap=float(np.fmin(others, np.inf) - 2) * loop.radius,
        interlock_angle=interlock,
        leg_angle=leg,
    )


def honeycomb_angles(contact, rise):
    """Angles to x, 0 to 90 degrees, of the inclined segments of Fig. 4 (interlock, leg), from contact points (4, 3)."""
    interlock = contact[2, :2] - contact[0, :2]
    leg = contact[0, :2] + [0.0, rise] - contact[2, :2]
    return tuple(float(np.degrees(np.arctan2(abs(y), abs(x)))) for x, y in (interlock, leg))


def check_yarns(surveyed, loop, tolerance):
    """Refuse yarns that fold, or overlap by more than a tolerance [radii]; raises GeometryError."""
    if surveyed.radius_of_curvature <= loop.radius:
        raise GeometryError(
            f"yarn.diameter = {2 * loop.radius} m: the loop's smallest radius of curvature is "
            f"{surveyed.radius_of_curvature:.4e} m, and the yarn's radius must be below it or the yarn folds"
        )
    gap, allowed = surveyed.gap / loop.radius, -tolerance
    if gap < allowed or surveyed.other_gap < 0:
        raise GeometryError(
            f"yarns overlap after the optimisation: the smallest gap is {gap:.4f} radii (allowed {allowed:g}) "
            f"and away from the crossings {surveyed.other_gap / loop.radius:.4f} (allowed 0): take a smaller "
            "yarn.diameter, wider spacings or other pattern.control_points"
        )


def approaches(loop, reach=REACH, samples=APPROACH_SAMPLES):
    """All places where a loop comes near other yarn, or to itself: local minima of the distance.

    Parameters
    ----------
    reach : float
        Distance of centrelines, in radii, beyond which pieces of yarn are not looked at.
    samples : int
        Samples a Bezier segment.

    Returns
    -------
    DataFrame
        By distance: ``row`` of the second point above the first one's, the curve's parameters ``u`` and ``v`` of the
        two points, the latter counting on through the neighbouring loops, and ``distance`` of the centrelines. [m]
    """
    curve = loop.curve
    y = curve.value(np.linspace(0, curve.period, 20 * curve.period))[:, 1]
    rows = max(1, int((np.ptp(y) + reach * loop.radius) // loop.course_spacing))  # that are in reach
    width = 2 / samples
    minima = []
    for row in range(rows + 1):
        start = _local_minima(loop, row, reach, samples)
        near = refine(curve, curve.shifted(row * loop.rise), start, start[..., None] + [-width, width])
        columns = np.column_stack([np.full(len(start), row), near.parameter, near.distance])
        minima.append(columns[near.interior])
    found = pd.DataFrame(np.concatenate(minima), columns=["row", "u", "v", "distance"])
    found = found.sort_values("distance", kind="stable", ignore_index=True)
    # Neighbouring samples may end in one minimum.
    return found[~found[["row", "u", "v"]].round(6).duplicated()]


def away_from_crossings(near, crossings):
    """The approaches that are not among the crossings with the next row, (4, 2) parameters."""
    apart = np.abs(near[["u", "v"]].to_numpy()[:, None] - crossings).max(axis=-1).min(axis=-1)
    return near[(near["row"] != 1) | (apart > 1e-3)]


def _local_minima(loop, row, reach, samples):
    """Parameters (k, 2) of pairs of samples, on a loop and `row` rows above, nearer than their eight neighbours."""
    curve = loop.curve
    # One more sample at both ends of the loop, so that minima at its ends are seen as such.
    here = np.arange(-1, curve.period * samples + 2) / samples
    around = np.arange(-curve.period * samples, 2 * curve.period * samples + 1) / samples
    first = curve.value(here)
    second = curve.value(around) + row * loop.rise
    square = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1) - 2 * first @ second.T
    centre = square[1:-1, 1:-1]
    lowest = centre < (reach * loop.radius) ** 2
    for i, j in np.ndindex(3, 3):
        lowest &= centre <= square[i : i + centre.shape[0], j : j + centre.shape[1]]
    if row == 0:
        lowest &= _beyond_half_circle(curve, here[1:-1], around[1:-1], loop.radius)
    i, j = np.nonzero(lowest)
    return np.column_stack([here[1:-1][i], around[1:-1][j]])


def _beyond_half_circle(curve, here, around, radius):
    """Pairs on one yarn, each once, that are further apart along it than half a circle of radius R.

    Nearer ones cannot overlap, with a radius of curvature above R (Schur's theorem).
    """
    knots = np.concatenate([[0.0], np.cumsum(curve.segment_lengths())])
    u = np.arange(curve.period + 1)

    def along(parameter):
        turns, rest = np.divmod(parameter, curve.period)
        return turns * knots[-1] + np.interp(rest, u, knots)

    return along(around) - along(here)[:, None] > np.pi * radius


def smallest_radius_of_curvature(curve):
    """Smallest radius of curvature of a loop, from dense samples of both sides of every joint. [m]"""
    share = np.linspace(0, 1 - 1e-9, CURVATURE_SAMPLES)
    return float(1 / curve.curvature(np.arange(curve.period)[:, None] + share).max())
