"""Curves of force per width [N/m] over strain [1], measured or simulated: a series by rising strain.

A measured curve is a table of a text file (`lab_table`), whose columns have a meaning (`lab_columns`), from its zero on
(`curve_zero`). The caller names columns, units and sizes that the file does not tell; they are kept in a YAML file
beside it. Of loading cycles one branch is taken, the first loading where nothing else is asked for; whatever is
corrected or left out is printed.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import floor, inf, log10, nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
import yaml
from pandas.api.types import is_numeric_dtype
from scipy.interpolate import PchipInterpolator

from knitstudy.datasets import STRAINS
from knitstudy.errors import DataFileError
from knitstudy.files import write_text
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.scene.documents import read_yaml
from knitstudy.registry import find
from knitstudy.use.curve_zero import ZEROS, anchored
from knitstudy.use.lab_columns import SIZES, UNITS, measured_columns
from knitstudy.use.lab_table import LEAST, SHOWN, read_lab_table

log = logging.getLogger(__name__)

LEAST_STRAIN, LARGEST_STRAIN = 1e-6, 30.0  # of a curve; beyond them a unit or a size is wrong
LEAST_FORCE, LARGEST_FORCE = 1e-9, 1e9  # [N/m], of its largest force
DIGITS = 12  # of the largest number in a column of a curve
TURNS = 0.02  # Share of the largest strain by which it falls where a branch ends; less is noise
SAME = 1e-9  # Share of the largest strain by which strains that are meant to be one may differ
STRAIN, PULL = "{} strain [1]".format, "{} force per width [N/m]".format  # columns of `curve_table`
THICKNESS, PRESSURE, ENERGY = "thickness [mm]", "pressure [Pa]", "energy [J/m2]"  # others
BRANCHES = ("loading", "unloading")


def simulated_curve(
    history: xr.Dataset, geometry: xr.Dataset, cycle: int = 1, branch: str = "loading"
) -> pd.Series:
    """Return a branch of the curve of a history, by rising strain; where it has fewer cycles, of its last one.

    Of a cell it is the force per width, of a knit the force over its width at rest.
    Raises DataFileError where the history has no such branch, no force per width, or values that are no numbers.
    """
    if "pressure" in history:
        raise DataFileError(
            "is the history of a cell between plates, which has no force per width along its load"
        )
    table = curve_table(history, None if "force_per_width" in history else geometry)
    curve = force_over_strain(table, STRAINS[int(history.attrs["axis"])])
    if not np.isfinite([curve.index, curve]).all():
        raise DataFileError("its curve holds a value that is not a number; make it again")
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
        size = fabric_of(geometry).size
        axis = int(history.attrs["axis"])
        if axis == 2:
            raise DataFileError("is the history of two yarns, which have no force per width")
        strain, force = (history[name].to_numpy()[:, None] for name in ("strain", "force"))
        force = force / size[1 - axis]
        energy = history["energy"].sel(form="external") / (size[0] * size[1])
        names = STRAINS[axis : axis + 1]
    columns = {STRAIN(name): strain[:, k] for k, name in enumerate(names)}
    columns |= {PULL(name): force[:, k] for k, name in enumerate(names)}
    columns |= {f"{name} force per width [N/mm]": 1e-3 * force[:, k] for k, name in enumerate(names)}
    if pressed:
        columns |= {THICKNESS: 1e3 * history["thickness"].data, PRESSURE: history["pressure"].data}
    return without_noise(pd.DataFrame(columns | {ENERGY: np.asarray(energy)}))


def without_noise(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table of numbers without digits below the rounding error of the largest number of the same unit.

    Examples
    --------
    >>> without_noise(pd.DataFrame({"course strain [1]": [0.1 + 0.2], "shear strain [1]": [-1e-18]})).iloc[0].tolist()
    [0.3, 0.0]
    """
    units = table.columns.str.extract(r"\[(.*)\]$", expand=False).fillna("")
    largest = table.abs().max().groupby(units.to_numpy()).max()

    def rounded(column: pd.Series) -> pd.Series:
        most = largest[units[table.columns.get_loc(column.name)]]
        if not 0 < most < inf:
            return column
        return column.round(DIGITS - 1 - floor(log10(most))) + 0.0  # -0.0 becomes 0.0

    return table.apply(rounded)


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
    least = TURNS * np.ptp(strain)
    turns = [0]
    far = 0
    way = -1 if strain[np.argmax(np.abs(strain - strain[0]) > least)] < strain[0] else 1
    for k in range(1, len(strain)):
        if way * (strain[k] - strain[far]) > 0:
            far = k
        elif way * (strain[far] - strain[k]) > least:
            turns.append(far)
            way = -way
            far = k
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
    table: int | None = None,
) -> pd.Series:
    """Return one branch of the curve of a text file, by rising strain; what is corrected or left out is logged.

    Parameters
    ----------
    path : Path
        A file of `read_lab_table`.
    named : mapping
        How the file is read where its names do not tell: a column and its unit for ``strain`` and ``force``;
        ``width``, ``length`` and ``thickness`` of the specimen [m]; ``zero``, one of `ZEROS`. They are kept in a file
        beside it.
    only : mapping
        Values of columns that tell curves apart.
    direction : str
        "course" or "wale", chosen where a column has it.
    cycle, branch : int, str
        Which of the branches of a curve that turns back.
    skip_bad : bool
        Leave out rows that cannot be read.
    table : int, optional
        Which of several tables in the file.

    Returns
    -------
    Series
        Forces per width (n,) [N/m] by strains [1], both over sizes at rest.

    Raises
    ------
    DataFileError
        If the file does not hold one curve of tension, or not so many cycles.
    """
    rows = _one_curve(read_lab_table(path, skip_bad, table), only, direction, path)
    beside = path.with_name(f"{file_stem(path)}.columns.yaml")
    if wrong := _wrong(named):
        raise DataFileError(f"{path}: --{wrong} must be a positive number, in m")
    how = _kept(beside) | {name: list(value) if name in UNITS else value for name, value in named.items()}
    strain, force = measured_columns(rows, how, direction, path)
    curve = pd.Series(force.to_numpy(), strain).loc[lambda values: values.notna() & values.index.notna()]
    if (empty := len(rows) - len(curve)) > 0:
        log.warning("%s: %d rows have no strain or no force and are not used", path, empty)
    _require_rows(curve, path)
    curve = anchored(curve, how.get("zero"), path)
    _require_tension(curve, path)
    rising = _branch(curve, cycle, branch, path)
    _require_rows(rising, path)
    if len(rising) < len(curve):
        log.warning(
            "%s: %s of cycle %d is taken, %d rows are left out", path, branch, cycle, len(curve) - len(rising)
        )
    if named:
        try:
            write_text(f"# How knitstudy reads {path.name}; sizes in m\n{yaml.safe_dump(how)}", beside)
        except (OSError, DataFileError) as error:
            log.warning("%s; columns and units have to be named again next time", error)
    return rising.sort_index(kind="stable")


def file_stem(path: Path) -> str:
    """Return the name of a file, without its ending if that is .csv: lab.csv and lab.txt are two files."""
    return path.stem if path.suffix == ".csv" else path.name


def _kept(beside: Path) -> dict[str, Any]:
    """Return the options with which a file was read before."""
    kept = read_yaml(beside) if beside.is_file() else {}
    if wrong := _wrong(kept):
        raise DataFileError(
            f"{beside}: is not as knitstudy wrote it; delete it and name the columns again ({wrong})"
        )
    return kept


def _wrong(how: Mapping[str, Any]) -> str:
    """Return a name whose value is no pair of column and unit, no positive size or no zero; "" if there is none."""
    for name, value in how.items():
        if name in UNITS:
            right = np.shape(value) == (2,) and all(isinstance(text, str) for text in value)
        elif name in SIZES.values():
            right = isinstance(value, float) and 0 < value < inf
        else:
            right = name == "zero" and value in ZEROS
        if not right:
            return name
    return ""


def _require_rows(curve: pd.Series, path: Path) -> None:
    """Refuse a curve of too few rows."""
    if len(curve) < LEAST:
        raise DataFileError(
            f"{path}: has {len(curve)} rows of numbers up to the largest strain; {LEAST} are needed"
        )


def _require_tension(curve: pd.Series, path: Path) -> None:
    """Refuse a curve from its zero on that no fabric has in tension."""
    strain = curve.index.to_numpy(dtype=float)
    force = curve.to_numpy()
    most, largest = np.abs(strain).max(), np.abs(force).max()
    if not LEAST_STRAIN < most < LARGEST_STRAIN:
        raise DataFileError(
            f"{path}: strains reach {100 * most:.3g} %: check the unit of the strain, and --length in m"
        )
    if not LEAST_FORCE < largest < LARGEST_FORCE:
        raise DataFileError(
            f"{path}: forces reach {largest:.3g} N/m: check the unit of the force, and sizes in m"
        )
    if force.min() < -0.1 * largest:
        raise DataFileError(
            f"{path}: forces are from {force.min():.3g} to {force.max():.3g} N/m: no curve of tension"
        )


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
        find("column", dict.fromkeys(table), column, str(path))
        values = table[column]
        there = values.map("{:.15g}".format) if is_numeric_dtype(values) else values.astype(str)
        find(f"{column} in --only", dict.fromkeys(there), value, str(path))
        table = table[there == value]
    for column in map(str, table.select_dtypes(exclude="number")):
        names = table[column].astype(str)
        if direction in set(names):
            table = table[names == direction]
        elif names.nunique() > 1:
            some = ", ".join(name[:SHOWN] for name in names.unique()[:4])
            has = f"has {names.nunique()} curves by {column!r} ({some})"
            raise DataFileError(f"{path}: {has}: add --only {column}={names.iloc[0][:SHOWN]}")
    return table
