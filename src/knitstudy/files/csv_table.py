"""Tables as CSV; errors name the file and the remedy."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.files.replacing import replacing


def write_table(table: pd.DataFrame, path: Path | str) -> None:
    """Write a table as CSV without row numbers; column names carry their units, for example ``force [N]``."""
    with replacing(path) as temporary:
        table.to_csv(temporary, index=False)


def read_table(path: Path | str, needs: Iterable[str] = ()) -> pd.DataFrame:
    """Read a CSV table that must have the columns ``needs``.

    Raises
    ------
    DataFileError
        When the file is missing, is not CSV, or lacks a column.
    """
    path = Path(path)
    try:
        table = pd.read_csv(path)
    except FileNotFoundError as error:
        raise DataFileError(f"{path}: there is no such file; make it with `make study`") from error
    except (OSError, ValueError) as error:
        said = " ".join(str(error).split())
        raise DataFileError(f"{path}: is not a CSV table ({said}); delete it and run `make study`") from error
    missing = [name for name in needs if name not in table.columns]
    if missing:
        raise DataFileError(
            f"{path}: has no column {missing[0]!r}, only {', '.join(map(repr, table.columns))}"
        )
    return table
