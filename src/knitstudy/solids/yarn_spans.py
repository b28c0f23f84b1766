"""Where the spans of solid yarns end, and which degree they have: near crossings, on legs, where they are gripped."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knitstudy.geometry.arcs import head_arcs, sinker_arcs
from knitstudy.geometry.pair import YarnPair
from knitstudy.mesh.sampled import crossing_stations
from knitstudy.mesh.spacing import Spacing, place_slices

if TYPE_CHECKING:
    from knitstudy.geometry.pattern import Knit
    from knitstudy.study.scene import Scene

RAMP = 1.0
"""Distance over which spans grow beyond the reach of a crossing, over the yarn's radius."""

NONE = np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class YarnSpans:
    """The spans of one yarn.

    Attributes
    ----------
    breaks : ndarray, shape (E + 1,)
        Their ends [m].
    degrees : ndarray of int, shape (E,)
        p of each.
    sharp : ndarray of int
        Breaks at which a grip begins or ends.
    arcs : ndarray, shape (a, 2)
        Arc lengths between which it is gripped [m].
    """

    breaks: np.ndarray
    degrees: np.ndarray
    sharp: np.ndarray
    arcs: np.ndarray

    def gripped(self) -> np.ndarray:
        """Return which spans (E,) lie in the arcs."""
        middle = 0.5 * (self.breaks[1:] + self.breaks[:-1])[:, None]
        return np.any((middle > self.arcs[:, 0]) & (middle < self.arcs[:, 1]), axis=1)


def yarn_spans(scene: Scene, specimen: Knit | YarnPair) -> list[YarnSpans]:
    """Return the spans of every yarn: of all loops the same, but for the ends of arcs that are gripped."""
    curves, radius, keys = specimen.centrelines, specimen.radius, scene.mesh
    periods = 1 if isinstance(specimen, YarnPair) else specimen.loops
    stations, period = np.array(crossing_stations(specimen)), curves[0].length / periods
    reach = keys.crossing_reach * radius
    spacing = Spacing(
        keys.crossing_span * radius,
        keys.span / keys.crossing_span,
        tuple(stations.tolist()),
        period,
        reach=reach,
        ramp=RAMP * radius,
    )
    ends = np.linspace(0.0, curves[0].length, periods + 1)
    plain = _spans(ends, NONE, spacing, stations, period, reach, scene)
    arcs = _arcs(scene, specimen)
    return [
        _spans(ends, arcs[yarn], spacing, stations, period, reach, scene) if yarn in arcs else plain
        for yarn in range(len(curves))
    ]


def _arcs(scene: Scene, specimen: Knit | YarnPair) -> dict[int, np.ndarray]:
    """Return the arcs of yarns that are gripped along them."""
    if scene.specimen != "knit" or scene.load.direction == "course":
        return {}
    return {0: sinker_arcs(specimen), specimen.rows: head_arcs(specimen)}


def _spans(
    ends: np.ndarray,
    arcs: np.ndarray,
    spacing: Spacing,
    stations: np.ndarray,
    period: float,
    reach: float,
    scene: Scene,
) -> YarnSpans:
    """Return the spans of a yarn of loops that begin and end at `ends` and is gripped along `arcs`."""
    length = ends[-1]
    rounding = 1e-9 * length
    bounds = np.sort(np.concatenate([ends, arcs.ravel()]))
    bounds = bounds[np.diff(bounds, prepend=-length) > rounding]
    bounds[[0, -1]] = 0.0, length
    parts = [
        low + place_slices(high - low, lambda s, low=low: spacing(s + low))[:-1]
        for low, high in pairwise(bounds)
    ]
    breaks = np.append(np.concatenate(parts), length)
    around = (stations + period * np.arange(-1, len(ends) + 1)[:, None]).ravel()
    apart = np.maximum(np.maximum(breaks[:-1, None] - around, around - breaks[1:, None]), 0.0).min(axis=1)
    degrees = np.where(apart < reach, scene.mesh.crossing_degree, scene.mesh.degree)
    inner = arcs.ravel()[(arcs.ravel() > rounding) & (arcs.ravel() < length - rounding)]
    sharp = np.abs(breaks[:, None] - inner).argmin(axis=0) if len(inner) else np.empty(0, dtype=int)
    return YarnSpans(breaks, degrees, sharp, arcs)
