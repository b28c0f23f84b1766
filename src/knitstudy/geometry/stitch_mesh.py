"""Cells of knits with tucks and floats: curves of all rows, from what every stitch is made of.

A stitch has feet in its own row, and a head in the row of the stitch that is drawn through it. A loop that is held
over tucks (T) or floats (-) has long legs; a tuck has no loop below it, and its head lies behind and below that of the
loop held on the same needle; a float passes behind the loop that is held, seen from the side of its stitch. Loops are
those that `geometry.fit` draws for a plain knit, with parts moved (drawn "stitch meshes": Yuksel et al. 2012, ACM
Transactions on Graphics 31). Yarns stand apart where they cross, and no force is in balance: the way to rest of beams
(`models.endless_beams.relax`) finds the shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError
from knitstudy.geometry.fabric import Fabric, of_curves, rows_of_repeat
from knitstudy.geometry.fit import LoopTarget
from knitstudy.geometry.spline import CatmullRom
from knitstudy.geometry.stitches import KNIT, PURL
from knitstudy.study.problem_sections import idle_needle

TUCK, FLOAT = "T", "-"
DRAWN = KNIT + PURL

BEHIND, NARROWER = 0.4, 0.1
"""How far the head of a tuck lies behind that of the loop it is with, over the diameter and the depth of the drawing,
and how much narrower it is. Centrelines then stand half a diameter apart or more (tests/unit/test_stitch_mesh.py)."""


@dataclass(frozen=True)
class Stitch:
    """What a letter of a repeat stands for, in its place."""

    letter: str
    side: float  # of the stitch that is drawn through it: 1 to the front, -1 to the back
    own: float  # the side to which it is itself drawn; of tucks and floats `side`
    held: int  # rows over which its head is held, beyond the next one
    place: int  # in the stack of heads that one stitch is drawn through: 0 for the loop, then its tucks


def stitches_of(rows: Sequence[str]) -> list[list[Stitch]]:
    """Return the stitches of a repeat of rows of letters, the bottom row first.

    Raises GeometryError where a needle never knits, so that its loops would be held for ever.

    Examples
    --------
    >>> [(each.held, each.place) for row in stitches_of(["KP", "KT"]) for each in row]
    [(0, 0), (1, 0), (0, 0), (0, 1)]
    """
    if idle := idle_needle(rows):
        fact = f"pattern.stitches is {list(rows)}: needle {idle} never knits"
        raise GeometryError(f"{fact}: allowed is K or P in a row of every column")
    count = len(rows)
    every: list[list[Stitch]] = []
    for row, letters in enumerate(rows):
        stitches = []
        for column, letter in enumerate(letters):
            above = [rows[(row + up) % count][column] for up in range(1, count + 1)]
            up = next(up for up, other in enumerate(above) if other in DRAWN)
            side = 1.0 if above[up] == KNIT else -1.0
            own = {KNIT: 1.0, PURL: -1.0}.get(letter, side)
            stitches.append(Stitch(letter, side, own, up, _place(rows, row, column)))
        every.append(stitches)
    return every


def _place(rows: Sequence[str], row: int, column: int) -> int:
    """Return how many loops lie on the needle already when a tuck is laid there; 0 for others."""
    place = 0
    if rows[row][column] == TUCK:
        for down in range(1, len(rows) + 1):
            letter = rows[(row - down) % len(rows)][column]
            place += letter != FLOAT
            if letter in DRAWN:
                break
    return place


def row_points(
    plain: np.ndarray, wale: float, rise: float, diameter: float, row: Sequence[Stitch]
) -> np.ndarray:
    """Return the control points (n, 3) of a row of stitches, from the sinker before the first one on.

    Parameters
    ----------
    plain : ndarray (4 q, 3)
        Control points of a plain loop, from sinker to sinker. [m]
    wale, rise, diameter : float
        Distances of loops and rows, and the diameter of the yarn times the depth of the drawing. [m]
    row : sequence of Stitch
    """
    parts, before = [], row[-1]
    for column, stitch in enumerate(row):
        points = _float(plain, wale) if stitch.letter == FLOAT else _loop(plain, rise, diameter, stitch)
        points[:, 2] *= np.where(_is_head(points, plain), stitch.side, stitch.own)
        points[0, 2] *= 0.5 * (before.own + stitch.own) * stitch.own
        parts.append(points + np.array([column * wale, 0.0, 0.0]))
        before = stitch
    return np.concatenate(parts)


def _is_head(points: np.ndarray, plain: np.ndarray) -> np.ndarray:
    """Whether points (n, 3) lie above the middles of the legs."""
    return points[:, 1] > plain[len(plain) // 4, 1] + 1e-9 * np.ptp(plain[:, 1])


def _float(plain: np.ndarray, wale: float) -> np.ndarray:
    """Return the points (4, 3) of a float: straight on from sinker to sinker, behind what is held."""
    return plain[0] + np.linspace(0, wale, 4, endpoint=False)[:, None] * [1, 0, 0]


def _loop(plain: np.ndarray, rise: float, diameter: float, stitch: Stitch) -> np.ndarray:
    """Return the points (n, 3) of a loop or a tuck that is drawn to the front."""
    quarter = len(plain) // 4
    foot, leg, head = plain[:quarter], plain[quarter], plain[quarter + 1 : 3 * quarter]
    other_leg, other_foot = plain[3 * quarter], plain[3 * quarter + 1 :]
    if stitch.letter == TUCK:  # no loop below it: it comes from the sinkers straight to its head
        middle, behind = plain[2 * quarter, 0], [0, 0, BEHIND * stitch.place * diameter]
        squeezed = np.array([1 - NARROWER * stitch.place, 1, 1])
        head, leg, other_leg = (
            (each - [middle, 0, 0]) * squeezed + [middle, 0, 0] - behind for each in (head, leg, other_leg)
        )
        shares = np.arange(quarter)[:, None] / quarter
        end = plain[0] + [2 * middle, 0, 0]
        foot, other_foot = plain[0] + shares * (leg - plain[0]), other_leg + shares[1:] * (end - other_leg)
    up = np.array([0.0, stitch.held * rise, 0.0])
    steps = np.linspace(0, 1, 2 * stitch.held + 1)[:, None]
    return np.concatenate([foot, leg + steps * up, head + up, other_leg + steps[::-1] * up, other_foot])


def endless_cell_of_stitches(wanted: LoopTarget, loops: int, rows: int) -> Fabric:
    """Return a cell of an endless knit of any stitches, as it is drawn for spacings and a yarn.

    The wanted length is that of a plain loop; those that tucks push apart are drawn deeper and longer.
    Raises GeometryError where a needle never knits, or where no loop is drawn that long.
    """
    letters, plain = wanted.stitches, LoopTarget(wanted.course, wanted.wale, wanted.radius, wanted.clearance)
    stitches, columns, height = stitches_of(letters), len(letters[0]), len(letters)
    depth = 1 + max(each.place for row in stitches for each in row)
    points = plain.drawn(wanted.length).control_points * [1, 1, depth]
    along, up = np.array([wanted.wale, 0, 0]), np.array([0, wanted.course, 0])
    drawn = [
        row_points(points, wanted.wale, wanted.course, 2 * depth * wanted.radius, row) for row in stitches
    ]
    curves = [CatmullRom(row + number * up, columns * along) for number, row in enumerate(drawn)]
    lines, copy_of, shift = rows_of_repeat(curves, up, rows, loops // columns)
    return of_curves(
        lines,
        wanted.radius,
        wanted.clearance,
        size=np.array([loops * wanted.wale, rows * wanted.course, 2 * wanted.radius]),
        copy_of=copy_of,
        shift=shift,
        specimen="cell",
        made_of={"wale_spacing": wanted.wale, "course_spacing": wanted.course, "loops": loops, "rows": rows},
        repeats=loops // columns,
        cell=np.array([columns * wanted.wale, height * wanted.course]),
        periods=np.array([loops * along, rows * up]),
    )
