"""Numbers that the paper prints, from ``resources/reference/paper_tables.csv``."""

from __future__ import annotations

import numpy as np
import pandas as pd

from knitstudy.errors import DataFileError

# Cases of the paper's Table 5 by fidelity, in its order.
REPORTED = {"dns": "dns-tie 3x3", "rom2d": "rom2d 3x3", "rom3d": "rom3d 3x3"}

COLUMNS = ("table", "case", "quantity", "value", "unit", "note")


def reported(paper: pd.DataFrame, table: str, case: str, quantity: str) -> pd.Series:
    """Return the one row of a quantity; DataFileError when the quantity is not there, or more than once."""
    missing = [name for name in COLUMNS if name not in paper]
    if missing:
        raise DataFileError(
            f"table of the paper's numbers: has no column {missing[0]!r}; needed are {COLUMNS}"
        )
    rows = _rows(paper, table, case, quantity)
    if len(rows) != 1:
        raise DataFileError(
            f"table of the paper's numbers: table {table!r}, case {case!r}, quantity {quantity!r} is there "
            f"{len(rows)} times; it must be there once"
        )
    return rows.iloc[0]


def numbers(paper: pd.DataFrame, table: str, case: str, quantity: str) -> np.ndarray:
    """Return numbers that are printed together, for example the angles of a line to x, y and z."""
    row = reported(paper, table, case, quantity)
    try:
        return np.array([float(part) for part in str(row["value"]).split()])
    except ValueError as error:
        raise DataFileError(
            f"table of the paper's numbers: {row['quantity']!r} is {row['value']!r}; it must be numbers"
        ) from error


def number(paper: pd.DataFrame, table: str, case: str, quantity: str) -> float:
    """Return a printed number in its unit."""
    return numbers(paper, table, case, quantity)[0]


def number_if_printed(paper: pd.DataFrame, table: str, case: str, quantity: str) -> float:
    """Return a number in its unit, nan where the paper prints none."""
    return number(paper, table, case, quantity) if len(_rows(paper, table, case, quantity)) else np.nan


def _rows(paper: pd.DataFrame, table: str, case: str, quantity: str) -> pd.DataFrame:
    same = (paper["table"].astype(str) == table) & (paper["case"] == case) & (paper["quantity"] == quantity)
    return paper[same]
