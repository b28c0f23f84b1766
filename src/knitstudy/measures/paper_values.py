"""Looks up what the paper prints, in ``resources/reference/paper_tables.csv``."""

from __future__ import annotations

import numpy as np
import pandas as pd

from knitstudy.errors import DataFileError

REPORTED = {"dns": "dns-tie 3x3", "rom2d": "rom2d 3x3", "rom3d": "rom3d 3x3"}
"""Cases of the paper's Table 5 by fidelity, in its order."""

COLUMNS = ("table", "case", "quantity", "value", "unit", "note")


def reported(paper: pd.DataFrame, table: str, case: str, quantity: str) -> pd.Series:
    """Return the one row of a quantity.

    Raises
    ------
    DataFileError
        When the quantity is not there, or more than once.
    """
    missing = [name for name in COLUMNS if name not in paper]
    if missing:
        raise DataFileError(
            f"table of the paper's numbers: has no column {missing[0]!r}; needed are {COLUMNS}"
        )
    same = _is(paper, table, case, quantity)
    if same.sum() != 1:
        raise DataFileError(
            f"table of the paper's numbers: table {table!r}, case {case!r}, quantity {quantity!r} is there "
            f"{same.sum()} times; it must be there once"
        )
    return paper[same].iloc[0]


def number(paper: pd.DataFrame, table: str, case: str, quantity: str) -> float:
    """Return a printed number in its unit."""
    return _floats(reported(paper, table, case, quantity))[0]


def numbers(paper: pd.DataFrame, table: str, case: str, quantity: str) -> np.ndarray:
    """Return several numbers that are printed together, for example the angles of a line to x, y and z."""
    return _floats(reported(paper, table, case, quantity))


def number_if_printed(paper: pd.DataFrame, table: str, case: str, quantity: str) -> float:
    """Return a number in its unit, nan where the paper prints none."""
    there = _is(paper, table, case, quantity).any()
    return number(paper, table, case, quantity) if there else np.nan


def _is(paper: pd.DataFrame, table: str, case: str, quantity: str) -> pd.Series:
    """Return which rows are of a quantity."""
    return (paper["table"].astype(str) == table) & (paper["case"] == case) & (paper["quantity"] == quantity)


def _floats(row: pd.Series) -> np.ndarray:
    try:
        return np.array([float(part) for part in str(row["value"]).split()])
    except ValueError as error:
        raise DataFileError(
            f"table of the paper's numbers: {row['quantity']!r} is {row['value']!r}; it must be numbers"
        ) from error
