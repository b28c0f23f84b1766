"""Where the spans of solid yarns end, and which degree they have: near crossings, on legs, where they are gripped."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knitstudy.geometry.arcs import grip_ends, gripped_arcs
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
    spacing = Spacing(
        keys.crossing_span * radius,
        keys.span / keys.crossing_span,
        crossing_stations(specimen),
        curves[0].length / periods,
        reach=keys.crossing_reach * radius,
        ramp=RAMP * radius,
    )
    direction = scene.value("load.direction")
    arcs, ends = gripped_arcs(specimen, direction), grip_ends(specimen, direction)
    plain = _spans(periods, NONE, NONE.ravel(), spacing, scene)
    return [
        _spans(periods, arcs[yarn], ends[yarn], spacing, scene) if yarn in arcs else plain
        for yarn in range(len(curves))
    ]


def _spans(loops: int, arcs: np.ndarray, ends: np.ndarray, spacing: Spacing, scene: Scene) -> YarnSpans:
    """Return the spans of a yarn of loops, gripped along arcs (a, 2) that end inside it at ends (k,) [m]."""
    breaks = place_slices(loops * spacing.period, spacing, loops, ends=ends)
    around = (np.array(spacing.stations) + spacing.period * np.arange(-1, loops + 2)[:, None]).ravel()
    apart = np.maximum(np.maximum(breaks[:-1, None] - around, around - breaks[1:, None]), 0.0).min(axis=1)
    degrees = np.where(apart < spacing.reach, scene.mesh.crossing_degree, scene.mesh.degree)
    return YarnSpans(breaks, degrees, np.searchsorted(breaks, ends), arcs)
