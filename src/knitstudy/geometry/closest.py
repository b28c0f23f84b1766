"""Closest points of two centrelines, and the four crossings of a plain knit's cell.

In a loop the yarn of a row and the yarn of the row above cross four times in the plane of the fabric: zones 0 left
lower, 1 right lower, 2 left upper, 3 right upper. The closest points of a crossing are looked for in a window on both
yarns, half way to the next crossings along the yarn. Newton's method finds the true minimum: with distances between
samples alone F_Distance (Eq. 2) would have kinks.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.errors import GeometryError

ZONES = 4
PLANE_SAMPLES = 10
"""Samples a Bezier segment, between which crossings in the plane are looked for."""

ROUNDING = 1e-9
"""Share of the distance of two samples within which a crossing in the plane is at one of them."""

NEWTON_STEPS = 40
HALVINGS = 20


@dataclass(frozen=True)
class Approach:
    """Closest points of two curves, K times.

    Attributes
    ----------
    parameter : ndarray (K, 2)
        Of the curves.
    point : ndarray (K, 2, 3)
    distance : ndarray (K,)
    interior : ndarray of bool (K,)
        False where a point lies on the bound of its window: there is no closest approach in it.
    """

    parameter: np.ndarray
    point: np.ndarray
    distance: np.ndarray
    interior: np.ndarray


def plane_crossings(u, a, v, b, apart=None):
    """Parameters (k, 2) at which two polylines cross in the plane.

    Parameters
    ----------
    u, v : ndarray (m,), (n,)
        Parameters of the samples.
    a, b : ndarray (m, 2), (n, 2)
        The samples.
    apart : int, optional
        Where both are the same line: how many segments the two that cross are apart at least, the second one ahead.
    """
    da, db = np.diff(a, axis=0), np.diff(b, axis=0)
    longest = max(np.linalg.norm(step, axis=1).max() for step in (da, db))
    middles = [cKDTree(line[:-1] + 0.5 * step) for line, step in ((a, da), (b, db))]
    near = middles[0].sparse_distance_matrix(middles[1], longest, output_type="coo_matrix")
    i, j = near.row, near.col
    if apart is not None:
        ahead = j >= i + apart
        i, j = i[ahead], j[ahead]
    offset, det = b[j] - a[i], _cross(da[i], db[j])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.stack([_cross(offset, db[j]) / det, _cross(offset, da[i]) / det], axis=-1)
    here = ((share > -ROUNDING) & (share < 1 + ROUNDING)).all(axis=-1)
    i, j, share = i[here], j[here], share[here]
    found = np.column_stack([u[i] + share[:, 0] * np.diff(u)[i], v[j] + share[:, 1] * np.diff(v)[j]])
    # A crossing at a sample is found on both sides of it.
    _, first_of_equals = np.unique(np.rint(found / (10 * ROUNDING)), axis=0, return_index=True)
    return found[first_of_equals]


def _cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def crossings_in_plane(curve, rise):
    """Parameters (4, 2), by zone, at which a row's yarn and the next row's yarn cross in the plane of the fabric.

    Parameters
    ----------
    curve : CatmullRom
        One loop; its advance is (w, 0, 0).
    rise : float
        Course spacing c, in the unit of the curve.

    Raises
    ------
    GeometryError
        When the two do not cross four times in a loop, twice left and twice right of the loop's middle.
    """
    u = np.arange(curve.period * PLANE_SAMPLES + 1) / PLANE_SAMPLES
    lower = curve.value(u)[:, :2]
    found = plane_crossings(u, lower, u, lower + np.array([0.0, rise]))
    point = curve.value(found[:, 0])
    right = point[:, 0] > 0.5 * curve.advance[0] + curve.control_points[0, 0]
    if len(found) != ZONES or right.sum() != 2:
        raise GeometryError(
            f"pattern.control_points: the yarns of neighbouring rows cross {len(found)} times in a loop, "
            f"{right.sum()} times right of its middle: allowed is 4 crossings, 2 on each side"
        )
    left_lower, left_upper, right_lower, right_upper = np.lexsort((point[:, 1], right))
    return found[[left_lower, right_lower, left_upper, right_upper]]


def windows(crossings, period):
    """First and last parameter (4, 2, 2) of each zone on both yarns: half way to the neighbours along the yarn.

    Parameters
    ----------
    crossings : ndarray (4, 2)
        As `crossings_in_plane` gives them.
    period : int
        Segments in one loop.
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
    """Closest points of the two yarns at every crossing of a cell: Approach, by zone.

    Parameters
    ----------
    curve : CatmullRom
    rise : float
        Course spacing c.
    window : ndarray (4, 2, 2)
        As `windows` gives it.
    samples : int
        Samples a Bezier segment, the closest of which start Newton's method (100 in the paper).
    """
    count = np.ceil((window[..., 1] - window[..., 0]).max() * samples).astype(int) + 1
    u = window[..., :1] + (window[..., 1:] - window[..., :1]) * np.linspace(0, 1, count)  # (4, 2, count)
    x = curve.value(u)
    x[:, 1, :, 1] += rise
    square = (x * x).sum(axis=-1)
    gap = square[:, 0, :, None] + square[:, 1, None, :] - 2 * x[:, 0] @ np.swapaxes(x[:, 1], -1, -2)
    best = np.stack(np.unravel_index(gap.reshape(ZONES, -1).argmin(axis=1), (count, count)), axis=-1)
    start = np.take_along_axis(u, best[..., None], axis=-1)[..., 0]
    return refine(curve, np.tile([0.0, rise, 0.0], (ZONES, 1)), start, window)


def refine(curve, shift, start, window, other=None):
    """Newton's method for local minima of the distance between a curve and shifted images of it, or of another one.

    Parameters
    ----------
    curve : CatmullRom
    shift : ndarray (K, 3)
        Where the image stands that the second point lies on.
    start : ndarray (K, 2)
        Parameters to start from.
    window : ndarray (K, 2, 2)
        First and last parameter allowed.
    other : CatmullRom, optional
        The curve of the second points; the same one if left out.

    Returns
    -------
    Approach
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
