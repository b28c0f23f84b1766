"""Numbers as a report writes them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from knitstudy.errors import ConfigurationError

NOTHING = "–"

DIGITS = 4


def value(results: Mapping[str, pd.DataFrame], table: str, row: str, column: str, form: str = ".3g") -> str:
    """Return one number of a table; the row is named by its cell in the first column.

    Raises
    ------
    ConfigurationError
        When there is no such table, row or column.
    """
    if table not in results:
        raise ConfigurationError(
            f"captions: there is no table {table!r}, only {', '.join(results) or 'none'}"
        )
    frame = results[table]
    names = frame[frame.columns[0]]
    if column not in frame or (names == row).sum() != 1:
        raise ConfigurationError(
            f"captions: table {table!r} has no cell of row {row!r} and column {column!r}; rows are "
            f"{', '.join(map(str, names))}, columns {', '.join(map(str, frame.columns))}"
        )
    number = frame.loc[names == row, column].iloc[0]
    return NOTHING if pd.isna(number) else format(number, form)


def cells(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table as text: integers with thousands set apart, other numbers with four digits."""
    return table.map(_cell)


def _cell(content: object) -> str:
    if isinstance(content, bool | np.bool_):
        return str(content)
    if isinstance(content, int | np.integer):
        return f"{content:,}"
    if isinstance(content, float | np.floating):
        return NOTHING if np.isnan(content) else _rounded(float(content))
    return NOTHING if content is None else str(content)


def _rounded(number: float) -> str:
    """Return four digits, without an exponent where the number is readable without one."""
    if number == 0:
        return "0"
    if 1e-4 <= abs(number) < 1e6:
        decimals = max(0, DIGITS - 1 - int(np.floor(np.log10(abs(number)))))
        text = f"{number:,.{decimals}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    return f"{number:.{DIGITS - 1}g}"
