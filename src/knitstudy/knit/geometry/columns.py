"""Variables of all result files: dimensions, unit and meaning, listed in ``columns.tsv``.

Files are described by these tables, and docs/reference/files.md prints them (`docs/reference/columns.py`).
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from knitstudy.errors import DataFileError

LIST = Path(__file__).with_name("columns.tsv")


@dataclass(frozen=True)
class Columns:
    """The variables that one kind of file may hold."""

    kind: str
    table: pd.DataFrame  # dims, unit, meaning, and which files have them, by name

    def require(self, names: Iterable[str]) -> None:
        """Refuse names that the table does not have; DataFileError for the first of them."""
        for name in names:
            if name not in self.table.index:
                raise DataFileError(
                    f"a {self.kind} has no variable {name!r}; "
                    f"give its dimensions, unit and meaning in knitstudy/knit/geometry/{LIST.name}"
                )

    def variables(self, values: Mapping[str, Any]) -> dict[str, tuple[Any, ...]]:
        """Return arrays as variables of a dataset, in the order of the table; DataFileError as `require`."""
        self.require(values)
        rows: Iterable[Any] = self.table.itertuples()
        return {
            row.Index: (row.dims.split(), values[row.Index], {"units": row.unit, "long_name": row.meaning})
            for row in rows
            if row.Index in values
        }


_LISTED = pd.read_csv(LIST, sep="\t", quoting=csv.QUOTE_NONE, keep_default_na=False, index_col="name")
KINDS = {
    "history": "history",  # of all models; `contact_...` has a row for every point in contact at every increment
    "contacts": "file of contacts",  # at the crossings of solid yarns
    "stresses": "file of stresses",  # mean stresses of cells, pieces and segments of solid yarns
    "geometry": "geometry",  # fabrics
    "mesh": "mesh",  # swept meshes
    "rest": "shape at rest",  # of cells of beams
    "bending": "file of bending",  # the same
    "coordinates": "file",  # names of entries along a dimension, in all files
}
HISTORY, CONTACTS, STRESSES, GEOMETRY, MESH, REST, BENDING, COORDINATES = (
    Columns(kind, _LISTED[_LISTED["file"] == name]) for name, kind in KINDS.items()
)
