"""Variables of all result files: dimensions, unit and meaning, listed in ``columns.tsv``.

Files are described by these tables, and docs/reference/files.md prints them (`docs/reference/columns.py`).
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
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
                    f"give its dimensions, unit and meaning in knitstudy/loading/{LIST.name}"
                )

    def variables(self, values: Mapping[str, np.ndarray]) -> dict[str, tuple]:
        """Return arrays as variables of a dataset, in the order of the table; DataFileError as `require`."""
        self.require(values)
        return {
            row.Index: (row.dims.split(), values[row.Index], {"units": row.unit, "long_name": row.meaning})
            for row in self.table.itertuples()
            if row.Index in values
        }


_LISTED = pd.read_csv(
    LIST, sep="\t", quoting=csv.QUOTE_NONE, keep_default_na=False, index_col=["file", "name"]
)

# Histories of all models; `contact_...` has a row for every point in contact at every increment
HISTORY = Columns("history", _LISTED.loc["history"])

# Contacts at the crossings of solid yarns
CONTACTS = Columns("file of contacts", _LISTED.loc["contacts"])

# Mean stresses of cells, pieces and segments of solid yarns
STRESSES = Columns("file of stresses", _LISTED.loc["stresses"])

# Fabrics, and swept meshes
GEOMETRY, MESH = Columns("geometry", _LISTED.loc["geometry"]), Columns("mesh", _LISTED.loc["mesh"])

# Shapes at rest of cells of beams
REST = Columns("shape at rest", _LISTED.loc["rest"])

# Names of entries along a dimension, in all files
COORDINATES = Columns("file", _LISTED.loc["coordinates"])
