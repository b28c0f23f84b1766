"""Table 4: angles to the axes of the six segments, of the honeycomb by geometry and of those by principal stress."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.discretisation import INTERACTIONS, made_of
from knitstudy.measures.paper_values import numbers
from knitstudy.measures.segments import (
    SEGMENT,
    angles_to_axes,
    cell_force,
    central,
    cut_force,
    honeycomb_segments,
    stress_angles,
)
from knitstudy.measures.selection import TIED_COURSE
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

AXES = "xyz"

DECIMALS = 3
"""Of angles in degrees: the paper prints none; closest points are found to about 1e-5 degrees."""

REPORTED = {
    "head": "segment 1 angles to x y z",
    "interlock, left": "segment 2 and 3 angles to x y z",
    "interlock, right": "segment 2 and 3 angles to x y z",
    "leg, left": "segment 4 and 5 angles to x y z",
    "leg, right": "segment 4 and 5 angles to x y z",
    "sinker": "segment 6 angles to x y z",
}
"""Where the paper prints the angles of the honeycomb by geometry."""


@TABLES.add(
    "table4_angles",
    "Table 4: angles of the honeycombs' segments",
    needs=("contacts", "paper"),
    of=TIED_COURSE,
    optional=("fields_stress", "scenes"),
    order=6,
)
def tabulate(
    contacts: xr.Dataset,
    paper: pd.DataFrame,
    fields_stress: Mapping[str, xr.Dataset] | None = None,
    scenes: Mapping[str, Scene] | None = None,
) -> pd.DataFrame:
    """Return the angles of each kind of segment, and the paper's.

    Lines between contact zones are averaged over the knit, axes of the maximum principal stress over the segments that
    end in its centre cell.

    Parameters
    ----------
    contacts : Dataset
        Contacts of a direct simulation (see docs/files.md).
    paper : DataFrame
        ``resources/reference/paper_tables.csv``.
    fields_stress : mapping of str to Dataset, optional
        Stresses of direct simulations, by scene.
    scenes : mapping of str to Scene, optional
        Their scenes.
    """
    rows = [
        _row("geometry", kind, angles_to_axes(vectors), numbers(paper, "4", "rom2d", REPORTED[kind]))
        for kind, vectors in honeycomb_segments(contacts).items()
    ]
    for name, stresses in (fields_stress or {}).items():
        rows += _by_stress(scenes[name], stresses, paper)
    found = pd.DataFrame(rows)
    order = {honeycomb: place for place, honeycomb in enumerate(dict.fromkeys(found["honeycomb"]))}
    return (
        found.assign(place=found["honeycomb"].map(order))
        .sort_values(["place", "segment"], ignore_index=True)
        .drop(columns="place")
    )


def _by_stress(scene: Scene, stresses: xr.Dataset, paper: pd.DataFrame) -> list[dict]:
    direction = scene.load.direction
    honeycomb = f"principal stress, {direction}, {INTERACTIONS[scene.interaction]}, {made_of(scene)}"
    printed = np.stack(
        [numbers(paper, "4", f"mps-{direction}", f"segments 1..6 angle to {axis}") for axis in AXES], axis=-1
    )
    rows = []
    for kind, number in SEGMENT.items():
        angle = stress_angles(stresses, kind)
        if not len(angle):
            continue
        back, middle = stress_angles(stresses, kind, undeformed=True), stress_angles(stresses, kind, "middle")
        more = {
            "angle to x, axes turned back [deg]": round(back[:, 0].mean(), DECIMALS),
            "angle to x, middle halves [deg]": round(middle[:, 0].mean(), DECIMALS),
        }
        rows.append(_row(honeycomb, kind, angle, printed[number - 1]) | more)
    return rows


def _row(honeycomb: str, kind: str, angle: np.ndarray, theirs: np.ndarray) -> dict:
    """Return the row of a kind of segment from the angles (k, 3) of equivalent ones, and the paper's (3,)."""
    ours = angle.mean(axis=0)
    row = {"segment": SEGMENT[kind], "honeycomb": honeycomb, "kind": kind, "segments": len(angle)}
    for i, axis in enumerate(AXES):
        row[f"angle to {axis} [deg]"] = round(ours[i], DECIMALS)
        row[f"angle to {axis}, paper [deg]"] = theirs[i]
    row["largest difference [deg]"] = round(np.abs(ours - theirs).max(), DECIMALS)
    row["spread over equivalent segments [deg]"] = round(np.ptp(angle, axis=0).max(), DECIMALS)
    return row


# ---- Stresses averaged over the six segments of the centre cell (section 3.4)


COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")

XYZ = "xyz"


@TABLES.add(
    "segment_stress",
    "Stress averaged over the segments of the centre cell",
    needs=("fields_stress", "scenes"),
    of=TIED_COURSE,
    order=6.5,
)
def tabulate_stress(fields_stress: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return principal values and components of the mean Cauchy stress at full load, a row a segment.

    Parameters
    ----------
    fields_stress : mapping of str to Dataset
        Stresses of direct simulations by scene (see docs/files.md).
    scenes : mapping of str to Scene
        Their scenes.
    """
    rows = []
    for name, stresses in fields_stress.items():
        whole = stresses.sel(extent="whole")
        for kind, number in SEGMENT.items():
            for segment in central(stresses, kind):
                rows.append(
                    {
                        "segment": number,
                        "kind": kind,
                        "scene": name,
                        "discretisation": made_of(scenes[name]),
                        "row": int(stresses["segment_row"][segment]),
                        "column": int(stresses["segment_column"][segment]),
                        **_stress(whole.isel(segment=segment)),
                    }
                )
    return pd.DataFrame(rows)


def _stress(segment: xr.Dataset) -> dict[str, float]:
    principal, stress = segment["segment_principal"].to_numpy(), segment["segment_stress"].to_numpy()
    axis = np.abs(segment["segment_axis"].to_numpy()[0])
    angles = np.degrees(np.arccos(np.clip(axis, 0, 1)))
    return {
        "deformed volume [m3]": float(segment["segment_volume"]),
        **{f"principal stress {i + 1} [Pa]": value for i, value in enumerate(principal)},
        **{f"angle of 1 to {axis} [deg]": angle for axis, angle in zip(XYZ, angles, strict=True)},
        **{f"stress {name} [Pa]": stress[XYZ.index(name[0]), XYZ.index(name[1])] for name in COMPONENTS},
    }


# ---- Forces through the knit from stresses, beside those of the grips


CUTS = (0.3, 0.4, 0.5, 0.6, 0.7)
"""Shares of the knit along the load: slabs about them lie between the grips."""


@TABLES.add(
    "cut_forces",
    "Forces from averaged stresses and of the grips",
    needs=("geometry", "fields_stress", "scenes"),
    of=TIED_COURSE,
    order=6.6,
)
def tabulate_cut_forces(
    geometry: xr.Dataset, fields_stress: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]
) -> pd.DataFrame:
    """Return one row a simulation.

    Parameters
    ----------
    geometry : Dataset
        Result of the geometry stage.
    fields_stress : mapping of str to Dataset
        Stresses of direct simulations by scene (see docs/files.md).
    scenes : mapping of str to Scene
        Their scenes.
    """
    knit = Fabric.from_dataset(geometry)
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
