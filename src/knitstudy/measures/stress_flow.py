"""Where the maximum principal stress runs along the yarns, and how far contacts turn it away from them.

The flow of stress has two meanings. Of *sections*: the mean stress of slices of a yarn, one radius long, in which
bending cancels. Of *points*: the stress of every cell, which counts by its tension; bending puts that on one side of
the yarn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree

from knitstudy.knit.contacts.segments import NO_SEGMENT
from knitstudy.measures.response import deformed_centrelines
from knitstudy.mechanics.contact.solid import principal_axes
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.materials import FULL

LENGTH = 1.0  # of a slice, over the radius of the yarn
# Distances along the yarn from a crossing, over the radius: at a contact, and away from all
NEAR = 1.0
FAR = 2.0
SECTIONS, POINTS = "means of sections", "points by their tension"  # Meanings of the flow of stress


@dataclass(frozen=True, eq=False)
class Flow:
    """The maximum principal stress at places (k,) of the segments between contact zones (Fig. 14), at full load."""

    angle: Floats  # to the deformed centreline, 0 to 90 [deg]
    weight: Floats  # by which a place counts
    at_contact: Bools  # whether a free crossing that touches is near
    away: Bools  # whether all crossings are far

    def mean_angle(self, here: Bools) -> float:
        """Return the mean angle at some of the places [deg]; nan where there is none."""
        weight = self.weight[here]
        return float(weight @ self.angle[here] / weight.sum()) if weight.sum() > 0 else np.nan

    def share_within(self, angle: float) -> float:
        """Return the share of the places that lie within an angle [deg] of the yarn."""
        return float(self.weight @ (self.angle <= angle) / self.weight.sum())


def flows_of(
    stresses: xr.Dataset, history: xr.Dataset, contacts: xr.Dataset, radius: float
) -> dict[str, Flow]:
    """Return the flow by its meaning (`SECTIONS`, `POINTS`) from one simulation of yarns of a radius [m]."""
    number, yarn, middle, tangent = _cut(history, LENGTH * radius)
    count = len(yarn)
    touching = (contacts["tied"].to_numpy() == 0) & (contacts["zones"].to_numpy()[-1] > 0)
    at_contact = _distance(contacts, touching, yarn, middle) <= NEAR * radius
    away = _distance(contacts, np.ones_like(touching), yarn, middle) > FAR * radius
    cell = _slice_of_cells(stresses, history, number)
    inside = _in_segments(stresses, yarn, middle)[cell]
    cell = cell[inside]
    volume = stresses["cell_volume"].to_numpy()[inside]
    stress = stresses["cell_stress"].to_numpy()[inside]
    here = np.flatnonzero(np.bincount(cell, volume, count))
    # The axes of a sum are those of the mean.
    total = [np.bincount(cell, volume * component, count)[here] for component in stress.T]

    def flow(components: Floats, of: Ints, weight: Floats | None) -> Flow:
        value, axis = principal_axes(components[:, FULL])
        cosine = np.abs(np.einsum("ki,ki->k", axis[:, 0], tangent[of]))
        angle = np.degrees(np.arccos(np.clip(cosine, 0, 1)))
        counts = np.ones(len(of)) if weight is None else weight * np.maximum(value[:, 0], 0)
        return Flow(angle, counts, at_contact[of], away[of])

    return {SECTIONS: flow(np.stack(total, axis=1), here, None), POINTS: flow(stress, cell, volume)}


def _cut(history: xr.Dataset, length: float) -> tuple[Ints, Ints, Floats, Floats]:
    """Cut yarns into slices of about a length [m].

    Returns the slice (S,) of every station, and the yarn (k,), the arc length of the middle (k,) [m] and the deformed
    direction (k, 3) of every slice.
    """
    s, yarn = history["arc_length"].to_numpy(), history["yarn"].to_numpy()
    now = deformed_centrelines(history)
    number = np.empty(len(s), dtype=int)
    yarns, middles, tangents = [], [], []
    first = 0
    for each in np.unique(yarn):
        own = yarn == each
        count = max(round(s[own].max() / length), 1)
        bounds = np.linspace(0.0, s[own].max(), count + 1)
        number[own] = first + np.clip(np.searchsorted(bounds, s[own], side="right") - 1, 0, count - 1)
        ends = np.stack([np.interp(bounds, s[own], now[own, axis]) for axis in range(3)], axis=1)
        chord = np.diff(ends, axis=0)
        yarns.append(np.full(count, each))
        middles.append(0.5 * (bounds[:-1] + bounds[1:]))
        tangents.append(chord / np.linalg.norm(chord, axis=1, keepdims=True))
        first += count
    return number, np.concatenate(yarns), np.concatenate(middles), np.concatenate(tangents)


def _slice_of_cells(stresses: xr.Dataset, history: xr.Dataset, number: Ints) -> Ints:
    """Return the slice (C,) of every cell: that of the nearest station of its own yarn, from those of stations (S,)."""
    place, owner = stresses["cell_place"].to_numpy(), stresses["cell_yarn"].to_numpy()
    station, yarn = deformed_centrelines(history), history["yarn"].to_numpy()
    cell = np.empty(len(place), dtype=int)
    for each in np.unique(owner):
        own = np.flatnonzero(yarn == each)
        here = owner == each
        cell[here] = number[own[cKDTree(station[own]).query(place[here])[1]]]
    return cell


def _in_segments(stresses: xr.Dataset, yarn: Ints, middle: Floats) -> Bools:
    """Return whether slices (k,) lie in a piece of yarn that belongs to a segment."""
    inside = stresses["piece_segment"].to_numpy() != NO_SEGMENT
    owner = stresses["piece_yarn"].to_numpy()[inside]
    begin, end = stresses["piece_arc_length"].to_numpy()[inside].T
    of_piece = (yarn[:, None] == owner) & (middle[:, None] >= begin) & (middle[:, None] < end)
    return np.asarray(of_piece.any(axis=1))


def _distance(contacts: xr.Dataset, chosen: Bools, yarn: Ints, middle: Floats) -> Floats:
    """Return how far along their yarns slices (k,) are from the nearest of the chosen crossings [m]."""
    owner = contacts["yarn"].to_numpy()[chosen].ravel()
    place = contacts["arc_length"].to_numpy()[chosen].ravel()
    apart = np.abs(middle[:, None] - place)
    return np.where(yarn[:, None] == owner, apart, np.inf).min(axis=1, initial=np.inf)
