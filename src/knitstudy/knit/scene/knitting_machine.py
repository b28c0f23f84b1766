"""A knitting machine with two beds: it runs a knitout file and keeps every loop, what it is drawn through, and its row.

knitout is the open format of CMU's Textiles Lab for instructions of knitting machines: McCann 2017, "The knitout (.k)
file format", textiles-lab.github.io/knitout. A loop on a back needle b faces the front needle b + rack. Where the back
bed is racked its loops pass behind those of the front bed; loops cross nowhere else.
"""

from __future__ import annotations

import logging
import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from math import ceil, floor
from pathlib import Path
from typing import Any

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.files import read_text

log = logging.getLogger(__name__)

NEEDLE = re.compile(r"([fb]s?)(-?\d+)")
FRONT, BACK = ("f", "fs"), ("b", "bs")  # beds: needles, and the sliders beside them
OUT_OF_ORDER = 1.5  # Needles by which an edge may be written out of order within a pass
FACING = 0.26  # Needles by which two needles may miss each other in a transfer: racked for all needles

Needle = tuple[str, int]  # bed and position


@dataclass(eq=False)
class Loop:
    """A loop of yarn."""

    line: int  # of the file
    needle: Needle
    position: float  # of the needle in front of which it was made
    way: str
    carriers: tuple[str, ...]
    row: int  # pass of the carriage
    made_in: str  # operation
    parents: list[Loop] = field(default_factory=list)
    """Loops it is drawn through, as they came onto the needle."""
    children: int = 0
    dropped: int = 0  # line
    passed: dict[Loop, int] = field(default_factory=dict)
    """Crossings with other loops: 1 for each to the right in front or to the left behind, -1 for the others."""
    cut: bool = False  # the yarn ends behind this loop


def is_back(needle: Needle) -> bool:
    """Whether a needle is of the back bed."""
    return needle[0] in BACK


def name_of(needle: Needle) -> str:
    """Return the name of a needle in a file."""
    return f"{needle[0]}{needle[1]}"


class Machine:
    """A machine that knits: `rows` are passes of the carriage, with the loops of one yarn in one direction."""

    def __init__(self, path: Path | str, unit: str = "line") -> None:
        self.path, self.unit, self.line = path, unit, 0
        self._words: tuple[str, ...] = ()
        self.headers: dict[str, str] = {}
        self.rows: list[list[Loop]] = []
        self.live: list[list[Needle]] = []  # needles with loops as each row begins
        self.rack = 0.0
        self._on: defaultdict[Needle, list[Loop]] = defaultdict(list)
        self._last: dict[str, Loop | None] = {}  # carriers in action, with their last loops
        self._sides: dict[tuple[Loop, Loop], float] = {}
        self._at: tuple[Any, ...] | None = None  # carriers, direction and place of the carriage

    @classmethod
    def of_file(cls, path: Path) -> Machine:
        """Return a machine that has knitted a file; raises ConfigurationError with the line of a wrong instruction."""
        self, unknown = cls(path), dict[str, int]()
        for self.line, text in enumerate(_text(path).splitlines(), 1):
            header = re.match(r";;([^:]+):(.*)", text)
            if header and not self.rows:
                self.headers[header[1].strip().lower()] = header[2].strip()
            elif words := text.split(";")[0].split():
                if words[0].startswith("x-"):
                    unknown.setdefault(words[0], self.line)
                else:
                    self.run(*words)
        if unknown:
            names = ", ".join(f"{word} (line {line})" for word, line in unknown.items())
            log.warning("%s: extensions are left out: %s", path, names)
        if "carriers" not in self.headers:
            log.warning("%s: has no header ;;Carriers:, which the format asks for", path)
        return self

    @property
    def gauge(self) -> float | None:
        """Needles per inch; None where the file does not say."""
        gauge = self.headers.get("gauge", "").rstrip("; \t")
        if not gauge:
            return None
        if not re.fullmatch(r"\d*\.?\d+", gauge) or float(gauge) <= 0:
            allowed = "must be needles per inch, such as 15 or 7.5"
            raise ConfigurationError(f"{self.path}: ;;Gauge: is {gauge!r} but {allowed}")
        return float(gauge)

    def _refuse(self, reason: str) -> ConfigurationError:
        where = f"{self.path}, line {self.line}"
        return ConfigurationError(f"{where}: cannot be knitted: {' '.join(self._words)}: {reason}")

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
            case "rack", (by,) if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)", by):
                self._rack(float(by))
            case "drop", (needle,):
                self._drop(self._needle(needle))
            case "xfer", (needle, other):
                self._transfer(self._needle(needle), self._needle(other))
            case (("knit" | "tuck" | "miss"), (("+" | "-") as way, needle, *carriers)):
                if carriers and name != "miss":
                    self._loop(name, way, self._needle(needle), carriers)
                elif name == "knit":
                    self._drop(self._needle(needle))
            case "split", (("+" | "-") as way, needle, other, *carriers):
                at, to = self._needle(needle), self._needle(other)
                held = list(self._on[at])
                loop = self._loop(name, way, at, carriers) if carriers else None
                self._on[at] = held
                self._transfer(at, to)
                if loop:
                    self._on[at] = [loop]
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
            raise self._refuse(f"{word} is no needle; expected is one such as f10, b-2 or fs3")
        return match[1], int(match[2])

    def _position(self, needle: Needle) -> float:
        return needle[1] + (self.rack if is_back(needle) else 0.0)

    def _loop(self, name: str, way: str, needle: Needle, carriers: list[str]) -> Loop:
        if idle := [carrier for carrier in carriers if carrier not in self._last]:
            raise self._refuse(f"carrier {idle[0]} is inactive yarn: no in or inhook brings it")
        position, yarn = self._position(needle), tuple(carriers)
        along = position if way == "+" else -position
        if not self._goes_on(yarn, way, along, needle):
            self.rows.append([])
            self.live.append([needle for needle, loops in self._on.items() if loops])
        self._at = yarn, way, along
        loop = Loop(self.line, needle, position, way, yarn, len(self.rows) - 1, name)
        if name != "tuck":
            loop.parents = self._on[needle]
            for parent in loop.parents:
                parent.children, parent.dropped = parent.children + 1, 0
            self._on[needle] = []
        self._on[needle].append(loop)
        self.rows[-1].append(loop)
        self._last |= dict.fromkeys(carriers, loop)
        return loop

    def _goes_on(self, yarn: tuple[str, ...], way: str, along: float, needle: Needle) -> bool:
        """Whether a loop is of the pass before it: of its yarn, or of one that takes over where that is cut."""
        if self._at is None or self._at[1] != way:
            return False
        if self._at[0] != yarn:
            return self.rows[-1][-1].cut and along > self._at[2]
        near = self._at[2] - along <= OUT_OF_ORDER and all(loop.needle != needle for loop in self.rows[-1])
        return along >= self._at[2] or near

    def _drop(self, needle: Needle) -> None:
        for loop in self._on.pop(needle, []):
            loop.dropped = self.line

    def hand(self, loops: Iterable[Loop], word: str) -> None:
        """Hang loops on a needle, in this order, wherever they are; what else is on it falls."""
        if hung := list(dict.fromkeys(loops)):
            self._on |= {at: [each for each in on if each not in hung] for at, on in self._on.items()}
            self._drop(self._needle(word))
            self._on[self._needle(word)] = hung

    def _transfer(self, needle: Needle, other: Needle) -> None:
        if is_back(needle) == is_back(other):
            raise self._refuse("the needles are of one bed")
        if abs(self._position(needle) - self._position(other)) > FACING:
            raise self._refuse(f"the needles do not face each other at rack {self.rack:g}")
        # The last loop on a needle is the nearest to the other bed, where it comes to lie deepest.
        self._on[other] += self._on.pop(needle, [])[::-1]

    def _rack(self, to: float) -> None:
        """Rack the back bed: its loops pass behind those loops of the front bed that lie in between."""
        by, self.rack = self.rack, to
        for (bed, number), loops in list(self._on.items()):
            if not is_back((bed, number)):
                continue
            before, after = number + by, number + to
            for place in range(ceil(min(before, after)), floor(max(before, after)) + 1):
                for other in [each for front in FRONT for each in self._on.get((front, place), ())]:
                    for loop in loops:
                        self._pass(loop, other, before - place, after - place)

    def _pass(self, loop: Loop, other: Loop, before: float, after: float) -> None:
        """Keep on which side of a loop of the front bed a loop of the back bed is, and whether it passed behind it."""
        side = self._sides.get((loop, other), float(np.sign(before)))
        now = float(np.sign(after)) or side
        if side and now != side:
            loop.passed[other] = other.passed[loop] = loop.passed.get(other, 0) - int(now)
        self._sides[loop, other], self._sides[other, loop] = now, -now


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
