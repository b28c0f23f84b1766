"""The table of numbers in a text file of a testing machine: encoding, separator, names, units, marks of numbers.

Machines write lines of metadata above the table, a row of units below the names, comments, empty columns, remarks below
the table; programs for other countries write decimal commas. The table is the rows that have two numbers or more. No
number is guessed: a text that can be read in two ways, and a row that cannot be read, are refused by their line.
"""

from __future__ import annotations

import csv
import logging
import re
from collections.abc import Iterable, Sequence
from itertools import zip_longest
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


Lines = dict[int, tuple[str, ...]]
"""Fields of the lines of a file that are not empty, by their numbers from 1."""


def is_row(fields: Sequence[str]) -> bool:
    """Return whether fields are a row of the table: two of them look like numbers, or more."""
    return sum(bool(NUMBER.match(field)) for field in fields) > 1


def read_lab_table(path: Path, skip_bad: bool = False) -> pd.DataFrame:
    """Return the table of a file: numbers (float) and words by the names of columns, units in brackets behind names.

    Rows that are not of the table are named in the log.

    Raises DataFileError if there is no table, a row cannot be read (unless `skip_bad`), or a number in two ways.
    """
    lines, separator = _best_split(read_text(path), path)
    numbers = [number for number, fields in lines.items() if is_row(fields)]
    above, below = ([n for n in lines if n < numbers[0]], [n for n in lines if n > numbers[-1]])
    head, named = _names([lines[number] for number in above], path)
    if twice := next((name for name in head if name and head.count(name) > 1), None):
        raise DataFileError(f"{path}: {head.count(twice)} columns are named {twice!r}: rename them")
    inside = [number for number in lines if numbers[0] <= number <= numbers[-1]]
    rows = {
        number: (lines[number] + ("",) * len(head))[: len(head)]
        for number in inside
        if is_row(lines[number]) and not any(lines[number][len(head) :])
    }
    table = pd.DataFrame(rows.values(), rows, head).loc[:, [*map(bool, head)]]
    fits, empty = table.apply(lambda column: column.map(_fits)), table == ""
    words = 2 * (fits & ~empty).sum() <= (~empty).sum()  # columns that are not mostly numbers
    table = table[(fits | words).all(axis=1)]
    bad = [number for number in inside if number not in table.index]
    if bad and not skip_bad:
        shown = " | ".join(lines[bad[0]])[:60]
        raise DataFileError(
            f"{path}: line {bad[0]} ({shown}) is no row of the {len(head)} columns {', '.join(head)}: mend "
            "it, or add --skip-bad"
        )
    unused = {"above the table": above[: -len(named)], "unreadable": bad, "below the table": below}
    for where, left_out in unused.items():
        if left_out:
            some = ", ".join(map(str, left_out[:6])) + (", ..." if len(left_out) > 6 else "")
            log.warning("%s: %d lines %s are not used: %s", path, len(left_out), where, some)
    marks = _marks(table, separator, path)
    table = table.apply(lambda column: _converted(column, *marks))
    # Full names of columns, with units, by the names in the file
    table.attrs["full_names"] = dict(zip(named[0], head, strict=False))
    return table


def _fits(field: str) -> bool:
    """Return whether the text of a field is empty or a number, as all fields of a numeric column are."""
    return not field or bool(NUMBER.match(field))


def _best_split(text: str, path: Path) -> tuple[Lines, str | None]:
    """Return the lines of a text, split so that most of them are rows of numbers, and the separator."""
    if text.startswith("PK\x03\x04"):
        raise DataFileError(f"{path}: is a workbook or another packed file; save the table as CSV")
    texts = re.split("\r\n|\r|\n", text)
    said = SEPARATOR_LINE.match(texts[0].strip())
    if said:
        texts[0] = ""
    kept = {
        number: line
        for number, line in enumerate(texts, 1)
        if line.strip() and not line.lstrip().startswith(COMMENT)
    }
    try:
        splits = {mark: _split(kept, mark) for mark in ([said[1]] if said else SEPARATORS)}
    except csv.Error as error:
        raise DataFileError(f"{path}: is no table of text ({error}); save it as CSV") from error
    count = {mark: sum(map(is_row, lines.values())) for mark, lines in splits.items()}
    best = max(count, key=lambda mark: count[mark])
    if not count[best]:
        raise DataFileError(
            f"{path}: must be a table with names of columns above rows of numbers, parted by commas, semicolons, tabs "
            "or spaces"
        )
    return splits[best], best


def _split(texts: dict[int, str], separator: str | None) -> Lines:
    parted: Iterable[list[str]]
    if separator is None:
        parted = (re.split(r"\t|\s{2,}|\s(?=[+-]?[\d.,])", text.strip()) for text in texts.values())
    else:
        parted = csv.reader(texts.values(), delimiter=separator, skipinitialspace=True)
    return {
        number: tuple(field.strip() for field in fields)
        for number, fields in zip(texts, parted, strict=False)
    }


def _names(above: list[tuple[str, ...]], path: Path) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return the names of columns, with their units if the file has a row of units, and the lines of both."""
    if not above:
        raise DataFileError(
            f"{path}: has no names of columns above its first row of numbers; write them there"
        )
    units = ["" if (unit := field.strip("()[]")) == "-" else unit for field in above[-1]]
    if len(above) == 1 or not any(units) or not all(is_unit(unit) for unit in units if unit):
        return list(above[-1]), above[-1:]
    pairs = zip_longest(above[-2], units[: len(above[-2])], fillvalue="")
    return [f"{name} ({unit})" if unit else name for name, unit in pairs], above[-2:]


def _marks(table: pd.DataFrame, separator: str | None, path: Path) -> tuple[str, str]:
    """Return the decimal mark and the mark of thousands of all numbers of a table."""
    fields = {field.translate(SPACES) for field in table.to_numpy().ravel() if NUMBER.match(field)}
    decimal: dict[str, str] = {}
    for field in sorted(fields):
        body = re.split("[eE]", field)[0]
        both = [mark for mark in ".," if mark in body]
        if len(both) == 2:
            decimal.setdefault(max(both, key=body.rfind), field)
        elif both and (not GROUPED.fullmatch(body) or body.lstrip("+-").startswith("0")):
            decimal.setdefault(both[0], field)
    if len(decimal) == 2:
        raise DataFileError(f"{path}: {decimal['.']} has a decimal point and {decimal[',']} a decimal comma")
    if not decimal:
        # Between commas or spaces a point is a decimal one.
        marks = "," if separator in (",", None) else ",."
        if grouped := sorted(field for field in fields if any(mark in field for mark in marks)):
            raise DataFileError(
                f"{path}: {grouped[0]} can be a thousand times as much as with a decimal mark: leave out marks of "
                "thousands, or write one more decimal"
            )
        decimal = {".": ""}
    (mark,) = decimal
    return mark, "." if mark == "," else ","


def _converted(column: pd.Series, decimal: str, thousands: str) -> pd.Series:
    """Return a column as numbers where each of its fields is one or empty, else as it is."""
    if not column.map(_fits).all():
        return column
    plain = column.map(lambda field: field.translate(SPACES).replace(thousands, "").replace(decimal, "."))
    return pd.to_numeric(plain.replace("", "nan"), errors="coerce").astype(float)
