"""Forces through the knit from stresses, beside those of the grips."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
import xarray as xr

from knitstudy.geometry.pattern import Knit
from knitstudy.measures.cut_force import cell_force, cut_force
from knitstudy.measures.discretisation import made_of
from knitstudy.measures.selection import TIED_COURSE
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

CUTS = (0.3, 0.4, 0.5, 0.6, 0.7)
"""Shares of the knit along the load: slabs about them lie between the grips."""


@TABLES.add(
    "cut_forces",
    "Forces from averaged stresses and of the grips",
    needs=("geometry", "fields_stress", "scenes"),
    of=TIED_COURSE,
    order=6.6,
)
def tabulate(
    geometry: xr.Dataset, fields_stress: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return one row a simulation.

    Parameters
    ----------
    geometry : Dataset
        Result of the geometry stage.
    fields_stress : mapping of str to Dataset
        Stresses of direct simulations by scene (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes.
    """
    knit = Knit.from_dataset(geometry)
    rows = []
    for name, stresses in fields_stress.items():
        grips = stresses.attrs["force"]
        through = [cut_force(stresses, share) / grips for share in CUTS]
        rows.append(
            {
                "scene": name,
                "discretisation": made_of(scenes[name]),
                "force of the grips [N]": grips,
                "smallest force through a cut, over it [1]": min(through),
                "largest force through a cut, over it [1]": max(through),
                "force by the pieces of the centre cells, over it [1]": cell_force(stresses, knit) / grips,
            }
        )
    return pd.DataFrame(rows)
