"""Table 2 at a glance: the averaged springs of interfaces, one row a direct simulation."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
import xarray as xr

from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES
from knitstudy.tables.table2_springs import STATISTICS
from knitstudy.tables.table2_springs import tabulate as all_springs

DISPLACEMENT, STATISTIC = "interface", next(iter(STATISTICS))
"""What is shown: what the main reduced models use."""

NAMES = {"x": "kx", "y": "ky", "z": "kz", "normal": "normal to contact", "tangential": "along contact"}
"""Columns by axis."""


@TABLES.add(
    "springs",
    "Table 2 at a glance: springs",
    needs=("sprung_contacts", "paper", "scenes"),
    order=4,
)
def tabulate(
    sprung_contacts: Mapping[str, xr.Dataset], paper: pd.DataFrame, scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return stiffnesses along all axes beside the paper's, and how many of the crossings are negative.

    Parameters
    ----------
    sprung_contacts, paper, scenes
        As of `table2_springs`.
    """
    springs = all_springs(sprung_contacts, paper, scenes)
    shown = springs[(springs["displacement"] == DISPLACEMENT) & (springs["statistic"] == STATISTIC)]
    return pd.DataFrame(
        [_row(name, of.set_index("axis"), scenes) for name, of in shown.groupby("scene", sort=False)]
    )


def _row(name: str, of: pd.DataFrame, scenes: Mapping[str, Scene]) -> dict:
    scene, first = scenes[name], of.iloc[0]
    row = {
        "scene": name,
        "load": first["load"],
        "interaction": first["interaction"],
        "mesh size [m]": scene.value("mesh.size"),
        "contact stiffness over E / h [1]": scene.contact.normal_stiffness,
        "penalty alone": scene.contact.augmentations == 0,
    }
    for axis, column in NAMES.items():
        row[f"{column} [N/m]"] = of.loc[axis, "stiffness [N/m]"]
    for axis in "xyz":
        row[f"k{axis}, paper [N/m]"] = of.loc[axis, "paper [N/m]"]
    for axis in "xyz":
        row[f"k{axis} negative at crossings [1]"] = int(of.loc[axis, "negative [1]"])
    return row | {"crossings [1]": int(first["crossings [1]"])}
