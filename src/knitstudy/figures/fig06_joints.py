"""Fig. 6: the three-dimensional reduced model, and one of its joints with the directions of its forces."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.fig05_contact_points import InterlockSide, piece
from knitstudy.figures.picture import bounds, label, scale_bar, show, triad, write
from knitstudy.figures.renderer import MILLIMETRE, Surface, View
from knitstudy.figures.shapes import arrow, rod, sphere, tube
from knitstudy.figures.style import ACCENT, DOUBLE, INK, PAPER, YARNS, figure, panel_letter
from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.catalogue import network, solid
from knitstudy.models.joints import joint_points

WHOLE, DETAIL = View.orbit(turn=-18, tilt=16), View.orbit(turn=34, tilt=-37)
SHARE = 0.55  # of the figure's width for the whole knit
BEAM, ARM = 0.26, 0.16  # radii in which beams and joints are drawn, over the yarn's
REACH = 3.2  # how much of the yarns the detail shows on either side of the joint, in radii
AXIS = 2.0  # length of the directions in the detail, in radii

PLACES = {"C_1": (-32, -10), "C_3": (34, 8), "P_1": (0, -30)}
"""Offsets of the names of the detail from the points [points]."""


@FIGURES.add(
    "fig06_joints",
    "Fig. 6: 3D reduced model and its joints",
    results={
        "geometry": solid("geometry", "tie-course"),
        "contacts": solid("contacts", "tie-course"),
        "rom3d": network("rom3d", "tie-course"),
    },
)
def draw(geometry: xr.Dataset, contacts: xr.Dataset, rom3d: xr.Dataset) -> Figure:
    """Draw the beams of the model between their nodes, and the arms that join them."""
    knit = Fabric.from_dataset(geometry)
    whole = _beams(rom3d, knit.radius) + _joints(knit, contacts)
    window = bounds(whole, WHOLE)
    height = SHARE * DOUBLE * (window[3] - window[2] + 3) / (window[1] - window[0]) / 0.93
    drawing = figure(DOUBLE, height)
    left = drawing.add_axes((0.01, 0.0, SHARE, 0.93))
    show(left, whole, WHOLE, (*window[:2], window[2] - 3, window[3]))
    scale_bar(left, 5, (0.03, 0.02))
    triad(left, WHOLE, 2.5, (0.9, 0.04))
    panel_letter(left, "a", "beams and joints")
    _draw_joint(drawing.add_axes((SHARE + 0.03, 0.10, 0.96 - SHARE, 0.72)), knit, contacts, rom3d)
    return drawing


def _beams(rom3d: xr.Dataset, radius: float) -> list[Surface]:
    """Return every yarn's chain of straight beams."""
    yarn, position = rom3d["yarn"].to_numpy(), rom3d["centreline"].to_numpy()
    return [tube(position[yarn == i], BEAM * radius, YARNS[i % len(YARNS)]) for i in np.unique(yarn)]


def _joints(knit: Fabric, contacts: xr.Dataset) -> list[Surface]:
    """Return the arms from the points C to P, and the points C, of all contacts."""
    points, radius = joint_points(knit, contacts), knit.radius
    arms = [
        rod(end, centroid, ARM * radius, ACCENT)
        for pair, centroid in zip(points.point, points.centroid, strict=True)
        for end in pair
    ]
    return arms + [sphere(point, 1.35 * BEAM * radius, ACCENT) for point in points.point.reshape(-1, 3)]


def _draw_joint(axes: Axes, knit: Fabric, contacts: xr.Dataset, rom3d: xr.Dataset) -> None:
    """Draw the joint at P1: C1 and C3, the arms, the beam nodes around, and the directions x, y, z."""
    radius, side = knit.radius, InterlockSide.in_the_middle(knit, contacts)
    start, surfaces = side.P[0], []
    for yarn, s, end, colour in zip(side.yarn, side.arc_length[0], side.C[0], side.colours, strict=True):
        span = (s - REACH * radius, s + REACH * radius)
        nodes = _nodes(rom3d, yarn, *span)
        surfaces += [piece(knit, yarn, *span, radius, colour, 0.2), tube(nodes, 0.09 * radius, colour)]
        surfaces += [sphere(node, 0.16 * radius, colour) for node in nodes]
        surfaces.append(rod(end, start, 0.10 * radius, ACCENT))
    surfaces += [arrow(start, AXIS * radius * direction, 0.05 * radius, INK) for direction in np.eye(3)]
    show(axes, surfaces, DETAIL)
    _name_joint(axes, side, radius)
    scale_bar(axes, 1, (0.02, 0.0))
    panel_letter(axes, "b", "joint of $C_1$ and $C_3$ at $P_1$")


def _nodes(rom3d: xr.Dataset, yarn: int, start: float, end: float) -> np.ndarray:
    """Return the beam nodes (k, 3) of a yarn between two arc lengths [m]."""
    s = rom3d["arc_length"].to_numpy()
    inside = (rom3d["yarn"].to_numpy() == yarn) & (s >= start) & (s <= end)
    return rom3d["centreline"].to_numpy()[inside]


def _name_joint(axes: Axes, side: InterlockSide, radius: float) -> None:
    points = {"C_1": side.C[0, 0], "C_3": side.C[0, 1], "P_1": side.P[0]}
    for name, point in points.items():
        axes.scatter(*MILLIMETRE * DETAIL.project(point), s=22, color=ACCENT, edgecolor=PAPER, zorder=8)
        label(axes, DETAIL, point, f"${name}$", PLACES[name], ACCENT)
    for name, direction in zip("xyz", np.eye(3), strict=True):
        tip = side.P[0] + (AXIS + 0.3) * radius * direction
        write(axes, MILLIMETRE * DETAIL.project(tip), f"${name}$")
