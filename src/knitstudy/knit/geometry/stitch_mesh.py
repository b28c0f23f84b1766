"""Cells of knits with tucks, floats, cables and lace: curves of all rows, put together from stitches.

A stitch has feet in its own row, and a head in the row of the stitch that is drawn through it. A loop that is held
over tucks (T) or floats (-) has long legs; a tuck has no loop below it, and its head lies behind and below that of the
loop held on the same needle; a float passes behind the loop that is held, seen from the side of its stitch. The head
of a loop that is moved (cables, lace) lies on another needle, and its legs pass in front of or behind others.
`LoopTarget` draws the loops, for a plain knit, and parts of them are moved (drawn "stitch meshes": Yuksel and others
2012, ACM Transactions on Graphics 31). Yarns stand apart where they cross, and no force is in balance: the relaxation
of beams (`knit.models.beam.cell.relax`) finds the shape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from math import lcm

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.loop import LoopTarget
from knitstudy.knit.geometry.specimens import knit_of_rows
from knitstudy.knit.geometry.spline import CatmullRom
from knitstudy.knit.geometry.stitches import PLAIN
from knitstudy.knit.scene.stitches import MARKS, STITCHES, idle_needle, knits, stitches_of_row, ways_to_next
from knitstudy.mechanics.core.arrays import Floats

BEHIND, NARROWER = 1.6, 0.1
"""Distance of a head in a stack from the head before it, over the diameter and times the heads of the highest stack,
and by how much the head is narrower. At larger distances the feet of the last head pass behind the sinkers of the
stitch that is drawn through the stack."""
ASIDE = 0.6
"""Distance of the legs of a moved loop in front of the plane, or behind it, over the same diameter."""
SAMPLES = 20  # of a curve, by control point, at which its distance to an inlay is looked at


@dataclass(frozen=True)
class Stitch:
    """A stitch of a repeat, in its place."""

    letter: str
    moved: int  # needles to the right by which its head is moved
    aside: float  # where its legs pass others then: 1 in front, -1 behind
    side: float  # of the stitch that is drawn through it: 1 to the front, -1 to the back
    own: float  # the side to which it is itself drawn; of tucks and floats `side`
    held: int  # rows over which its head is held, beyond the next one
    place: int = 0  # in the stack of heads that one stitch is drawn through, from its side


def stitches_of(rows: Sequence[str]) -> list[list[Stitch]]:
    """Return the stitches of a repeat of rows of letters, the bottom row first.

    Raises GeometryError where a needle never knits, so that its loops would be held for ever, or where a stitch has no
    loop to be drawn through.

    Examples
    --------
    >>> [(each.held, each.place) for row in stitches_of(["KP", "KT"]) for each in row]
    [(0, 0), (1, 0), (0, 0), (0, 1)]
    """
    if idle := idle_needle(rows):
        fact = f"pattern.stitches is {list(rows)}: needle {idle} never knits"
        raise GeometryError(f"{fact}: allowed is K or P in a row of every column")
    letters = [stitches_of_row(row) for row in rows]
    count = len(rows)
    columns = len(letters[0])
    every: list[list[Stitch]] = []
    # By row and column of the stitch that is drawn through them
    stacks: dict[tuple[int, int], list[tuple[float, int, int, int]]] = {}
    for (row, column), (up, moved) in ways_to_next(rows).items():
        letter = letters[row][column][0]
        marks = letters[row][column][1:]
        kind = STITCHES.find(letter)
        above = ((row + up) % count, (column + moved) % columns)
        side = float(STITCHES.find(letters[above[0]][above[1]][0]).side)
        aside = (1.0 if MARKS[marks[0]][1] else -1.0) if marks else 0.0
        if kind.has_head:
            stacks.setdefault(above, []).append((-aside * side, -up, row, column))
        every += [[]] if column == 0 else []
        every[row].append(Stitch(letter, moved, aside, side, float(kind.side or side), up - 1))
    for row, column in product(range(count), range(columns)):
        if knits(letters[row][column]) and (row, column) not in stacks:
            fact = f"stitch {column + 1} of row {row + 1} has no loop to be drawn through"
            raise GeometryError(
                f"pattern.stitches is {list(rows)}: {fact}: on an empty needle it is a tuck (T)"
            )
    for stack in stacks.values():
        for place, (*_, row, column) in enumerate(sorted(stack)):
            every[row][column] = replace(every[row][column], place=place)
    return every


@dataclass(frozen=True, eq=False)
class Drawing:
    """The plain loop that stitches are drawn from, and its distances from others. [m]"""

    plain: Floats  # (4 q, 3), control points from sinker to sinker
    wale: float
    rise: float  # from a row to the next
    diameter: float  # of the yarn, times the depth of the drawing
    behind: float  # of a head in a stack, from the head before it

    def row(self, row: Sequence[Stitch]) -> Floats:
        """Return the control points (n, 3) of a row of stitches, from the sinker before the first one on."""
        parts = []
        before = row[-1]
        legs = self.plain[len(self.plain) // 4, 1] + 1e-9 * np.ptp(self.plain[:, 1])  # their middles
        for column, stitch in enumerate(row):
            points = (STITCHES.find(stitch.letter).draw or DRAWN.get(stitch.letter, loop))(self, stitch)
            points[:, 2] *= np.where(points[:, 1] > legs, stitch.side, stitch.own)
            points[0, 2] *= 0.5 * (before.own + stitch.own) * stitch.own
            if stitch.moved:
                points += self._lean(points, stitch)
            parts.append(points + np.array([column * self.wale, 0.0, 0.0]))
            before = stitch
        return np.concatenate(parts)

    def _lean(self, points: Floats, stitch: Stitch) -> Floats:
        """Return by how much the points (n, 3) of a loop are moved: its head to its needle, its legs past others."""
        # Sinkers of the next row; legs lean from the heads below up to these
        low = self.plain[0, 1] + self.rise
        share = np.clip(0.5 + 0.5 * points[:, 1] / low, 0, 1)
        out = ASIDE * self.diameter * stitch.aside * 4 * share * (1 - share)
        return np.column_stack([share * stitch.moved * self.wale, 0 * share, out])


def loop(drawing: Drawing, stitch: Stitch, tuck: bool = False) -> Floats:
    """Return the points (n, 3) of a loop or a tuck that is drawn to the front."""
    plain = drawing.plain
    quarter = len(plain) // 4
    foot = plain[:quarter]
    leg = plain[quarter]
    head = plain[quarter + 1 : 3 * quarter]
    other_leg = plain[3 * quarter]
    other_foot = plain[3 * quarter + 1 :]
    middle = plain[2 * quarter, 0]
    if stitch.place:
        behind = [0, 0, stitch.place * drawing.behind]
        squeezed = np.array([1 - NARROWER * stitch.place, 1, 1])
        head, leg, other_leg = (
            (part - [middle, 0, 0]) * squeezed + [middle, 0, 0] - behind for part in (head, leg, other_leg)
        )
    if tuck:  # no loop below it: it comes from the sinkers straight to its head
        shares = np.arange(quarter)[:, None] / quarter
        end = plain[0] + [2 * middle, 0, 0]
        foot = plain[0] + shares * (leg - plain[0])
        other_foot = other_leg + shares[1:] * (end - other_leg)
    up = np.array([0.0, stitch.held * drawing.rise, 0.0])
    steps = np.linspace(0, 1, 2 * stitch.held + 1)[:, None]
    return np.concatenate([foot, leg + steps * up, head + up, other_leg + steps[::-1] * up, other_foot])


def straight(drawing: Drawing, stitch: Stitch) -> Floats:
    """Return the points (4, 3) of a float: straight on from sinker to sinker, behind the loop that is held."""
    return drawing.plain[0] + np.linspace(0, drawing.wale, 4, endpoint=False)[:, None] * [1, 0, 0]


DRAWN: dict[str, Callable[[Drawing, Stitch], Floats]] = {"T": partial(loop, tuck=True), "-": straight}


def endless_cell_of_stitches(
    wanted: LoopTarget,
    loops: int,
    rows: int,
    inlaid: Sequence[bool] = (False,),  # by row, again and again, whether a straight yarn is laid into it
    inlay: float = 0.0,  # radius of that yarn [m]
) -> Fabric:
    """Return a cell of an endless knit of any stitches, as it is drawn for spacings and a yarn.

    The wanted length is the length of a plain loop; loops that tucks push apart are drawn deeper and longer.
    The yarn after a row with an inlay is the inlay, along the middle of the row and of the fabric.
    Raises GeometryError where a needle never knits, where no loop is drawn that long, or as `_require_room`.
    """
    letters = wanted.stitches
    plain = replace(wanted, stitches=PLAIN, deep=1.0 + any(inlaid))
    stitches = stitches_of(letters)
    columns = len(stitches[0])
    depth = 1 + max(stitch.place for row in stitches for stitch in row)
    drawn = plain.drawn(wanted.length)
    along = np.array([wanted.wale, 0, 0])
    up = np.array([0, wanted.course, 0])
    points = drawn.control_points * [1, 1, depth]
    diameter = 2 * wanted.radius
    drawing = Drawing(points, wanted.wale, wanted.course, depth * diameter, BEHIND * diameter / depth)
    repeat = lcm(len(stitches), len(inlaid))
    knitted = [
        CatmullRom(drawing.row(stitches[number % len(stitches)]) + number * up, columns * along)
        for number in range(repeat)
    ]
    curves: list[CatmullRom] = []
    for number, curve in enumerate(knitted):
        curves.append(curve)
        if inlaid[number % len(inlaid)]:
            _require_room(knitted, number, wanted, repeat * wanted.course, wanted.radius + inlay)
            share = np.linspace(0, 1, 4 * columns, endpoint=False)[:, None]
            curves.append(CatmullRom(share * columns * along + number * up, columns * along))
    yarns = len(curves) / repeat  # of a row
    return knit_of_rows(
        curves,
        replace(drawn, course_spacing=wanted.course / yarns),
        columns,
        loops,
        round(rows * yarns),
        specimen="cell",
        made_of={"wale_spacing": wanted.wale, "course_spacing": wanted.course, "loops": loops, "rows": rows},
        periods=np.array([loops * along, rows * up]),
    )


def _require_room(
    rows: Sequence[CatmullRom],  # of one period
    number: int,  # of a row
    wanted: LoopTarget,
    height: float,  # of the period [m]
    least: float,  # distance of axes [m]
) -> None:
    """Refuse a straight yarn along the middle of a row that is not between loops in front of it and behind it.

    Raises GeometryError where it passes loops of a wale on both sides, or of all wales on one, or is nearer than it may
    be.
    """
    wales = len(wanted.stitches[0])
    level = number * wanted.course
    near = np.inf
    front, every = np.zeros(wales), np.zeros(wales)
    for row in rows:
        x, y, z = row.value(np.linspace(0, row.period, SAMPLES * row.period + 1)).T
        off = (y - level) / height
        near = min(near, float(np.hypot(height * (off - np.rint(off)), z).min()))
        passes = np.flatnonzero(np.diff(np.floor(off)))
        wale = np.floor(x[passes] / wanted.wale).astype(int) % wales
        every += np.bincount(wale, minlength=wales)
        front += np.bincount(wale, z[passes] > 0, wales)
    apart = ((front == 0) | (front == every)).all() and 0 < front.sum() < every.sum()
    if not apart or near < least:
        what = f"is {near:.2g} m from loops, {least:.2g} m are needed: use a smaller geometry.diameter_share"
        if not apart:
            what = "would pierce loops or lie beside all: allowed are rows of K and P, such as the rib [KP]"
        raise GeometryError(
            f"pattern.stitches is {list(wanted.stitches)}, and an inlay (yarn_b.rows) in row {number + 1} {what}"
        )
