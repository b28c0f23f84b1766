"""What happens at the crossings of a direct simulation, per crossing and increment (sections 2.5 and 2.6).

The normal is the line of the closest points, not the direction of the resultant that section 2.5 names: a tie also
carries shear, and the plane of P1, P2 and its resultant misses the centrelines that it should cut in C1 to C4.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.geometry.pattern import Knit


def extract(knit: Knit, history: xr.Dataset) -> xr.Dataset:
    """Return the contacts dataset of docs/architecture.md.

    Parameters
    ----------
    knit : Knit
    history : Dataset
        History of a DNS of that knit, with the forces of its crossings.

    Raises
    ------
    DataFileError
        If the history holds no crossings, or those of another knit.
    """
    crossings = knit.crossings
    if "crossing_force" not in history:
        raise DataFileError(
            "the history holds no crossing_force: contacts come from a scene with fidelity 'dns'"
        )
    if history.sizes["crossing"] != len(crossings.row):
        raise DataFileError(
            f"the history has {history.sizes['crossing']} crossings and the knit {len(crossings.row)}: "
            "they belong to different scenes"
        )
    motion = history["crossing_displacement"].values
    apart = crossings.point[:, 1] - crossings.point[:, 0]
    one, metre = {"units": "1"}, {"units": "m"}
    return xr.Dataset(
        {
            "strain": history["strain"],
            "row": ("crossing", crossings.row, one),
            "column": ("crossing", crossings.column, one),
            "zone": (
                "crossing",
                crossings.zone,
                one | {"long_name": "0 left lower, 1 right lower, 2, 3 upper"},
            ),
            "yarn": (("crossing", "side"), crossings.yarn, one),
            "arc_length": (("crossing", "side"), crossings.arc_length, metre),
            "centroid": (("crossing", "xyz"), history["tied_centroid"].values, metre),
            "normal": (
                ("crossing", "xyz"),
                apart / np.linalg.norm(apart, axis=1, keepdims=True),
                one | {"long_name": "from the lower row's yarn to the upper row's"},
            ),
            "area": ("crossing", history["tied_area"].values, {"units": "m2"}),
            "force": (
                ("increment", "crossing", "xyz"),
                history["crossing_force"].values,
                {"units": "N", "long_name": "on the lower row's yarn"},
            ),
            # Tied sides move as one.
            "centroid_displacement": (
                ("increment", "crossing", "side", "xyz"),
                np.repeat(motion[:, :, None], 2, axis=2),
                metre,
            ),
        },
        coords={"xyz": list("xyz")},
        attrs={
            name: history.attrs[name]
            for name in ("scene", "scene_hash", "interaction")
            if name in history.attrs
        },
    )
