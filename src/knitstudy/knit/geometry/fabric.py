"""A fabric: yarns as curves, where these cross, and where a load grips them.

Every specimen is one (`specimens`), and so are `pieces_of` any of them. Everything after the geometry reads curves,
crossings and grips; rows, columns and zones of crossings are labels for reports.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from knitstudy.knit.geometry.crossings import SAME, Crossings, find_crossings
from knitstudy.knit.geometry.loop import Loop
from knitstudy.knit.geometry.spline import Centreline
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints

NO_ARCS = np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class Grip:
    """Arcs of yarns that a load holds or drives; an arc without length is the end of a yarn."""

    yarn: Ints  # (k,)
    arc: Floats  # (k, 2) arc lengths between which a yarn is gripped. [m]
    side: Ints | None = None  # direction: only the half of the surface that looks there is gripped

    def of(self, yarn: int) -> Floats:
        """Return the gripped arcs (k, 2) of a yarn. [m]"""
        return self.arc[self.yarn == yarn]

    def holds(self, yarn: Ints, arc_length: Floats) -> Bools:
        """Return whether places (k,) on yarns (k,) are gripped; the ends of arcs are, whatever the rounding."""
        rounding = 1e-9 * self.arc.max(initial=0.0)
        s = np.asarray(arc_length)[:, None]
        here = (np.asarray(yarn)[:, None] == self.yarn) & (s >= self.arc[:, 0] - rounding)
        return (here & (s <= self.arc[:, 1] + rounding)).any(axis=1)


@dataclass(frozen=True, eq=False)
class Arcs:
    """Arcs of a fabric's yarns, and the crossings that lie on them."""

    crossing: Ints  # crossings of which both yarns are there, ascending
    yarn: Ints  # (A,) of every arc, ascending
    arc: Floats  # (A, 2) where it begins and ends; of a yarn ascending. [m]

    def piece(self, yarn: Ints, arc_length: Floats) -> Ints:
        """Return the arcs (k,) that places on yarns (k,) lie in, -1 where there is none."""
        inside = (yarn[:, None] == self.yarn) & (arc_length[:, None] > self.arc[:, 0])
        inside &= arc_length[:, None] < self.arc[:, 1]
        return np.where(inside.any(axis=1), inside.argmax(axis=1), -1)


@dataclass(frozen=True, eq=False)
class Fabric:
    """Yarns of one radius, as curves."""

    radius: float  # of the yarns. [m]
    clearance: float  # gap aimed at where yarns cross, in radii
    centrelines: tuple[Centreline, ...]  # of all Y yarns
    crossings: Crossings
    size: Floats  # lengths along x, y and z that strains refer to. [m]
    copy_of: Ints  # (Y,) the yarn that every yarn is a moved copy of; it may be itself
    shift: Floats  # (Y, 3) vector from that one to the copy. [m]
    specimen: str = "curves"  # what it was made as, and
    made_of: Mapping[str, Any] = field(default_factory=dict)  # of which numbers, by their names in a dataset
    # Held and driven, by the direction of the load (of a pair: by how it is supported).
    grips: Mapping[str, tuple[Grip, Grip]] = field(default_factory=dict)
    repeats: int = 1  # equally long parts with the same crossings that every yarn consists of
    # Distances along x and y after which the pattern repeats itself; nan if it does not. [m]
    cell: Floats = field(default_factory=lambda: np.full(2, np.nan))
    angle: float = 90.0  # between crossing yarns [degrees], for refined meshes; of a knit as if 90
    arcs: Arcs | None = None  # of pieces: the parts of another fabric's yarns that the yarns are
    # (p, 3) vectors by which an endless fabric repeats itself; none if it ends. [m]
    periods: Floats = field(default_factory=lambda: np.empty((0, 3)))
    loop: Loop | None = None  # of a knit
    sample: Fabric | None = None  # a smaller fabric, if any, in which yarns bend and meet as in this one

    @property
    def width(self) -> float:
        """Length along x that strains refer to. [m]"""
        return float(self.size[0])

    @property
    def height(self) -> float:
        """Length along y that strains refer to. [m]"""
        return float(self.size[1])

    @property
    def cells(self) -> tuple[int, int]:
        """Columns and rows of cells that crossings are labelled with."""
        return int(self.crossings.column.max()) + 1, int(self.crossings.row.max()) + 1

    def gripped_arcs(self, load: str | None) -> dict[int, Floats]:
        """Return the arcs (a, 2) by yarn along which a load grips yarns, without the ends of yarns. [m]"""
        pair = self.grips.get(load or "")
        if pair is None:
            return {}
        yarn, arc = (np.concatenate([getattr(grip, name) for grip in pair]) for name in ("yarn", "arc"))
        long = arc[:, 1] > arc[:, 0]
        return {number: arc[long & (yarn == number)] for number in np.unique(yarn[long]).tolist()}

    def grip_ends(self, load: str | None) -> dict[int, Floats]:
        """Return the arc lengths (k,) by yarn, ascending, at which grips begin or end inside yarns. [m]"""
        ends = {}
        for yarn, arcs in self.gripped_arcs(load).items():
            arc = np.unique(arcs)
            ends[yarn] = arc[(arc > 0) & (arc < self.centrelines[yarn].length)]
        return ends

    @cached_property
    def _places(self) -> dict[int, tuple[Floats, Floats]]:
        """Arc lengths (m,) and points (m, 3) at which each yarn, or one of its copies, is crossed, by yarn."""
        crossings = self.crossings
        places = {}
        yarn, s = crossings.yarn.ravel(), crossings.arc_length.ravel()
        middle = np.repeat(crossings.point.mean(axis=1), 2, axis=0) - self.shift[yarn]
        for number in np.unique(self.copy_of).tolist():
            here = np.flatnonzero(self.copy_of[yarn] == number)
            here = here[np.argsort(s[here], kind="stable")]
            here = here[np.diff(s[here], prepend=-np.inf) > SAME * self.radius]
            places[number] = s[here], middle[here]
        return places

    def places(self, yarn: int) -> tuple[Floats, Floats]:
        """Return where a yarn would be crossed if it had the neighbours of all of its copies.

        These are ascending arc lengths (m,) [m] and points (m, 3) [m] in the middle between the closest points of the
        two centrelines.
        """
        s, point = self._places[int(self.copy_of[yarn])]
        return s, point + self.shift[yarn]

    def places_of_a_repeat(self, yarn: int = 0) -> Floats:
        """Return the arc lengths (k,) of the places in the first of a yarn's repeats. [m]"""
        s = self.places(yarn)[0]
        return s[s < self.centrelines[yarn].length / self.repeats]


def of_curves(
    centrelines: Sequence[Centreline],
    radius: float,
    clearance: float = 0.0,
    size: Floats | None = None,
    copy_of: Ints | None = None,
    shift: Floats | None = None,
    **more: Any,
) -> Fabric:
    """Return a fabric of any curves, whose crossings are found; see `Fabric` for the arguments.

    Strains refer to the extent of the curves where no size is given.

    Examples
    --------
    >>> from knitstudy.knit.geometry.readers import centreline
    >>> low, high = (centreline(np.array([[-5, 0, z], [0, 0, z], [5, 0, z]]) * 1e-3) for z in (0, 2))
    >>> of_curves([low, high], radius=0.9e-3).radius
    0.0009
    """
    count = len(centrelines)
    copy_of = np.arange(count) if copy_of is None else copy_of
    shift = np.zeros((count, 3)) if shift is None else shift
    if size is None:
        points = np.concatenate([curve.curve.value(np.linspace(*curve.span, 100)) for curve in centrelines])
        size = np.ptp(points, axis=0)
    crossings = find_crossings(centrelines, radius, copy_of, shift)
    return Fabric(radius, clearance, tuple(centrelines), crossings, np.asarray(size), copy_of, shift, **more)


def pieces_of(fabric: Fabric, arcs: Arcs) -> Fabric:
    """Return arcs of a fabric's yarns as a fabric, each a yarn; nothing is gripped. Crossings keep order and labels."""
    lines = fabric.centrelines
    of = zip(arcs.yarn, arcs.arc, strict=True)
    crossings = fabric.crossings[arcs.crossing]
    piece = arcs.piece(crossings.yarn.ravel(), crossings.arc_length.ravel()).reshape(-1, 2)
    arc_length = crossings.arc_length - arcs.arc[piece, 0]
    return replace(
        fabric,
        centrelines=tuple(lines[yarn].part(low, high) for yarn, (low, high) in of),
        crossings=replace(crossings, yarn=piece, arc_length=arc_length),
        grips={},
        repeats=1,
        copy_of=np.arange(len(arcs.yarn)),
        shift=np.zeros((len(arcs.yarn), 3)),
        arcs=arcs,
        sample=fabric.sample or fabric,
    )
