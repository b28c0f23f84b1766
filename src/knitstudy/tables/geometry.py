"""The unit cell before and after its optimisation, and sweeps of course spacing and yarn diameter."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.measures.centre_cell import crossing_error
from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.measures.response import at_strain
from knitstudy.measures.selection import TIED_COURSE
from knitstudy.measures.sweeps import DIAMETER, HELD, SPACING, Point, Sweep, sweeps_of
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

# ---- The unit cell before and after its optimisation, and how far it is from what it was calibrated to


MEASURES = {
    "deepest penetration": ("penetration", "m", None),
    "smallest gap": ("gap", "m", None),
    "smallest gap away from crossings": ("other_gap", "m", None),
    "smallest radius of curvature": ("radius_of_curvature", "m", None),
    "yarn in a loop": ("loop_length", "m", "length"),
    "angle of interlock segments to x": ("interlock_angle", "deg", "interlock_angle"),
    "angle of legs to x": ("leg_angle", "deg", "leg_angle"),
}
"""Name in the table: variable of the geometry dataset, unit, and key of the target."""


@TABLES.add(
    "geometry",
    "Unit cell before and after optimisation",
    needs=("geometry", "targets"),
    of=TIED_COURSE,
    order=14,
)
def tabulate_unit_cell(geometry: xr.Dataset, targets: dict) -> pd.DataFrame:
    """Return measures and terms of F before and after, with targets and residuals where there are any.

    Parameters
    ----------
    geometry : Dataset
        Result of the geometry stage (see docs/files.md).
    targets : dict
        ``config/calibration.yaml``: under ``targets``, a mapping with ``value`` for each.

    Raises
    ------
    ConfigurationError
        When a target is missing.
    """
    rows = [
        _row_of_measure(name, geometry[key].to_numpy(), unit, target, targets)
        for name, (key, unit, target) in MEASURES.items()
    ]
    error = crossing_error(geometry).to_numpy()
    rows.insert(0, _row_of_measure("largest |D - 2R - c0| of a crossing", error, "m", None, targets))
    rows += [
        _row_of_measure(
            f"F, {'total' if term == 'total' else 'term ' + term}", each.to_numpy(), "1", None, targets
        )
        for term, each in zip(
            geometry["term"].to_numpy(), geometry["cost"].transpose("term", "state"), strict=True
        )
    ]
    diameter = 2 * float(geometry["radius"])
    rows.append(_row_of_measure("yarn diameter", np.array([diameter, diameter]), "m", "diameter", targets))
    return pd.DataFrame(rows)


def _row_of_measure(name: str, values: np.ndarray, unit: str, target: str | None, targets: dict) -> dict:
    before, after = (float(value) for value in values)
    row = {
        "quantity": name,
        "unit": unit,
        "before": before,
        "after": after,
        "target": np.nan,
        "residual": np.nan,
    }
    if target is None:
        return row
    try:
        wanted = float(targets["targets"][target]["value"])
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigurationError(
            f"calibration: targets.{target}.value must be there and be a number"
        ) from error
    return row | {"target": wanted, "residual": after - wanted}


# ---- Sweeps of course spacing and yarn diameter (Fig. 11): one row a simulation


SWEEPS = {SPACING: "course spacing", DIAMETER: "yarn diameter"}

COLUMNS = [
    "swept",
    "held fixed",
    "interaction",
    "made of",
    "scene",
    "course spacing [m]",
    "course spacing over drawn [1]",
    "yarn diameter [m]",
    "width of the knit [m]",
    "strain [1]",
    "largest |u_z| [m]",
    "uncertainty of that [m]",
    "largest |u_z| over diameter [1]",
    "force [N]",
]


@TABLES.add(
    "sweeps",
    "Other course spacings and yarn diameters",
    needs=("sweeps", "scenes", "reference"),
    order=13,
)
def tabulate_sweeps(
    sweeps: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], reference: pd.DataFrame
) -> pd.DataFrame:
    """Return one row a simulation of each sweep; what has no known error has no uncertainty.

    Parameters
    ----------
    sweeps : mapping of str to Dataset
        Histories by scene (see docs/files.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    """
    rows = [
        _row_of_point(key, series, point, sweeps[point.scene.name])
        for key in SWEEPS
        for series in sweeps_of(key, sweeps, scenes, reference)
        for point in series.points
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def _row_of_point(key: str, series: Sweep, point: Point, history: xr.Dataset) -> dict:
    pattern, strain = point.scene.pattern, float(history["strain"][-1])
    values = (
        SWEEPS[key],
        HELD[series.keep],
        INTERACTIONS[series.interaction],
        series.made_of,
        point.scene.name,
        pattern.course_ratio * pattern.course_spacing,
        pattern.course_ratio,
        point.scene.yarn.diameter,
        float(history["displacement"][-1]) / strain,
        strain,
        point.u_z.value,
        point.u_z.uncertainty,
        point.over_diameter.value,
        at_strain(history, strain, history["force"].to_numpy()),
    )
    return dict(zip(COLUMNS, values, strict=True))
