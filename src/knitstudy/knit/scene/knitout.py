"""Stitches from a file that drives a knitting machine.

The loops that `knitting_machine` makes are the truth. Letters are one way to write those of a repeat: passes of the
carriage are rows, needles are columns, and the largest part that repeats itself is the body. Every loop of the body
must be drawn through the loops that the letters say, and every yarn must lead from loop to loop as rows do; or the file
is refused with the line.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.knit_graph import machine_of
from knitstudy.knit.scene.knitting_machine import Loop, Machine, Needle, is_back, name_of
from knitstudy.knit.scene.stitches import (
    MARKS,
    STITCHES,
    idle_needle,
    stitches_of_row,
    ways_to_next,
    wrong_stitches,
)

log = logging.getLogger(__name__)

INCH = 25.4e-3  # [m]
BINDING = 2  # Loops of a pass that binds off, at most
EDGE = 2  # Columns between the edge of the knit and a loop where its yarn turns
MOST = 0.9  # Share of the needles that begin in the rows of the cast-on; others may begin later, at edges
NO_LETTER = "?"

Ends = tuple[int, int]  # the first and the last one
Place = tuple[int, int]  # row and column


@dataclass(frozen=True)
class Repeat:
    """What a machine file repeats."""

    stitches: tuple[str, ...]  # rows of letters, the bottom row first, as in ``pattern.stitches``
    wale_spacing: float | None  # of the needles in use [m]; None where the file names no gauge
    rows: Ends  # passes of the carriage, from 1 on
    needles: tuple[str, str]


def repeat_of(knit: Any, rows: Ends | None = None, needles: Ends | None = None) -> tuple[str, ...]:
    """Return the rows of letters of the smallest repeat of a knit, ``pattern.stitches`` of a scene (`read_repeat`)."""
    return read_repeat(knit, rows, needles).stitches


def read_repeat(knit: Any, rows: Ends | None = None, needles: Ends | None = None) -> Repeat:
    """Return the repeat of a knit, or of a part of it.

    The knit is the path of a knitout file, a graph of knit-graphs, or the third result of knitout-interpreter's
    ``run_knitout``. The part are passes of the carriage, `rows` from 1 on, and positions of needles as in the file; by
    default all. Raises ConfigurationError when the file cannot be read or knitted, or holds what no letters say, with
    its line; when rows of another yarn lie above or below the body; or when no needle knits twice.
    """
    machine = Machine.of_file(Path(knit)) if isinstance(knit, str | Path) else machine_of(knit)
    path, knit = machine.path, Letters(machine)
    asked, column = knit.part(rows, needles)
    whole, part = (asked if rows else knit.begun(asked, column, share) for share in (1.0, MOST))
    if found := largest_repeat(knit.grid[np.ix_(part, column)]):
        (up, beside), (high, wide) = found
        row, column = part[up], column[beside]
    else:
        row, grid = whole, knit.grid[np.ix_(whole, column)]
        alike = (n for n in range(1, len(column) // 2 + 1) if (grid[:, n:] == grid[:, :-n]).all())
        high, wide = len(row), next(alike, len(column))
        if high > 1:
            log.warning("%s: no rows repeat themselves: all of them are the repeat", path)
    if not row.size:
        fact = "no row follows on one in which every needle has a loop: nothing is a stitch"
        raise ConfigurationError(f"{path}: {fact}")
    stitches = tuple("".join(line) for line in knit.grid[np.ix_(row[:high], column[:wide])])
    knit.check(stitches, row, column)
    names = [name_of(knit.needle[end]) for end in (column[0], column[-1], 0, -1)]
    read = Repeat(stitches, knit.spacing(column, wide), (row[0] + 1, row[-1] + 1), (names[0], names[1]))
    if not rows:
        knit.require_one_yarn(row)
    if row[0] > whole[0] or len(row) + 1 < len(whole) or len(column) < len(knit.needle):
        text = "the repeat is of rows {} to {} of {}, needles {} to {} of {} to {}; what begins, is bound off"
        body = text.format(*read.rows, len(knit.machine.rows), *names)
        log.warning("%s: %s or is another pattern is left out", path, body)
    return read


class Letters:
    """A knit as rows of letters: `grid` has a stitch, a letter with its marks, for every row and column.

    It is `NO_LETTER` for what no letter says. `needle` is a needle of every column.
    """

    def __init__(self, machine: Machine) -> None:
        if not machine.rows:
            raise ConfigurationError(f"{machine.path}: has no stitches")
        self.machine, self.loops = machine, [loop for row in machine.rows for loop in row]
        self.column, self.needle, self.position = columns_of(self.loops, machine.unit == "loop")
        self.grid = np.full((len(machine.rows), len(self.needle)), "-", dtype=object)
        self.faults: dict[Place, tuple[int, str]] = {}  # lines, and what no letter says
        bound, moved = self._bound_off(), set()
        knitted = [loop for loop in self.loops if loop.row < bound]
        for loop in knitted:
            place = self.place(loop)
            fault = "two loops on one needle in one pass" if self.grid[place] != "-" else ""
            if fault := fault or fault_of(loop, knitted[-1].line):
                self.faults[place] = loop.dropped or loop.line, fault
            self.grid[place] = "T" if not loop.parents else "P" if is_back(loop.needle) else "K"
        for loop, parent in [(each, parent) for each in knitted for parent in each.parents]:
            if self.column[loop.needle] != self.column[parent.needle]:
                self._mark(loop, parent)
                moved.add(parent)
        for loop in knitted:
            if loop not in moved and any(
                crossed for other, crossed in loop.passed.items() if other not in moved
            ):
                fault = "the back bed is racked past another loop, and both stay on their needles"
                self.faults[self.place(loop)] = loop.line, fault
        for place in self.faults:
            self.grid[place] = NO_LETTER
        # Where loops of the last row would be moved is not in the file.
        self.grid = self.grid[: bound - (bound == len(self.grid) and bool(moved))]

    def place(self, loop: Loop) -> Place:
        """Return row and column of a loop."""
        return loop.row, self.column[loop.needle]

    def _bound_off(self) -> int:
        """Return the first row that binds off, or the number of all rows."""
        for number, row in enumerate(self.machine.rows):
            pairs = ((loop, parent) for loop in row for parent in loop.parents)
            if len(row) <= BINDING and any(self.column[a.needle] != self.column[b.needle] for a, b in pairs):
                return number
        return len(self.machine.rows)

    def _mark(self, loop: Loop, parent: Loop) -> None:
        """Add the marks of a parent that was moved to the needle of a loop."""
        place, way = self.place(parent), self.column[loop.needle] - self.column[parent.needle]
        passes = {int(np.sign(way)) * crossings for crossings in parent.passed.values() if crossings}
        if len(passes) > 1 or passes - {1, -1}:
            fact = f"the loop of needle {name_of(parent.needle)} in row {parent.row + 1}"
            self.faults[place] = parent.line, f"{fact} passes in front of one loop and behind another"
        # On the needle first: away from the other bed
        first = parent is loop.parents[0] and len(loop.parents) > 1
        front = passes == {1} or (not passes and first != is_back(loop.needle))
        mark = next(mark for mark, to in MARKS.items() if to == (np.sign(way), front))
        self.grid[place] += abs(way) * mark

    def part(self, rows: Ends | None, needles: Ends | None) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows and columns of the grid with some passes and needles."""
        low, high = rows or (1, len(self.grid))
        there, at = np.arange(len(self.grid)), np.array([needle[1] for needle in self.needle])
        least, most = needles or (at.min(), at.max())
        part = there[(there >= low - 1) & (there < high)], np.flatnonzero((least <= at) & (at <= most))
        if not all(of.size for of in part):
            has = f"rows 1 to {len(self.grid)} and needles {name_of(self.needle[0])} to {name_of(self.needle[-1])}"
            asked = f"rows {rows}, needles {needles}"
            raise ConfigurationError(f"{self.machine.path}: {asked} hold no loops; it has {has}")
        return part

    def begun(self, rows: np.ndarray, columns: np.ndarray, share: float) -> np.ndarray:
        """Return rows without those in which this share of the needles begins."""
        first = (self.grid[np.ix_(rows, columns)] != "-").argmax(axis=0)
        return rows[int(np.quantile(first, share, method="higher")) + 1 :]

    def check(self, stitches: tuple[str, ...], rows: np.ndarray, columns: np.ndarray) -> None:
        """Compare a repeat with every loop of the body. Raises ConfigurationError with line, needle and reason."""
        body = [loop for loop in self.loops if loop.row in rows and self.column[loop.needle] in columns]
        for line, fault in sorted(
            self.faults[place] for place in map(self.place, body) if place in self.faults
        ):
            raise self._refuse(line, f"no letter of a stitch says this: {fault}")
        if wrong := wrong_stitches(stitches):
            if idle := idle_needle(stitches):
                wrong = f"needle {name_of(self.needle[columns[idle - 1]])} never knits"
            raise self._refuse(
                (body or self.loops)[0].line, f"read as {' '.join(stitches)} from here on: {wrong}"
            )
        self._check_layers(body)
        self._check_yarns(body, len(stitches_of_row(stitches[0])))
        parents, high, wide = parents_of_letters(stitches), len(stitches), len(stitches_of_row(stitches[0]))
        for loop in body:
            row, column = self.place(loop)
            here = {self.place(parent) for parent in loop.parents}
            said = parents.get(((row - rows[0]) % high, (column - columns[0]) % wide), ())
            letters = {(row - up, column - along) for up, along in said}
            if here != letters and all(r in rows and c in columns for r, c in here | letters):
                raise self._refuse(
                    loop.line,
                    f"the loop of needle {name_of(loop.needle)} is drawn through {self._names(here)}, but the letters "
                    f"{' '.join(stitches)} say {self._names(letters)}: no letter says that a held loop moves",
                )

    def _refuse(self, line: int, reason: str) -> ConfigurationError:
        return ConfigurationError(f"{self.machine.path}, {self.machine.unit} {line}: {reason}")

    def _names(self, places: set[Place]) -> str:
        named = [f"{name_of(self.needle[column])} of row {row + 1}" for row, column in sorted(places)]
        return " and ".join(named) or "no loop"

    def _check_layers(self, body: list[Loop]) -> None:
        """Refuse two layers: loops of both beds in the body, which no row and no loop joins."""
        rows = {loop.row: {is_back(each.needle) for each in self.machine.rows[loop.row]} for loop in body}
        joined = any(len(beds) > 1 for beds in rows.values())
        crossed = any(
            is_back(parent.needle) != is_back(loop.needle) for loop in body for parent in loop.parents
        )
        if len(set().union(*rows.values())) > 1 and not joined and not crossed:
            raise self._refuse(
                body[0].line,
                "from here on passes are of one bed each and no loop changes beds: a tube or a pocket, two layers that "
                "are joined at their edges alone, which an endless fabric does not have",
            )

    def _check_yarns(self, body: list[Loop], wide: int) -> None:
        """Refuse a yarn that does not lead from needle to needle along rows and turn at the edges of the knit."""
        inside, near = set(body), max(EDGE, min(wide, len(self.needle) // 4))
        live = [{self.column[needle] for needle in row if needle in self.column} for row in self.machine.live]
        carriers = dict.fromkeys(carrier for loop in self.loops for carrier in loop.carriers)
        yarns = {name: [loop for loop in self.loops if name in loop.carriers] for name in carriers}
        for carrier, loop, after in (
            (name, *step) for name, yarn in yarns.items() for step in pairwise(yarn)
        ):
            if loop.cut or not inside & {loop, after}:
                continue
            here, there = self.column[loop.needle], self.column[after.needle]
            if loop.row == after.row:
                fits = here != there and (there > here) == (loop.way == "+")
            else:
                across = live[after.row] | {here, there}
                left, right = (
                    sum(c < max(here, there) for c in across),
                    sum(c > min(here, there) for c in across),
                )
                fits = min(left, right) <= near
            if not fits:
                at = {name: [each.needle[1] for each in yarn] for name, yarn in yarns.items()}
                extents = ", ".join(
                    f"carrier {name}: needles {min(of)} to {max(of)}" for name, of in at.items()
                )
                raise self._refuse(
                    after.line,
                    f"the yarn of carrier {carrier} leads from needle {name_of(loop.needle)} ({self.machine.unit} "
                    f"{loop.line}) to "
                    f"{name_of(after.needle)}: no step along a row and no turn at an edge of the knit, as in intarsia, "
                    f"short rows, cords and racked ribs ({extents})",
                )

    def require_one_yarn(self, rows: np.ndarray) -> None:
        """Refuse rows of other yarns above or below the body, such as waste yarn: which fabric is meant?

        Several yarns in the body are taken as one, with a warning.
        """
        of_row = [{carrier for loop in row for carrier in loop.carriers} for row in self.machine.rows]
        body = set().union(*(of_row[row] for row in rows))
        if len(body) > 1:
            log.warning(
                "%s: carriers %s are taken as one yarn", self.machine.path, " and ".join(sorted(body))
            )
        if others := [row for row, carriers in enumerate(of_row) if not carriers & body]:
            here, there = (
                " and ".join(sorted(of)) for of in (body, set().union(*(of_row[row] for row in others)))
            )
            raise ConfigurationError(
                f"{self.machine.path}: rows {rows[0] + 1} to {rows[-1] + 1} are of carrier {here}, rows "
                f"{others[0] + 1} to {others[-1] + 1} of carrier {there}, such as waste yarn: name the rows that are "
                f"meant, such as pattern.knitout_rows: [{rows[0] + 1}, {rows[-1] + 1}]"
            )

    def spacing(self, columns: np.ndarray, wide: int) -> float | None:
        """Return the spacing of the columns of a repeat that is `wide` columns wide. [m]"""
        if (gauge := self.machine.gauge) is None:
            return None
        at = self.position[columns]
        needles = (
            (at[wide] - at[0]) / wide if len(at) > wide else np.mean(np.diff(at)) if len(at) > 1 else 1.0
        )
        return INCH / gauge * float(needles)


def fault_of(loop: Loop, last: int) -> str:
    """Return what no letter says of a loop of a file whose last loop is in line `last`; empty if letters say it."""
    if len(loop.carriers) > 1:
        return f"plating: a loop of the carriers {' and '.join(loop.carriers)}; the yarn of a scene is one"
    if loop.made_in == "split" or any(parent.children > 1 for parent in loop.parents):
        return "split: a loop that is drawn through stays, and may be drawn through again"
    if any(parent.row == loop.row for parent in loop.parents):
        return "a tuck and a knit on one needle in one pass"
    if not loop.children and 0 < loop.dropped < last:
        return "drop: a loop falls from its needle and is never knitted"
    return ""


def columns_of(loops: Sequence[Loop], facing: bool) -> tuple[dict[Needle, int], list[Needle], np.ndarray]:
    """Return the column of every needle, a needle of every column, and where columns are, in needles.

    Needles of both beds at one number are one column where loops went across; everywhere if they are `facing`.
    """
    pairs = [(loop, parent) for loop in loops for parent in loop.parents]
    across = {
        each.needle[1]
        for pair in pairs
        for each in pair
        if facing or is_back(pair[0].needle) != is_back(pair[1].needle)
    }
    made: dict[Needle, list[float]] = {}
    for loop in loops:
        made.setdefault(loop.needle, []).append(loop.position)
    at = {needle: needle[1] if needle[1] in across else float(np.median(of)) for needle, of in made.items()}
    column: dict[Needle, int] = {}
    needles: list[Needle] = []
    for needle in sorted(at, key=lambda needle: (at[needle], is_back(needle))):
        if not needles or needle[1] not in across or needles[-1][1] != needle[1]:
            needles.append(needle)
        column[needle] = len(needles) - 1
    return column, needles, np.array([at[needle] for needle in needles])


def parents_of_letters(stitches: Sequence[str]) -> dict[Place, set[Place]]:
    """Return how many rows below and columns to the left the parents of stitches are, by row and column of a repeat."""
    high, wide = len(stitches), len(stitches_of_row(stitches[0]))
    parents: dict[Place, set[Place]] = {}
    for (row, column), (up, along) in ways_to_next(stitches).items():
        if STITCHES.find(stitches_of_row(stitches[row])[column][0]).has_head:
            parents.setdefault(((row + up) % high, (column + along) % wide), set()).add((up, along))
    return parents


def largest_repeat(grid: np.ndarray) -> tuple[tuple[slice, slice], Place] | None:
    """Return the largest part of a grid that repeats itself, and the rows and columns of its smallest repeat.

    Two repeats or more lie above each other and side by side, or else one is as wide as the grid. What is left out on
    any side is at most half as wide as the part. None where no part is like that.
    """
    rows, columns = grid.shape
    grid = np.unique(grid.astype(str), return_inverse=True)[1].reshape(grid.shape)
    for widths in (range(1, columns // 2 + 1), (columns,)):
        most = 0
        found: tuple[tuple[slice, slice], Place] | None = None
        for size in sorted(product(range(1, rows // 2 + 1), widths), key=lambda size: size[0] * size[1]):
            if found and not any(count % part for count, part in zip(size, found[1], strict=True)):
                continue  # the same repeat, several times
            for body in _bodies(grid, *size):
                extent = [part.stop - part.start for part in body]
                margins = [
                    max(part.start, whole - part.stop)
                    for part, whole in zip(body, (rows, columns), strict=True)
                ]
                narrow = all(2 * margin <= part for margin, part in zip(margins, extent, strict=True))
                if narrow and extent[0] * extent[1] > most:
                    most, found = extent[0] * extent[1], (body, size)
        if found:
            return found
    return None


def _bodies(grid: np.ndarray, high: int, wide: int) -> Iterator[tuple[slice, slice]]:
    """Return parts of a grid that repeat themselves after `high` rows and `wide` columns, grown from cores of two."""
    up, along = grid[high:] == grid[:-high], grid[:, wide:] == grid[:, :-wide]

    def repeats(box: list[int]) -> bool:
        bottom, top, left, right = box
        return bool(
            up[bottom : top - high, left:right].all() and along[bottom:top, left : right - wide].all()
        )

    core = 2 * high, min(2 * wide, grid.shape[1])
    corners = [{0, (size - of) // 2, size - of} for size, of in zip(grid.shape, core, strict=True)]
    boxes = ([bottom, bottom + core[0], left, left + core[1]] for bottom, left in product(*corners))
    for box, order in product(filter(repeats, boxes), ((0, 1, 2, 3), (2, 3, 0, 1))):
        grown = list(box)
        for side in order:
            step, end = (1, grid.shape[side // 2]) if side % 2 else (-1, 0)
            while grown[side] != end:
                grown[side] += step
                if not repeats(grown):
                    grown[side] -= step
                    break
        yield slice(*grown[:2]), slice(*grown[2:])
