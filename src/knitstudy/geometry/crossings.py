"""Crossings of yarns: where two centrelines cross in the plane of the fabric, and their closest points there.

A crossing is a double point of the fabric's projection on the plane of x and y. The closest points of the two curves
near it are found by Newton's method, started from the closest samples; near it means half way to the next crossings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from knitstudy.geometry.closest import PLANE_SAMPLES, ROUNDING, plane_crossings, refine
from knitstudy.geometry.spline import CatmullRom, Centreline

SAMPLES = 20
"""Samples a Bezier segment among which the closest ones start Newton's method."""

REACH = 3.0
"""Distance of centrelines over the radius beyond which two yarns pass each other without meeting."""

SAME = 1e-6
"""Length over the radius within which two places on a yarn are one."""


@dataclass(frozen=True, eq=False)
class Crossings:
    """The K crossings of a fabric, each of two yarns: sides 0 and 1.

    Attributes
    ----------
    row, column, zone : ndarray of int (K,)
        Labels: the cell, and the place in the cell.
    yarn : ndarray of int (K, 2)
    arc_length : ndarray (K, 2)
        Of the closest points along their yarns. [m]
    point : ndarray (K, 2, 3)
        The closest points of the two centrelines. [m]
    distance : ndarray (K,)
        Distance of the two. [m]
    """

    row: np.ndarray
    column: np.ndarray
    zone: np.ndarray
    yarn: np.ndarray
    arc_length: np.ndarray
    point: np.ndarray
    distance: np.ndarray

    def __len__(self) -> int:
        return len(self.distance)

    def chosen(self, index: np.ndarray) -> Crossings:
        """Return the crossings at an index or mask."""
        return Crossings(*(getattr(self, field.name)[index] for field in fields(self)))

    def labelled(self, row: np.ndarray, column: np.ndarray, zone: np.ndarray) -> Crossings:
        """Return the crossings with these labels (K,), in their order."""
        return replace(self, row=row, column=column, zone=zone).chosen(np.lexsort((zone, column, row)))

    def variables(self) -> dict[str, Any]:
        """Return the crossings as variables of a dataset, by name."""
        one = {"units": "1"}
        return {
            "row": (("crossing",), self.row, one),
            "column": (("crossing",), self.column, one),
            "zone": (("crossing",), self.zone, one),
            "yarn": (("crossing", "side"), self.yarn, one),
            "arc_length": (("crossing", "side"), self.arc_length, metre("along the yarn")),
            "point_of_contact": (("crossing", "side", "xyz"), self.point, metre("closest points")),
            "distance": (("crossing",), self.distance, metre("shortest distance of the centrelines")),
        }


def metre(long_name: str) -> dict[str, str]:
    """Return the attributes of a length."""
    return {"units": "m", "long_name": long_name}


def find_crossings(
    curves: Sequence[Centreline], radius: float, copy_of: np.ndarray, shift: np.ndarray
) -> Crossings:
    """Return the crossings of yarns of a radius [m], also of a yarn with itself.

    Labels are the number of the first yarn, 0, and the number along it.

    Parameters
    ----------
    curves : sequence of Centreline
    radius : float
    copy_of : ndarray of int (Y,)
        The yarn that each yarn is a moved copy of. Copies share their places: pairs that stand alike are looked at
        once, and where one copy is crossed, a window ends on all of them.
    shift : ndarray (Y, 3)
        Vector from that yarn to the copy. [m]
    """
    polylines = [_Polyline.of(curve) for curve in curves]
    alike: dict[tuple[Any, ...], list[tuple[int, int]]] = {}
    for first in range(len(curves)):
        for second in range(first, len(curves)):
            if polylines[first].meets(polylines[second]):
                step = np.rint((shift[second] - shift[first]) / (SAME * radius)).astype(int)
                key = (int(copy_of[first]), int(copy_of[second]), *step.tolist(), first == second)
                alike.setdefault(key, []).append((first, second))
    in_plane = {key: _in_plane(polylines, *pairs[0]) for key, pairs in alike.items()}
    places = _places(in_plane)
    found = []
    for key, pairs in alike.items():
        first, second = (curves[number] for number in pairs[0])
        u, distance = _closest(first, second, in_plane[key], (places.get(key[0]), places.get(key[1])))
        one = _of_pair(first, second, u[distance <= REACH * radius])
        if first is second:  # pieces of a yarn within half a turn are neighbours
            one = one.chosen(np.diff(one.arc_length, axis=1)[:, 0] > np.pi * radius)
        found += [_moved(one, pair, shift[pair[0]] - shift[pairs[0][0]]) for pair in pairs]
    return _joined(found)


def _closest(
    first: Centreline, second: Centreline, u: np.ndarray, places: Sequence[np.ndarray | None]
) -> tuple[np.ndarray, np.ndarray]:
    """Return parameters (k, 2) and distances (k,) of closest points near crossings in the plane at parameters (k, 2).

    Curves that repeat themselves in step are looked at where they first cross in each way.
    """
    if not len(u):
        return u, np.empty(0)
    curves = first.curve, second.curve
    in_step = curves[0].period == curves[1].period and np.allclose(curves[0].advance, curves[1].advance)
    turns = curves[0].period * np.floor(u[:, :1] / curves[0].period) * in_step
    _, one, of = np.unique(np.rint((u - turns) / SAME), axis=0, return_index=True, return_inverse=True)
    windows = np.stack(
        [_windows(u[one, side], places[side], (first, second)[side]) for side in (0, 1)], axis=1
    )
    # In the windows of a yarn that crosses itself the closest samples are neighbours.
    start = u[one] if first is second else _closest_samples(*curves, windows)
    found = refine(curves[0], np.zeros((len(start), 3)), start, windows, curves[1])
    of = of.ravel()
    return (found.parameter - turns[one])[of] + turns, found.distance[of]


@dataclass(frozen=True, eq=False)
class _Polyline:
    """Samples of a curve in the plane: parameters (n,) and points (n, 2), and the corners of their bounding box."""

    u: np.ndarray
    points: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, curve: Centreline) -> _Polyline:
        low, high = curve.span
        inner = np.arange(np.floor(low * PLANE_SAMPLES) + 1, np.ceil(high * PLANE_SAMPLES)) / PLANE_SAMPLES
        u = np.concatenate([[low], inner, [high]])
        points = curve.curve.value(u)[:, :2]
        return cls(u, points, points.min(axis=0), points.max(axis=0))

    def meets(self, other: _Polyline) -> bool:
        """Whether the bounding boxes overlap."""
        return bool(np.all(np.maximum(self.low, other.low) <= np.minimum(self.high, other.high)))


def _in_plane(polylines: list[_Polyline], first: int, second: int) -> np.ndarray:
    """Return parameters (k, 2) at which two curves, or parts of one that are no neighbours, cross in the plane."""
    a, b = polylines[first], polylines[second]
    return plane_crossings(a.u, a.points, b.u, b.points, apart=2 if first == second else None)


def _places(in_plane: dict[tuple[Any, ...], np.ndarray]) -> dict[int, np.ndarray]:
    """Return the parameters, ascending, at which a curve or a copy of it is crossed, by the number of the curve."""
    every: dict[int, list[np.ndarray]] = {}
    for key, found in in_plane.items():
        for side in (0, 1):
            every.setdefault(key[side], []).append(found[:, side])
    return {number: _apart(np.sort(np.concatenate(each)), 10 * ROUNDING) for number, each in every.items()}


def _apart(places: np.ndarray, least: float) -> np.ndarray:
    """Return ascending places (m,) without those that another one lies less than `least` before."""
    return places[np.diff(places, prepend=-np.inf) > least]


def _windows(u: np.ndarray, places: np.ndarray, curve: Centreline) -> np.ndarray:
    """Return parameters (k, 2): half way to the neighbours among all places of a curve."""
    middles = np.concatenate([curve.span[:1], 0.5 * (places[1:] + places[:-1]), curve.span[1:]])
    at = np.searchsorted(places, u - 10 * ROUNDING)
    return np.column_stack([middles[at], middles[at + 1]])


def _closest_samples(first: CatmullRom, second: CatmullRom, windows: np.ndarray) -> np.ndarray:
    """Return the parameters (k, 2) of the closest samples in windows (k, 2, 2)."""
    start = np.empty(windows.shape[:2])
    for k, (here, there) in enumerate(windows):
        u, v = (np.linspace(*each, int(np.ceil(np.ptp(each) * SAMPLES)) + 1) for each in (here, there))
        x, y = first.value(u), second.value(v)
        square = (x * x).sum(axis=1)[:, None] + (y * y).sum(axis=1) - 2 * x @ y.T
        i, j = np.unravel_index(square.argmin(), square.shape)
        start[k] = u[i], v[j]
    return start


def _of_pair(first: Centreline, second: Centreline, u: np.ndarray) -> Crossings:
    """Return the crossings of two yarns, numbered 0 and 1, at parameters (k, 2) of their curves."""
    count, curves = len(u), (first, second)
    point = np.stack([each.curve.value(u[:, side]) for side, each in enumerate(curves)], axis=1)
    return Crossings(
        row=np.zeros(count, dtype=int),
        column=np.zeros(count, dtype=int),
        zone=np.arange(count),
        yarn=np.tile([0, 1], (count, 1)),
        arc_length=np.column_stack([each.arc_length(u[:, side]) for side, each in enumerate(curves)]),
        point=point,
        distance=np.linalg.norm(point[:, 1] - point[:, 0], axis=1),
    )


def _moved(found: Crossings, pair: tuple[int, int], by: np.ndarray) -> Crossings:
    """Return crossings as those of another pair of yarns that stands alike, moved by a vector (3,)."""
    yarns = np.array(pair)[found.yarn]
    return replace(found, row=yarns[:, 0], yarn=yarns, point=found.point + by)


def _joined(parts: list[Crossings]) -> Crossings:
    if not parts:
        none = np.empty(0, dtype=int)
        return Crossings(
            none, none, none, np.empty((0, 2), int), np.empty((0, 2)), np.empty((0, 2, 3)), np.empty(0)
        )
    return Crossings(
        *(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Crossings))
    )
