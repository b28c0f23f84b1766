"""The unit cell of a geometry: its loop, and how well the yarns touch at their crossings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr

from knitstudy.geometry.loop import Loop
from knitstudy.geometry.pattern import Knit


def loop_of(geometry: xr.Dataset, state: str) -> Loop:
    """Return the loop "before" or "after" the optimisation."""
    loop = Knit.from_dataset(geometry).loop
    if state == "before":
        return replace(loop, control_points=geometry["control_points_before"].to_numpy())
    return loop


def crossing_error(geometry: xr.Dataset) -> xr.DataArray:
    """Return the largest |D - 2R - c0| of a crossing by state [m]."""
    wanted = float((2 + geometry["clearance"]) * geometry["radius"])
    return np.abs(geometry["crossing_distance"] - wanted).max("cell_zone")
