"""The tables of numbers in a text file of a testing machine.

The stages: decode the text, split its lines into fields, find tables (names above rows of numbers), join names with a
row of units, and read the numbers. Machines write metadata and tables of results above the raw data, comments, empty
columns and remarks below; programs for other countries write decimal commas. No number is guessed: a text that can be
read in two ways, a row that cannot be read, and a file of several tables are refused by their lines.
"""

from __future__ import annotations

import csv
import logging
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, zip_longest
from pathlib import Path

import numpy as np
import pandas as pd

from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.files import read_text
from knitstudy.use.lab_columns import is_unit, plain_unit

log = logging.getLogger(__name__)

SEPARATORS = (";", "\t", ",", None)  # None: spaces
SEPARATOR_LINE = re.compile(r'"?sep=(.)"?$', re.IGNORECASE)  # of Excel
COMMENT = ("#", "%%", "//")
LEAST = 3  # rows of a table; fewer are numbers among metadata, unless there is no other table
MOST_LINES = 5  # of a field in quotes
LONGEST_NAME = 200  # characters of the name of a column
SHOWN = 60  # characters of a line in a message

# 12, 1.5, ,5, 2,105.6, 2'105 and 1 234 567,8. Mantissa and exponent are bounded: squares of numbers stay finite.
NUMBER = re.compile(
    r"[+−-]?(?:[0-9]{1,3}(?:(?P<mark>[.,'’ ])[0-9]{3})(?:(?P=mark)[0-9]{3}){0,9}(?:(?!(?P=mark))[.,][0-9]{0,30})?"
    r"|[0-9]{1,30}(?:[.,][0-9]{0,30})?|[.,][0-9]{1,30})(?:[eE][+−-]?0?[0-9]{1,2})?"
).fullmatch
GROUPED = re.compile(r"[+-]?[0-9]{1,3}[.,][0-9]{3}").fullmatch  # 2,105 or 2.105
OTHER = {".": ",", ",": "."}
DECIMAL = {".": "a decimal point", ",": "a decimal comma"}
THOUSANDS = {".": "points of thousands", ",": "commas of thousands"}
ONE_STYLE = str.maketrans({"'": "", "’": "", " ": "", "−": "-"})
NAN = "nan"  # a number that was not measured, in lower case, as an empty field
NO_NUMBER = frozenset(
    {NAN, "-", "--", "---", "----", "*", "inf", "-inf", "+inf", "n/a", "na", "null", "none"}
)

Fields = tuple[str, ...]
Lines = dict[int, Fields]
"""Fields of the lines of a file that are not empty, by their numbers from 1."""


@dataclass(frozen=True)
class _Found:
    """A table in a file: its names with units, and the numbers of its lines."""

    names: Fields
    header: tuple[int, ...]  # lines of the names and of their units
    rows: list[int] = field(default_factory=list)
    bad: list[int] = field(default_factory=list)  # lines among the rows that are no rows


def read_lab_table(path: Path, skip_bad: bool = False, number: int | None = None) -> pd.DataFrame:
    """Return a table of a file: numbers (float) and words by names of columns, by the numbers of their lines.

    Every column name ends with its unit in brackets, even if the file has a separate row of units. The log names the
    lines that do not belong to the table.

    Parameters
    ----------
    path : Path
        Text in any usual encoding.
    skip_bad : bool
        Leave out rows that cannot be read, and read tables with the same names as one.
    number : int, optional
        Which of several tables, from 1.

    Raises
    ------
    DataFileError
        If there is no table, or there are several and none is named; if a row cannot be read, unless `skip_bad`; if a
        number can be read in two ways.
    """
    lines, separator, tables = _best_split(read_text(path), path)
    found = _chosen(tables, skip_bad, number, path)
    if twice := next((name for name, count in Counter(found.names).items() if name and count > 1), None):
        raise DataFileError(f"{path}: {found.names.count(twice)} columns are named {twice!r}: rename them")
    rows, numeric, bad = _read_rows(lines, found)
    if bad and not skip_bad:
        names = ", ".join(found.names[:6]) + (", ..." if len(found.names) > 6 else "")
        raise DataFileError(
            f"{path}: line {bad[0]} ({' | '.join(lines[bad[0]])[:SHOWN]}) is not a row of the {len(found.names)} "
            f"columns {names[: 2 * SHOWN]}: correct it, or add --skip-bad"
        )
    _log_unused(lines, found, bad, path)
    columns = list(zip(*rows.values(), strict=True)) or [()] * len(numeric)
    texts = {text for column, of in zip(columns, numeric, strict=True) if of for text in column}
    decimal = _decimal_mark(texts, separator, path)
    values = {
        name: _numbers(column, decimal) if of else np.array(column, dtype=object)
        for name, column, of in zip(found.names, columns, numeric, strict=True)
        if name
    }
    return pd.DataFrame(values, index=list(rows))


# Lines and fields


def _best_split(text: str, path: Path) -> tuple[Lines, str | None, list[_Found]]:
    """Return lines, split so that most of them are rows of tables, with the separator and the tables."""
    kept, separators = _lines_and_separators(text, path)
    best: tuple[Lines, str | None, list[_Found]] = ({}, None, [])
    most, first = 0, None
    for mark in separators:
        if mark is not None and mark not in text:
            continue
        try:
            lines = _split(kept, mark)
        except csv.Error as error:
            raise DataFileError(f"{path}: is not a table of text ({error}); save it as CSV") from error
        tables = _tables(lines)
        rows = sum(len(table.rows) for table in tables)
        if rows > most:
            most = rows
            best = (lines, mark, tables)
        if not rows and first is None:
            first = next((number for number, fields in lines.items() if _is_row(fields)), None)
    if most:
        return best
    if first is not None:
        raise DataFileError(
            f"{path}: has no names of columns above its first row of numbers, line {first}; write them there"
        )
    raise DataFileError(
        f"{path}: must be a table with names of columns above rows of numbers, parted by commas, semicolons, tabs or "
        "spaces"
    )


def _lines_and_separators(text: str, path: Path) -> tuple[dict[int, str], Sequence[str | None]]:
    """Return lines by number, without comments and empty ones, and the separators that they may have."""
    if text.startswith("PK\x03\x04"):
        raise DataFileError(f"{path}: is a workbook or another packed file; save the table as CSV")
    texts = re.split("\r\n|\r|\n", text)
    separator_line = SEPARATOR_LINE.match(texts[0].strip())
    if separator_line:
        texts[0] = ""
    kept = {
        number: line
        for number, line in enumerate(texts, 1)
        if line.strip() and not line.lstrip().startswith(COMMENT)
    }
    return kept, [separator_line[1]] if separator_line else SEPARATORS


def _split(texts: dict[int, str], separator: str | None) -> Lines:
    """Return the fields of lines; a field in quotes may go on in the next lines."""
    lines: Lines = {}
    numbers = list(texts)
    place = 0
    while place < len(numbers):
        parts, used = _fields([texts[number] for number in numbers[place : place + MOST_LINES]], separator)
        lines[numbers[place]] = tuple(" ".join(part.split()) for part in parts)
        place += used
    return lines


def _fields(texts: list[str], separator: str | None) -> tuple[list[str], int]:
    """Return the fields of the first of some lines, and how many lines they take."""
    if separator is None:
        return re.split(r"\t|\s{2,}|\s(?=[+−-]?[0-9.,])", texts[0].strip()), 1
    if '"' not in texts[0]:
        return texts[0].split(separator), 1
    for used in range(1, len(texts) + 1):
        try:
            together = ["\n".join(texts[:used])]
            return next(csv.reader(together, delimiter=separator, skipinitialspace=True, strict=True)), used
        except csv.Error:  # a quotation mark is left open
            continue
    return next(csv.reader(texts[:1], delimiter=separator, skipinitialspace=True)), 1


# Tables


def _is_number(text: str) -> bool:
    """Return whether a field is a number, or a number that was not measured."""
    return bool(NUMBER(text)) or text.lower() == NAN


def _is_row(fields: Fields) -> bool:
    """Return whether fields are a row of a table: two of them are numbers, or more."""
    return len(list(islice(filter(_is_number, fields), 2))) == 2


def _are_names(fields: Fields) -> bool:
    """Return whether fields can be names of columns: two or more, and all are words (no numbers, no empty fields)."""
    return sum(map(bool, fields)) > 1 and not any(
        NUMBER(text) or text.lower() in NO_NUMBER for text in fields
    )


def _are_units(fields: Fields) -> bool:
    """Return whether fields are units of columns: as many are known as are not, or more."""
    units = [text for text in fields if text and plain_unit(text) != "1"]
    return bool(units) and 2 * sum(map(is_unit, units)) >= len(units)


def _tables(lines: Lines) -> list[_Found]:
    """Return the tables among lines. Names stand above the first row, or apart from the rows of the table before."""
    tables: list[_Found] = []
    between: list[int] = []  # lines since the last row
    for number, fields in lines.items():
        if not _is_row(fields):
            between.append(number)
            continue
        header = _header(lines, between)
        if header and (not tables or _apart(tables[-1], header, between)):
            below = [line for line in between if line > header[-1]]
            tables.append(_Found(_names(lines, header), header, bad=below))
        elif tables:
            tables[-1].bad.extend(between)
        if tables:
            tables[-1].rows.append(number)
        between = []
    return tables


def _apart(before: _Found, header: tuple[int, ...], between: list[int]) -> bool:
    """Return whether names begin another table: one word among rows is a bad row of the table before."""
    after_a_blank = header[0] > before.rows[-1] + 1
    return len(before.rows) < LEAST or after_a_blank or len(between) > len(header)


def _header(lines: Lines, above: list[int]) -> tuple[int, ...]:
    """Return the lines of names, and of units if there are some, that are the nearest ones above a row."""
    units: tuple[int, ...] = ()
    for number in reversed(above):
        fields = lines[number]
        if not units and _are_units(fields):
            units = (number,)
        elif _are_names(fields):
            return (number, *units)
    return units  # a row of units alone names its columns


def _names(lines: Lines, header: tuple[int, ...]) -> Fields:
    """Return the names of columns, each with its unit in brackets if the file has a row of units."""
    names = tuple(name[:LONGEST_NAME] for name in lines[header[0]])
    if len(header) == 1:
        return names
    units = (plain_unit(text)[:LONGEST_NAME] for text in lines[header[1]][: len(names)])
    return tuple(
        f"{name} ({unit})" if name and unit else name
        for name, unit in zip_longest(names, units, fillvalue="")
    )


def _chosen(tables: list[_Found], skip_bad: bool, number: int | None, path: Path) -> _Found:
    """Return the table that is asked for, or the only one."""
    joined = _joined(tables) if skip_bad else tables
    large = [table for table in joined if len(table.rows) >= LEAST]
    choice = large or [max(joined, key=lambda table: len(table.rows))]
    if number is not None and number > len(choice):
        raise ConfigurationError(f"{path}: --table {number}: the file has {len(choice)}")
    if number is not None or len(choice) == 1:
        return choice[(number or 1) - 1]
    listed = "; ".join(
        f"{place} of {len(table.rows)} rows below line {table.header[0]} ({', '.join(table.names)[:SHOWN]})"
        for place, table in islice(enumerate(choice, 1), 4)
    )
    same = len(_joined(tables)) < len(tables)
    join = ", or --skip-bad to read tables of the same columns as one" if same else ""
    raise DataFileError(
        f"{path}: has {len(choice)} tables: {listed}; add --table {len(choice)} for one of them{join}"
    )


def _joined(tables: list[_Found]) -> list[_Found]:
    """Return tables, neighbours of the same columns as one."""
    joined: list[_Found] = []
    for table in tables:
        if joined and joined[-1].names == table.names:
            joined[-1].rows.extend(table.rows)
            joined[-1].bad.extend((*table.header, *table.bad))
        else:
            joined.append(replace(table, rows=[*table.rows], bad=[*table.bad]))
    return joined


def _read_rows(lines: Lines, found: _Found) -> tuple[Lines, list[bool], list[int]]:
    """Return rows with a field for each column, whether columns are numeric, and the lines that are no rows.

    Columns are numeric where more than half of their fields that are not empty are numbers.
    """
    count = len(found.names)
    fitting = {
        line: (lines[line] + ("",) * count)[:count] for line in found.rows if not any(lines[line][count:])
    }
    numeric = []
    for column in zip(*fitting.values(), strict=True):
        there = [text for text in column if text]
        numeric.append(2 * sum(map(_is_number, there)) > len(there))
    rows = {}
    for line, fields in fitting.items():
        if all(not of or not text or _is_number(text) for text, of in zip(fields, numeric, strict=True)):
            rows[line] = fields
    bad = [*found.bad, *(line for line in found.rows if line not in rows)]
    return rows, numeric or [False] * count, sorted(bad)


def _log_unused(lines: Lines, found: _Found, bad: list[int], path: Path) -> None:
    """Log the lines that are not of the table."""
    unused = {
        "above the table": [line for line in lines if line < found.header[0]],
        "unreadable": bad,
        "below the table": [line for line in lines if line > found.rows[-1]],
    }
    for where, left_out in unused.items():
        if left_out:
            some = ", ".join(map(str, left_out[:6])) + (", ..." if len(left_out) > 6 else "")
            log.warning("%s: %d lines %s are not used: %s", path, len(left_out), where, some)


# Numbers


def _decimal_mark(texts: set[str], separator: str | None, path: Path) -> str:
    """Return the decimal mark of all numbers of a table."""
    numbers = sorted(text.translate(ONE_STYLE) for text in texts if NUMBER(text))
    evidence: dict[str, str] = {}  # by decimal mark, a number that takes it
    for number in numbers:
        if found := _mark_of(number):
            evidence.setdefault(*found)
    if len(evidence) == 2:
        raise DataFileError(f"{path}: {evidence['.'].replace(' ', ' has ', 1)} and {evidence[',']}")
    if evidence:
        return next(iter(evidence))
    # Between commas or spaces a point is a decimal one.
    marks = "," if separator in (",", None) else ",."
    if grouped := next((number for number in numbers if any(mark in number for mark in marks)), None):
        raise DataFileError(
            f"{path}: {grouped} can be a thousand times as much as with a decimal mark: leave out marks of "
            "thousands, or write one more decimal"
        )
    return "."


def _mark_of(number: str) -> tuple[str, str] | None:
    """Return the decimal mark that a number must have, and why; None where it says nothing."""
    body = re.split("[eE]", number)[0]
    marks = [mark for mark in ".," if mark in body]
    if not marks:
        return None
    first = marks[0]
    if len(marks) == 2:
        last = max(marks, key=body.rfind)
        return last, f"{number} {DECIMAL[last]}"
    if body.count(first) > 1:
        return OTHER[first], f"{number} {THOUSANDS[first]}"
    if not GROUPED(body) or body.lstrip("+-").startswith("0"):
        return first, f"{number} {DECIMAL[first]}"
    return None


def _numbers(column: Fields, decimal: str) -> np.ndarray:
    """Return a column (n,) as numbers, nan where a field is empty."""
    plain = (text.translate(ONE_STYLE).replace(OTHER[decimal], "").replace(decimal, ".") for text in column)
    return np.array([float(text or "nan") for text in plain], dtype=float)
