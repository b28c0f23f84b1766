"""Segments of yarn between crossings: their directions, their mean stresses, and the force that these carry."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from knitstudy.contacts.segments import KINDS
from knitstudy.loading.history import DIRECTIONS
from knitstudy.measures.estimate import UNKNOWN, Estimate

# Number of a segment in Fig. 14; the paper does not say which of 1 and 6 is the head.
SEGMENT = {kind: number for number, kind in enumerate(KINDS, start=1)}
LEGS = KINDS[1:5]  # Segments 2 to 5, which are not along x

# Width of the slab over which the force through a cut is averaged, over the length of the knit: about a cell.
SLAB = 0.4


def honeycomb_segments(contacts: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the segments between contact zones by kind, vectors (k, 3) in the plane of the fabric [m].

    A knit of one row has no legs, one of one column no sinkers: such kinds are left out.
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


def _by_place(contacts: xr.Dataset) -> np.ndarray:
    """Return the centroids by row, column and zone (rows, columns, 4, 3), moved into the plane z = 0."""
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    centroid = np.full((row.max() + 1, column.max() + 1, 4, 3), np.nan)
    centroid[row, column, zone] = contacts["centroid"].to_numpy() * [1.0, 1.0, 0.0]
    return centroid


def angles_to_axes(vectors: np.ndarray) -> np.ndarray:
    """Return the angles (k, 3) of lines along vectors (k, 3) to x, y and z, from 0 to 90 [deg]."""
    cosine = np.abs(vectors) / np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.degrees(np.arccos(np.clip(cosine, 0, 1)))


# Stresses are Datasets of the stage `stress` (docs/files.md).


def central(stresses: xr.Dataset, kind: str) -> np.ndarray:
    """Return the segments (k,) of a kind that end in the centre cell: equivalent ones."""
    return np.flatnonzero(
        (stresses["segment_kind"].to_numpy() == KINDS.index(kind))
        & (stresses["segment_central"].to_numpy() == 1)
    )


def stress_angles(
    stresses: xr.Dataset, kind: str, extent: str = "whole", undeformed: bool = False
) -> np.ndarray:
    """Return the angles (k, 3) of the maximum principal stress in the equivalent segments of a kind [deg].

    `extent` is "whole" for pieces of yarn, "middle" for their middle halves; `undeformed` turns axes back with the
    segments.
    """
    here = central(stresses, kind)
    axis = stresses["segment_axis"].sel(extent=extent).to_numpy()[here, 0]
    if undeformed:
        axis = np.einsum("kji,kj->ki", stresses["segment_rotation"].to_numpy()[here], axis)
    return angles_to_axes(axis)


def angle_to_x(stresses: Sequence[xr.Dataset], kind: str) -> Estimate:
    """Return the angle to x of the maximum principal stress in a kind of segment [deg].

    The value is of the first of several discretisations. The uncertainty is half the range over equivalent segments,
    or the largest difference to the other discretisations where that is larger.
    """
    means = [angles[:, 0].mean() for each in stresses if len(angles := stress_angles(each, kind))]
    if not means:
        return UNKNOWN
    first = stress_angles(stresses[0], kind)[:, 0]
    off = [0.5 * np.ptp(first), *np.abs(np.subtract(means[1:], means[0]))]
    return Estimate(float(means[0]), float(max(off)))


# Equilibrium holds in the mean for every function phi(x) that is constant at both grips; with psi = phi',
#     integral of sigma_xx psi dv = F * integral of psi dx.
# Stresses averaged over a slab with the weight psi give the force F through the knit. Contact adds nothing where both
# of its sides lie at one place.


def cut_force(stresses: xr.Dataset, share: float) -> float:
    """Return the force through a cut across the load, at a share of the deformed length of the knit [N].

    The weight is psi = 1 + cos over a slab (`SLAB`), which should lie between the grips. It is smooth, since elements
    are in equilibrium in their mean only.
    """
    axis = DIRECTIONS.index(stresses.attrs["direction"])
    place = stresses["cell_place"].to_numpy()[:, axis]
    length = np.ptp(place)
    away = (place - place.min() - share * length) / (SLAB * length)
    weight = np.where(np.abs(away) < 0.5, 1 + np.cos(2 * np.pi * away), 0.0)
    stress = stresses["cell_stress"].to_numpy()[:, axis]  # xx, yy, zz come first
    return float(np.sum(stress * stresses["cell_volume"].to_numpy() * weight) / (SLAB * length))
