"""Letters of stitches, and what a repeat that is written in them must be: rows of letters, the bottom row first."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from knitstudy.registry import Registry, meanings


@dataclass(frozen=True)
class StitchKind:
    """Meaning of a letter of a repeat; `knit.geometry.stitch_mesh` draws K, P, T and -."""

    name: str  # the letter
    meaning: str
    # The loop below is drawn to the front (1) or to the back (-1); 0: that loop is held, and this one laid beside it.
    side: int
    has_head: bool = True  # or the needle gets no yarn
    # Points (n, 3) [m] of a stitch drawn to the front, from a `Drawing` and a `Stitch`; None: of a loop or a tuck
    draw: Callable[[Any, Any], Any] | None = None


STITCHES: Registry[StitchKind] = Registry("stitch")
for _kind in (
    StitchKind("K", "knit", 1),
    StitchKind("P", "purl", -1),
    StitchKind("T", "tuck", 0),
    StitchKind("-", "float", 0, has_head=False),
):
    STITCHES.register(_kind)

Place = tuple[int, int]  # row and column, or how far apart two are

PLAIN = "KP"  # stitches whose loops are alike
MARKS = {">": (1, True), "<": (-1, True), ")": (1, False), "(": (-1, False)}
"""Behind a letter: the loop is moved by a needle to the right or to the left, in front of or behind those it meets."""


def stitches_of_row(row: str) -> list[str]:
    """Return the stitches of a row: letters, each with its marks.

    Examples
    --------
    >>> stitches_of_row("K>K(P")
    ['K>', 'K(', 'P']
    """
    return re.findall(r".[<>()]*", row)


def size_of_repeat(stitches: Sequence[str]) -> tuple[int, int]:
    """Return the loops and rows of a repeat."""
    return len(stitches_of_row(stitches[0])), len(stitches)


def wrong_stitches(stitches: tuple[str, ...]) -> str | None:
    """Return the error in rows of stitches in words; None if they are a rectangle in which all needles knit."""
    rows = [stitches_of_row(row) for row in stitches]
    for row, every in enumerate(rows, 1):
        for number, stitch in enumerate(every, 1):
            if wrong := _wrong_stitch(stitch):
                return f"stitch {number} of row {row} is {stitch!r}{wrong}"
    if not rows or not rows[0] or len({len(every) for every in rows}) > 1:
        return 'it must be rows of letters, all of one length, the bottom row first, such as ["KP", "PK"]'
    if idle := idle_needle(stitches):
        held = " and ".join(sorted({every[idle - 1] for every in rows}))
        return f"stitch {idle} is {held} in all rows but must be K or P in one"
    for row, every in enumerate(rows, 1):
        if set(every) == {"-"}:
            return f"row {row} floats past all needles but must have a stitch"
    if empty := empty_needle(stitches):
        row, number = empty
        return f"stitch {number} of row {row} has no loop to be drawn through: on an empty needle it is a tuck (T)"
    return None


def _wrong_stitch(stitch: str) -> str:
    """Return what is wrong in a letter with its marks; empty if nothing is."""
    if stitch[0] not in STITCHES.names():
        return f" but must be {meanings(STITCHES.all())}"
    if len(set(stitch[1:])) > STITCHES.find(stitch[0]).has_head:
        return ": a loop has marks of one kind, a float none"
    return ""


def idle_needle(stitches: Sequence[str]) -> int | None:
    """Return the number, from 1, of the first column in which no stitch is K or P; None if there is none."""
    columns = enumerate(zip(*map(stitches_of_row, stitches), strict=True), 1)
    return next((number for number, column in columns if not any(map(knits, column))), None)


def empty_needle(stitches: Sequence[str]) -> Place | None:
    """Return row and number, from 1, of the first K or P on an empty needle; None if each has a loop below.

    Examples
    --------
    >>> empty_needle(["K>K"])  # all loops of the first needle go to the second one
    (1, 1)
    """
    parents = parents_of_letters(stitches)
    for row, every in enumerate(map(stitches_of_row, stitches)):
        for column, stitch in enumerate(every):
            if knits(stitch) and (row, column) not in parents:
                return row + 1, column + 1
    return None


def knits(stitch: str) -> bool:
    """Whether a stitch, a letter with its marks, is drawn through the loop below."""
    return STITCHES.find(stitch[0]).side != 0


def ways_to_next(stitches: Sequence[str]) -> dict[Place, Place]:
    """Return how many rows up and needles to the right the stitch lies that is drawn through each, by row and column.

    Loops that are held, tucks and floats wait for the next knit or purl stitch on their needle, which every one has.

    Examples
    --------
    >>> ways_to_next(["KP", "KT"])[0, 1]
    (2, 0)
    """
    rows = [stitches_of_row(row) for row in stitches]
    drawn = [[knits(stitch) for stitch in row] for row in rows]
    following: dict[int, int] = {}  # by column, the row of the next knit or purl stitch above
    ups: dict[Place, int] = {}
    for row in reversed(range(2 * len(rows))):
        if row < len(rows):
            ups |= {(row, column): above - row for column, above in following.items()}
        following |= {column: row for column, knitted in enumerate(drawn[row % len(rows)]) if knitted}
    ways = {}
    for row, column in product(range(len(rows)), range(len(rows[0]))):
        marks = rows[row][column][1:]
        along = MARKS[marks[0]][0] * len(marks) if marks else 0
        ways[row, column] = ups[row, (column + along) % len(rows[row])], along
    return ways


def parents_of_letters(stitches: Sequence[str]) -> dict[Place, set[Place]]:
    """Return how many rows below and columns to the left the parents of stitches are, by row and column of a repeat.

    Examples
    --------
    >>> parents_of_letters(["KP", "KT"])[0, 1] == {(1, 0), (2, 0)}  # the tuck, and the loop that is held
    True
    """
    rows = [stitches_of_row(row) for row in stitches]
    high = len(rows)
    wide = len(rows[0])
    parents: dict[Place, set[Place]] = {}
    for (row, column), (up, along) in ways_to_next(stitches).items():
        if STITCHES.find(rows[row][column][0]).has_head:
            parents.setdefault(((row + up) % high, (column + along) % wide), set()).add((up, along))
    return parents


def is_plain(stitches: Sequence[str]) -> bool:
    """Whether a repeat has knit and purl stitches alone, each on its needle; others are `knit.geometry.stitch_mesh`."""
    return set("".join(stitches)) <= set(PLAIN)
