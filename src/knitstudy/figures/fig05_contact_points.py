"""Fig. 5: from the two contacts on one side of an interlock to the points C1 to C4 of the 3D reduced model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.errors import DataFileError
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.picture import bounds, label, scale_bar, show, triad
from knitstudy.figures.renderer import MILLIMETRE, Surface, View
from knitstudy.figures.shapes import arrow, plate, rod, tube
from knitstudy.figures.style import ACCENT, INK, PAPER, SINGLE, YARNS, figure
from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.catalogue import solid
from knitstudy.models.joints import contact_normal_planes, joint_points

VIEW = View.orbit(turn=-12, tilt=-36)
"""From below: here the two planes and the two normals part most in the picture."""

WIDTH = 1.2 * SINGLE
SILL = 0.4  # room below the yarns for the scale bar [mm]
REACH = 2.0  # how much of the yarns is shown beyond the contacts, in radii
ARROW = 2.6  # length of a drawn normal, in radii
PLANES = ("#E69F00", "#6B6B80")  # colours of the contact normal planes of P1 and P2
RIM = 0.4  # margin of the drawn part of a plane, in radii

PLACES = {
    "C_1": (-34, 8),
    "C_2": (-30, 26),
    "C_3": (34, 6),
    "C_4": (24, 22),
    "P_1": (-34, -14),
    "P_2": (-16, 34),
    "n_1": (11, 7),
    "n_2": (-3, -13),
}
"""Offsets of the names from the points [points]."""

LEFT_ZONES = (0, 2)  # lower and upper contact on the left of an interlock, where P1 and P2 of Fig. 5 lie


@FIGURES.add(
    "fig05_contact_points",
    "Fig. 5: points of the 3D reduced model",
    results={
        "geometry": solid("geometry", "tie-course"),
        "contacts": solid("contacts", "tie-course"),
    },
)
def draw(geometry: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the left side of the middle interlock, with translucent yarns."""
    knit = Fabric.from_dataset(geometry)
    side, radius = InterlockSide.in_the_middle(knit, contacts), knit.radius
    surfaces = _yarns(knit, side) + _marks(side, radius)
    left, right, bottom, top = bounds(surfaces, VIEW)
    window = (left, right, bottom - SILL, top)
    drawing = figure(WIDTH, WIDTH * (window[3] - window[2]) / (window[1] - window[0]))
    axes = drawing.add_axes((0, 0, 1, 1))
    show(axes, surfaces, VIEW, window)
    _names(axes, side, radius)
    scale_bar(axes, 1)
    triad(axes, VIEW, 0.7, (0.8, 0.06))
    return drawing


def _yarns(knit: Fabric, side: InterlockSide) -> list[Surface]:
    """The two yarns as translucent tubes, with their centrelines."""
    radius = knit.radius
    surfaces = []
    for yarn, s, colour in zip(side.yarn, side.arc_length.T, side.colours, strict=True):
        span = (s.min() - REACH * radius, s.max() + REACH * radius)
        surfaces.append(piece(knit, yarn, *span, radius, colour, 0.22))
        surfaces.append(piece(knit, yarn, *span, 0.06 * radius, colour))
    return surfaces


def _marks(side: InterlockSide, radius: float) -> list[Surface]:
    """The line P1 P2, the contact normals, and the planes that they span."""
    marks = [rod(*side.P, 0.05 * radius, ACCENT)]
    for contact in range(2):
        corners, colour = corners_of_plane(side, contact, radius), PLANES[contact]
        marks.append(plate(corners, colour, 0.25))
        outline = zip(corners, np.roll(corners, -1, axis=0), strict=True)
        marks += [rod(start, end, 0.02 * radius, colour) for start, end in outline]
        marks.append(arrow(side.P[contact], ARROW * radius * side.normal[contact], 0.06 * radius, ACCENT))
    return marks


def corners_of_plane(side: InterlockSide, contact: int, radius: float) -> np.ndarray:
    """Return the corners of the drawn part of a contact normal plane.

    Parameters
    ----------
    side : InterlockSide
    contact : int
        0 for the plane of P1, 1 for that of P2.
    radius : float
        Of the yarns [m].

    Returns
    -------
    ndarray, shape (4, 3)
        Of a rectangle along P1 P2 that reaches ``RIM`` radii beyond both P, the arrow and the points C [m].
    """
    origin, line = side.P[0], side.P[1] - side.P[0]
    along = line / np.linalg.norm(line)
    across = np.cross(side.plane[contact], along)
    tip = side.P[contact] + ARROW * radius * side.normal[contact]
    held = np.stack([*side.P, *side.C[contact], tip]) - origin
    (low, left), (high, right) = (
        end(held @ np.column_stack([along, across]), axis=0) for end in (np.min, np.max)
    )
    rim = RIM * radius
    ahead, aside = (low - rim, high + rim), (left - rim, right + rim)
    return origin + np.stack(
        [ahead[i] * along + aside[j] * across for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    )


def _names(axes: Axes, side: InterlockSide, radius: float) -> None:
    """Dots and names over the picture, so that no yarn dims them."""
    points = {f"C_{i + 1}": side.C[i % 2, i // 2] for i in range(4)}
    points |= {f"P_{i + 1}": side.P[i] for i in range(2)}
    for name, point in points.items():
        colour = ACCENT if name.startswith("P") else INK
        axes.scatter(*MILLIMETRE * VIEW.project(point), s=28, color=colour, edgecolor=PAPER, zorder=8)
        label(axes, VIEW, point, f"${name}$", PLACES[name], colour)
    for i, tip in enumerate(side.P + ARROW * radius * side.normal, start=1):
        label(axes, VIEW, tip, rf"$\mathbf{{n}}_{i}$", PLACES[f"n_{i}"], ACCENT)


# ---- the side of an interlock that Figs. 5 and 6 look at ----


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
        """Colours of the two yarns, the same as in pictures of the whole knit."""
        lower, upper = (YARNS[yarn % len(YARNS)] for yarn in self.yarn)
        return lower, upper


def piece(
    knit: Fabric, yarn: int, start: float, end: float, radius: float, colour: str, opacity: float = 1.0
) -> Surface:
    """Return the tube about a piece of a yarn's centreline between two arc lengths [m], cut at its ends."""
    centreline = knit.centrelines[yarn]
    s = np.linspace(max(start, 0.0), min(end, centreline.length), 160)
    return tube(centreline.position(s), radius, colour, opacity)
