"""The unit cell before and after its optimisation, and sweeps of course spacing and yarn diameter (Fig. 11)."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.measures.centre_cell import crossing_error
from knitstudy.measures.reference import INTERACTIONS
from knitstudy.measures.response import at_strain
from knitstudy.paper.sweeps import DIAMETER, HELD, RESULTS, SPACING, Point, Sweep, sweeps_of
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, solid

# Variable of the geometry dataset, unit, and key of the target, by name in the table.
MEASURES = {
    "deepest penetration": ("penetration", "m", None),
    "smallest gap": ("gap", "m", None),
    "smallest gap away from crossings": ("other_gap", "m", None),
    "smallest radius of curvature": ("radius_of_curvature", "m", None),
    "yarn in a loop": ("loop_length", "m", "length"),
    "angle of interlock segments to x": ("interlock_angle", "deg", "interlock_angle"),
    "angle of legs to x": ("leg_angle", "deg", "leg_angle"),
}

SWEEPS = {SPACING: "course spacing", DIAMETER: "yarn diameter"}


@TABLES.add(
    "geometry",
    "Unit cell before and after optimisation",
    results={"geometry": solid("geometry", "tie-course")},
    order=14,
)
def tabulate_unit_cell(geometry: xr.Dataset, targets: dict) -> pd.DataFrame:
    """Return measures and terms of F before and after, with targets and residuals where there are any.

    Raises ConfigurationError when a target is missing.
    """
    rows = [("largest |D - 2R - c0| of a crossing", "m", *crossing_error(geometry).to_numpy(), None)]
    rows += [
        (name, unit, *geometry[key].to_numpy(), target) for name, (key, unit, target) in MEASURES.items()
    ]
    for term, cost in zip(
        geometry["term"].to_numpy(), geometry["cost"].transpose("term", "state"), strict=True
    ):
        rows.append((f"F, {'' if term == 'total' else 'term '}{term}", "1", *cost.to_numpy(), None))
    diameter = 2 * float(geometry["radius"])
    rows.append(("yarn diameter", "m", diameter, diameter, "diameter"))
    table = pd.DataFrame(rows, columns=["quantity", "unit", "before", "after", "target"])
    table["target"] = [_target(targets, name) for *_, name in rows]
    return table.assign(residual=table["after"] - table["target"])


def _target(targets: dict, name: str | None) -> float:
    if name is None:
        return np.nan
    try:
        return float(targets["targets"][name]["value"])
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigurationError(
            f"calibration: targets.{name}.value must be there and be a number"
        ) from error


@TABLES.add(
    "sweeps",
    "Other course spacings and yarn diameters",
    results=RESULTS,
    order=13,
)
def tabulate_sweeps(
    drawn: Datasets, sweeps: Datasets, scenes: Scenes, reference: pd.DataFrame
) -> pd.DataFrame:
    """Return one row a simulation of each sweep; the uncertainty is empty where no error is known."""
    histories = {**drawn, **sweeps}
    return pd.DataFrame(
        [
            _row(key, sweep, point, histories[point.scene.name])
            for key in SWEEPS
            for sweep in sweeps_of(key, histories, scenes, reference)
            for point in sweep.points
        ]
    )


def _row(key: str, sweep: Sweep, point: Point, history: xr.Dataset) -> dict:
    pattern, strain = point.scene.pattern, float(history["strain"][-1])
    return {
        "swept": SWEEPS[key],
        "held fixed": HELD[sweep.keep],
        "interaction": INTERACTIONS[sweep.interaction],
        "made of": sweep.made_of,
        "scene": point.scene.name,
        "course spacing [m]": pattern.course_ratio * pattern.course_spacing,
        "course spacing over drawn [1]": pattern.course_ratio,
        "yarn diameter [m]": point.scene.yarn.diameter,
        "width of the knit [m]": float(history["displacement"][-1]) / strain,
        "strain [1]": strain,
        "largest |u_z| [m]": point.u_z.value,
        "uncertainty of that [m]": point.u_z.uncertainty,
        "largest |u_z| over diameter [1]": point.u_z.value / point.scene.yarn.diameter,
        "force [N]": at_strain(history, strain, history["force"].to_numpy()),
    }
