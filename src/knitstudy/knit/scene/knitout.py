"""Stitches from a file that drives a knitting machine.

The loops that `knitting_machine` makes are the truth. Letters are one way to write those of a repeat: passes of the
carriage are rows, needles are columns, and the largest part that repeats itself is the body. Every loop of the body
must be drawn through the loops that the letters say, and every yarn must lead from loop to loop as rows do; or the file
is refused with the line.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.flat_knit import EDGE, Body, Fault, fault_of_knit, width_of
from knitstudy.knit.scene.knit_graph import machine_of
from knitstudy.knit.scene.knitting_machine import Machine, MachineLoop, Needle, is_back, name_of, some_of
from knitstudy.knit.scene.repeat_search import largest_repeat, numbered
from knitstudy.knit.scene.stitches import (
    MARKS,
    Place,
    empty_needle,
    idle_needle,
    knits,
    parents_of_letters,
    size_of_repeat,
    wrong_stitches,
)

log = logging.getLogger(__name__)

INCH = 25.4e-3  # [m]
BINDING = 2  # Loops of a pass that binds off, at most
MOST = 0.9  # Share of the needles that begin in the rows of the cast-on; others may begin later, at edges
FEWEST = 2  # Rows of a piece that does not repeat itself
MOST_PLACES = 4_000_000  # Rows times columns
LETTERS = 60  # Characters of letters that a message shows
NO_LETTER = "?"

Ends = tuple[int, int]  # the first and the last one


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
    default all. Raises ConfigurationError when the file cannot be read or knitted, holds what no letters say, or is no
    endless flat fabric, such as a tube or a triangle, with its line; when rows of another yarn lie above or below the
    body; or when no needle knits twice.
    """
    machine = Machine.of_file(Path(knit)) if isinstance(knit, str | Path) else machine_of(knit)
    letters = Letters(machine)
    part, columns = letters.part(rows, needles)
    body, high = letters.body(part, columns, bool(rows))
    stitches = letters.stitches(body, high)
    if not rows and not body.repeats:
        letters.require_mixed_rows(body)
    letters.check(stitches, body)
    if not rows:
        letters.require_one_yarn(body)
        if high < FEWEST and not body.repeats:
            fact = f"row {body.rows[0] + 1} alone follows the cast-on of all needles"
            raise ConfigurationError(f"{machine.path}: {fact}: one row does not show the repeat")
    if not body.repeats and high > 1:
        log.warning("%s: no rows repeat: all rows are taken as the repeat", machine.path)
    names = [name_of(letters.needle[end]) for end in (body.columns[0], body.columns[-1], 0, -1)]
    read = Repeat(
        stitches, letters.spacing(body), (body.rows[0] + 1, body.rows[-1] + 1), (names[0], names[1])
    )
    begun = part if rows else letters.begun(part, columns, MOST)
    less = body.rows[0] > begun[0] or len(body.rows) + 1 < len(begun)
    if less or len(body.columns) < len(letters.needle):
        text = "the repeat is of rows {} to {} of {}, needles {} to {} of {} to {}; what begins, is bound off"
        known = text.format(*read.rows, len(machine.rows), *names)
        log.warning("%s: %s or is another pattern is left out", machine.path, known)
    return read


class Letters:
    """A knit as rows of letters: `grid` has a stitch, a letter with its marks, for every row and column.

    It is `NO_LETTER` for what no letter says. `needle` is a needle of every column. Raises ConfigurationError where a
    machine has knitted nothing, on one needle alone, or a few loops on very many rows and needles.
    """

    def __init__(self, machine: Machine) -> None:
        if not machine.rows:
            raise ConfigurationError(f"{machine.path}: has no stitches")
        self.machine = machine
        self.loops = [loop for row in machine.rows for loop in row]
        self.column, self.needle, self.position = columns_of(self.loops, machine.unit == "loop")
        if len(self.needle) == 1:
            raise ConfigurationError(f"{machine.path}: all loops are on one needle: a chain, and no fabric")
        size = len(machine.rows), len(self.needle)
        if size[0] * size[1] > MOST_PLACES:
            fact = f"{len(self.loops)} loops in {size[0]} passes over {size[1]} needles"
            raise ConfigurationError(
                f"{machine.path}: {fact}; allowed are {MOST_PLACES} places, rows times needles"
            )
        self.grid = np.full(size, "-", dtype=object)
        self.faults: dict[Place, Fault] = {}  # what no letter says
        bound = self._bound_off()
        knitted = [loop for loop in self.loops if loop.row < bound]
        for loop in knitted:
            self._write(loop, knitted[-1].line)
        moved = self._mark_moved(knitted)
        self._find_racked(knitted, moved)
        for place in self.faults:
            self.grid[place] = NO_LETTER
        # Where loops of the last row would be moved is not in the file.
        self.grid = self.grid[: bound - (bound == len(self.grid) and bool(moved))]

    def _write(self, loop: MachineLoop, last: int) -> None:
        """Write the letter of a loop of a file whose last loop is in line `last`."""
        place = self.place(loop)
        fault = "two loops on one needle in one pass" if self.grid[place] != "-" else ""
        if fault := fault or fault_of(loop, last):
            self.faults[place] = Fault(loop.dropped or loop.line, fault)
        self.grid[place] = "T" if not loop.parents else "P" if is_back(loop.needle) else "K"

    def _mark_moved(self, knitted: Sequence[MachineLoop]) -> set[MachineLoop]:
        """Add the marks of all loops that were moved to other needles, and return these loops."""
        moved = set()
        for loop in knitted:
            for parent in loop.parents:
                if self.column[loop.needle] != self.column[parent.needle]:
                    self._mark(loop, parent)
                    moved.add(parent)
        return moved

    def _find_racked(self, knitted: Sequence[MachineLoop], moved: set[MachineLoop]) -> None:
        """Add faults of loops that stay on their needles, and are racked past others that do."""
        for loop in knitted:
            past = any(crossed for other, crossed in loop.passed.items() if other not in moved)
            if past and loop not in moved:
                fault = "the back bed is racked past another loop, and both stay on their needles"
                self.faults[self.place(loop)] = Fault(loop.line, fault)

    def place(self, loop: MachineLoop) -> Place:
        """Return row and column of a loop; column -1 of a needle that is left out."""
        return loop.row, self.column.get(loop.needle, -1)

    def _bound_off(self) -> int:
        """Return the first row that binds off, or the number of all rows."""
        return next(
            (at for at, row in enumerate(self.machine.rows) if self._binds_off(row)), len(self.machine.rows)
        )

    def _binds_off(self, row: Sequence[MachineLoop]) -> bool:
        """Whether loops are moved to be drawn off: in a pass of a few loops, or most by the next one of the pass."""
        moved = [
            parent
            for loop in row
            for parent in loop.parents
            if self.column[loop.needle] != self.column[parent.needle]
        ]
        chained = sum(parent.row == row[0].row for parent in moved)
        return bool(moved) and (len(row) <= BINDING or 2 * chained >= len(row))

    def _mark(self, loop: MachineLoop, parent: MachineLoop) -> None:
        """Add the marks of a parent that was moved to the needle of a loop."""
        place = self.place(parent)
        way = self.column[loop.needle] - self.column[parent.needle]
        passes = {int(np.sign(way)) * crossings for crossings in parent.passed.values() if crossings}
        if len(passes) > 1 or passes - {1, -1}:
            fact = f"the loop of needle {name_of(parent.needle)} in row {parent.row + 1}"
            self.faults[place] = Fault(parent.line, f"{fact} passes in front of one loop and behind another")
        # On the needle first: away from the other bed
        first = parent is loop.parents[0] and len(loop.parents) > 1
        front = passes == {1} or (not passes and first != is_back(loop.needle))
        mark = next(mark for mark, to in MARKS.items() if to == (np.sign(way), front))
        self.grid[place] += abs(way) * mark

    def part(self, rows: Ends | None, needles: Ends | None) -> tuple[range, range]:
        """Return the rows and columns of the grid with some passes and needles, without empty columns."""
        low, high = rows or (1, len(self.grid))
        at = [needle[1] for needle in self.needle]
        least, most = needles or (min(at), max(at))
        has = (
            f"rows 1 to {len(self.grid)} and needles {name_of(self.needle[0])} to {name_of(self.needle[-1])}"
        )
        there = range(max(low - 1, 0), min(high, len(self.grid)))
        self._leave_out_empty(there)
        columns = [column for column, needle in enumerate(self.needle) if least <= needle[1] <= most]
        if not there or not columns:
            asked = f"rows {rows}, needles {needles}"
            raise ConfigurationError(f"{self.machine.path}: {asked} hold no loops; it has {has}")
        return there, range(columns[0], columns[-1] + 1)

    def _used(self, rows: range) -> set[int]:
        """Return columns that have loops in some rows, made or held; but not held ones that are never knitted again."""
        used = {self.column[loop.needle] for row in rows for loop in self.machine.rows[row]}
        for loop in (each for each in self.loops if each.gone is not None):
            for begun, end, needle in loop.spans(len(self.machine.rows)):
                if begun < rows.stop and end > rows.start:
                    used.add(self.column.get(needle, self.column[loop.needle]))
        return used

    def _leave_out_empty(self, rows: range) -> None:
        """Leave out columns without loops in some rows, such as those of waste yarn alone."""
        used = self._used(rows)
        left = sorted(used)
        number = {column: at for at, column in enumerate(left)}
        self.column = {needle: number[column] for needle, column in self.column.items() if column in used}
        self.faults = {(row, number[at]): fault for (row, at), fault in self.faults.items() if at in used}
        self.needle = [self.needle[at] for at in left]
        self.position = self.position[left]
        self.grid = self.grid[:, left]

    def begun(self, rows: range, columns: range, share: float) -> range:
        """Return rows without those in which this share of the needles begins."""
        grid = self.grid[rows.start : rows.stop, columns.start : columns.stop]
        first = (grid != "-").argmax(axis=0)
        return rows[int(np.quantile(first, share, method="higher")) + 1 :]

    def fabric(self, rows: range, columns: range) -> range:
        """Return rows behind the cast-on: its tucks on needles that have not knitted, and its rounds of loops."""
        rows = self.begun(rows, columns, 1.0)
        grid = self.grid[rows.start : rows.stop, columns.start : columns.stop]
        knit = {stitch: stitch == NO_LETTER or knits(stitch) for stitch in set(grid.ravel().tolist())}
        drawn = np.array([[knit[stitch] for stitch in row] for row in grid], dtype=bool).reshape(grid.shape)
        tucks = (grid != "-") & ~np.logical_or.accumulate(drawn, axis=0)
        last = np.flatnonzero(tucks.any(axis=1))
        return self._behind_rounds(rows[last[-1] + 1 :] if last.size else rows, columns)

    def body(self, rows: range, columns: range, all_rows: bool) -> tuple[Body, int]:
        """Return the largest part that repeats itself, with the rows of its repeat.

        Where there is none, it is all but the cast-on. Raises ConfigurationError where nothing is left.
        """
        begun = rows if all_rows else self.begun(rows, columns, MOST)
        grid = self.grid[begun.start : begun.stop, columns.start : columns.stop]
        numbers = numbered(grid.ravel().tolist()).reshape(grid.shape)
        try:
            found = largest_repeat(numbers) if grid.size else None
        except ConfigurationError as error:
            raise ConfigurationError(f"{self.machine.path}: {error}") from None
        if found:
            (up, along), (high, wide) = found
            return Body(begun[up], columns[along], wide, True), high
        whole = rows if all_rows else self.fabric(rows, columns)
        if not whole:
            raise ConfigurationError(f"{self.machine.path}: {self._nothing(columns)}")
        numbers = numbers[len(begun) - len(whole) :]
        alike = (n for n in range(1, len(columns) // 2 + 1) if (numbers[:, n:] == numbers[:, :-n]).all())
        return Body(whole, columns, next(alike, len(columns)), False), len(whole)

    def _behind_rounds(self, rows: range, columns: range) -> range:
        """Return rows behind first rounds of several passes, in which one yarn knits once on every needle.

        A cast-on goes on in this way, and the first row of the fabric knits on all needles.
        """
        begun = 0
        met = set[int]()
        yarns = set[tuple[str, ...]]()
        for number, row in enumerate(rows):
            knitted = {column for column in columns if self.grid[row, column] != "-"}
            yarns |= {loop.carriers for loop in self.machine.rows[row]}
            if knitted & met or len(yarns) > 1:
                break
            if len(knitted) == len(columns):
                return rows[begun:]
            met |= knitted
            if len(met) == len(columns):
                begun = number + 1
                met = set()
        return rows

    def _nothing(self, columns: range) -> str:
        """Return why no row of some columns is a row of fabric."""
        fact = "no row follows on one in which every needle has a loop: nothing is a stitch"
        begun: dict[int, MachineLoop] = {}
        for loop in self.loops:
            begun.setdefault(self.place(loop)[1], loop)
        late = max((loop for column, loop in begun.items() if column in columns), key=lambda loop: loop.row)
        if late.row > EDGE:
            fact += f" (needle {name_of(late.needle)} begins in row {late.row + 1}: the piece becomes wider)"
        return fact

    def stitches(self, body: Body, high: int) -> tuple[str, ...]:
        """Return the rows of letters of the repeat of a part, `high` rows."""
        columns = slice(body.columns.start, body.columns.start + body.wide)
        return tuple("".join(self.grid[row, columns]) for row in body.rows[:high])

    def check(self, stitches: tuple[str, ...], body: Body) -> None:
        """Compare a repeat with every loop of the body. Raises ConfigurationError with line, needle and reason."""
        loops = [
            loop for row in body.rows for loop in self.machine.rows[row] if body.holds(*self.place(loop))
        ]
        faults = [self.faults[place] for place in map(self.place, loops) if place in self.faults]
        if faults:
            first = min(faults, key=lambda fault: fault.line)
            raise self._refuse(first.line, f"stitch letters cannot express this: {first.reason}")
        if fault := fault_of_knit(self.machine, self.column, body):
            raise self._refuse(fault.line, fault.reason)
        if wrong := wrong_stitches(stitches):
            reason = f"read as {_short(stitches)} from here on: {self._named(wrong, stitches, body)}"
            raise self._refuse((loops or self.loops)[0].line, reason)
        self._check_parents(stitches, body, loops)

    def _named(self, wrong: str, stitches: tuple[str, ...], body: Body) -> str:
        """Return what is wrong in letters with the needle of the file."""
        if idle := idle_needle(stitches):
            return f"needle {name_of(self.needle[body.columns[idle - 1]])} never knits"
        if empty := empty_needle(stitches):
            row, column = empty
            needle = name_of(self.needle[body.columns[column - 1]])
            widths = width_of(self.machine, body)
            return (
                f"needle {needle} is empty where row {row} of the repeat knits on it again: a piece that becomes "
                f"narrower or wider ({widths}) is not an endless fabric"
            )
        return wrong

    def _check_parents(self, stitches: tuple[str, ...], body: Body, loops: Sequence[MachineLoop]) -> None:
        """Refuse the first loop that is drawn through other loops than its letters mean."""
        parents, (wide, high) = parents_of_letters(stitches), size_of_repeat(stitches)
        for loop in loops:
            row, column = self.place(loop)
            here = {self.place(parent) for parent in loop.parents}
            drawn = parents.get(((row - body.rows[0]) % high, (column - body.columns[0]) % wide), ())
            letters = {(row - up, column - along) for up, along in drawn}
            if here != letters and all(body.holds(*place) for place in here | letters):
                raise self._refuse(
                    loop.line,
                    f"the loop of needle {name_of(loop.needle)} is drawn through {self._names(here)}, but the letters "
                    f"{_short(stitches)} say {self._names(letters)}: "
                    "stitch letters cannot express that a held loop moves",
                )

    def _refuse(self, line: int, reason: str) -> ConfigurationError:
        return ConfigurationError(f"{self.machine.path}, {self.machine.unit} {line}: {reason}")

    def _names(self, places: set[Place]) -> str:
        named = [f"{name_of(self.needle[column])} of row {row + 1}" for row, column in sorted(places)]
        return some_of(named, " and ") or "no loop"

    def require_mixed_rows(self, body: Body) -> None:
        """Refuse rows of one yarn above those of another where nothing repeats itself: which fabric is meant?"""
        yarns = {
            row: tuple(sorted({c for loop in self.machine.rows[row] for c in loop.carriers}))
            for row in body.rows
        }
        parts = [(of, list(rows)) for of, rows in groupby(body.rows, key=yarns.__getitem__)]
        if len(parts) > 1 and len({of for of, _ in parts}) == len(parts):
            texts = (
                f"rows {rows[0] + 1} to {rows[-1] + 1} of carrier {some_of(of, ' and ')}"
                for of, rows in parts
            )
            raise ConfigurationError(
                f"{self.machine.path}: nothing repeats itself in {some_of(texts)}, such as waste yarn and a draw "
                "thread: name the rows that are meant, such as pattern.knitout_rows: "
                f"[{parts[-1][1][0] + 1}, {parts[-1][1][-1] + 1}]"
            )

    def require_one_yarn(self, body: Body) -> None:
        """Refuse rows of other yarns above or below the body, such as waste yarn: which fabric is meant?

        Several yarns in the body are taken as one, with a warning.
        """
        of_row = [{carrier for loop in row for carrier in loop.carriers} for row in self.machine.rows]
        yarns = set().union(*(of_row[row] for row in body.rows))
        if len(yarns) > 1:
            names = some_of(sorted(yarns), " and ")
            log.warning("%s: carriers %s are taken as one yarn", self.machine.path, names)
        if others := [row for row, carriers in enumerate(of_row) if not carriers & yarns]:
            here, there = (
                some_of(sorted(of), " and ") for of in (yarns, set().union(*(of_row[row] for row in others)))
            )
            first = body.rows[0] + 1
            last = body.rows[-1] + 1
            raise ConfigurationError(
                f"{self.machine.path}: rows {first} to {last} are of carrier {here}, rows {others[0] + 1} to "
                f"{others[-1] + 1} of carrier {there}, such as waste yarn: name the rows that are meant, such as "
                f"pattern.knitout_rows: [{first}, {last}]"
            )

    def spacing(self, body: Body) -> float | None:
        """Return the spacing of the columns of a repeat. [m]"""
        if (gauge := self.machine.gauge) is None:
            return None
        at = self.position[body.columns.start : body.columns.stop]
        wide = body.wide
        needles = (
            (at[wide] - at[0]) / wide if len(at) > wide else np.mean(np.diff(at)) if len(at) > 1 else 1.0
        )
        return INCH / gauge * float(needles)


def _short(stitches: Sequence[str]) -> str:
    """Return rows of letters as a message shows them."""
    text = " ".join(stitches)
    return text if len(text) <= LETTERS else f"{text[:LETTERS]} ... ({len(stitches)} rows)"


def fault_of(loop: MachineLoop, last: int) -> str:
    """Return what letters cannot express of a loop, in a file whose last loop is in line `last`; else empty."""
    if len(loop.carriers) > 1:
        return (
            f"plating: a loop of the carriers {some_of(loop.carriers, ' and ')}; the yarn of a scene is one"
        )
    if loop.made_in == "split" or any(parent.children > 1 for parent in loop.parents):
        return "split: a loop that is drawn through stays, and may be drawn through again"
    if any(parent.row == loop.row for parent in loop.parents):
        return "a tuck and a knit on one needle in one pass"
    if not loop.children and 0 < loop.dropped < last:
        return "drop: a loop falls from its needle and is never knitted"
    return ""


def columns_of(
    loops: Sequence[MachineLoop], facing: bool
) -> tuple[dict[Needle, int], list[Needle], np.ndarray]:
    """Return the column of every needle, a needle of every column, and where columns are, in needles.

    Needles of both beds at one number are one column where loops went across; everywhere if they are `facing`.
    """
    across: set[int] = set()
    made: dict[Needle, list[float]] = {}
    for loop in loops:
        made.setdefault(loop.needle, []).append(loop.position)
        for parent in loop.parents:
            if facing or is_back(loop.needle) != is_back(parent.needle):
                across |= {loop.needle[1], parent.needle[1]}
    at = {needle: needle[1] if needle[1] in across else float(np.median(of)) for needle, of in made.items()}
    column: dict[Needle, int] = {}
    needles: list[Needle] = []
    for needle in sorted(at, key=lambda needle: (at[needle], is_back(needle))):
        if not needles or needle[1] not in across or needles[-1][1] != needle[1]:
            needles.append(needle)
        column[needle] = len(needles) - 1
    return column, needles, np.array([at[needle] for needle in needles])
