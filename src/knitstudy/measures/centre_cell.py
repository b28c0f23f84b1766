"""The unit cell, the crossings of the cell in the middle of a knit, and the segments of yarn between crossings.

Fig. 7 shows the contact zones of that cell, Fig. 10 the kinematics of its crossings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.knit.contacts.segments import BETWEEN, KINDS, centre
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.loop import Loop
from knitstudy.measures.estimate import UNKNOWN, Estimate

SNAPSHOTS = (0.0005, 0.0033, 0.0045, 0.0195)  # Strains of the points 1 to 4 of Fig. 7
SAME_STRAIN = 0.01  # Relative difference up to which an increment is at the strain of a point
MIRRORED = (1, 0, 3, 2)  # Zone that a zone becomes when left and right are exchanged


def loop_of(geometry: xr.Dataset, state: str) -> Loop:
    """Return the loop "before" or "after" the optimisation."""
    loop = fabric_of(geometry).loop
    assert loop is not None, "a knit has a loop"
    if state == "before":
        return replace(loop, control_points=geometry["control_points_before"].to_numpy())
    return loop


def crossing_error(geometry: xr.Dataset) -> xr.DataArray:
    """Return the largest |D - 2R - c0| of a crossing by state [m]."""
    wanted = float((2 + geometry["clearance"]) * geometry["radius"])
    return abs(geometry["crossing_distance"] - wanted).max("cell_zone")


@dataclass(frozen=True)
class Snapshot:
    """The increment nearest to a point of Fig. 7: number from 1, strain of the paper and of the increment."""

    number: int
    wanted: float
    strain: float
    increment: int

    @property
    def exact(self) -> bool:
        """Whether the increment is at the paper's strain."""
        return abs(self.strain - self.wanted) <= SAME_STRAIN * self.wanted

    @property
    def label(self) -> str:
        """Number and strain of the increment, and the paper's strain where it differs."""
        text = f"{self.number}: {100 * self.strain:.3g} %"
        return text if self.exact else f"{text} (paper {100 * self.wanted:.3g} %)"


def snapshots(dataset: xr.Dataset) -> list[Snapshot]:
    """Return the points of Fig. 7 that a history or its contacts reach."""
    strain = dataset["strain"].to_numpy()
    reached = [wanted for wanted in SNAPSHOTS if wanted <= strain[-1] * (1 + SAME_STRAIN)]
    nearest = [int(np.argmin(np.abs(strain - wanted))) for wanted in reached]
    return [
        Snapshot(number, wanted, float(strain[increment]), increment)
        for number, (wanted, increment) in enumerate(zip(reached, nearest, strict=True), start=1)
    ]


def centre_cell(contacts: xr.Dataset) -> np.ndarray:
    """Return the crossings (4,) of the centre interlock row and column, by zone.

    Raises DataFileError when its four zones are not there once each.
    """
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    here = np.flatnonzero((row == centre(row)) & (column == centre(column)))
    here = here[np.argsort(zone[here])]
    if zone[here].tolist() != [0, 1, 2, 3]:
        raise DataFileError(
            f"contacts: the centre cell has the zones {zone[here].tolist()}; they must be 0 to 3, once each"
        )
    return here


def zones_of_cell(contacts: xr.Dataset) -> np.ndarray:
    """Return the number of contact zones in the centre cell at every increment (I,)."""
    return contacts["zones"].to_numpy()[:, centre_cell(contacts)].sum(axis=1)


def area_of_cell(contacts: xr.Dataset) -> np.ndarray:
    """Return the contact area in the centre cell at every increment (I,) [m2]."""
    return contacts["contact_area"].to_numpy()[:, centre_cell(contacts)].sum(axis=1)


def pressed_area_of_cell(history: xr.Dataset, contacts: xr.Dataset) -> np.ndarray:
    """Return the area under pressure in the centre cell at every increment (I,) [m2], the mean of both sides.

    It is counted from the points of contact, also where `area_of_cell` follows from the force by Hertz's formula.
    """
    pressed = (history["contact_pressure"].to_numpy() > 0) & np.isin(
        history["contact_crossing"].to_numpy(), centre_cell(contacts)
    )
    increment, area = (history[f"contact_{name}"].to_numpy()[pressed] for name in ("increment", "area"))
    return 0.5 * np.bincount(increment.astype(int), area, history.sizes["increment"])


def first_symmetric_contact(contacts: xr.Dataset) -> int | None:
    """Return the first increment at which the same zones touch on the left and on the right, if there is one."""
    touching = contacts["zones"].to_numpy()[:, centre_cell(contacts)] > 0
    symmetric = touching.any(axis=1) & (touching == touching[:, MIRRORED]).all(axis=1)
    return int(np.argmax(symmetric)) if symmetric.any() else None


def rotation_angle(contacts: xr.Dataset) -> np.ndarray:
    """Return the angles (I, K, 2) by which sections have turned [rad]."""
    return np.linalg.norm(contacts["section_rotation"].to_numpy(), axis=-1)


def closest_neighbour(contacts: xr.Dataset) -> np.ndarray:
    """Return the contraction (I, K, 2) of the chord to the neighbour on the yarn that comes closer at the end.

    Chords across the arcs of loops lie along the courses and lengthen in course tension.
    """
    contraction = contacts["segment_contraction"].to_numpy()
    most = np.argmax(np.nan_to_num(contraction[-1], nan=-np.inf), axis=-1)
    return np.take_along_axis(contraction, most[None, ..., None], axis=-1)[..., 0]


# Number of a segment in Fig. 14; the paper does not say which of 1 and 6 is the head.
SEGMENT = {kind: number for number, kind in enumerate(KINDS, start=1)}
LEGS = KINDS[1:5]  # Segments 2 to 5, which are not along x


def honeycomb_segments(contacts: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the segments between contact zones by kind, vectors (k, 3) in the plane of the fabric [m].

    A knit of one row has no legs, one of one column no sinkers: such kinds are left out.
    """
    zone = _by_place(contacts)
    rows, columns = zone.shape[:2]
    segments = {
        KINDS[kind]: zone[up:, right:, end] - zone[: rows - up, : columns - right, start]
        for (start, end, up, right), (kind, _) in BETWEEN.items()
    }
    return {kind: points.reshape(-1, 3) for kind, points in segments.items() if points.size}


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
    means = [angles[:, 0].mean() for stress in stresses if len(angles := stress_angles(stress, kind))]
    if not means:
        return UNKNOWN
    first = stress_angles(stresses[0], kind)[:, 0]
    off = [0.5 * np.ptp(first), *np.abs(np.subtract(means[1:], means[0]))]
    return Estimate(float(means[0]), float(max(off)))
