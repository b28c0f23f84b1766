"""Crossings of the yarns of neighbouring rows, and the closest approach of the two centrelines at each.

Within one loop the yarn of a row and the yarn of the row above cross four times in the plane of the fabric
(zones 0 left lower, 1 right lower, 2 left upper, 3 right upper). Each crossing has a window on both yarns,
half way to the next crossing along the yarn, in which the closest approach is looked for.
"""

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError

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


def refine(curve, shift, start, window):
    """Newton iteration for local minima of the distance between a curve and shifted images of it.

    Parameters
    ----------
    curve : CatmullRom
    shift : ndarray (K, 3)
        Where the image stands that the second point lies on.
    start : ndarray (K, 2)
        Parameters to start from, on the curve and on its image.
    window : ndarray (K, 2, 2)
        First and last parameter allowed.

    Returns
    -------
    Approach
        Arrays over K.
    """
    u = start.copy()
    low, high = window[..., 0], window[..., 1]
    value, newton = _half_square(curve, shift, u)
    active = np.ones(len(u), dtype=bool)
    for _ in range(NEWTON_STEPS):
        step = np.where(active[:, None], np.clip(u + newton, low, high) - u, 0.0)
        for _ in range(HALVINGS):
            worse = _half_square(curve, shift, u + step)[0] > value * (1 + 1e-15)  # beyond rounding
            if not worse.any():
                break
            step = np.where(worse[:, None], 0.5 * step, step)
        step = np.where(worse[:, None], 0.0, step)
        u = u + step
        active &= np.abs(step).max(axis=1) > 1e-13
        if not active.any():
            break
        value, newton = _half_square(curve, shift, u)
    point = np.stack([curve.value(u[:, 0]), curve.value(u[:, 1]) + shift], axis=1)
    interior = ((u > low + 1e-9) & (u < high - 1e-9)).all(axis=1)
    return Approach(u, point, np.linalg.norm(point[:, 1] - point[:, 0], axis=-1), interior)


def _half_square(curve, shift, u):
    """Half the squared distance (K,) and the Newton step that lowers it (K, 2)."""
    a, b = u[:, 0], u[:, 1]
    apart = curve.value(a) - curve.value(b) - shift
    ta, tb = curve.d1(a), curve.d1(b)
    gradient = np.stack([_dot(apart, ta), -_dot(apart, tb)], axis=-1)
    mixed = -_dot(ta, tb)
    saa, sbb = _dot(ta, ta), _dot(tb, tb)
    haa, hbb = saa + _dot(apart, curve.d2(a)), sbb - _dot(apart, curve.d2(b))
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
