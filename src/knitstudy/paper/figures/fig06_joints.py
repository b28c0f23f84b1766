"""Fig. 6: the three-dimensional reduced model, and one of its joints with the directions of its forces."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.yarns.joints import joint_points, spring_axes
from knitstudy.paper.figures.fig05_contact_points import InterlockSide, name_points, piece
from knitstudy.run.catalogue import FIGURES, network, of_solid
from knitstudy.use.picture import arrow, bounds, draw_rows, scale_bar, sphere, tube, write, yarn_colours
from knitstudy.use.renderer import MILLIMETRE, Picture, Surface, View
from knitstudy.use.style import ACCENT, INK, panel_letter

WHOLE, DETAIL = View.orbit(turn=-18, tilt=16), View.orbit(turn=34, tilt=-37)
BEAM, ARM = 0.26, 0.16  # radii in which beams and joints are drawn, over the yarn's
REACH = 3.2  # how much of the yarns the detail shows on either side of the joint, in radii
AXIS = 2.0  # length of the directions in the detail, in radii
PLACES = {"$C_1$": (-32, -10), "$C_3$": (34, 8), "$P_1$": (0, -30)}  # offsets of names from points [points]


@FIGURES.add(
    "fig06_joints",
    "Fig. 6: 3D reduced model and its joints",
    results=of_solid("isotropic-course", "geometry", "contacts")
    | {"rom3d": network("rom3d", "isotropic-course")},
)
def draw(geometry: xr.Dataset, contacts: xr.Dataset, rom3d: xr.Dataset) -> Figure:
    """Draw the beams of the model between their nodes with the arms that join them, and the joint at P1."""
    knit = fabric_of(geometry)
    side, radius = InterlockSide.in_the_middle(knit, contacts), knit.radius
    axes = spring_axes(side.normal, "local")[0]
    whole, joint = _whole(knit, contacts, rom3d), _joint(knit, side, rom3d, axes)
    pictures = [
        Picture(surfaces, view, bounds(surfaces, view, below))
        for surfaces, view, below in ((whole, WHOLE, 3.0), (joint, DETAIL, 0.5))
    ]
    drawing, (left, right) = draw_rows([pictures])
    scale_bar(left, 5, WHOLE)
    panel_letter(left, "a", "beams and joints")
    points = {"$C_1$": side.C[0, 0], "$C_3$": side.C[0, 1], "$P_1$": side.P[0]}
    name_points(right, DETAIL, points, PLACES, ACCENT)
    for name, direction in zip("xyz", axes, strict=True):
        tip = side.P[0] + (AXIS + 0.3) * radius * direction
        write(right, MILLIMETRE * DETAIL.project(tip), f"${name}$")
    scale_bar(right, 1)
    panel_letter(right, "b", "joint of $C_1$ and $C_3$ at $P_1$")
    return drawing


def _whole(knit: Fabric, contacts: xr.Dataset, rom3d: xr.Dataset) -> list[Surface]:
    """Return every yarn's chain of straight beams, the arms from the points C to P, and the points C."""
    yarn, position = rom3d["yarn"].to_numpy(), rom3d["centreline"].to_numpy()
    points, radius = joint_points(knit, contacts), knit.radius
    surfaces = [
        tube(position[yarn == i], BEAM * radius, colour) for i, colour in enumerate(yarn_colours(knit))
    ]
    for pair, centroid in zip(points.point, points.centroid, strict=True):
        for end in pair:
            surfaces.append(tube([end, centroid], ARM * radius, ACCENT))
            surfaces.append(sphere(end, 1.35 * BEAM * radius, ACCENT))
    return surfaces


def _joint(knit: Fabric, side: InterlockSide, rom3d: xr.Dataset, axes: np.ndarray) -> list[Surface]:
    """Return C1 and C3, the arms from there to P1, the beam nodes around, and the axes (3, 3) of its springs."""
    radius, start = knit.radius, side.P[0]
    s, of_yarn = rom3d["arc_length"].to_numpy(), rom3d["yarn"].to_numpy()
    surfaces = [arrow(start, AXIS * radius * direction, 0.05 * radius, INK) for direction in axes]
    for yarn, middle, end, colour in zip(side.yarn, side.arc_length[0], side.C[0], side.colours, strict=True):
        reach = REACH * radius
        nodes = rom3d["centreline"].to_numpy()[(of_yarn == yarn) & (abs(s - middle) <= reach)]
        surfaces.append(piece(knit, yarn, (middle - reach, middle + reach), radius, colour, 0.2))
        surfaces.append(tube(nodes, 0.09 * radius, colour))
        surfaces += [sphere(node, 0.16 * radius, colour) for node in nodes]
        surfaces.append(tube([end, start], 0.10 * radius, ACCENT))
    return surfaces
