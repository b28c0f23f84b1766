"""Metrics of a loop in its knit: length, gaps, curvature, and the angles of the honeycomb of its contact points.

A tube of radius R about a curve overlaps itself or another one exactly where the radius of curvature is below R, or
where two points that are closest to each other are nearer than 2R (Litherland, Simon, Durumeric and Rawdon 1999,
"Thickness of knots"). The metrics therefore need all local minima of the distance between one loop and the yarn around
the loop in an endless knit; a finite knit has no other pairs. "One loop" is one repeat where stitches differ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.crossings import crossings_of_loop, refine, windows_of_loop
from knitstudy.knit.geometry.loop import Loop
from knitstudy.knit.geometry.spline import CatmullRom, Centreline
from knitstudy.mechanics.core.arrays import Floats, Ints

APPROACH_SAMPLES = 12  # a Bezier segment in which other local minima are looked for, before these are refined
REACH = 8.0  # distance of centrelines in radii up to which local minima are listed
CURVATURE_SAMPLES = 200  # a Bezier segment for the largest curvature, which often lies at the end of one


@dataclass(frozen=True)
class LoopMetrics:
    """Metrics of the loops of a repeat in their knit."""

    length: float  # arc length of yarn in a loop. [m]
    radius_of_curvature: float  # the smallest one. [m]
    distance: Floats  # (4 r k,) shortest distance of the centrelines at each crossing. [m]
    gap: float  # smallest between pieces that are no neighbours along a yarn; negative where yarns penetrate. [m]
    other_gap: float  # smallest away from the closest points of the crossings. [m]
    # Angles to x, in the plane: of the segment between the two contact points of one side of an interlock, and of the
    # leg between two interlocks (Table 4 prints 66 and 80), of the first loop. [deg]
    interlock_angle: float
    leg_angle: float

    @property
    def penetration(self) -> float:
        """Deepest penetration of two yarns, zero if there is none. [m]"""
        return max(0.0, -self.gap)


def loop_metrics(loop: Loop) -> LoopMetrics:
    """Return the metrics of the loops of one repeat.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> from knitstudy.knit.geometry.lay_out import initial_loop
    >>> round(1e3 * loop_metrics(initial_loop(load_scene("yarns-tie-course"))).length, 1)  # mm of yarn in a loop
    54.9
    """
    unit = loop.in_radii()
    row, _, windows = windows_of_loop(unit)
    crossings = crossings_of_loop(unit, row, windows)
    near = approaches(unit)
    others = away_from_crossings(near, row, crossings.parameter)["distance"].min()  # nan if there are none
    interlock, leg = honeycomb_angles(crossings.point.mean(axis=1), unit.course_spacing)
    shortest = np.fmin(crossings.distance.min(), near["distance"].min())
    return LoopMetrics(
        length=unit.length * loop.radius,
        radius_of_curvature=smallest_radius_of_curvature(*unit.curves) * loop.radius,
        distance=crossings.distance * loop.radius,
        gap=float(shortest - 2) * loop.radius,
        other_gap=float(np.fmin(others, np.inf) - 2) * loop.radius,
        interlock_angle=interlock,
        leg_angle=leg,
    )


def honeycomb_angles(contact: Floats, rise: float) -> tuple[float, float]:
    """Return the angles to x [deg] of the segments of Fig. 4 (interlock, leg), from the contact points (4, 3).

    Examples
    --------
    >>> contact = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 1.0, 0.0], [3.0, 1.0, 0.0]])
    >>> interlock, leg = honeycomb_angles(contact, rise=2.0)
    >>> round(interlock), round(leg)
    (45, 45)
    """
    interlock = contact[2, :2] - contact[0, :2]
    leg = contact[0, :2] + [0.0, rise] - contact[2, :2]
    along, up = (float(np.degrees(np.arctan2(abs(y), abs(x)))) for x, y in (interlock, leg))
    return along, up


def check_yarns(metrics: LoopMetrics, loop: Loop, tolerance: float) -> None:
    """Refuse yarns that fold, or overlap by more than a tolerance [radii]; raises GeometryError."""
    if metrics.radius_of_curvature <= loop.radius:
        raise GeometryError(
            f"yarn.diameter = {2 * loop.radius} m: the loop's smallest radius of curvature is "
            f"{metrics.radius_of_curvature:.4e} m, and the yarn's radius must be below it or the yarn folds"
        )
    gap = metrics.gap / loop.radius
    allowed = -tolerance
    if gap < allowed or metrics.other_gap < 0:
        raise GeometryError(
            f"yarns overlap after the optimisation: the smallest gap is {gap:.4f} radii (allowed {allowed:g}) "
            f"and away from the crossings {metrics.other_gap / loop.radius:.4f} (allowed 0): take a smaller "
            "yarn.diameter, wider spacings or other pattern.control_points"
        )


def approaches(loop: Loop, reach: float = REACH, samples: int = APPROACH_SAMPLES) -> pd.DataFrame:
    """Return all places where a loop comes near other yarn, or itself: local minima of the distance.

    Pairs of centrelines farther apart than a reach [radii] are left out; samples are those of a Bezier segment. The
    columns are, by distance: ``row`` of the first point, ``above``, the rows by which the second one lies higher, the
    curves' parameters ``u`` and ``v`` of the two points, the latter counting on through the neighbouring loops, and
    ``distance`` of the centrelines. [m]
    """
    curves = loop.curves
    u = np.linspace(0, curves[0].period, 20 * curves[0].period)
    y = np.concatenate([curve.value(u)[:, 1] - row * loop.course_spacing for row, curve in enumerate(curves)])
    rows = max(1, int((np.ptp(y) + reach * loop.radius) // loop.course_spacing))  # that are in reach
    width = 2 / samples
    minima = []
    for row, above in np.ndindex(loop.rows, rows + 1):
        curve = curves[row]
        other = loop.image(row + above)
        start = _local_minima(curve, other, above == 0, reach * loop.radius, samples, np.pi * loop.radius)
        near = refine(curve, other, start, start[..., None] + [-width, width])
        columns = [np.full((len(start), 2), (row, above)), near.parameter, near.distance]
        minima.append(np.column_stack(columns)[near.interior])
    places = pd.DataFrame(np.concatenate(minima), columns=["row", "above", "u", "v", "distance"])
    places = places.sort_values("distance", kind="stable", ignore_index=True)
    # Neighbouring samples may end in one minimum.
    return places[~places[["row", "above", "u", "v"]].round(6).duplicated()]


def away_from_crossings(near: pd.DataFrame, row: Ints, crossings: Floats) -> pd.DataFrame:
    """Return the approaches that are not crossings of rows (K,) with the next row at parameters (K, 2)."""
    apart = np.abs(near[["u", "v"]].to_numpy()[:, None] - crossings).max(axis=-1)
    elsewhere = (apart > 1e-3) | (near["row"].to_numpy()[:, None] != row)
    return near[(near["above"] != 1) | elsewhere.all(axis=-1)]


def _local_minima(
    curve: CatmullRom, other: CatmullRom, same: bool, reach: float, samples: int, half_circle: float
) -> Floats:
    """Return parameters (k, 2) of pairs of samples on two curves that are nearer than their eight neighbours."""
    # One more sample at both ends of the period, so that minima at its ends are seen as such.
    here = np.arange(-1, curve.period * samples + 2) / samples
    around = np.arange(-curve.period * samples, 2 * curve.period * samples + 1) / samples
    first = curve.value(here)
    second = other.value(around)
    square = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1) - 2 * first @ second.T
    centre = square[1:-1, 1:-1]
    lowest = centre < reach**2
    for i, j in np.ndindex(3, 3):
        lowest &= centre <= square[i : i + centre.shape[0], j : j + centre.shape[1]]
    if same:
        # Each pair once; nearer ones cannot overlap, with a radius of curvature above R (Schur's theorem).
        line = Centreline(curve, 3)
        start, end = (line.arc_length(u[1:-1] + curve.period) for u in (here, around))
        lowest &= end - start[:, None] > half_circle
    i, j = np.nonzero(lowest)
    return np.column_stack([here[1:-1][i], around[1:-1][j]])


def smallest_radius_of_curvature(*curves: CatmullRom) -> float:
    """Return the smallest radius of curvature of curves [m], from dense samples of both sides of every joint."""
    share = np.linspace(0, 1 - 1e-9, CURVATURE_SAMPLES)
    return float(1 / np.max([curve.curvature(np.arange(curve.period)[:, None] + share) for curve in curves]))
