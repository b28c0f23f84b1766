"""The unit cell before and after its optimisation, and how far it is from what it was calibrated to."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.measures.centre_cell import crossing_error
from knitstudy.measures.selection import TIED_COURSE
from knitstudy.tables.catalogue import TABLES

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
def tabulate(geometry: xr.Dataset, targets: dict) -> pd.DataFrame:
    """Return measures and terms of F before and after, with targets and residuals where there are any.

    Parameters
    ----------
    geometry : Dataset
        Result of the geometry stage (see docs/architecture.md).
    targets : dict
        ``config/calibration.yaml``: under ``targets``, a mapping with ``value`` for each.

    Raises
    ------
    ConfigurationError
        When a target is missing.
    """
    rows = [
        _row(name, geometry[key].to_numpy(), unit, target, targets)
        for name, (key, unit, target) in MEASURES.items()
    ]
    error = crossing_error(geometry).to_numpy()
    rows.insert(0, _row("largest |D - 2R - c0| of a crossing", error, "m", None, targets))
    rows += [
        _row(f"F, {'total' if term == 'total' else 'term ' + term}", each.to_numpy(), "1", None, targets)
        for term, each in zip(
            geometry["term"].to_numpy(), geometry["cost"].transpose("term", "state"), strict=True
        )
    ]
    diameter = 2 * float(geometry["radius"])
    rows.append(_row("yarn diameter", np.array([diameter, diameter]), "m", "diameter", targets))
    return pd.DataFrame(rows)


def _row(name: str, values: np.ndarray, unit: str, target: str | None, targets: dict) -> dict:
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
