"""The pair of contacts that Figs. 5 and 6 look at: left and right, in the middle of the knit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.figures.surface import Surface, tube
from knitstudy.geometry.pattern import Knit
from knitstudy.rom.points import contact_normal_planes, contact_points

UPPER_ZONES = (2, 3)
"""Where the upper yarn's legs lie over the lower yarn's head: the pair that Fig. 5 shows."""


@dataclass(frozen=True)
class Interlock:
    """The two contacts of one level of an interlock; side 0 is the lower row's yarn, side 1 the upper's.

    Attributes
    ----------
    yarn : ndarray of int, shape (2,)
        By side.
    P : ndarray, shape (2, 3)
        Centroids of the contacts, left and right [m].
    C : ndarray, shape (2, 2, 3)
        Points on the centrelines by contact and side [m]: C1 is [0, 0], C3 [0, 1], C2 [1, 0], C4 [1, 1].
    arc_length : ndarray, shape (2, 2)
        Of the points C on their centrelines [m].
    normal : ndarray, shape (2, 3)
        Contact normals, from side 0 to side 1.
    plane : ndarray, shape (3,)
        Unit normal of the contact normal plane.
    """

    yarn: np.ndarray
    P: np.ndarray
    C: np.ndarray
    arc_length: np.ndarray
    normal: np.ndarray
    plane: np.ndarray

    @classmethod
    def in_the_middle(cls, knit: Knit, contacts: xr.Dataset) -> Interlock:
        """Return the upper contacts of the middle interlock.

        Raises
        ------
        DataFileError
            When the contacts do not hold them.
        """
        row, column = knit.rows // 2, knit.loops // 2
        here = (contacts["row"] == row) & (contacts["column"] == column)
        found = [np.flatnonzero(here & (contacts["zone"] == zone)) for zone in UPPER_ZONES]
        if any(len(place) != 1 for place in found):
            raise DataFileError(
                f"contacts: row {row}, column {column} must have the zones {UPPER_ZONES}, once each"
            )
        pair = np.concatenate(found)
        points = contact_points(knit, contacts)
        return cls(
            yarn=points.yarn[pair[0]],
            P=points.centroid[pair],
            C=points.point[pair],
            arc_length=points.arc_length[pair],
            normal=contacts["normal"].to_numpy()[pair],
            plane=contact_normal_planes(contacts)[pair[0]],
        )


def piece(
    knit: Knit, yarn: int, start: float, end: float, radius: float, colour: str, opacity: float = 1.0
) -> Surface:
    """Return the tube about a piece of a yarn's centreline between two arc lengths [m], cut at its ends."""
    centreline = knit.centrelines[yarn]
    s = np.linspace(max(start, 0.0), min(end, centreline.length), 160)
    return tube(centreline.position(s), radius, colour, opacity)
