"""Table 4, geometry row: the angles of the six segments of the honeycomb to the axes."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.printed import numbers
from knitstudy.measures.selection import TIED_COURSE
from knitstudy.tables.catalogue import TABLES

AXES = "xyz"

DECIMALS = 3
"""Of angles in degrees: the paper prints none; closest points are found to about 1e-5 degrees."""

REPORTED = {
    "head": (1, "segment 1 angles to x y z"),
    "interlock, left": (2, "segment 2 and 3 angles to x y z"),
    "interlock, right": (3, "segment 2 and 3 angles to x y z"),
    "leg, left": (4, "segment 4 and 5 angles to x y z"),
    "leg, right": (5, "segment 4 and 5 angles to x y z"),
    "sinker": (6, "segment 6 angles to x y z"),
}
"""Number of a segment in Fig. 14 and where the paper prints it; which of 1 and 6 is the head is not said."""


@TABLES.add(
    "table4_angles",
    "Table 4: angles of the honeycomb's segments",
    needs=("contacts", "paper"),
    of=TIED_COURSE,
    order=6,
)
def tabulate(contacts: xr.Dataset, paper: pd.DataFrame) -> pd.DataFrame:
    """Return the angles of each kind of segment, averaged over the knit, and the paper's.

    Parameters
    ----------
    contacts : Dataset
        Contacts of a direct simulation (see docs/architecture.md).
    paper : DataFrame
        ``resources/reference/paper_tables.csv``.
    """
    rows = []
    for kind, segments in honeycomb_segments(contacts).items():
        angle = angles_to_axes(segments)
        segment, quantity = REPORTED[kind]
        ours, theirs = angle.mean(axis=0), numbers(paper, "4", "rom2d", quantity)
        row = {"segment": segment, "kind": kind, "segments": len(segments)}
        for i, axis in enumerate(AXES):
            row[f"angle to {axis} [deg]"] = round(ours[i], DECIMALS)
            row[f"angle to {axis}, paper [deg]"] = theirs[i]
        row["largest difference [deg]"] = round(np.abs(ours - theirs).max(), DECIMALS)
        row["spread over the knit [deg]"] = round(np.ptp(angle, axis=0).max(), DECIMALS)
        rows.append(row)
    return pd.DataFrame(rows).sort_values("segment", ignore_index=True)


def honeycomb_segments(contacts: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the segments between contact zones by kind, vectors (k, 3) in the plane of the fabric [m].

    A kind that a knit does not have is left out: a knit of one row has no legs, one of one column no sinkers.
    """
    zone = _by_place(contacts)
    segments = {
        "head": zone[:, :, 3] - zone[:, :, 2],
        "interlock, left": zone[:, :, 2] - zone[:, :, 0],
        "interlock, right": zone[:, :, 3] - zone[:, :, 1],
        "leg, left": zone[1:, :, 0] - zone[:-1, :, 2],
        "leg, right": zone[1:, :, 1] - zone[:-1, :, 3],
        "sinker": zone[:, 1:, 0] - zone[:, :-1, 1],
    }
    return {kind: each.reshape(-1, 3) for kind, each in segments.items() if each.size}


def angles_to_axes(vectors: np.ndarray) -> np.ndarray:
    """Return the angles (k, 3) of lines along vectors (k, 3) to x, y and z, from 0 to 90 [deg]."""
    cosine = np.abs(vectors) / np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.degrees(np.arccos(np.clip(cosine, 0, 1)))


def _by_place(contacts: xr.Dataset) -> np.ndarray:
    """Return the centroids by row, column and zone (rows, columns, 4, 3), moved into the plane z = 0."""
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    centroid = np.full((row.max() + 1, column.max() + 1, 4, 3), np.nan)
    centroid[row, column, zone] = contacts["centroid"].to_numpy() * [1.0, 1.0, 0.0]
    return centroid
