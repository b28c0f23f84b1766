"""Contacts as the geometry alone predicts them: one touching point, or one tied disc, at every crossing.

They stand in where no simulation of the solid yarns is at hand, or is needed, in the format of its contacts (see
docs/architecture.md).
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.errors import GeometryError
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.columns import CONTACTS


def contacts_of_crossings(knit: Knit, tied: float = 0.0) -> xr.Dataset:
    """Return contacts at the closest points of the centrelines of a knit.

    The centroid is halfway between the two closest points and the normal points from side 0 to side 1. Forces and
    displacements are left out.

    Parameters
    ----------
    knit : Knit
    tied : float
        Radius of the disc that joins two yarns at a crossing, over that of the yarn; 0 for a point without area.

    Raises
    ------
    GeometryError
        If two centrelines meet, so that there is no normal.
    """
    crossings = knit.crossings
    apart = crossings.point[:, 1] - crossings.point[:, 0]
    distance = np.linalg.norm(apart, axis=1)
    if not np.all(distance > 0):
        k = int(np.argmin(distance))
        raise GeometryError(
            f"crossing {k} (row {crossings.row[k]}, column {crossings.column[k]}, zone {crossings.zone[k]}): "
            "the centrelines of its two yarns meet, which leaves no contact normal; they must be apart"
        )
    values = {
        "row": np.asarray(crossings.row),
        "column": np.asarray(crossings.column),
        "zone": np.asarray(crossings.zone),
        "yarn": np.asarray(crossings.yarn),
        "arc_length": np.asarray(crossings.arc_length),
        "centroid": crossings.point.mean(axis=1),
        "normal": apart / distance[:, None],
        "area": np.full(len(distance), np.pi * (tied * knit.radius) ** 2),
    }
    return xr.Dataset(
        CONTACTS.variables(values),
        coords={"xyz": list("xyz")},
    )
