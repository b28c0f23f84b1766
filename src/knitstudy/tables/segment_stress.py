"""Stresses averaged over the six segments of the centre cell (section 3.4)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.discretisation import made_of
from knitstudy.measures.segment_angles import SEGMENT, central
from knitstudy.measures.selection import TIED_COURSE
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")

XYZ = "xyz"


@TABLES.add(
    "segment_stress",
    "Stress averaged over the segments of the centre cell",
    needs=("fields_stress", "scenes"),
    of=TIED_COURSE,
    order=6.5,
)
def tabulate(fields_stress: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]) -> pd.DataFrame:
    """Return principal values and components of the mean Cauchy stress at full load, a row a segment.

    Parameters
    ----------
    fields_stress : mapping of str to Dataset
        Stresses of direct simulations by scene (see docs/architecture.md).
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
