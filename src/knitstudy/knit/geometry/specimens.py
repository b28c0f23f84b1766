"""Specimens of knits, whole, cut or endless, and pairs of yarns that cross.

Zones of a cell: 0 left lower, 1 right lower, 2 left upper, 3 right upper. Side 0 of a crossing is the yarn of the lower
row, side 1 the one above.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.crossings import ALONG, Crossings
from knitstudy.knit.geometry.fabric import Arcs, Fabric, Grip, of_curves, pieces_of
from knitstudy.knit.geometry.loop import Loop
from knitstudy.knit.geometry.spline import CatmullRom, Centreline
from knitstudy.knit.geometry.stitches import PLAIN
from knitstudy.mechanics.core.arrays import Bools, Floats


def plain_knit(loop: Loop, loops: int, rows: int) -> Fabric:
    """Return a knit of ``rows`` interlock rows, that is ``rows`` + 1 whole yarns of ``loops`` loops.

    In course tension it is gripped at the ends of all yarns, in wale tension at the sinker arcs of the first yarn and
    at the head arcs of the last one. Of other stitches than plain ones it has whole repeats, and the last yarn is a
    copy of the first.
    Raises GeometryError when yarns do not cross as in a knit.
    """
    made_of = vars(loop) | {"loops": loops, "rows": rows}
    knit = knit_of_rows(
        loop.curves, loop, loop.columns, loops, rows, specimen="knit", made_of=made_of, loop=loop
    )
    knit = replace(knit, crossings=_by_cells(knit.crossings, loop, loops, rows))
    bottom, top = sinker_arcs(knit), head_arcs(knit)
    every = np.arange(rows + 1)
    ends = np.array([[curve.length] * 2 for curve in knit.centrelines])
    grips = {
        "course": (Grip(every, np.zeros_like(ends)), Grip(every, ends)),
        "wale": (Grip(np.zeros(len(bottom), dtype=int), bottom), Grip(np.full(len(top), rows), top)),
    }
    return replace(knit, grips=grips, sample=sample_of(loop, loops, rows, "knit"))


def knit_of_rows(
    curves: Sequence[CatmullRom],  # of the rows of a repeat, each in its place
    drawn: Loop,  # with their spacings and their yarn
    columns: int,  # loops of a row of the repeat
    loops: int,
    rows: int,
    **more: Any,
) -> Fabric:
    """Return ``rows`` interlock rows of ``loops`` loops, which are ``rows`` + 1 whole yarns; `more` as of `Fabric`."""
    every = np.arange(rows + 1)
    height = len(curves)
    repeats = loops // columns
    wale, course, rise = drawn.wale_spacing, drawn.course_spacing, drawn.rise
    first = [Centreline(curve, repeats) for curve in curves]
    lines = first[: rows + 1]
    copy_of = every % height
    for row in every[height:].tolist():
        like = first[copy_of[row]]
        moved = like.curve.control_points + row // height * (height * rise)
        lines.append(Centreline(CatmullRom(moved, like.curve.advance), repeats, like))
    return of_curves(
        lines,
        drawn.radius,
        drawn.clearance,
        size=np.array([loops * wale, rows * course, 2 * drawn.radius]),
        copy_of=copy_of,
        shift=(every - copy_of)[:, None] * rise,
        repeats=repeats,
        cell=np.array([wale, course]) * [columns, height],
        **more,
    )


def sample_of(loop: Loop, loops: int, rows: int, specimen: str) -> Fabric | None:
    """Return a smaller knit in which yarns bend and meet as in the large one; None if there is no smaller one.

    The whole knit is also a sample of a cut knit.
    """
    fewer = min(loops, 3 * loop.columns), min(rows, 2 * loop.rows)
    return plain_knit(loop, *fewer) if fewer != (loops, rows) or specimen == "cut_knit" else None


def _by_cells(crossings: Crossings, loop: Loop, loops: int, rows: int) -> Crossings:
    """Return the crossings of a knit by row, column and zone."""
    row = crossings.yarn[:, 0]
    order = np.lexsort((crossings.arc_length[:, 0], row))
    neighbours = np.array_equal(
        crossings.yarn[order], np.repeat(np.arange(rows), 4 * loops)[:, None] + [0, 1]
    )
    upper = crossings.arc_length[order, 1]
    if not neighbours or (np.diff(upper.reshape(rows, -1), axis=1) <= 0).any():
        message = (
            f"pattern.control_points: the yarns of {rows} rows of {loops} loops cross {len(crossings)} times: allowed "
            "are 4 crossings of neighbouring rows a loop, in the same order along both, and no others"
        )
        if loop.stitches != PLAIN:
            message += "; one may lie beyond the cut between two repeats: take a larger pattern.wale_spacing"
        raise GeometryError(message)
    order = order.reshape(-1, 4)[:, ALONG].ravel()
    row, column, zone = np.indices((rows, loops, 4)).reshape(3, -1)
    return replace(crossings[order], row=row, column=column, zone=zone)


def _places_of_loops(knit: Fabric, yarn: int) -> Floats:
    """Arc lengths (n, 8) at which every loop of a knit's yarn is crossed. [m]

    In this order: left with the row below, left with the row above, right with the row above, right with the row below,
    each twice.
    """
    return knit.places(yarn)[0].reshape(-1, 8)


def sinker_arcs(knit: Fabric) -> Floats:
    """Return the arc lengths (n + 1, 2) between which a knit's first yarn runs along the bottom of its loops. [m]

    Each reaches from the last crossing of a loop with the row below to the first crossing of the next loop. At its
    ends, which lie in the middles of sinkers, the yarn has half of one.
    """
    places = _places_of_loops(knit, 0)
    length = knit.centrelines[0].length
    return np.column_stack([np.append(0.0, places[:, 7]), np.append(places[:, 0], length)])


def head_arcs(knit: Fabric) -> Floats:
    """Return the arc lengths (n, 2) between which a knit's last yarn runs along the top of its loops. [m]"""
    return _places_of_loops(knit, len(knit.centrelines) - 1)[:, 3:5]


def endless_cell(loop: Loop, loops: int, rows: int) -> Fabric:
    """Return a cell of an endless knit: its rows of loops, and the image of the first one above the last.

    Every crossing is there once. Nothing is gripped.
    """
    knit = plain_knit(loop, loops, rows)
    return replace(
        knit, grips={}, specimen="cell", periods=np.array([[knit.width, 0, 0], [0, knit.height, 0]])
    )


def cut_cells(loop: Loop, loops: int, rows: int) -> Fabric:
    """Return cells cut out of a knit, so that each has as much yarn as one of an endless knit.

    Of the yarn below there are heads alone, each on the halves of its two legs, and of the yarn above sinkers. In
    course tension yarns are gripped where these end at the sides, in wale tension at the cut legs of the first and the
    last yarn.
    """
    knit = plain_knit(loop, loops, rows)
    # The first and the last yarn are copies of each other.
    legs = middles_of_legs(knit)
    whole = np.array([curve.length for curve in knit.centrelines])
    sinkers = np.column_stack([np.append(0.0, legs[:, 1]), np.append(legs[:, 0], whole[0])])
    counts = [len(legs), *[1] * (rows - 1), len(sinkers)]
    yarn = np.repeat(np.arange(rows + 1), counts)
    inner = np.column_stack([np.zeros(rows - 1), whole[1:-1]])
    arc = np.concatenate([legs, inner, sinkers])
    cells = pieces_of(knit, Arcs(np.arange(len(knit.crossings)), yarn, arc))
    lengths = arc[:, 1] - arc[:, 0]
    first = arc[:, 0] == 0
    last = arc[:, 1] == whole[yarn]

    def ends(begins: Bools, finishes: Bools) -> Grip:
        yarns = np.flatnonzero(begins), np.flatnonzero(finishes)
        at = np.concatenate([np.zeros(len(yarns[0])), lengths[yarns[1]]])
        return Grip(np.concatenate(yarns), np.column_stack([at, at]))

    none = np.zeros(len(yarn), dtype=bool)
    lowest = yarn == 0
    highest = yarn == rows
    grips = {
        "course": (ends(first, none), ends(none, last)),
        "wale": (ends(lowest & ~first, lowest & ~last), ends(highest & ~first, highest & ~last)),
    }
    return replace(cells, grips=grips, specimen="cut_knit")


KNITS = {"knit": plain_knit, "cut_knit": cut_cells, "cell": endless_cell}


def middles_of_legs(knit: Fabric) -> Floats:
    """Return the arc lengths (n, 2) of the middles of both legs of every loop of a knit's first yarn. [m]

    A leg runs from the crossings with the row below to the crossings with the row above.
    """
    places = _places_of_loops(knit, 0)
    return 0.5 * (places[:, [1, 5]] + places[:, [2, 6]])


# Two straight yarns that cross


def yarn_pair(radius: float, angle: float, length: float, clearance: float = 0.0) -> Fabric:
    """Return two yarns of a radius and length [m] that cross in their middles, at the origin.

    The lower yarn lies along x below the plane z = 0; the upper one is turned from x to y by the angle [degrees] and
    lies above it, so that the gap of their surfaces is the clearance [radii]. The lower one is held and the upper one
    driven, at "ends" or at the "back", the half of the surface that is turned away from the other yarn.

    Examples
    --------
    >>> fabric = yarn_pair(radius=0.9e-3, angle=90, length=10e-3, clearance=0.0)
    >>> len(fabric.centrelines), len(fabric.crossings.yarn)
    (2, 1)
    """
    turn = np.radians(angle)
    half = 0.5 * (2 + clearance) * radius
    along = np.array([[1.0, 0.0, 0.0], [np.cos(turn), np.sin(turn), 0.0]])
    middles = np.array([[0.0, 0.0, -half], [0.0, 0.0, half]])
    share = np.arange(4)[:, None] / 4 - 0.5
    curves = [
        Centreline(CatmullRom(middle + share * length * way, length * way), 1)
        for middle, way in zip(middles, along, strict=True)
    ]
    ends = np.array([[0.0, 0.0], [length, length]])
    all_of_it = np.array([[0.0, length]])
    lower, upper = np.zeros(2, dtype=int), np.ones(2, dtype=int)
    up = np.array([0.0, 0.0, 1.0])
    return of_curves(
        curves,
        radius,
        clearance,
        grips={
            "ends": (Grip(lower, ends), Grip(upper, ends)),
            "back": (Grip(lower[:1], all_of_it, -up), Grip(upper[:1], all_of_it, up)),
        },
        size=np.array([length, length, 2 * radius]),
        specimen="pair",
        made_of={"radius": radius, "angle": angle, "length": length, "clearance": clearance},
        angle=angle,
    )
