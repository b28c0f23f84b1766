"""The side of an interlock that Figs. 5 and 6 look at: its lower and its upper contact, in the middle of the knit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.figures.shapes import tube
from knitstudy.figures.style import YARNS
from knitstudy.figures.surface import Surface
from knitstudy.geometry.fabric import Fabric
from knitstudy.models.joints import contact_normal_planes, joint_points

LEFT_ZONES = (0, 2)
"""Lower and upper contact on the left of an interlock, where P1 and P2 of Fig. 5 lie."""


@dataclass(frozen=True)
class InterlockSide:
    """The two contacts on one side of an interlock, where the same two yarns touch twice.

    Contact 0 is the lower one (P1), contact 1 the upper one (P2); yarn 0 is the lower row's, yarn 1 the upper's.

    Attributes
    ----------
    yarn : ndarray of int, shape (2,)
        Numbers of the two yarns.
    P : ndarray, shape (2, 3)
        Centroids of the contacts [m].
    C : ndarray, shape (2, 2, 3)
        Points on the centrelines by contact and yarn [m]: C1 is [0, 0], C3 [0, 1], C2 [1, 0], C4 [1, 1].
    arc_length : ndarray, shape (2, 2)
        Of the points C on their centrelines [m].
    normal : ndarray, shape (2, 3)
        Contact normals, from yarn 0 to yarn 1.
    plane : ndarray, shape (2, 3)
        Unit normals of the contact normal planes, one for each contact.
    """

    yarn: np.ndarray
    P: np.ndarray
    C: np.ndarray
    arc_length: np.ndarray
    normal: np.ndarray
    plane: np.ndarray

    @classmethod
    def in_the_middle(cls, knit: Fabric, contacts: xr.Dataset) -> InterlockSide:
        """Return the left side of the middle interlock.

        Raises
        ------
        DataFileError
            When the contacts do not hold it.
        """
        row, column = knit.cells[1] // 2, knit.cells[0] // 2
        here = (contacts["row"] == row) & (contacts["column"] == column)
        found = [np.flatnonzero(here & (contacts["zone"] == zone)) for zone in LEFT_ZONES]
        if any(len(place) != 1 for place in found):
            raise DataFileError(
                f"contacts: row {row}, column {column} must have the zones {LEFT_ZONES}, once each"
            )
        pair = np.concatenate(found)
        points = joint_points(knit, contacts)
        return cls(
            yarn=points.yarn[pair[0]],
            P=points.centroid[pair],
            C=points.point[pair],
            arc_length=points.arc_length[pair],
            normal=contacts["normal"].to_numpy()[pair],
            plane=contact_normal_planes(contacts)[pair],
        )

    @property
    def colours(self) -> tuple[str, str]:
        """Colours of the two yarns, which are those that they have in pictures of the whole knit."""
        lower, upper = (YARNS[yarn % len(YARNS)] for yarn in self.yarn)
        return lower, upper


def piece(
    knit: Fabric, yarn: int, start: float, end: float, radius: float, colour: str, opacity: float = 1.0
) -> Surface:
    """Return the tube about a piece of a yarn's centreline between two arc lengths [m], cut at its ends."""
    centreline = knit.centrelines[yarn]
    s = np.linspace(max(start, 0.0), min(end, centreline.length), 160)
    return tube(centreline.position(s), radius, colour, opacity)
