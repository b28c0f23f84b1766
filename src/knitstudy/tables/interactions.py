"""Ties, rough contact and isotropic friction compared: stiffness, out-of-plane motion and contraction (Figs. 8, 9)."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.names import INTERACTIONS
from knitstudy.measures.response import (
    at_strain,
    common_strain,
    out_of_plane,
    stiffness_at,
    transverse_contraction,
)
from knitstudy.measures.selection import ISOTROPIC_COURSE
from knitstudy.tables.catalogue import TABLES


@TABLES.add(
    "interactions",
    "Ties, rough contact and isotropic friction",
    needs=("tie", "rough", "isotropic", "geometry"),
    of=ISOTROPIC_COURSE,
    order=2,
)
def tabulate(tie: xr.Dataset, rough: xr.Dataset, isotropic: xr.Dataset, geometry: xr.Dataset) -> pd.DataFrame:
    """Return one row an interaction, at the largest strain that all have reached.

    Parameters
    ----------
    tie, rough, isotropic : Dataset
        Histories of direct simulations that differ in nothing else (see docs/architecture.md).
    geometry : Dataset
        Result of the geometry stage, for the yarn's diameter.
    """
    histories = {"tie": tie, "rough": rough, "isotropic": isotropic}
    strain = common_strain(histories.values())
    diameter = 2 * float(geometry["radius"])
    stiffnesses = {name: stiffness_at(history, strain) for name, history in histories.items()}
    rows = []
    for name, history in histories.items():
        u_z = at_strain(history, strain, out_of_plane(history))
        rows.append(
            {
                "interaction": INTERACTIONS[name],
                "scene": history.attrs.get("scene", ""),
                "strain [1]": strain,
                "force [N]": at_strain(history, strain, history["force"].to_numpy()),
                "secant stiffness [N/m]": stiffnesses[name],
                "stiffness over tie's [1]": stiffnesses[name] / stiffnesses["tie"],
                "largest |u_z| [m]": u_z,
                "largest |u_z| over diameter [1]": u_z / diameter,
                "transverse contraction at full strain [1]": transverse_contraction(history),
                "increments [1]": history.sizes["increment"] - 1,
                "Newton iterations [1]": int(history["newton_iterations"].sum()),
                "time [s]": history.attrs.get("wall_seconds", np.nan),
            }
        )
    return pd.DataFrame(rows)
