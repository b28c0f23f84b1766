"""What made every data file of a study: read from the attributes that the files carry."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from knitstudy.files import read_dataset

ATTRIBUTES = {
    "scene": "scene",
    "digest": "digest",
    "code_version": "code",
    "numpy": "numpy",
    "scipy": "scipy",
    "pyamg": "pyamg",
}


def origins(files: Iterable[Path | str], page: Path | str) -> pd.DataFrame:
    """Return one row for every netCDF file; the first column is its path from the page.

    Raises
    ------
    DataFileError
        When a file is missing or truncated.
    """
    folder = Path(page).parent
    rows = []
    for file in files:
        attributes = read_dataset(file).attrs
        row = {"file": Path(os.path.relpath(file, folder)).as_posix()}
        rows.append(row | {title: str(attributes.get(key, "")) for key, title in ATTRIBUTES.items()})
    return pd.DataFrame(rows, columns=["file", *ATTRIBUTES.values()])
