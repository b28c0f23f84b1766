"""Stitches from a file that drives a knitting machine: knitout, the open format of CMU's Textiles Lab.

``knitout-interpreter`` knits the file on a virtual machine (the optional dependency ``machine``) and refuses what
cannot be knitted. Its knit graph has every loop, the needle it was made on, and the loops that it is drawn through.
Passes of the carriage are rows and needles are columns; rows over which every needle has knitted are the body, and the
smallest rectangle that repeats itself in the body is the repeat.

McCann 2017, "The knitout (.k) file format", textiles-lab.github.io/knitout.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.study.stitch_letters import MARKS

INCH = 25.4e-3  # [m]
BINDING = 2  # Loops of a pass that binds off, at most
_GAUGE = re.compile(r"^;;\s*Gauge\s*:\s*([0-9.]+)", re.IGNORECASE | re.MULTILINE)

Needle = tuple[int, bool]  # position, and whether it is of the front bed
Place = tuple[int, Needle]  # row and needle of a loop


def repeat_of(path: Path | str) -> tuple[str, ...]:
    """Return the rows of letters of the smallest repeat of a knitout file, the bottom row first.

    Letters are as in ``pattern.stitches``.

    Raises
    ------
    ConfigurationError
        When the file cannot be read or knitted, with its line; when a moved loop passes in front of one loop and behind
        another; or when no needle knits twice.
    """
    path = Path(path)
    rows, parents, front = _knitted(path)
    columns = _columns(parents)
    letters = [["-"] * len(set(columns.values())) for _ in rows]
    for (row, needle), below in parents.items():
        letters[row][columns[needle]] = "T" if not below else "K" if needle[1] else "P"
    marks = {way: mark for mark, way in MARKS.items()}
    for (_, needle), below in parents.items():
        for row, before in below:
            if (way := columns[needle] - columns[before]) != 0:
                mark = marks[1 if way > 0 else -1, (row, before) in front]
                letters[row][columns[before]] += abs(way) * mark
    if any(len(stitch) > 1 for row in letters for stitch in row):
        letters = letters[:-1]  # where loops of the last row would be moved is not in the file
    body = _body(letters)
    if not body:
        raise ConfigurationError(
            f"{path}: no row follows on one in which every needle has a loop: nothing is a stitch"
        )
    return _smallest(body)


def spacing_of(path: Path | str) -> float | None:
    """Return the wale spacing of the machine that a knitout file names in ``;;Gauge:``, needles per inch [m]."""
    gauge = _GAUGE.search(Path(path).read_text(encoding="utf-8"))
    return INCH / float(gauge[1]) if gauge and float(gauge[1]) > 0 else None


def _rows(path: Path) -> tuple[list[list[Any]], Any]:
    """Return the loops of every pass of the carriage, and which loops cross.

    A pass has the loops that one yarn makes in one direction.
    """
    try:
        from knitout_interpreter.run_knitout import run_knitout
    except ImportError as error:
        remedy = "python -m pip install 'knitstudy[machine]'"
        raise ConfigurationError(
            f"{path}: knitout files take the package knitout-interpreter: {remedy}"
        ) from error
    if not path.is_file():
        raise ConfigurationError(f"{path}: there is no such file; allowed is a knitout file")
    try:
        with warnings.catch_warnings():  # lace begins loops on empty needles: no mistake
            warnings.filterwarnings("ignore", message=r"(?s).*empty needle")
            program, _, graph = run_knitout(str(path))
    except Exception as error:  # of the parser, of the file or of the machine
        raise ConfigurationError(_reason(path, error)) from error
    rows: list[list[Any]] = []
    before = None
    for instruction in program.loop_forming_instructions:
        way, position = (instruction.direction, str(instruction.carrier_set)), instruction.needle.position
        back = -position if str(instruction.direction) == "+" else position
        if before is None or way != before[0] or back > before[1]:
            rows.append([])
        rows[-1] += instruction.made_loops
        before = way, back
    return rows, graph.braid_graph


def _reason(path: Path, error: Exception) -> str:
    """Return the message of an error of the package in one line; the package counts lines from 0."""
    number, line = getattr(error, "line_number", None), getattr(error, "knitout_line", "")
    where = str(path) if number is None else f"{path}, line {number + 1}"
    reason = getattr(error, "error", getattr(error, "parse_error", error))
    text = " ".join(str(getattr(reason, "context_message", reason)).split())
    return f"{where}: cannot be knitted: " + ": ".join(filter(None, (" ".join(str(line).split()), text)))


def _needle(loop: Any) -> Needle:
    return int(loop.source_needle.position), bool(loop.source_needle.is_front)


def _knitted(path: Path) -> tuple[list[list[Any]], dict[Place, list[Place]], set[Place]]:
    """Return rows up to where loops are bound off, the loops below each loop, and loops moved to the front.

    Raises ConfigurationError where a loop passes in front of one and behind another.
    """
    rows, braid = _rows(path)
    place = {loop: (row, _needle(loop)) for row, made in enumerate(rows) for loop in made}
    parents: dict[Place, list[Place]] = {}
    front: set[Place] = set()
    for row, made in enumerate(rows):
        moved = [
            (loop, number, under)
            for loop in made
            for number, under in enumerate(loop.parent_loops)
            if _needle(loop)[0] != _needle(under)[0]
        ]
        if moved and len(made) <= BINDING:
            return rows[:row], parents, front
        parents |= {place[loop]: [place[under] for under in loop.parent_loops] for loop in made}
        for loop, number, under in moved:
            others = rows[place[under][0]]
            passes = {braid.get_crossing(under, other).value for other in others if other is not under} - {
                "|"
            }
            if len(passes) > 1:
                fact = f"the loop of needle {_name(_needle(under))} in row {place[under][0] + 1}"
                raise ConfigurationError(f"{path}: {fact} passes in front of one loop and behind another")
            first = number == 0 and len(loop.parent_loops) > 1  # on the needle, away from the other bed
            if passes == {"+"} or (not passes and first == _needle(loop)[1]):
                front.add(place[under])
    return rows, parents, front


def _columns(parents: dict[Place, list[Place]]) -> dict[Needle, int]:
    """Return the column of every needle: needles of both beds at one position are one where loops went across."""
    across = {
        position
        for (_, needle), below in parents.items()
        for _, other in below
        if other[1] != needle[1]
        for position in (needle[0], other[0])
    }
    columns: dict[Any, int] = {}
    needles = {needle for _, needle in parents}
    of = {needle: needle[0] if needle[0] in across else needle for needle in needles}
    for needle in sorted(needles, key=lambda place: (place[0], not place[1])):
        columns.setdefault(of[needle], len(columns))
    return {needle: columns[of[needle]] for needle in needles}


def _name(needle: Needle) -> str:
    return f"{'f' if needle[1] else 'b'}{needle[0]}"


def _body(letters: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
    """Return the rows that repeat themselves, or all, without the rows in which needles and yarns begin."""
    first = [
        next(row for row, line in enumerate(letters) if line[column] != "-")
        for column in range(len(letters[0]))
    ]
    rows = [tuple(line) for line in letters[max(first) + 1 :]]
    starts = (start for start in range(len(rows) - 1) if _period(rows[start:]) <= (len(rows) - start) // 2)
    return rows[next(starts, 0) :]


def _smallest(body: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return the smallest rectangle whose copies are the body, the last of which may be cut at its upper edge."""
    count = _period(body)
    rows = body[:count]
    return tuple("".join(row[: _period(list(zip(*rows, strict=True)))]) for row in rows)


def _period(lines: Sequence[Any]) -> int:
    """Return the smallest number of lines after which lines repeat themselves; all of them where none do."""
    sizes: Iterable[int] = range(1, len(lines) // 2 + 1)
    return next((n for n in sizes if all(a == b for a, b in zip(lines, lines[n:], strict=False))), len(lines))
