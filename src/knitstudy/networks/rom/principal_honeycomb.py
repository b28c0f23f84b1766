"""The planar honeycomb whose segments lie along the maximum principal stress (section 3.4, Fig. 14, Table 4).

The paper sets "the same distance between contact zones along the x-axis and y-axis" and positions the segments by
angles. A honeycomb repeats from row to row, so an interlock leads as far along x as a leg leads back: with the
distances along x kept, any two angles of interlock and leg close it, and the heights follow,

    h = |dx| tan(angle to x),

while with lengths kept it would not close. Heads and sinkers lie along x: they join zones of one height, left and right
mirror each other, and an axis of a stress that is its own mirror image lies along x or y.

Directions are those of the deformed knit, as the paper prints them, averaged over the segments that end in the centre
cell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.crossings.segments import KINDS
from knitstudy.errors import GeometryError
from knitstudy.geometry.pattern import Knit

INTERLOCKS, LEGS = ("interlock, left", "interlock, right"), ("leg, left", "leg, right")

UPRIGHT = 89.5
"""Angle to x beyond which a segment is too steep to give a height [deg]: there a tenth of a degree is a fifth of it."""


@dataclass(frozen=True)
class Heights:
    """Of the rows of a honeycomb.

    Attributes
    ----------
    interlock, leg : float
        From the lower to the upper zones of an interlock, and on to the lower zones of the next row [m].
    """

    interlock: float
    leg: float

    @property
    def course(self) -> float:
        """Distance of two rows [m]."""
        return self.interlock + self.leg


def plane_angles(stresses: xr.Dataset, kinds: tuple[str, ...], extent: str = "whole") -> np.ndarray:
    """Return the angles (k,) to x, in the plane and from 0 to 90, of the maximum principal stress [deg].

    Parameters
    ----------
    stresses : Dataset
        In the format of docs/architecture.md.
    kinds : tuple of str
        Of `crossings.segments.KINDS`; segments that end in the centre cell are taken.
    extent : str
        What is averaged over, "whole" or "middle".
    """
    wanted = [KINDS.index(kind) for kind in kinds]
    here = np.isin(stresses["segment_kind"], wanted) & (stresses["segment_central"].to_numpy() == 1)
    axis = stresses["segment_axis"].sel(extent=extent).to_numpy()[here, 0]
    return np.degrees(np.arctan2(*np.abs(axis[:, [1, 0]]).T))


def heights(knit: Knit, contacts: xr.Dataset, interlock: float, leg: float) -> Heights:
    """Return the heights of a honeycomb with the contacts' distances along x, from the angles of its segments [deg]."""
    x = zone_places(knit, contacts)[:, 0]
    step = 0.5 * (abs(x[2] - x[0]) + abs(x[3] - x[1]))
    return Heights(*(float(step * np.tan(np.radians(angle))) for angle in (interlock, leg)))


def heights_by_stress(knit: Knit, contacts: xr.Dataset, stresses: xr.Dataset) -> Heights:
    """Return the heights of the honeycomb along the maximum principal stress.

    Raises
    ------
    GeometryError
        If the knit has no legs, or a direction gives no height.
    """
    angles = []
    for name, kinds in (("interlocks", INTERLOCKS), ("legs", LEGS)):
        found = plane_angles(stresses, kinds)
        if found.size == 0:
            raise GeometryError(
                f"the centre cell has no {name} with stresses: a honeycomb by principal stress needs a knit of two "
                "rows or more"
            )
        angle = float(found.mean())
        if not 90 - UPRIGHT < angle < UPRIGHT:
            raise GeometryError(
                f"the maximum principal stress in {name} of the centre cell is at {angle:.2f} degrees to x: only "
                f"angles from {90 - UPRIGHT:g} to {UPRIGHT:g} make a honeycomb; use rom.honeycomb geometry"
            )
        angles.append(angle)
    return heights(knit, contacts, *angles)


def zone_places(knit: Knit, contacts: xr.Dataset) -> np.ndarray:
    """Return the mean places (4, 2) of the zones in their cells, from the left edge of the cell and row 0 on [m]."""
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    steps = np.column_stack([column * knit.loop.wale_spacing, row * knit.loop.course_spacing])
    within = contacts["centroid"].to_numpy()[:, :2] - steps
    return np.stack([within[zone == each].mean(axis=0) for each in range(4)])


def moved(knit: Knit, contacts: xr.Dataset, found: Heights) -> xr.Dataset:
    """Return contacts whose centroids are the joints of a honeycomb of some heights; x is each zone's mean."""
    row, column, zone = (contacts[name].to_numpy().astype(int) for name in ("row", "column", "zone"))
    place = zone_places(knit, contacts)
    centroid = contacts["centroid"].to_numpy().copy()
    centroid[:, 0] = column * knit.loop.wale_spacing + place[zone, 0]
    centroid[:, 1] = place[:2, 1].mean() + row * found.course + np.where(zone >= 2, found.interlock, 0.0)
    return contacts.assign(centroid=(contacts["centroid"].dims, centroid, contacts["centroid"].attrs))
