"""Curves of force per width [N/m] over strain [1], measured or simulated: a series by rising strain.

The caller names columns and units. Without names, a YAML file beside the CSV file has them from before; without that
file, the names of the columns tell them, such as ``strain (%)`` or ``force_per_width_N_mm``.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
import yaml
from scipy.interpolate import PchipInterpolator

from knitstudy.errors import DataFileError, message_of
from knitstudy.files import write_text
from knitstudy.geometry.fabric_file import fabric_of
from knitstudy.registry import find
from knitstudy.study.documents import read_yaml

WORDS = {"strain": "strain|elongation|extension|displacement", "force": "force|load|(?<!ex)tension"}
UNITS = {
    "strain": {"%": 0.01, "1": 1.0, "mm/mm": 1.0, "mm": 1e-3, "cm": 1e-2, "m": 1.0},
    "force": {"N/m": 1.0, "N/cm": 1e2, "N/mm": 1e3, "cN/cm": 1.0, "cN/mm": 10.0, "mN/mm": 1.0}
    | {"N": 1.0, "cN": 1e-2, "mN": 1e-3, "kN": 1e3},
}
"""Over 1 or N/m; or over m and N, which are divided by a size of the specimen."""
SIZES = {"mm": "length", "cm": "length", "m": "length"} | dict.fromkeys(("N", "cN", "mN", "kN"), "width")
SCATTER = re.compile(r"[\W_](sd|std|dev|error|rate)", re.IGNORECASE)
log = logging.getLogger(__name__)

LARGEST = 1.5  # a strain without a unit that exceeds this one may be meant in %


def simulated_curve(history: xr.Dataset, geometry: xr.Dataset) -> pd.Series:
    """Return the curve of a history: of a cell its force per width, of a knit the force over its width at rest."""
    axis, strain = int(history.attrs["axis"]), history["strain"].to_numpy()
    if "force_per_width" in history:
        return pd.Series(history["force_per_width"].to_numpy()[:, axis], strain)
    return pd.Series(history["force"].to_numpy() / fabric_of(geometry).size[1 - axis], strain)


def at(curve: pd.Series, strain: np.ndarray) -> np.ndarray:
    """Return the forces per width at strains on a curve, without overshoot between its points."""
    return PchipInterpolator(curve.index, curve)(strain)


def within(curve: pd.Series, strain: float) -> pd.Series:
    """Return the part of a curve up to a strain, without points at rest."""
    return curve[(curve.index > 0) & (curve.index <= strain * (1 + 1e-9))]


def read_curve(path: Path, named: Mapping[str, Any], only: Mapping[str, str], direction: str) -> pd.Series:
    """Return the curve of a CSV file, up to its largest strain.

    `named` has for ``strain`` and ``force`` a column and its unit, and ``width`` and ``length`` of the specimen [m]; it
    is kept beside the file. `only` has values of columns that tell curves apart; `direction`, "course" or "wale", is
    chosen where a column has it. Raises DataFileError where the file does not hold one curve.
    """
    table, beside = _one_curve(_table(path), only, direction, path), path.with_suffix(".columns.yaml")
    kept = read_yaml(beside) if beside.is_file() else {}
    if any(
        np.shape(value) != (2,) if name in WORDS else type(value) is not float for name, value in kept.items()
    ):
        raise DataFileError(f"{beside}: is not as knitstudy wrote it; delete it and name the columns again")
    how = kept | {name: list(value) if name in WORDS else value for name, value in named.items()}
    strain, force = (_values(table, name, how, path) for name in WORDS)
    curve = pd.Series(force.to_numpy(), strain).loc[lambda values: values.notna() & values.index.notna()]
    rising = curve.iloc[: curve.index.argmax() + 1] if len(curve) else curve
    if (count := len(rising)) < 3:
        raise DataFileError(f"{path}: has {count} rows of numbers up to the largest strain; 3 are needed")
    if count < len(curve):
        log.warning("%s: %d rows behind the largest strain are left out", path, len(curve) - count)
    if named:
        try:
            write_text(f"# How knitstudy reads {path.name}; sizes in m\n{yaml.safe_dump(how)}", beside)
        except (OSError, DataFileError) as error:
            log.warning("%s; columns and units have to be named again next time", error)
    return rising.sort_index(kind="stable")


def _table(path: Path) -> pd.DataFrame:
    """Return a table whose columns commas, tabs or semicolons part; `_numbers` reads decimal commas."""
    try:
        head = path.read_text(encoding="utf-8-sig").partition("\n")[0]
        mark = next((separator for separator in ";\t" if separator in head), ",")
        table = pd.read_csv(path, sep=mark, skipinitialspace=True, encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        wanted = "must be a CSV file with names of columns in its first row"
        raise DataFileError(f"{path}: {wanted} ({message_of(error, OSError, ValueError)})") from error
    return table.rename(columns=lambda name: str(name).strip())


def _one_curve(table: pd.DataFrame, only: Mapping[str, str], direction: str, path: Path) -> pd.DataFrame:
    """Return the rows of one curve."""
    for column, value in only.items():
        there = find("column", table, column, str(path)).astype(str)
        find(f"{column} in --only", dict.fromkeys(there), value, str(path))
        table = table[there == value]
    for column in table.select_dtypes(exclude="number"):
        names = table[column].dropna().astype(str)
        if direction in set(names):
            table = table[names == direction]
        elif names.nunique() > 1 and _numbers(names).isna().all():  # names, not numbers with decimal commas
            has = f"has {names.nunique()} curves by {column!r} ({', '.join(names.unique()[:4])})"
            raise DataFileError(f"{path}: {has}: add --only {column}={names.iloc[0]}")
    return table


def _values(table: pd.DataFrame, name: str, how: Mapping[str, Any], path: Path) -> pd.Series:
    """Return strain [1] or force [N/m]."""
    column, unit = how.get(name) or _recognised(table, name, path)
    scale = find("unit", UNITS[name], unit, f"{path}: --{name}")
    values = scale * _numbers(find("column", table, column, f"{path}: --{name}"))
    if (size := SIZES.get(unit)) is None:
        return values
    if size not in how:
        remedy = f"add --{size} of the specimen in m, for example --{size} 0.05"
        raise DataFileError(f"{path}: {column!r} is in {unit}: {remedy}")
    return values / how[size]


def _numbers(texts: pd.Series) -> pd.Series:
    return pd.to_numeric(texts.astype(str).str.replace(",", "."), errors="coerce").astype(float)


def _recognised(table: pd.DataFrame, name: str, path: Path) -> tuple[str, str]:
    """Return the column of strain or force, and its unit, by the names of the columns."""
    columns = [
        column for column in table if re.search(WORDS[name], column.lower()) and not SCATTER.search(column)
    ]
    add = f"add --{name} COLUMN UNIT, with a unit of {', '.join(UNITS[name])}"
    if len(columns) != 1:
        are = f"{len(columns) or 'no'} columns are named like a {name}: {', '.join(map(repr, columns or table))}"
        raise DataFileError(f"{path}: {are}; {add}")
    for unit in sorted(UNITS[name], key=len, reverse=True):  # force [N], force (N/mm), force_N_mm
        if re.search(rf"[\s_(\[,/]{re.escape(unit).replace('/', '[/_]')}[\])]?$", columns[0]):
            return columns[0], unit
    if name == "strain" and _numbers(table[columns[0]]).max() <= LARGEST:
        return columns[0], "1"
    raise DataFileError(f"{path}: {columns[0]!r} does not say its unit; {add}")
