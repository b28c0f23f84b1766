"""Table 4: angles of the six segments to the axes, by geometry and by principal stress; stresses of the segments."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.centre_cell import SEGMENT, angles_to_axes, central, honeycomb_segments, stress_angles
from knitstudy.measures.reference import INTERACTIONS, made_of
from knitstudy.mechanics.arrays import Floats
from knitstudy.paper.cases import angles_by_geometry, angles_of_stress
from knitstudy.paper.columns import Simulation
from knitstudy.paper.scene_names import CASES, OTHER_SOLIDS, SOLIDS, of_cases, solid
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several

AXES = "xyz"

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")
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
    scene, stresses = simulation.scene, simulation.results["stress"]
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


@TABLES.add(
    "segment_stress",
    "Stress averaged over the segments of the centre cell",
    results={"stresses": several("stress", *_SOLIDS)},
    order=6.5,
)
def tabulate_stress(stresses: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row a segment: principal values and components of the mean Cauchy stress at full load."""
    return pd.DataFrame(
        [
            {
                "segment": number,
                "kind": kind,
                "scene": name,
                "discretisation": made_of(scenes[name]),
                "row": int(dataset["segment_row"][segment]),
                "column": int(dataset["segment_column"][segment]),
                **_stress(dataset.sel(extent="whole").isel(segment=segment)),
            }
            for name, dataset in stresses.items()
            for kind, number in SEGMENT.items()
            for segment in central(dataset, kind)
        ]
    )


def _stress(segment: xr.Dataset) -> dict[str, float]:
    principal, stress = segment["segment_principal"].to_numpy(), segment["segment_stress"].to_numpy()
    (angles,) = angles_to_axes(segment["segment_axis"].to_numpy()[:1])
    return {
        "deformed volume [m3]": float(segment["segment_volume"]),
        **{f"principal stress {i + 1} [Pa]": value for i, value in enumerate(principal)},
        **{f"angle of 1 to {axis} [deg]": angle for axis, angle in zip(AXES, angles, strict=True)},
        **{f"stress {name} [Pa]": stress[AXES.index(name[0]), AXES.index(name[1])] for name in COMPONENTS},
    }
