"""The table of numbers in a text file of a testing machine: encoding, separator, names, units, marks of numbers.

Machines write lines of metadata above the table, a row of units below the names, comments, empty columns, remarks below
the table; programs for other countries write decimal commas. The table is the rows that have two numbers or more. No
number is guessed: a text that can be read in two ways, and a row that cannot be read, are refused by their line.
"""

from __future__ import annotations

import csv
import logging
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.files import read_text

log = logging.getLogger(__name__)

SEPARATORS = (";", "\t", ",", None)  # None: spaces
SEPARATOR_LINE = re.compile(r'"?sep=(.)"?$', re.IGNORECASE)  # of Excel
COMMENT = ("#", "%%", "//")
NUMBER = re.compile(r"[+-]?(\d[\d.,' \u00a0\u2009]*|[.,]\d+)([eE][+-]?\d+)?$")
GROUPED = re.compile(r"[+-]?\d{1,3}(?:([.,' \u00a0\u2009])\d{3})(?:\1\d{3})*")  # 2,105 or 2.105 or 2'105
SPACES = str.maketrans("", "", "' \u00a0\u2009")


RATIOS = {"%": 0.01, "1": 1.0, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0}
LENGTHS = {"um": 1e-6, "µm": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
FORCES = {"N": 1.0, "cN": 1e-2, "mN": 1e-3, "kN": 1e3, "gf": 9.80665e-3, "kgf": 9.80665, "lbf": 4.4482216}
PER_WIDTH = {
    "N/m": 1.0,
    "N/cm": 1e2,
    "N/mm": 1e3,
    "cN/cm": 1.0,
    "cN/mm": 10.0,
    "mN/mm": 1.0,
    "lbf/in": 175.12684,
}
STRESSES = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "N/mm2": 1e6, "psi": 6894.757}
UNITS = {"strain": RATIOS | LENGTHS, "force": PER_WIDTH | FORCES | STRESSES}
"""Over 1 or N/m; or over m, N and Pa, which take a size of the specimen: divided by it, stresses times it."""


def is_unit(text: str) -> bool:
    """Return whether a text is a unit of some strain or force."""
    return text in UNITS["strain"] or text in UNITS["force"] or text in ("s", "min", "°C")


@dataclass(frozen=True)
class Line:
    """Fields of one line of the file, counted from 1."""

    number: int
    fields: tuple[str, ...]

    @property
    def numbers(self) -> int:
        """How many fields look like numbers."""
        return sum(bool(NUMBER.match(field)) for field in self.fields)


def read_lab_table(path: Path, skip_bad: bool = False) -> pd.DataFrame:
    """Return the table of a file: numbers (float) and words by the names of columns, units in brackets behind names.

    Rows that are not of the table are named in the log.

    Raises DataFileError if there is no table, a row cannot be read (unless `skip_bad`), or a number in two ways.
    """
    lines, separator = _best_split(read_text(path), path)
    first = next(k for k, line in enumerate(lines) if line.numbers > 1)
    last = max(k for k, line in enumerate(lines) if line.numbers > 1)
    head, below = _names(lines[:first], path)
    rows, bad = [], []
    for line in lines[first : last + 1]:
        fields = line.fields[: len(head)] if not any(line.fields[len(head) :]) else ()
        if line.numbers > 1 and fields:
            rows.append(fields + ("",) * (len(head) - len(fields)))
        elif skip_bad:
            bad.append(line.number)
        else:
            shown = " | ".join(line.fields)[:60]
            raise DataFileError(
                f"{path}: line {line.number} ({shown}) is no row of the {len(head)} columns {', '.join(head)}: mend "
                "it, or add --skip-bad"
            )
    _report(path, "above the table", [line.number for line in lines[:first] if line not in below])
    _report(path, "unreadable", bad)
    _report(path, "below the table", [line.number for line in lines[last + 1 :]])
    table = pd.DataFrame(rows, columns=head)
    table = table.loc[:, [bool(name) for name in head]]
    marks = _marks(table, separator, path)
    table = table.apply(lambda column: _converted(column, *marks))
    # Full names of columns, with units, by the names in the file
    table.attrs["full_names"] = dict(zip(below[0].fields, head, strict=False))
    return table


def _best_split(text: str, path: Path) -> tuple[list[Line], str | None]:
    """Return the lines that are not empty, split so that most of them are rows of numbers, and the separator."""
    texts = [line.strip("\r") for line in text.split("\n")]
    said = SEPARATOR_LINE.match(texts[0].strip())
    if said:
        texts[0] = ""
    kept = [
        (k, line) for k, line in enumerate(texts, 1) if line.strip() and not line.lstrip().startswith(COMMENT)
    ]
    splits = {mark: _split(kept, mark) for mark in ([said[1]] if said else SEPARATORS)}
    best = max(splits, key=lambda mark: sum(line.numbers > 1 for line in splits[mark]))
    if not any(line.numbers > 1 for line in splits[best]):
        wanted = (
            "must be a table with names of columns above rows of numbers, parted by commas, semicolons, tabs"
        )
        raise DataFileError(f"{path}: {wanted} or spaces")
    return splits[best], best


def _split(lines: list[tuple[int, str]], separator: str | None) -> list[Line]:
    parted: Iterable[list[str]]
    if separator is None:
        parted = (re.split(r"\t|\s{2,}|\s(?=[+-]?[\d.,])", text.strip()) for _, text in lines)
    else:
        parted = csv.reader((text for _, text in lines), delimiter=separator, skipinitialspace=True)
    numbered = zip((number for number, _ in lines), parted, strict=False)
    return [Line(number, tuple(field.strip() for field in fields)) for number, fields in numbered]


def _names(above: list[Line], path: Path) -> tuple[list[str], list[Line]]:
    """Return the names of columns, with their units if the file has a row of units, and the lines of both."""
    if not above:
        raise DataFileError(
            f"{path}: has no names of columns above its first row of numbers; write them there"
        )
    *_, last = above
    units = [field.strip("()[]") for field in last.fields]
    if (
        len(above) > 1
        and any(map(is_unit, units))
        and all(is_unit(unit) or unit in ("", "-") for unit in units)
    ):
        names = above[-2].fields
        units += [""] * (len(names) - len(units))
        named = [
            f"{name} ({unit})" if unit not in ("", "-") else name
            for name, unit in zip(names, units, strict=False)
        ]
        return named, above[-2:]
    return list(last.fields), [last]


def _marks(table: pd.DataFrame, separator: str | None, path: Path) -> tuple[str, str]:
    """Return the decimal mark and the mark of thousands of all numbers of a table."""
    fields = {field.translate(SPACES) for field in table.to_numpy().ravel() if NUMBER.match(field)}
    decimal: dict[str, str] = {}
    for field in sorted(fields):
        body = re.split("[eE]", field)[0]
        both = [mark for mark in ".," if mark in body]
        if len(both) == 2:
            decimal.setdefault(max(both, key=body.rfind), field)
        elif both and not GROUPED.fullmatch(body):
            decimal.setdefault(both[0], field)
    if len(decimal) == 2:
        raise DataFileError(f"{path}: {decimal['.']} has a decimal point and {decimal[',']} a decimal comma")
    if not decimal:
        commas = sorted(field for field in fields if "," in field)
        if commas and separator in (",", None):
            raise DataFileError(
                f"{path}: {commas[0]} can be a thousand times as much as with a decimal comma: write decimal points"
            )
        decimal = {"," if commas else ".": ""}
    (mark,) = decimal
    return mark, "." if mark == "," else ","


def _converted(column: pd.Series, decimal: str, thousands: str) -> pd.Series:
    """Return a column as numbers where each of its fields is one or empty, else as it is."""
    if not column.map(lambda field: not field or bool(NUMBER.match(field))).all():
        return column
    plain = column.map(lambda field: field.translate(SPACES).replace(thousands, "").replace(decimal, "."))
    return pd.to_numeric(plain.replace("", "nan"), errors="coerce").astype(float)


def _report(path: Path, where: str, lines: list[int]) -> None:
    if lines:
        some = ", ".join(map(str, lines[:6])) + (", ..." if len(lines) > 6 else "")
        log.warning("%s: %d lines %s are not used: %s", path, len(lines), where, some)
