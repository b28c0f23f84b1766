"""A knitting machine with two beds: it runs a knitout file and keeps every loop, what it is drawn through, and its row.

knitout is the open format of CMU's Textiles Lab for instructions of knitting machines: McCann 2017, "The knitout (.k)
file format", textiles-lab.github.io/knitout. A loop on a back needle b faces the front needle b + rack. Where the back
bed is racked its loops pass behind those of the front bed; loops cross nowhere else.

Numbers of a file are bounded as no machine exceeds them, so that a wrong one is named and not knitted for hours.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import product
from math import ceil, floor
from pathlib import Path

from knitstudy.errors import ConfigurationError, printable
from knitstudy.files import read_text

log = logging.getLogger(__name__)

NEEDLE = re.compile(r"([fb]s?)(-?[0-9]+)")
NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)")
FRONT, BACK = ("f", "fs"), ("b", "bs")  # beds: needles, and the sliders beside them
OUT_OF_ORDER = 1.5  # Needles by which an edge may be written out of order within a pass
FACING = 0.26  # Needles by which two needles may miss each other in a transfer: racked for all needles

DIGITS = 4  # of a needle, at most: beds have less than two thousand needles
FARTHEST = 100  # Needles by which the back bed is racked, at most
GAUGES = (0.5, 100.0)  # Needles per inch
STACK = 100  # Loops on one needle, at most
MOST_LOOPS = 500_000
MOST_PASSED = 5_000_000  # Needles and loops that the back bed is racked past, in a whole file
SHOWN = 60  # Characters of an instruction that a message shows
NAMED = 5  # Names that a message lists

Needle = tuple[str, int]  # bed and position


@dataclass(eq=False, slots=True)
class MachineLoop:
    """A loop of yarn."""

    line: int  # of the file
    needle: Needle
    position: float  # of the needle in front of which it was made
    way: str
    carriers: tuple[str, ...]
    row: int  # pass of the carriage
    made_in: str  # operation
    parents: list[MachineLoop] = field(default_factory=list)
    """Loops it is drawn through, as they came onto the needle."""
    children: int = 0
    dropped: int = 0  # line
    passed: dict[MachineLoop, int] = field(default_factory=dict)
    """Crossings with other loops: 1 for each to the right in front or to the left behind, -1 for the others."""
    cut: bool = False  # the yarn ends behind this loop
    stays: list[tuple[int, Needle]] = field(
        default_factory=list
    )  # needles on which it lies, each as a row begins
    gone: int | None = None  # the first row at whose beginning it lies on no needle any more
    sides: dict[MachineLoop, int] = field(default_factory=dict)
    """On which side of it loops of the other bed lie that it was racked past."""

    def needle_at(self, row: int) -> Needle | None:
        """Return the needle on which it lies as a row begins; None before it is made, and once it is knitted."""
        if self.gone is not None and row >= self.gone:
            return None
        return next((needle for begun, needle in reversed(self.stays) if begun <= row), None)

    def spans(self, rows: int) -> list[tuple[int, int, Needle]]:
        """Return for each of its needles the first row on it and the row after the last, in a knit of `rows`."""
        ends = [begun for begun, _ in self.stays[1:]] + [rows if self.gone is None else self.gone]
        return [
            (begun, end, needle) for (begun, needle), end in zip(self.stays, ends, strict=True) if begun < end
        ]


def is_back(needle: Needle) -> bool:
    """Whether a needle is of the back bed."""
    return needle[0] in BACK


def some_of(names: Iterable[str], joined: str = ", ") -> str:
    """Return the first names of many, and how many more there are."""
    names = list(names)
    more = [f"{len(names) - NAMED} more"] if len(names) > NAMED else []
    return joined.join([shown(name) for name in names[:NAMED]] + more)


def shown(text: str) -> str:
    """Return a text of a file as messages show it: without control characters, and cut off where it is long."""
    return printable(text if len(text) <= SHOWN else f"{text[:SHOWN]} ...")


def name_of(needle: Needle) -> str:
    """Return the name of a needle in a file."""
    return f"{needle[0]}{needle[1]}"


class Machine:
    """A machine that knits: `rows` are passes of the carriage, with the loops of one yarn in one direction."""

    def __init__(self, path: Path | str, unit: str = "line") -> None:
        self.path = path
        self.unit = unit
        self.line = 0
        self._words: tuple[str, ...] = ()
        self.headers: dict[str, str] = {}
        self.rows: list[list[MachineLoop]] = []
        self.rack = 0.0
        self._beds: dict[str, dict[int, list[MachineLoop]]] = {bed: {} for bed in FRONT + BACK}
        self._last: dict[str, MachineLoop | None] = {}  # carriers in action, with their last loops
        self._in_row: set[Needle] = set()  # needles of the row that is knitted
        self._at: tuple[tuple[str, ...], str, float] | None = (
            None  # carriers, direction and place of the carriage
        )
        self._made = self._passed = 0

    @classmethod
    def of_file(cls, path: Path) -> Machine:
        """Return a machine that has knitted a file; raises ConfigurationError with the line of a wrong instruction."""
        self = cls(printable(str(path)))
        unknown = dict[str, int]()
        for self.line, text in enumerate(_text(path).splitlines(), 1):
            header = re.match(r";;([^:]+):(.*)", text)
            if header and not self.rows:
                self.headers[header[1].strip().lower()] = header[2].strip()
            elif words := text.split(";")[0].split():
                words = words if text.isprintable() else [printable(word) for word in words]
                if words[0].startswith("x-"):
                    unknown.setdefault(words[0], self.line)
                else:
                    self.run(*words)
        if unknown:
            names = some_of(f"{shown(word)} (line {line})" for word, line in unknown.items())
            log.warning("%s: extensions are left out: %s", self.path, names)
        if "carriers" not in self.headers:
            log.warning("%s: has no header ;;Carriers:, which the format requires", self.path)
        return self

    @property
    def gauge(self) -> float | None:
        """Needles per inch; None where the file does not say."""
        gauge = self.headers.get("gauge", "").rstrip("; \t")
        if not gauge:
            return None
        number = float(gauge) if NUMBER.fullmatch(gauge) else 0.0
        if not GAUGES[0] <= number <= GAUGES[1]:
            allowed = "must be needles per inch, such as 15 or 7.5"
            raise ConfigurationError(f"{self.path}: ;;Gauge: is {shown(gauge)!r} but {allowed}")
        return number

    def _refuse(self, reason: str) -> ConfigurationError:
        where = f"{self.path}, line {self.line}"
        return ConfigurationError(f"{where}: cannot be knitted: {shown(' '.join(self._words))}: {reason}")

    def run(self, name: str, *words: str) -> None:
        """Run an instruction of knitout."""
        self._words = name, *words
        match name, words:
            case (("in" | "inhook"), _):
                for carrier in self._carriers(words):
                    self._last.setdefault(carrier, None)
            case (("out" | "outhook"), _):
                for carrier in self._carriers(words):
                    if last := self._last.pop(carrier, None):
                        last.cut = True
            case (("releasehook" | "pause" | "stitch" | "amiss"), _):
                pass
            case "rack", (by,) if NUMBER.fullmatch(by):
                self._rack(float(by))
            case "drop", (needle,):
                self._drop(self._needle(needle))
            case "xfer", (needle, other):
                self._transfer(self._needle(needle), self._needle(other))
            case (("knit" | "tuck" | "miss"), (("+" | "-") as way, needle, *carriers)):
                self._stitch(name, way, self._needle(needle), carriers)
            case "split", (("+" | "-") as way, needle, other, *carriers):
                self._split(way, self._needle(needle), self._needle(other), carriers)
            case _ if name in FORMS:
                raise self._refuse(f"{FORMS[name]} is expected")
            case _:
                raise self._refuse(
                    f"expected is one of {', '.join(FORMS)}, in, out, inhook, outhook, releasehook"
                )

    def _carriers(self, words: tuple[str, ...]) -> list[str]:
        """Return the carriers among words: some files also name the needle and the direction."""
        return [word for word in words if word not in "+-" and not NEEDLE.fullmatch(word)]

    def _needle(self, word: str) -> Needle:
        if not (match := NEEDLE.fullmatch(word)):
            raise self._refuse(f"{shown(word)} is not a needle; expected is one such as f10, b-2 or fs3")
        if len(digits := match[2].lstrip("-0")) > DIGITS:
            raise self._refuse(f"{shown(word)} is not a needle of a bed; allowed are {DIGITS} digits")
        return match[1], int(digits or 0) * (-1 if match[2].startswith("-") else 1)

    def _position(self, needle: Needle) -> float:
        return needle[1] + (self.rack if is_back(needle) else 0.0)

    def _stitch(self, name: str, way: str, needle: Needle, carriers: list[str]) -> None:
        """Knit or tuck on a needle, or pass it; a knit of no yarn drops what is there."""
        if carriers and name != "miss":
            self._loop(name, way, needle, carriers)
        elif name == "knit":
            self._drop(needle)

    def _loop(self, name: str, way: str, needle: Needle, carriers: list[str]) -> MachineLoop:
        if idle := [carrier for carrier in carriers if carrier not in self._last]:
            raise self._refuse(f"carrier {shown(idle[0])} is inactive yarn: no in or inhook brings it")
        self._made += 1
        if self._made > MOST_LOOPS:
            raise self._refuse(f"allowed are {MOST_LOOPS} loops in a file; cut out a part of the knit")
        position = self._position(needle)
        yarn = tuple(carriers)
        along = position if way == "+" else -position
        if not self._goes_on(yarn, way, along, needle):
            self.rows.append([])
            self._in_row = set()
        self._at = yarn, way, along
        loop = MachineLoop(self.line, needle, position, way, yarn, len(self.rows) - 1, name)
        if name != "tuck":
            loop.parents = self._taken(needle)
            for parent in loop.parents:
                parent.children = parent.children + 1
                parent.dropped = 0
        self._hang([loop], needle)
        self.rows[-1].append(loop)
        self._in_row.add(needle)
        self._last |= dict.fromkeys(carriers, loop)
        return loop

    def _goes_on(self, yarn: tuple[str, ...], way: str, along: float, needle: Needle) -> bool:
        """Whether a loop is of the pass before it: of its yarn, or of one that takes over where that is cut."""
        if self._at is None or self._at[1] != way:
            return False
        if self._at[0] != yarn:
            return self.rows[-1][-1].cut and along > self._at[2]
        back = self._at[2] - along
        return back <= 0 or (back <= OUT_OF_ORDER and needle not in self._in_row)

    def _taken(self, needle: Needle) -> list[MachineLoop]:
        """Take the loops off a needle, and return them as they came onto it."""
        loops = self._beds[needle[0]].pop(needle[1], [])
        for loop in loops:
            loop.gone = len(self.rows)
            for other in loop.sides:
                other.sides.pop(loop, None)
            loop.sides = {}
        return loops

    def _hang(self, loops: list[MachineLoop], needle: Needle) -> None:
        """Hang loops on a needle, behind those that are there."""
        there = self._beds[needle[0]].setdefault(needle[1], [])
        there += loops
        if len(there) > STACK:
            raise self._refuse(f"allowed are {STACK} loops on one needle, which holds no more")
        for loop in loops:
            loop.stays.append((len(self.rows), needle))
            loop.gone = None

    def _drop(self, needle: Needle) -> None:
        for loop in self._taken(needle):
            loop.dropped = self.line

    def hand(self, loops: Iterable[MachineLoop], word: str) -> None:
        """Hang loops on a needle, in this order, wherever they are; what else is on it falls."""
        needle = self._needle(word)
        hung = list(dict.fromkeys(loops))
        for loop in hung:
            if loop.gone is None:
                bed, number = loop.stays[-1][1]
                self._beds[bed][number].remove(loop)
        if hung:
            self._drop(needle)
            self._hang(hung, needle)

    def _require_facing(self, needle: Needle, other: Needle) -> None:
        if is_back(needle) == is_back(other):
            raise self._refuse("the needles are of one bed")
        if abs(self._position(needle) - self._position(other)) > FACING:
            raise self._refuse(f"the needles do not face each other at rack {self.rack:g}")

    def _transfer(self, needle: Needle, other: Needle) -> None:
        self._require_facing(needle, other)
        # The last loop on a needle is the nearest to the other bed, where it comes to lie deepest.
        self._hang(self._beds[needle[0]].pop(needle[1], [])[::-1], other)

    def _split(self, way: str, needle: Needle, other: Needle, carriers: list[str]) -> None:
        """Knit a loop, and hand the loops that it is drawn through to the other bed, where they stay."""
        if not carriers:
            return self._transfer(needle, other)
        self._require_facing(needle, other)
        loop = self._loop("split", way, needle, carriers)
        return self._hang(loop.parents[::-1], other)

    def _rack(self, to: float) -> None:
        """Rack the back bed: its loops pass behind those loops of the front bed that lie in between."""
        if abs(to) > FARTHEST:
            raise self._refuse(f"allowed are racks by {FARTHEST} needles")
        by = self.rack
        self.rack = to
        for number, loops in [on for bed in BACK for on in self._beds[bed].items() if on[1]]:
            before, after = number + by, number + to
            places = range(ceil(min(before, after)), floor(max(before, after)) + 1)
            others = [
                (place, other)
                for place in places
                for front in FRONT
                for other in self._beds[front].get(place, ())
            ]
            self._passed += 1 + len(places) + len(others) * len(loops)
            if self._passed > MOST_PASSED:
                raise self._refuse(
                    f"the back bed is racked past more than {MOST_PASSED} needles and loops in all"
                )
            for (place, other), loop in product(others, loops):
                _pass(loop, other, before - place, after - place)

    def loops_by_carrier(self) -> dict[str, list[MachineLoop]]:
        """Return the loops of every carrier, in the order of their making."""
        of: dict[str, list[MachineLoop]] = {}
        for loop in (each for row in self.rows for each in row):
            for carrier in dict.fromkeys(loop.carriers):
                of.setdefault(carrier, []).append(loop)
        return of


def _pass(loop: MachineLoop, other: MachineLoop, before: float, after: float) -> None:
    """Keep on which side of a loop of the front bed a loop of the back bed is, and whether it passed behind it."""
    side = loop.sides[other] if other in loop.sides else _sign(before)
    now = _sign(after) or side
    if side and now != side:
        loop.passed[other] = other.passed[loop] = loop.passed.get(other, 0) - now
    loop.sides[other] = now
    other.sides[loop] = -now


def _sign(number: float) -> int:
    return (number > 0) - (number < 0)


FORMS = {
    "knit": "knit + f1 CARRIERS",
    "tuck": "tuck - b1 CARRIERS",
    "miss": "miss + f1 CARRIERS",
    "split": "split + f1 b1 CARRIERS",
    "xfer": "xfer f1 b1",
    "drop": "drop f1",
    "rack": "rack NUMBER",
}


def _text(path: Path) -> str:
    """Return the text of a knitout file."""
    if not path.is_file():
        raise ConfigurationError(f"{path}: there is no such file; allowed is a knitout file")
    text = read_text(path)
    if not text.strip():
        raise ConfigurationError(f"{path}: is empty; allowed is a knitout file")
    if not text.startswith(";!knitout"):
        log.warning("%s: does not begin with ;!knitout-2, as knitout files do", path)
    return text
