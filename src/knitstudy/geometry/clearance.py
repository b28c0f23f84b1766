"""Gaps between pieces of yarn that are not neighbours along one yarn, and the smallest radius of curvature.

A tube of radius R about a curve overlaps itself or another one exactly where the radius of curvature is below
R, or where two points that are closest to each other (the segment between them is normal to both curves) are
nearer than 2R (Litherland, Simon, Durumeric and Rawdon 1999, "Thickness of knots"). So all local minima of
the distance are listed, between one loop and everything around it in an endless knit: a finite one has no
other pairs.
"""

from dataclasses import dataclass

import numpy as np

from knitstudy.geometry.crossing import refine

SAMPLES = 12
"""Samples a Bezier segment in which local minima are looked for, before they are refined."""

REACH = 8.0
"""Distance of centrelines in radii up to which approaches are listed."""

CURVATURE_SAMPLES = 200
"""Samples a Bezier segment for the largest curvature, which often lies at the end of one."""


@dataclass(frozen=True)
class Approaches:
    """Local minima of the distance between a loop and the pieces of yarn around it.

    Attributes
    ----------
    parameter : ndarray (A, 2)
        The curve's parameter u of the two points; the second one counts on through the neighbouring loops.
    row : ndarray of int (A,)
        Row of the second point above the first one's.
    distance : ndarray (A,)
        Distance of the centrelines. [m]
    point : ndarray (A, 2, 3)
        The two points. [m]
    """

    parameter: np.ndarray
    row: np.ndarray
    distance: np.ndarray
    point: np.ndarray

    def without(self, crossings):
        """The approaches that are not among the crossings with the next row, (4, 2) parameters."""
        apart = np.abs(self.parameter[:, None] - crossings).max(axis=-1).min(axis=-1)
        return self.selected((self.row != 1) | (apart > 1e-3))

    def selected(self, index):
        """The approaches at an index or mask."""
        return Approaches(self.parameter[index], self.row[index], self.distance[index], self.point[index])


def approaches(loop, reach=REACH, samples=SAMPLES):
    """All places where a loop comes near other yarn, or to itself.

    Parameters
    ----------
    loop : Loop
    reach : float
        Distance of centrelines, in radii, beyond which pieces of yarn are not looked at.
    samples : int
        Samples a Bezier segment.

    Returns
    -------
    Approaches
        Sorted by distance.
    """
    curve = loop.curve
    # One more sample at both ends of the loop, so that minima at its ends are seen as such.
    here = np.arange(-1, curve.period * samples + 2) / samples
    around = np.arange(-curve.period * samples, 2 * curve.period * samples + 1) / samples
    starts = [_local_minima(loop, here, around, row, reach) for row in range(_rows_in_reach(loop, reach) + 1)]
    row = np.repeat(np.arange(len(starts)), [len(start) for start in starts])
    start = np.concatenate(starts)
    shift = row[:, None] * loop.rise
    width = 2 / samples
    found = refine(curve, shift, start, start[..., None] + [-width, width])
    order = np.argsort(found.distance, kind="stable")
    result = Approaches(found.parameter, row, found.distance, found.point).selected(
        order[found.interior[order]]
    )
    return result.selected(_first_of_equals(result))


def _rows_in_reach(loop, reach):
    """Rows above a yarn that can come nearer to it than the reach."""
    y = loop.curve.value(np.linspace(0, loop.curve.period, 20 * loop.curve.period))[:, 1]
    return max(1, int((np.ptp(y) + reach * loop.radius) // loop.course_spacing))


def _local_minima(loop, here, around, row, reach):
    """Pairs of samples nearer to each other than their eight neighbours: (k, 2) parameters."""
    curve = loop.curve
    first = curve.value(here)
    second = curve.value(around) + row * loop.rise
    square = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1) - 2 * first @ second.T
    centre = square[1:-1, 1:-1]
    lowest = centre < (reach * loop.radius) ** 2
    for i in (0, 1, 2):
        for j in (0, 1, 2):
            lowest &= centre <= square[i : i + centre.shape[0], j : j + centre.shape[1]]
    if row == 0:
        lowest &= _beyond_half_circle(curve, here[1:-1], around[1:-1], loop.radius)
    i, j = np.nonzero(lowest)
    return np.column_stack([here[1:-1][i], around[1:-1][j]])


def _beyond_half_circle(curve, here, around, radius):
    """Pairs on one yarn, each once, that are further apart along it than half a circle of radius R.

    Nearer ones are neighbours: with a radius of curvature above R they cannot overlap (Schur's theorem).
    """
    knots = np.concatenate([[0.0], np.cumsum(curve.segment_lengths())])
    u = np.arange(curve.period + 1)

    def along(parameter):
        turns, rest = np.divmod(parameter, curve.period)
        return turns * knots[-1] + np.interp(rest, u, knots)

    return along(around) - along(here)[:, None] > np.pi * radius


def _first_of_equals(found):
    """Indices of the approaches that are not repeated: neighbouring samples may end in one minimum."""
    key = np.column_stack([found.row, np.round(found.parameter, 6)])
    return np.sort(np.unique(key, axis=0, return_index=True)[1])


def smallest_radius_of_curvature(curve):
    """Smallest radius of curvature of a loop, from dense samples of both sides of every joint. [m]"""
    share = np.linspace(0, 1 - 1e-9, CURVATURE_SAMPLES)
    return float(1 / curve.curvature(np.arange(curve.period)[:, None] + share).max())
