"""Arcs of yarns: pieces that are cut out of a knit, and arcs that are gripped."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from knitstudy.geometry.pattern import Crossings, Knit
from knitstudy.geometry.spline import Centreline
from knitstudy.geometry.yarn_spacing import ZONES

# ---- Pieces of a knit's yarns as a specimen of their own, whose yarns are the pieces


@dataclass(frozen=True, eq=False)
class Arcs:
    """Which arcs of a knit's yarns are pieces, and the crossings that lie on them.

    Attributes
    ----------
    crossing : ndarray of int, shape (V,)
        Crossings of which both yarns are there, ascending.
    yarn : ndarray of int, shape (P,)
        Yarn of every arc, ascending.
    arc : ndarray, shape (P, 2)
        Where it begins and ends [m]; of a yarn ascending.
    """

    crossing: np.ndarray
    yarn: np.ndarray
    arc: np.ndarray

    def piece(self, yarn: np.ndarray, arc_length: np.ndarray) -> np.ndarray:
        """Return the arcs (k,) that places on yarns (k,) lie in, -1 where there is none."""
        inside = (yarn[:, None] == self.yarn) & (arc_length[:, None] > self.arc[:, 0])
        inside &= arc_length[:, None] < self.arc[:, 1]
        return np.where(inside.any(axis=1), inside.argmax(axis=1), -1)


@dataclass(frozen=True, eq=False)
class Arc:
    """A part of a centreline, with arc lengths of its own.

    Attributes
    ----------
    line : Centreline
    start, length : float
        Where it begins, and how long it is [m].
    """

    line: Centreline
    start: float
    length: float

    @property
    def curve(self):
        """Curve of the whole centreline, whose parameters `parameter` returns."""
        return self.line.curve

    def position(self, s: np.ndarray) -> np.ndarray:
        """Return points (k, 3) at arc lengths (k,) of this arc [m]."""
        return self.line.position(self.start + s)

    def tangent(self, s: np.ndarray) -> np.ndarray:
        """Return unit tangents (k, 3)."""
        return self.line.tangent(self.start + s)

    def parameter(self, s: np.ndarray) -> np.ndarray:
        """Return parameters (k,) of the curve."""
        return self.line.parameter(self.start + s)


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of yarns as a specimen: `radius`, `centrelines` and `crossings` as a knit has them.

    Attributes
    ----------
    knit : Knit
    arcs : Arcs
    """

    knit: Knit
    arcs: Arcs

    @property
    def radius(self) -> float:
        """Radius of the yarn [m]."""
        return self.knit.radius

    @cached_property
    def centrelines(self) -> tuple[Arc, ...]:
        """Of every piece."""
        lines = self.knit.centrelines
        return tuple(
            Arc(lines[yarn], low, high - low)
            for yarn, (low, high) in zip(self.arcs.yarn, self.arcs.arc, strict=True)
        )

    @cached_property
    def crossings(self) -> Crossings:
        """Crossings of the pieces, in the order of the knit, with pieces instead of yarns."""
        every, arcs = self.knit.crossings, self.arcs
        chosen = {name: getattr(every, name)[arcs.crossing] for name in Crossings.__dataclass_fields__}
        yarn, s = chosen["yarn"], chosen["arc_length"]
        piece = arcs.piece(yarn.ravel(), s.ravel()).reshape(yarn.shape)
        return replace(Crossings(**chosen), yarn=piece, arc_length=s - arcs.arc[piece, 0])

    def stations(self, piece: int) -> np.ndarray:
        """Return the ascending arc lengths (k,) of a piece's crossings [m]."""
        crossings = self.crossings
        return np.sort(crossings.arc_length[crossings.yarn == piece])


# ---- Cells cut out of a knit: the outer yarns end in the middles of their legs, so that all cells are alike
# A knit of m rows of interlocks has m + 1 whole yarns, of which the first is held by heads alone and the last by
# sinkers
# alone. Of m rows of cells, the yarn below has nothing but heads, each on the halves of its two legs, and the
# yarn above
# nothing but sinkers: each cell has as much yarn as one of an endless knit.


LEFT, RIGHT = [0, 2], [1, 3]
"""Zones of a cell."""

ABOVE, BELOW = 0, 1
"""Side that a yarn has at its crossings with the row above and with the row below."""


def cut_rows(knit: Knit) -> Arcs:
    """Return what is left of a knit's yarns: arches of the first one, whole ones, sinkers of the last one."""
    legs, length = middles_of_legs(knit), knit.centrelines[0].length
    sinkers = np.column_stack([np.append(0.0, legs[:, 1]), np.append(legs[:, 0], length)])
    whole = np.tile([0.0, length], (knit.rows - 1, 1))
    counts = [len(legs), *[1] * (knit.rows - 1), len(sinkers)]
    return Arcs(
        crossing=np.arange(len(knit.crossings.row)),
        yarn=np.repeat(np.arange(knit.rows + 1), counts),
        arc=np.concatenate([legs, whole, sinkers]),
    )


def middles_of_legs(knit: Knit) -> np.ndarray:
    """Return the arc lengths (n, 2) of the middles of both legs of every loop of a yarn [m].

    A leg runs from the crossings with the row below to those with the row above; all yarns have one shape.
    """
    crossings = knit.crossings
    at = crossings.arc_length[crossings.row == 0].reshape(knit.loops, ZONES, 2)
    up = at[:, LEFT, BELOW].max(axis=1) + at[:, LEFT, ABOVE].min(axis=1)
    down = at[:, RIGHT, ABOVE].max(axis=1) + at[:, RIGHT, BELOW].min(axis=1)
    return 0.5 * np.column_stack([up, down])


# ---- Sinker arcs and head arcs: where a knit is gripped in wale tension


LEFT_LOWER, RIGHT_LOWER, LEFT_UPPER, RIGHT_UPPER = range(ZONES)


def sinker_arcs(knit):
    """Arc lengths between which a yarn runs along the bottom of its loops: (n + 1, 2), m.

    From the last crossing of a loop with the row below to the first one of the next loop; at the yarn's ends, in the
    middles of sinkers, half of it. The bottom yarn, which crosses none below, has its arcs where the others have
    theirs: all yarns have one shape.

    Parameters
    ----------
    knit : Knit
    """
    first, last = (_along(knit, 1, zones) for zones in ((LEFT_LOWER, LEFT_UPPER), (RIGHT_LOWER, RIGHT_UPPER)))
    length = knit.centrelines[0].length
    return np.column_stack([np.append(0.0, last[:, 1]), np.append(first[:, 0], length)])


def head_arcs(knit):
    """Arc lengths between which a yarn runs along the top of its loops, from its left to its right crossing: (n, 2), m.

    Parameters
    ----------
    knit : Knit
    """
    left, right = (_along(knit, 0, zones) for zones in ((LEFT_LOWER, LEFT_UPPER), (RIGHT_LOWER, RIGHT_UPPER)))
    return np.column_stack([left[:, 1], right[:, 0]])


def gripped_arcs(specimen, direction):
    """Arcs (a, 2) [m] along which yarns are gripped, by yarn: in wale tension of a knit the first and the last one.

    In course tension a knit is gripped at the ends of its yarns, a pair is in ways of its own: there are none.

    Parameters
    ----------
    specimen : Knit or YarnPair
    direction : str or None
        Of the load; a pair has none.
    """
    if direction != "wale":
        return {}
    return {0: sinker_arcs(specimen), specimen.rows: head_arcs(specimen)}


def grip_ends(knit, direction):
    """Arc lengths (k,) [m] by yarn, ascending, at which a grip of `gripped_arcs` begins or ends inside it."""
    length = knit.centrelines[0].length
    arcs = {yarn: each.ravel() for yarn, each in gripped_arcs(knit, direction).items()}
    return {yarn: np.sort(each[(each > 0) & (each < length)]) for yarn, each in arcs.items()}


def inside(arc_length, arcs):
    """Whether arc lengths (k,) lie in arcs (a, 2), ends included: bool (k,).

    A joint at the end of an arc lies in it, whatever rounding says.
    """
    rounding = 1e-9 * arcs.max()
    at = np.asarray(arc_length)[:, None]
    return np.any((at >= arcs[:, 0] - rounding) & (at <= arcs[:, 1] + rounding), axis=1)


def _along(knit, side, zones):
    """Arc lengths (n, 2), ascending, of two crossings of every loop of a yarn; side 1: with the row below."""
    crossings = knit.crossings
    here = (crossings.row == 0) & np.isin(crossings.zone, zones)
    return np.sort(crossings.arc_length[here, side].reshape(knit.loops, 2), axis=1)
