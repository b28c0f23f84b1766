"""Distances between yarns: crossings, closest approaches, gaps away from crossings."""

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError

# ---- Crossings of the yarns of neighbouring rows, and the closest approach of the two centrelines at each
# Within one loop the yarn of a row and the yarn of the row above cross four times in the plane of the fabric
# (zones 0 left lower, 1 right lower, 2 left upper, 3 right upper). Each crossing has a window on both yarns,
# half way to the next crossing along the yarn, in which the closest approach is looked for.


ZONES = 4
SEARCH_SAMPLES = 10
"""Samples a Bezier segment by which the crossings in the plane are found; the closest approach is refined."""
NEWTON_STEPS = 40
HALVINGS = 20


@dataclass(frozen=True)
class Approach:
    """Closest approach of two centrelines at the four crossings of a cell.

    Attributes
    ----------
    parameter : ndarray (4, 2)
        The curve's parameter u on the lower (0) and the upper (1) row's yarn.
    point : ndarray (4, 2, 3)
        The two closest points.
    distance : ndarray (4,)
    interior : ndarray of bool (4,)
        False where the closest points lie on the bound of the window: no closest approach of this crossing.
    """

    parameter: np.ndarray
    point: np.ndarray
    distance: np.ndarray
    interior: np.ndarray


def crossings_in_plane(curve, rise):
    """Parameters at which a row's yarn and the next row's yarn cross in the plane of the fabric.

    Parameters
    ----------
    curve : CatmullRom
        One loop; its advance is (w, 0, 0).
    rise : float
        Course spacing c, in the unit of the curve.

    Returns
    -------
    ndarray (4, 2)
        By zone: u on the lower row's and on the upper row's yarn.

    Raises
    ------
    GeometryError
        When the two do not cross four times in a loop, twice left and twice right of the loop's middle.
    """
    u = np.arange(curve.period * SEARCH_SAMPLES + 1) / SEARCH_SAMPLES
    lower = curve.value(u)[:, :2]
    upper = lower + np.array([0.0, rise])
    first, second, share = _intersections(lower, upper)
    found = np.column_stack([first + share[:, 0], second + share[:, 1]]) / SEARCH_SAMPLES
    point = curve.value(found[:, 0])
    right = point[:, 0] > 0.5 * curve.advance[0] + curve.control_points[0, 0]
    if len(found) != ZONES or right.sum() != 2:
        raise GeometryError(
            f"pattern.control_points: the yarns of neighbouring rows cross {len(found)} times in a loop, "
            f"{right.sum()} times right of its middle: allowed is 4 crossings, 2 on each side"
        )
    left_lower, left_upper = sorted(np.flatnonzero(~right), key=lambda k: point[k, 1])
    right_lower, right_upper = sorted(np.flatnonzero(right), key=lambda k: point[k, 1])
    return found[[left_lower, right_lower, left_upper, right_upper]]


def _intersections(a, b):
    """Which segments of two plane polylines (k, 2) cross, and where on each: (n,), (n,), (n, 2)."""
    da, db = np.diff(a, axis=0), np.diff(b, axis=0)
    offset = b[None, :-1] - a[:-1, None]  # (i, j, 2)
    det = _cross(da[:, None], db[None])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.stack([_cross(offset, db[None]) / det, _cross(offset, da[:, None]) / det], axis=-1)
    i, j = np.nonzero(((share >= 0) & (share < 1)).all(axis=-1))
    return i, j, share[i, j]


def _cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def windows(crossings, period):
    """Share of each yarn that belongs to each crossing.

    Parameters
    ----------
    crossings : ndarray (4, 2)
        As `crossings_in_plane` gives them.
    period : int
        Segments in one loop.

    Returns
    -------
    ndarray (4, 2, 2)
        By zone and side: first and last parameter, half way to the neighbours along the yarn.
    """
    # One yarn is the lower of the row above it and the upper of the row below: eight crossings a loop.
    u = crossings.ravel()
    order = np.argsort(u)
    along = u[order]
    middle = 0.5 * (along + np.append(along[1:], along[0] + period))
    bounds = np.empty((u.size, 2))
    bounds[order, 0] = np.append(middle[-1] - period, middle[:-1])
    bounds[order, 1] = middle
    return bounds.reshape(ZONES, 2, 2)


def closest_approach(curve, rise, window, samples):
    """Shortest distance between the two yarns at every crossing of a cell.

    The closest pair of samples is the start of a Newton iteration for the true minimum: distances between
    samples alone would make F_Distance kink.

    Parameters
    ----------
    curve : CatmullRom
    rise : float
        Course spacing c.
    window : ndarray (4, 2, 2)
        As `windows` gives it.
    samples : int
        Samples a Bezier segment (100 in the paper).

    Returns
    -------
    Approach
    """
    step = 1.0 / samples
    count = np.ceil((window[..., 1] - window[..., 0]).max() / step).astype(int) + 1
    u = window[..., :1] + (window[..., 1:] - window[..., :1]) * np.linspace(0, 1, count)  # (4, 2, count)
    x = curve.value(u)
    x[:, 1, :, 1] += rise
    square = (x * x).sum(axis=-1)
    gap = square[:, 0, :, None] + square[:, 1, None, :] - 2 * x[:, 0] @ np.swapaxes(x[:, 1], -1, -2)
    best = np.stack(np.unravel_index(gap.reshape(ZONES, -1).argmin(axis=1), (count, count)), axis=-1)
    start = np.take_along_axis(u, best[..., None], axis=-1)[..., 0]
    return refine(curve, np.tile([0.0, rise, 0.0], (ZONES, 1)), start, window)


def refine(curve, shift, start, window, other=None):
    """Newton iteration for local minima of the distance between a curve and shifted images of it or another one.

    Parameters
    ----------
    curve : CatmullRom
    shift : ndarray (K, 3)
        Where the image stands that the second point lies on.
    start : ndarray (K, 2)
        Parameters to start from, on the curve and on its image.
    window : ndarray (K, 2, 2)
        First and last parameter allowed.
    other : CatmullRom, optional
        The curve of the second points; the same one if left out.

    Returns
    -------
    Approach
        Arrays over K.
    """
    curves, u = (curve, other or curve), start.copy()
    low, high = window[..., 0], window[..., 1]
    value, newton = _half_square(curves, shift, u)
    active = np.ones(len(u), dtype=bool)
    for _ in range(NEWTON_STEPS):
        step = np.where(active[:, None], np.clip(u + newton, low, high) - u, 0.0)
        for _ in range(HALVINGS):
            worse = _half_square(curves, shift, u + step)[0] > value * (1 + 1e-15)  # beyond rounding
            if not worse.any():
                break
            step = np.where(worse[:, None], 0.5 * step, step)
        step = np.where(worse[:, None], 0.0, step)
        u = u + step
        active &= np.abs(step).max(axis=1) > 1e-13
        if not active.any():
            break
        value, newton = _half_square(curves, shift, u)
    point = np.stack([curves[0].value(u[:, 0]), curves[1].value(u[:, 1]) + shift], axis=1)
    interior = ((u > low + 1e-9) & (u < high - 1e-9)).all(axis=1)
    return Approach(u, point, np.linalg.norm(point[:, 1] - point[:, 0], axis=-1), interior)


def _half_square(curves, shift, u):
    """Half the squared distance (K,) and the Newton step that lowers it (K, 2)."""
    (a, b), (first, second) = u.T, curves
    apart = first.value(a) - second.value(b) - shift
    ta, tb = first.d1(a), second.d1(b)
    gradient = np.stack([_dot(apart, ta), -_dot(apart, tb)], axis=-1)
    mixed = -_dot(ta, tb)
    saa, sbb = _dot(ta, ta), _dot(tb, tb)
    haa, hbb = saa + _dot(apart, first.d2(a)), sbb - _dot(apart, second.d2(b))
    # Where the Hessian is not positive definite, the Gauss-Newton part of it is.
    bad = (haa <= 0) | (haa * hbb - mixed**2 <= 1e-6 * saa * sbb)
    haa, hbb = np.where(bad, 1.01 * saa, haa), np.where(bad, 1.01 * sbb, hbb)
    det = haa * hbb - mixed**2
    newton = -np.stack(
        [hbb * gradient[:, 0] - mixed * gradient[:, 1], haa * gradient[:, 1] - mixed * gradient[:, 0]],
        axis=-1,
    )
    return 0.5 * _dot(apart, apart), newton / det[:, None]


def _dot(a, b):
    return (a * b).sum(axis=-1)


# ---- Gaps between pieces of yarn that are not neighbours along one yarn, and the smallest radius of curvature
# A tube of radius R about a curve overlaps itself or another one exactly where the radius of curvature is below
# R, or where two points that are closest to each other (the segment between them is normal to both curves) are
# nearer than 2R (Litherland, Simon, Durumeric and Rawdon 1999, "Thickness of knots"). So all local minima of
# the distance are listed, between one loop and everything around it in an endless knit: a finite one has no
# other pairs.


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
