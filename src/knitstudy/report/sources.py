"""Reads what a figure or a table is made from."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from knitstudy.files import read_result, read_table
from knitstudy.study.documents import read_yaml

READERS = {".nc": read_result, ".csv": read_table, ".yaml": read_yaml}


def read_sources(files: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Return what files hold, by name; several files of one name by the names of their scenes.

    Parameters
    ----------
    files : iterable of (str, path) or (str, sequence of paths)

    Raises
    ------
    DataFileError, ConfigurationError
        When a file is missing or cannot be read.
    """
    return {name: _read(found) for name, found in files}


def _read(found: Any) -> Any:
    if isinstance(found, str | Path):
        return READERS[Path(found).suffix](Path(found))
    datasets = [_read(path) for path in found]
    return {dataset.attrs["scene"]: dataset for dataset in datasets}
