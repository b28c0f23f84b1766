"""Variables of histories, contacts and stresses: dimensions, unit and meaning, listed in ``columns.tsv``.

Files are written by these tables, and docs/files.md prints them (`docs/columns.py`).
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knitstudy.errors import DataFileError

LIST = Path(__file__).with_name("columns.tsv")


@dataclass(frozen=True)
class Column:
    """A variable of a file."""

    dims: tuple[str, ...]
    unit: str
    meaning: str
    where: str = ""  # which files have it; all if empty


@dataclass(frozen=True)
class Columns:
    """The variables that one kind of file may hold, by name."""

    kind: str
    table: dict[str, Column]

    @classmethod
    def listed(cls, name: str, kind: str) -> Columns:
        """Return the variables of a file by its name in the list."""
        with LIST.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))
        own = [row for row in rows if row["file"] == name]
        found = {
            row["name"]: Column(tuple(row["dims"].split()), row["unit"], row["meaning"], row["where"])
            for row in own
        }
        return cls(kind, found)

    def require(self, names: Iterable[str]) -> None:
        """Refuse names that the table does not have; DataFileError for the first of them."""
        for name in names:
            if name not in self.table:
                raise DataFileError(
                    f"a {self.kind} has no variable {name!r}; "
                    f"give its dimensions, unit and meaning in knitstudy/loading/{LIST.name}"
                )

    def variables(self, values: Mapping[str, np.ndarray]) -> dict[str, tuple]:
        """Return arrays as variables of a dataset, in the order of the table; DataFileError as `require`."""
        self.require(values)
        return {
            name: (column.dims, values[name], {"units": column.unit, "long_name": column.meaning})
            for name, column in self.table.items()
            if name in values
        }


# Histories of all models; `contact_...` has a row for every point in contact at every increment
HISTORY = Columns.listed("history", "history")

# Contacts at the crossings of solid yarns
CONTACTS = Columns.listed("contacts", "file of contacts")

# Mean stresses of cells, pieces and segments of solid yarns
STRESSES = Columns.listed("stresses", "file of stresses")
