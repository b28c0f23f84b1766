"""Directions of the six segments of a cell: lines between contact zones, and axes of the maximum principal stress."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr

from knitstudy.contacts.segments import KINDS
from knitstudy.measures.estimate import UNKNOWN, Estimate

SEGMENT = {kind: number for number, kind in enumerate(KINDS, start=1)}
"""Number of a segment in Fig. 14; which of 1 and 6 is the head is not said."""

LEGS = KINDS[1:5]
"""Segments 2 to 5: what is not along x."""


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


def central(stresses: xr.Dataset, kind: str) -> np.ndarray:
    """Return the segments (k,) of a kind that end in the centre cell: those that count as equivalent."""
    return np.flatnonzero(
        (stresses["segment_kind"].to_numpy() == KINDS.index(kind))
        & (stresses["segment_central"].to_numpy() == 1)
    )


def stress_angles(
    stresses: xr.Dataset, kind: str, extent: str = "whole", undeformed: bool = False
) -> np.ndarray:
    """Return the angles (k, 3) of the maximum principal stress in the equivalent segments of a kind [deg].

    Parameters
    ----------
    stresses : Dataset
        In the format of docs/architecture.md.
    kind : str
        Of `crossings.segments.KINDS`.
    extent : str
        "whole", or "middle" for the middle halves of the pieces.
    undeformed : bool
        Whether axes are turned back with the segments.
    """
    here = central(stresses, kind)
    axis = stresses["segment_axis"].sel(extent=extent).to_numpy()[here, 0]
    if undeformed:
        axis = np.einsum("kji,kj->ki", stresses["segment_rotation"].to_numpy()[here], axis)
    return angles_to_axes(axis)


def angle_to_x(stresses: Iterable[xr.Dataset], kind: str) -> Estimate:
    """Return the angle to x of the maximum principal stress in a kind of segment [deg].

    Parameters
    ----------
    stresses : iterable of Dataset
        Of one problem by several discretisations, the one that decides first. The uncertainty is the larger of half the
        range over equivalent segments and of the difference to the other discretisations.
    """
    means = [angles[:, 0].mean() for each in stresses if len(angles := stress_angles(each, kind))]
    if not means:
        return UNKNOWN
    first = stress_angles(next(iter(stresses)), kind)[:, 0]
    off = [0.5 * np.ptp(first), *np.abs(np.subtract(means[1:], means[0]))]
    return Estimate(float(means[0]), float(max(off)))


def _by_place(contacts: xr.Dataset) -> np.ndarray:
    """Return the centroids by row, column and zone (rows, columns, 4, 3), moved into the plane z = 0."""
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    centroid = np.full((row.max() + 1, column.max() + 1, 4, 3), np.nan)
    centroid[row, column, zone] = contacts["centroid"].to_numpy() * [1.0, 1.0, 0.0]
    return centroid
