"""Curves of force per width [N/m] over strain [1], measured or simulated: a series by rising strain.

The caller names columns and units. Without names, a YAML file beside the CSV file has them from before; without that
file, the names of the columns tell them, such as ``strain (%)`` or ``force_per_width_N_mm``. Of loading cycles one
branch is taken, the first loading where nothing else is asked for; whatever is corrected or left out is printed.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
import yaml
from pandas.api.types import is_numeric_dtype
from scipy.interpolate import PchipInterpolator

from knitstudy.errors import DataFileError
from knitstudy.files import STRAINS, write_text
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.scene.documents import read_yaml
from knitstudy.registry import find
from knitstudy.use.lab_table import FORCES, LENGTHS, STRESSES, UNITS, read_lab_table

WORDS = {
    "strain": "strain|elongation|extension|displacement",
    "force": "force|load|(?<!ex)tension|stress",
}
SIZES = (
    dict.fromkeys(LENGTHS, "length") | dict.fromkeys(FORCES, "width") | dict.fromkeys(STRESSES, "thickness")
)
LENGTHENED = re.compile("displacement|extension", re.IGNORECASE)  # without a unit these are no ratios
TRUE = re.compile("true|hencky|logarithmic", re.IGNORECASE)
IN_BRACKETS = re.compile(r"[(\[]\s*([^()\[\]]+?)\s*[)\]]\s*$")
SCATTER = re.compile(r"[\W_](sd|std|dev|error|rate)", re.IGNORECASE)
log = logging.getLogger(__name__)

LARGEST = 1.5  # a strain without a unit that exceeds this one may be meant in %
TURNS = 0.02  # Share of the largest strain by which it falls where a branch ends; less is noise
SAME = 1e-9  # Share of the largest strain by which strains that are meant to be one may differ
PRELOAD = 0.005  # Share of the largest force from which a force at no strain is a preload
STRAIN, PULL = "{} strain [1]".format, "{} force per width [N/m]".format  # columns of `curve_table`
THICKNESS, PRESSURE, ENERGY = "thickness [mm]", "pressure [Pa]", "energy [J/m2]"  # others
BRANCHES = ("loading", "unloading")


def simulated_curve(
    history: xr.Dataset, geometry: xr.Dataset, cycle: int = 1, branch: str = "loading"
) -> pd.Series:
    """Return a branch of the curve of a history, by rising strain; where it has fewer cycles, of its last one.

    Of a cell it is the force per width, of a knit the force over its width at rest.
    Raises DataFileError where the history has no such branch, or no force per width.
    """
    if "pressure" in history:
        raise DataFileError(
            "is the history of a cell between plates, which has no force per width along its load"
        )
    table = curve_table(history, None if "force_per_width" in history else geometry)
    curve = force_over_strain(table, STRAINS[int(history.attrs["axis"])])
    every = branches(curve)[BRANCHES.index(branch) :: 2]
    if not every:
        raise DataFileError(f"the history has no {branch}: simulate one, with load.turns")
    taken = min(cycle, len(every))
    chosen = every[taken - 1].sort_index()
    if len(chosen) < len(curve) or taken < cycle:
        log.warning("%s of cycle %d of the history, to %.3g, is taken", branch, taken, chosen.index[-1])
    return chosen


def curve_table(history: xr.Dataset, geometry: xr.Dataset | None = None) -> pd.DataFrame:
    """Return the curve of a history: strains, forces per width, and the work of the load per area, at every increment.

    Of a cell these are all strains of the plane and their forces, between plates thickness and pressure too; of a knit,
    which needs its `geometry`, the strain along the load and its force.
    Raises DataFileError where there is no width: of two yarns that cross.
    """
    names: tuple[str, ...] = STRAINS
    pressed = "pressure" in history
    if geometry is None:
        strain, force = history["cell_strain"].to_numpy(), history["force_per_width"].to_numpy()
        steps = (0.5 * (force[1:] + force[:-1]) * np.diff(strain, axis=0)).sum(axis=1)
        energy = np.append(0.0, np.cumsum(steps))
        if pressed:
            area = history.attrs["cell_width"] * history.attrs["cell_height"]
            energy = history["energy"].sel(form="external") / area
    else:
        size, axis = fabric_of(geometry).size, int(history.attrs["axis"])
        if axis == 2:
            raise DataFileError("is the history of two yarns, which have no force per width")
        strain, force = (history[name].to_numpy()[:, None] for name in ("strain", "force"))
        force, energy = force / size[1 - axis], history["energy"].sel(form="external") / (size[0] * size[1])
        names = STRAINS[axis : axis + 1]
    columns = {STRAIN(name): strain[:, k] for k, name in enumerate(names)}
    columns |= {PULL(name): force[:, k] for k, name in enumerate(names)}
    columns |= {f"{name} force per width [N/mm]": 1e-3 * force[:, k] for k, name in enumerate(names)}
    if pressed:
        columns |= {THICKNESS: 1e3 * history["thickness"].data, PRESSURE: history["pressure"].data}
    return pd.DataFrame(columns | {ENERGY: np.asarray(energy)})


def force_over_strain(table: pd.DataFrame, way: str) -> pd.Series:
    """Return the forces per width of a `curve_table` over strains, in course or wale direction or in shear."""
    return table.set_index(STRAIN(way))[PULL(way)]


@dataclass(frozen=True)
class Loss:
    """What a cycle loses."""

    work: float  # of loading, per area [J/m2]
    share: float  # of that work which does not come back
    peak: float  # largest force per width [N/m]


def loss_of_cycle(curve: pd.Series, cycle: int = 1) -> Loss | None:
    """Return the loss of a cycle of a curve; None where it has no work, or does not come back to half of its strain.

    Examples
    --------
    >>> loss_of_cycle(pd.Series([0.0, 2, 4, 1, 0], index=[0.0, 0.25, 0.5, 0.25, 0.0]))
    Loss(work=1.0, share=0.25, peak=4.0)
    """
    up, *down = branches(curve)[2 * (cycle - 1) : 2 * cycle] or [curve]
    if not down or abs(down[0].index[-1]) >= 0.5 * abs(up.index[-1]):
        return None
    work, back = (abs(float(np.trapezoid(part, part.index))) for part in (up, down[0]))
    return Loss(work, 1 - back / work, float(up.abs().max())) if work else None


def left_by_cycle(curve: pd.Series) -> float:
    """Return the strain at which the force ends on the first way back; nan where the curve has no way back.

    Friction holds a knit there: the band of its shapes at rest is at least this wide (Crassous, Poincloux and
    Steinberger 2024, doi 10.1103/PhysRevLett.133.248201). If the force is above 0 on the whole way back, the strain is
    the last one of that way.

    Examples
    --------
    >>> left_by_cycle(pd.Series([0.0, 4, 2, -2], index=[0.0, 0.5, 0.25, 0.125]))
    0.1875
    """
    _, *back = branches(curve)[:2]
    if not back:
        return nan
    rising = back[0][::-1]
    first = int(np.argmax(rising.to_numpy() > 0))
    pair = rising.iloc[max(first - 1, 0) : first + 1]
    return float(np.interp(0.0, pair, pair.index))


def branches(curve: pd.Series) -> list[pd.Series]:
    """Return the branches of a curve, loading and unloading in turn; strain that turns by less than `TURNS` is noise.

    The first one goes the way of the first motion, under compression too.

    Examples
    --------
    >>> there_and_back = pd.Series([0.0, 1, 2, 1, 0.5, 2], index=[0.0, 0.1, 0.2, 0.1, 0.05, 0.2])
    >>> [branch.tolist() for branch in branches(there_and_back)]
    [[0.0, 1.0, 2.0], [2.0, 1.0, 0.5], [0.5, 2.0]]
    """
    strain = curve.index.to_numpy(dtype=float)
    least, turns, far = TURNS * np.ptp(strain), [0], 0
    way = -1 if strain[np.argmax(np.abs(strain - strain[0]) > least)] < strain[0] else 1
    for k in range(1, len(strain)):
        if way * (strain[k] - strain[far]) > 0:
            far = k
        elif way * (strain[far] - strain[k]) > least:
            turns.append(far)
            way, far = -way, k
    turns.append(far)
    return [curve.iloc[low : high + 1] for low, high in pairwise(turns)]


def at(curve: pd.Series, strain: np.ndarray) -> np.ndarray:
    """Return the forces per width at strains on a curve, without overshoot between its points; never beyond them."""
    low, high = curve.index[[0, -1]]
    if len(curve) < 2 or np.min(strain) < low - SAME * high or np.max(strain) > high + SAME * high:
        known, asked = (f"from {np.min(x):.3g} to {np.max(x):.3g}" for x in (curve.index, strain))
        raise DataFileError(f"the simulated curve has strains {known}, not {asked}: change load.strain")
    return PchipInterpolator(curve.index, curve)(np.clip(strain, low, high))


def within(curve: pd.Series, *others: pd.Series) -> pd.Series:
    """Return the part of a curve at strains that all others have, without points at rest."""
    low, high = (pick(each.index[end] for each in others) for pick, end in ((max, 0), (min, -1)))
    same = SAME * high
    return curve[(curve.index > 0) & (curve.index >= low - same) & (curve.index <= high + same)]


def read_curve(
    path: Path,
    named: Mapping[str, Any],
    only: Mapping[str, str],
    direction: str,
    cycle: int = 1,
    branch: str = "loading",
    skip_bad: bool = False,
) -> pd.Series:
    """Return one branch of the curve of a CSV file, by rising strain; what is corrected or left out is logged.

    `named` has for ``strain`` and ``force`` a column and its unit, and ``width``, ``length`` and ``thickness`` of the
    specimen [m]; it is kept beside the file. `only` has values of columns that tell curves apart; `direction`, "course"
    or "wale", is chosen where a column has it.
    Raises DataFileError where the file does not hold one curve, or not so many cycles.
    """
    table = _one_curve(read_lab_table(path, skip_bad), only, direction, path)
    beside = path.with_suffix(".columns.yaml")
    kept = read_yaml(beside) if beside.is_file() else {}
    if any(
        np.shape(value) != (2,) if name in WORDS else type(value) is not float for name, value in kept.items()
    ):
        raise DataFileError(f"{beside}: is not as knitstudy wrote it; delete it and name the columns again")
    how = kept | {name: list(value) if name in WORDS else value for name, value in named.items()}
    strain, force = (_values(table, name, how, direction, path) for name in WORDS)
    curve = pd.Series(force.to_numpy(), strain).loc[lambda values: values.notna() & values.index.notna()]
    if (empty := len(table) - len(curve)) > 0:
        log.warning("%s: %d rows have no strain or no force and are not used", path, empty)
    rising = _branch(_pulled(curve, path), cycle, branch, path) if len(curve) else curve
    if (count := len(rising)) < 3:
        raise DataFileError(f"{path}: has {count} rows of numbers up to the largest strain; 3 are needed")
    if count < len(curve):
        log.warning(
            "%s: %s of cycle %d is taken, %d rows are left out", path, branch, cycle, len(curve) - count
        )
    if named:
        try:
            write_text(f"# How knitstudy reads {path.name}; sizes in m\n{yaml.safe_dump(how)}", beside)
        except (OSError, DataFileError) as error:
            log.warning("%s; columns and units have to be named again next time", error)
    return rising.sort_index(kind="stable")


def _pulled(curve: pd.Series, path: Path) -> pd.Series:
    """Return a curve with tension positive, and without a force that was there before any strain."""
    strain, force = curve.index.to_numpy(dtype=float), curve.to_numpy()
    if strain[np.argmax(np.abs(strain))] < 0:
        log.warning("%s: the sign of the strain is turned: tension is positive here", path)
        strain = -strain
    if force[np.argmax(np.abs(force))] < 0:
        log.warning("%s: the sign of the force is turned: tension is positive here", path)
        force = -force
    largest = np.abs(force).max()
    if abs(strain[0]) <= 1e-9 * np.abs(strain).max() and abs(force[0]) > PRELOAD * largest:
        log.warning(
            "%s: begins with %.4g N/m at no strain, a preload, which is taken off all forces", path, force[0]
        )
        force = force - force[0]
    if force.min() < -0.1 * np.abs(force).max():
        raise DataFileError(
            f"{path}: forces are from {force.min():.3g} to {force.max():.3g} N/m: no curve of tension"
        )
    return pd.Series(force, strain)


def _branch(curve: pd.Series, cycle: int, branch: str, path: Path) -> pd.Series:
    """Return one branch of a curve; the loss of its cycle is logged."""
    every = branches(curve)
    number = 2 * (cycle - 1) + BRANCHES.index(branch)
    if number >= len(every):
        raise DataFileError(
            f"{path}: has {len(every)} branches of loading and unloading: no {branch} of cycle {cycle}"
        )
    if loss := loss_of_cycle(curve, cycle):
        lost = f"loses {100 * loss.share:.0f} % of {loss.work:.3g} J/m2 (hysteresis)"
        log.warning("%s: cycle %d %s", path, cycle, lost)
    chosen = every[number]
    return chosen.iloc[: chosen.index.argmax() + 1] if branch == "loading" else chosen


def _one_curve(table: pd.DataFrame, only: Mapping[str, str], direction: str, path: Path) -> pd.DataFrame:
    """Return the rows of one curve."""
    for column, value in only.items():
        values = find("column", _columns(table), column, str(path))
        there = values.map("{:.15g}".format) if is_numeric_dtype(values) else values.astype(str)
        find(f"{column} in --only", dict.fromkeys(there), value, str(path))
        table = table[there == value]
    for column in map(str, table.select_dtypes(exclude="number")):
        names = table[column].astype(str)
        if direction in set(names):
            table = table[names == direction]
        elif names.nunique() > 1:
            has = f"has {names.nunique()} curves by {column!r} ({', '.join(names.unique()[:4])})"
            raise DataFileError(f"{path}: {has}: add --only {column}={names.iloc[0]}")
    return table


def _columns(table: pd.DataFrame) -> dict[str, pd.Series]:
    return {str(name): column for name, column in table.items()}


def _values(table: pd.DataFrame, name: str, how: Mapping[str, Any], direction: str, path: Path) -> pd.Series:
    """Return strain [1] or force [N/m]."""
    column, unit = how.get(name) or _recognised(table, name, direction, path)
    column = table.attrs["full_names"].get(column, column)
    scale = find("unit", UNITS[name], unit, f"{path}: --{name}")
    values = find("column", _columns(table), column, f"{path}: --{name}")
    if not is_numeric_dtype(values):
        raise DataFileError(f"{path}: {column!r} holds words: {values.iloc[0]!r}; add --{name} COLUMN UNIT")
    values = scale * values
    if name == "strain" and TRUE.search(column):
        log.warning("%s: %r is true strain; exp(strain) - 1 is taken", path, column)
        values = np.expm1(values)
    if (size := SIZES.get(unit)) is None:
        return values
    if size not in how:
        remedy = f"add --{size} of the specimen in m, for example --{size} {0.001 if size == 'thickness' else 0.05}"
        raise DataFileError(f"{path}: {column!r} is in {unit}: {remedy}")
    return values * how[size] if size == "thickness" else values / how[size]


def _recognised(table: pd.DataFrame, name: str, direction: str, path: Path) -> tuple[str, str]:
    """Return the column of strain or force, of several that of the direction, and its unit, by their names."""
    columns = [
        column
        for column in map(str, table)
        if re.search(WORDS[name], column.lower()) and not SCATTER.search(column)
    ]
    if len(columns) > 1 and (own := [column for column in columns if column.lower().startswith(direction)]):
        columns = [column for column in own if "[N/m]" in column] or own
    add = f"add --{name} COLUMN UNIT, with a unit of {', '.join(UNITS[name])}"
    if len(columns) != 1:
        are = f"{len(columns) or 'no'} columns are named like a {name}: {', '.join(map(repr, columns or table))}"
        raise DataFileError(f"{path}: {are}; {add}")
    for unit in sorted(UNITS[name], key=len, reverse=True):  # force [N], force (N/mm), force_N_mm
        if re.search(rf"[\s_(\[,/]{re.escape(unit).replace('/', '[/_]')}[\])]?$", columns[0]):
            return columns[0], unit
    if strange := IN_BRACKETS.search(columns[0]):
        raise DataFileError(f"{path}: {columns[0]!r}: unit {strange[1]} is not known; {add}")
    ratio = name == "strain" and not LENGTHENED.search(columns[0])
    if ratio and is_numeric_dtype(table[columns[0]]) and table[columns[0]].abs().max() <= LARGEST:
        return columns[0], "1"
    raise DataFileError(f"{path}: {columns[0]!r} does not say its unit; {add}")
