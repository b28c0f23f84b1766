"""Table 4: angles of the six segments to the axes, by geometry and by principal stress."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.centre_cell import SEGMENT, angles_to_axes, honeycomb_segments, stress_angles
from knitstudy.measures.reference import made_of
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.paper.cases import angles_by_geometry, angles_of_stress
from knitstudy.paper.columns import Simulation
from knitstudy.paper.scene_names import CASES, INTERACTIONS, OTHER_SOLIDS, SOLIDS, of_cases, solid
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several

AXES = "xyz"

DECIMALS = 3  # The paper prints none; closest points are found to about 1e-5 degrees

_SOLIDS = of_cases(CASES, (*SOLIDS, *OTHER_SOLIDS))


@TABLES.add(
    "table4_angles",
    "Table 4: angles of the honeycombs' segments",
    results={
        "contacts": solid("contacts", "tie-course"),
        "stresses": several("stress", *_SOLIDS, optional=True),
    },
    order=6,
)
def tabulate(
    contacts: xr.Dataset, paper: pd.DataFrame, stresses: Datasets | None = None, scenes: Scenes | None = None
) -> pd.DataFrame:
    """Return the angles of each kind of segment, and the paper's.

    Lines between contact zones are averaged over the knit, axes of the maximum principal stress over the segments that
    end in the centre cell.
    """
    printed = angles_by_geometry(paper)
    rows = [
        _row("geometry", kind, angles_to_axes(vectors), printed[SEGMENT[kind] - 1])
        for kind, vectors in honeycomb_segments(contacts).items()
    ]
    for name, dataset in (stresses or {}).items():
        rows += _by_stress(Simulation((scenes or {})[name], {"stress": dataset}), paper)
    order = list(dict.fromkeys(row["honeycomb"] for row in rows))
    rows.sort(key=lambda row: (order.index(row["honeycomb"]), row["segment"]))
    return pd.DataFrame(rows)


def _by_stress(simulation: Simulation, paper: pd.DataFrame) -> list[dict[str, Any]]:
    scene = simulation.scene
    stresses = simulation.results["stress"]
    direction = scene.value("load.direction")
    honeycomb = f"principal stress, {direction}, {INTERACTIONS[scene.interaction]}, {made_of(scene)}"
    printed = angles_of_stress(paper, direction)
    rows = []
    for kind, number in SEGMENT.items():
        if len(angle := stress_angles(stresses, kind)):
            back = stress_angles(stresses, kind, undeformed=True)
            middle = stress_angles(stresses, kind, "middle")
            row = _row(honeycomb, kind, angle, printed[number - 1])
            row["angle to x, axes turned back [deg]"] = round(back[:, 0].mean(), DECIMALS)
            row["angle to x, middle halves [deg]"] = round(middle[:, 0].mean(), DECIMALS)
            rows.append(row)
    return rows


def _row(honeycomb: str, kind: str, angle: Floats, theirs: Floats) -> dict[str, Any]:
    """Return the row of a kind of segment from the angles (k, 3) of equivalent ones, and the paper's (3,)."""
    ours = angle.mean(axis=0)
    row = {"segment": SEGMENT[kind], "honeycomb": honeycomb, "kind": kind, "segments": len(angle)}
    for i, axis in enumerate(AXES):
        row[f"angle to {axis} [deg]"] = round(ours[i], DECIMALS)
        row[f"angle to {axis}, paper [deg]"] = theirs[i]
    row["largest difference [deg]"] = round(np.abs(ours - theirs).max(), DECIMALS)
    row["spread over equivalent segments [deg]"] = round(np.ptp(angle, axis=0).max(), DECIMALS)
    return row
