"""Crossings of yarns, and closest points of two centrelines.

A crossing is a double point of the fabric's projection on the plane of x and y. The closest points of the two curves
near it are looked for in a window on both yarns, half way to the next crossings along the yarn. From the closest
samples Newton's method finds the true minimum: with samples alone F_Distance (Eq. 2) would have kinks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.spline import CatmullRom, Centreline, RowCurves
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.batches import Chosen

PLANE_SAMPLES = 10  # a Bezier segment, between which crossings in the plane are looked for
SAMPLES = 20  # a Bezier segment, the closest of which start Newton's method
ROUNDING = 1e-9  # share of the distance of two samples within which a crossing in the plane is at one of them
ALONG = [0, 3, 1, 2]  # place of every zone in the order in which a yarn passes them
REACH = 3.0  # distance of centrelines over the radius beyond which two yarns pass each other without meeting
SAME = 1e-6  # length over the radius within which two places on a yarn are one

NEWTON_STEPS = 25
HALVINGS = 6
LEVEL = 1e-12  # relative growth of a squared distance that is rounding
SMALLEST = 1e-8  # curvature of a squared distance over the squared speed
CONVERGED = 1e-11  # step of a parameter after which the next one would be its square


# ---- Crossings of a fabric


@dataclass(frozen=True, eq=False)
class Crossings(Chosen):
    """The K crossings of a fabric, each of two yarns: sides 0 and 1."""

    row: Ints  # (K,) labels: the cell's row and column, and the place in the cell
    column: Ints
    zone: Ints
    yarn: Ints  # (K, 2)
    arc_length: Floats  # (K, 2) of the closest points along their yarns. [m]
    point: Floats  # (K, 2, 3) the closest points of the two centrelines. [m]
    distance: Floats  # (K,) distance of the two. [m]

    def __len__(self) -> int:
        return len(self.distance)

    @property
    def normal(self) -> Floats:
        """Unit vectors (K, 3) from the closest point of side 0 to that of side 1; normal to both centrelines."""
        return (self.point[:, 1] - self.point[:, 0]) / self.distance[:, None]

    @classmethod
    def of_variables(cls, data: Mapping[str, Floats]) -> Crossings:
        """Return the crossings of variables that `variables` gave."""
        labels = [data[name].astype(int) for name in ("row", "column", "zone", "yarn")]
        return cls(*labels, *(data[name] for name in ("arc_length", "point_of_contact", "distance")))

    def variables(self) -> dict[str, Any]:
        """Return the crossings by the names of their variables in a file."""
        names = ("row", "column", "zone", "yarn", "arc_length", "distance")
        return {name: getattr(self, name) for name in names} | {"point_of_contact": self.point}


def find_crossings(curves: Sequence[Centreline], radius: float, copy_of: Ints, shift: Floats) -> Crossings:
    """Return the crossings of yarns of a radius [m], also of a yarn with itself.

    Labels are the number of the first yarn, 0, and the number along it. Each yarn (Y,) is the copy of a yarn, itself or
    another one, moved by a shift (Y, 3) [m]. Copies share their places: pairs that stand alike are looked at once, and
    where one copy is crossed, a window ends on all of them.
    """
    polylines = [_polyline(curve) for curve in curves]
    low, high = (np.array([bound(points, axis=0) for _, points in polylines]) for bound in (np.min, np.max))
    overlap = (np.maximum(low[:, None], low) <= np.minimum(high[:, None], high)).all(axis=-1)
    alike: dict[tuple[Any, ...], list[tuple[int, int]]] = {}
    for first, second in np.argwhere(np.triu(overlap)).tolist():
        step = np.rint((shift[second] - shift[first]) / (SAME * radius)).astype(int)
        key = (int(copy_of[first]), int(copy_of[second]), *step.tolist(), first == second)
        alike.setdefault(key, []).append((first, second))
    # Parts of one curve that cross are no neighbours.
    in_plane = {
        key: plane_crossings(polylines[first], polylines[second], apart=2 if first == second else None)
        for key, ((first, second), *_) in alike.items()
    }
    places = _places(in_plane)
    label = np.empty(0, int)
    places_of = np.empty((0, 2))
    none = Crossings(label, label, label, places_of.astype(int), places_of, np.empty((0, 2, 3)), np.empty(0))
    crossings: list[Crossings] = []
    for key, pairs in alike.items():
        one_curve, other = (curves[number] for number in pairs[0])
        one = _near(one_curve, other, in_plane[key], places[key[0]], places[key[1]])
        one = one[one.distance <= REACH * radius]
        if one_curve is other:  # pieces of a yarn within half a turn are neighbours
            one = one[np.diff(one.arc_length, axis=1)[:, 0] > np.pi * radius]
        for pair in pairs:
            yarn = np.array(pair)[one.yarn]
            by = shift[pair[0]] - shift[pairs[0][0]]
            crossings.append(replace(one, row=yarn[:, 0], yarn=yarn, point=one.point + by))
    return none.joined(*crossings)


def _polyline(curve: Centreline) -> tuple[Floats, Floats]:
    """Samples of a curve in the plane: parameters (n,) and points (n, 2)."""
    low, high = curve.span
    inner = np.arange(np.floor(low * PLANE_SAMPLES) + 1, np.ceil(high * PLANE_SAMPLES)) / PLANE_SAMPLES
    u = np.concatenate([[low], inner, [high]])
    return u, curve.curve.value(u)[:, :2]


def _places(in_plane: dict[tuple[Any, ...], Floats]) -> dict[int, Floats]:
    """Ascending parameters at which each curve, or one of its periodic copies, is crossed, by curve number."""
    every: dict[int, list[Floats]] = {}
    for key, crossed in in_plane.items():
        for side in (0, 1):
            every.setdefault(key[side], []).append(crossed[:, side])
    places = {number: np.sort(np.concatenate(parts)) for number, parts in every.items()}
    return {number: u[np.diff(u, prepend=-np.inf) > 10 * ROUNDING] for number, u in places.items()}


def _near(first: Centreline, second: Centreline, u: Floats, *places: Floats) -> Crossings:
    """Crossings of two yarns, numbered 0 and 1, near parameters (k, 2) at which they cross in the plane."""
    pair = first, second
    windows = np.stack([_half_way(u[:, i], places[i], pair[i].span) for i in (0, 1)], axis=1)
    if first is second:  # the closest samples in the windows would be neighbours
        closest = refine(first.curve, second.curve, u, windows)
    else:
        closest = closest_points(first.curve, second.curve, windows)
    none = np.zeros(len(u), dtype=int)
    arc_length = np.column_stack([pair[i].arc_length(closest.parameter[:, i]) for i in (0, 1)])
    yarn = np.tile([0, 1], (len(u), 1))
    return Crossings(none, none, np.arange(len(u)), yarn, arc_length, closest.point, closest.distance)


def _half_way(u: Floats, places: Floats, ends: tuple[float, float]) -> Floats:
    """Windows (k, 2) around places at u (k,): half way to the neighbours among all places of a curve, or its ends."""
    middles = np.concatenate([ends[:1], 0.5 * (places[1:] + places[:-1]), ends[1:]])
    at = np.searchsorted(places, u - 10 * ROUNDING)
    return np.column_stack([middles[at], middles[at + 1]])


# ---- Crossings in the plane


def plane_crossings(
    first: tuple[Floats, Floats], second: tuple[Floats, Floats], apart: int | None = None
) -> Floats:
    """Parameters (k, 2) at which two polylines, parameters (n,) and samples (n, 2), cross in the plane.

    Where both are the same line, the two segments that cross are so many `apart` at least, the second one ahead.

    Examples
    --------
    >>> along, up = np.array([[0.0, 1.0], [4.0, 1.0]]), np.array([[1.0, 0.0], [1.0, 4.0]])
    >>> plane_crossings((np.array([0.0, 1.0]), along), (np.array([0.0, 1.0]), up)).tolist()
    [[0.25, 0.25]]
    """
    # Imported here: a fabric that is read from a file has its crossings, and needs no tree.
    from scipy.spatial import cKDTree

    (u, a), (v, b) = first, second
    da, db = np.diff(a, axis=0), np.diff(b, axis=0)
    longest = max(np.linalg.norm(step, axis=1).max() for step in (da, db))
    middles = [cKDTree(line[:-1] + 0.5 * step) for line, step in ((a, da), (b, db))]
    near = middles[0].sparse_distance_matrix(middles[1], longest, output_type="coo_matrix")
    i, j = near.row, near.col
    if apart is not None:
        ahead = j >= i + apart
        i, j = i[ahead], j[ahead]
    offset = b[j] - a[i]
    det = _cross(da[i], db[j])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.stack([_cross(offset, db[j]) / det, _cross(offset, da[i]) / det], axis=-1)
    here = ((share > -ROUNDING) & (share < 1 + ROUNDING)).all(axis=-1)
    i, j, share = i[here], j[here], share[here]
    crossed = np.column_stack([u[i] + share[:, 0] * np.diff(u)[i], v[j] + share[:, 1] * np.diff(v)[j]])
    # A crossing at a sample is found on both sides of it.
    _, first_of_equals = np.unique(np.rint(crossed / (10 * ROUNDING)), axis=0, return_index=True)
    return crossed[first_of_equals]


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def windows_of_loop(loop: Any) -> tuple[Ints, Floats, Floats]:
    """Return where r rows of k loops cross in the plane: lower rows, parameters, and windows for the closest points.

    These are the lower row (4 r k,) of every crossing, its parameters (4 r k, 2) on the lower and the upper row, and
    the first and the last parameter (4 r k, 2, 2) of a window on both. In a loop the yarns of a row and of the row
    above cross four times: zones 0 left lower, 1 right lower, 2 left upper, 3 right upper; along both yarns 0, 2, 3, 1.
    Crossings are ordered by row, column and zone.
    Raises GeometryError when rows do not cross four times in a loop, in this order.
    """
    period = loop.curve.period
    half = period * PLANE_SAMPLES // 2
    u = np.arange(-half, 3 * half + 1) / PLANE_SAMPLES
    lines = [curve.value(u)[:, :2] for curve in loop.curves]
    one = slice(half, -half)
    every = []
    for lower, upper in zip(lines, [*lines[1:], lines[0] + (loop.rows * loop.rise)[:2]], strict=True):
        crossed = plane_crossings((u[one], lower[one]), (u, upper))
        crossed = crossed[np.argsort(crossed[:, 0], kind="stable")]
        times = f"{len(crossed)} times in {loop.columns} loops"
        fact = f"pattern.control_points: the yarns of neighbouring rows cross {times}"
        if len(crossed) != 4 * loop.columns:
            raise GeometryError(f"{fact}: allowed is 4 crossings a loop")
        if (np.diff(crossed[:, 1]) <= 0).any():
            turned = "a loop turns until its legs pass each other; take a larger pattern.wale_spacing"
            raise GeometryError(f"{fact}, not in the same order along both: {turned}")
        every.append(crossed.reshape(-1, 4, 2)[:, ALONG].reshape(-1, 2))
    windows = []
    for row, here in enumerate(every):
        # A yarn is the lower one of the row above it and the upper one of the row below: eight crossings a loop.
        sides = []
        for side, other in ((0, row - 1), (1, (row + 1) % loop.rows)):
            both = np.concatenate([here[:, side], every[other][:, 1 - side]])
            places = np.sort(np.concatenate([both - period, both, both + period]))
            sides.append(_half_way(here[:, side], places, (-np.inf, np.inf)))
        windows.append(np.stack(sides, axis=1))
    return np.repeat(np.arange(loop.rows), 4 * loop.columns), np.concatenate(every), np.concatenate(windows)


def crossings_of_loop(
    loop: Any, row: Ints, windows: Floats, samples: int = SAMPLES, start: Floats | None = None
) -> Approach:
    """Closest points of rows (K,) of a repeat's loops and the rows above in windows (K, 2, 2), from a start (K, 2)."""
    images = [loop.image(row) for row in range(loop.rows + 1)]
    if start is None:
        by_row = [
            closest_points(images[lower], images[lower + 1], windows[row == lower], samples)
            for lower in range(loop.rows)
        ]
        return by_row[0].joined(*by_row[1:])
    points = np.concatenate([image.control_points for image in images])
    lower, upper = (RowCurves(points, loop.advance, len(images), row + side) for side in (0, 1))
    return refine(lower, upper, start, windows)


# ---- Closest points of two curves


@dataclass(frozen=True)
class Approach(Chosen):
    """Closest points of two curves, K times."""

    parameter: Floats  # (K, 2) of the curves
    point: Floats  # (K, 2, 3)
    distance: Floats  # (K,)
    interior: Bools  # (K,) False on the bound of a window: there is no closest approach in it


def closest_points(
    first: CatmullRom, second: CatmullRom, windows: Floats, samples: int = SAMPLES
) -> Approach:
    """Closest points of two curves in windows (K, 2, 2) of their parameters, from samples a Bezier segment."""
    start = np.empty(windows.shape[:2])
    for k, window in enumerate(windows):
        u, v = (np.linspace(low, high, int(np.ceil((high - low) * samples)) + 1) for low, high in window)
        x, y = first.value(u), second.value(v)
        square = (x * x).sum(axis=1)[:, None] + (y * y).sum(axis=1) - 2 * x @ y.T
        i, j = np.unravel_index(square.argmin(), square.shape)
        start[k] = u[i], v[j]
    return refine(first, second, start, windows)


def refine(
    first: CatmullRom, second: CatmullRom, start: Floats, windows: Floats, shift: Any = 0.0
) -> Approach:
    """Newton's method for local minima of the distance of two curves.

    From parameters (K, 2) it finds minima in windows (K, 2, 2), first and last parameter allowed. The second curve may
    be moved by shifts (K, 3) [m].
    """
    curves = (first, second)
    u = start.copy()
    low, high = windows[..., 0], windows[..., 1]
    value, step = _half_square(curves, shift, u, low, high)
    active = np.ones(len(u), dtype=bool)
    for _ in range(NEWTON_STEPS):
        step = np.where(active[:, None], step, 0.0)
        for _ in range(HALVINGS):
            trial = np.clip(u + step, low, high)
            lower, following = _half_square(curves, shift, trial, low, high)
            worse = lower > value * (1 + LEVEL)
            if not worse.any():
                break
            step = np.where(worse[:, None], 0.5 * step, step)
        u = np.where(worse[:, None], u, trial)
        active &= ~worse & (np.abs(step).max(axis=1) > CONVERGED)
        if not active.any():
            break
        value, step = lower, following
    point = np.stack([first.value(u[:, 0]), second.value(u[:, 1]) + shift], axis=1)
    interior = ((u > low + 1e-9) & (u < high - 1e-9)).all(axis=1)
    return Approach(u, point, np.linalg.norm(point[:, 1] - point[:, 0], axis=-1), np.asarray(interior))


def _half_square(
    curves: tuple[CatmullRom, CatmullRom], shift: Any, u: Floats, low: Floats, high: Floats
) -> tuple[Floats, Floats]:
    """Half the squared distance (K,) at u (K, 2), and a step (K, 2) that lowers it, within bounds."""
    (a, ta, da), (b, tb, db) = (curve.jet(u[:, side]) for side, curve in enumerate(curves))
    apart = a - b - shift
    gradient = np.stack([np.vecdot(apart, ta), -np.vecdot(apart, tb)], axis=-1)
    mixed = -np.vecdot(ta, tb)
    saa = np.vecdot(ta, ta)
    sbb = np.vecdot(tb, tb)
    haa = saa + np.vecdot(apart, da)
    hbb = sbb - np.vecdot(apart, db)
    # Newton's method with the sizes of the eigenvalues, so that it leads down everywhere.
    sizes, vectors = np.linalg.eigh(np.stack([haa, mixed, mixed, hbb], axis=-1).reshape(-1, 2, 2))
    sizes = np.maximum(np.abs(sizes), SMALLEST * (saa + sbb)[:, None])
    newton = -np.vecmat(np.vecmat(gradient, vectors) / sizes, vectors.mT)
    # To the first bound in its way; where it stands there, each parameter goes its own way.
    room = np.where(newton > 0, high - u, low - u)
    ratio = np.where(np.abs(newton) > np.abs(room), room, newton) / np.where(newton == 0, 1.0, newton)
    ratio = np.where(newton == 0, 1.0, ratio).min(axis=1, keepdims=True)
    alone = -gradient / np.maximum(np.abs(np.stack([haa, hbb], axis=-1)), SMALLEST * (saa + sbb)[:, None])
    alone = np.clip(u + alone, low, high) - u
    return 0.5 * np.vecdot(apart, apart), np.where(ratio == 0, alone, ratio * newton)


def tied_crossings(crossings: Crossings, touches: bool, edges: str | None, direction: str | None) -> Bools:
    """Return which crossings (K,) of a specimen are tied.

    With interaction "tie" all are. Where yarns touch, those along the free edges of a knit are, for what would slide
    off there: of the first and last interlock row in course tension, of the first and last column of loops in wale
    tension.

    `touches` says whether yarns touch where they are not tied; `edges` and `direction` are ``contact.tied_edges`` and
    ``load.direction``, if the scene has them.
    """
    if not touches:
        return np.ones(len(crossings), dtype=bool)
    if direction is None or edges != "outer":
        return np.zeros(len(crossings), dtype=bool)
    along = crossings.row if direction == "course" else crossings.column
    return (along == along.min()) | (along == along.max())
