"""Figs. 5 and 6: the points C1 to C4 of the three-dimensional reduced model, and its joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.errors import DataFileError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.yarns.joints import contact_normal_planes, contact_normals, joint_points, spring_axes
from knitstudy.paper.scene_names import network, of_solid
from knitstudy.run.catalogue import FIGURES
from knitstudy.use.solids import (
    Picture,
    Surface,
    View,
    arrow,
    bounds,
    draw_rows,
    label,
    sphere,
    tube,
    write,
    yarn_colours,
)
from knitstudy.use.style import ACCENT, INK, MILLIMETRE, PAPER, SINGLE

VIEW = View.orbit(turn=-12, tilt=-36)  # from below: here planes and normals part most in the picture
REACH = 2.0  # how much of the yarns is shown beyond the contacts, in radii
ARROW = 2.6  # length of a drawn normal, in radii
PLANES = ("#E69F00", "#6B6B80")  # colours of the contact normal planes of P1 and P2
RIM = 0.4  # margin of the drawn part of a plane, in radii
LEFT_ZONES = (0, 2)  # lower and upper contact on the left of an interlock, where P1 and P2 of Fig. 5 lie

PLACES: dict[str, tuple[float, float]] = {
    "$C_1$": (-34, 8),
    "$C_2$": (-30, 26),
    "$C_3$": (34, 6),
    "$C_4$": (24, 22),
    "$P_1$": (-34, -14),
    "$P_2$": (-16, 34),
    r"$\mathbf{n}_1$": (11, 7),
    r"$\mathbf{n}_2$": (-3, -13),
}
"""Offsets of the names from the points [points]."""


@FIGURES.add(
    "fig05_contact_points",
    "Fig. 5: points of the 3D reduced model",
    results=of_solid("isotropic-course", "geometry", "contacts"),
)
def draw_contact_points(geometry: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the left side of the middle interlock, with translucent yarns."""
    knit = fabric_of(geometry)
    side = InterlockSide.in_the_middle(knit, contacts)
    radius = knit.radius
    surfaces = [tube(side.P, 0.05 * radius, ACCENT)]
    for yarn, s, colour in zip(side.yarn, side.arc_length.T, side.colours, strict=True):
        span = (s.min() - REACH * radius, s.max() + REACH * radius)
        surfaces.append(piece(knit, yarn, span, radius, colour, 0.22))
        surfaces.append(piece(knit, yarn, span, 0.06 * radius, colour))
    for contact, colour in enumerate(PLANES):
        corners = corners_of_plane(side, contact, radius)
        surfaces.append(Surface(corners, np.array([[0, 1, 2, 3], [3, 2, 1, 0]]), colour, 0.25))
        for k in range(4):
            surfaces.append(tube(corners[[k - 1, k]], 0.02 * radius, colour))
        normal = ARROW * radius * side.normal[contact]
        surfaces.append(arrow(side.P[contact], normal, 0.06 * radius, ACCENT))
    picture = Picture(surfaces, VIEW, bounds(surfaces, VIEW, below=0.4), 1)
    drawing, (axes,) = draw_rows([[picture]], 1.2 * SINGLE, head=0)
    tips = MILLIMETRE * VIEW.project(side.P + ARROW * radius * side.normal)
    name_points(axes, VIEW, {f"$C_{i + 1}$": side.C[i % 2, i // 2] for i in range(4)}, PLACES, INK)
    name_points(axes, VIEW, {"$P_1$": side.P[0], "$P_2$": side.P[1]}, PLACES, ACCENT)
    for tip, name in zip(tips, (r"$\mathbf{n}_1$", r"$\mathbf{n}_2$"), strict=True):
        label(axes, tip, name, PLACES[name], ACCENT)
    return drawing


def corners_of_plane(side: InterlockSide, contact: int, radius: float) -> np.ndarray:
    """Return the corners (4, 3) [m] of the drawn part of a contact normal plane, 0 that of P1 or 1 that of P2.

    It is a rectangle along P1 P2 that reaches `RIM` radii [m] beyond both P, the arrow and the points C.
    """
    origin = side.P[0]
    along = side.P[1] - side.P[0]
    along = along / np.linalg.norm(along)
    frame = np.stack([along, np.cross(side.plane[contact], along)])
    tip = side.P[contact] + ARROW * radius * side.normal[contact]
    held = (np.stack([*side.P, *side.C[contact], tip]) - origin) @ frame.T
    (low, left), (high, right) = held.min(axis=0) - RIM * radius, held.max(axis=0) + RIM * radius
    return origin + np.array([(low, left), (high, left), (high, right), (low, right)]) @ frame


def name_points(
    axes: Axes,
    view: View,
    points: dict[str, np.ndarray],
    offsets: dict[str, tuple[float, float]],
    colour: str,
) -> None:
    """Draw dots and names over the picture, so that no yarn dims them."""
    for name, point in points.items():
        at = MILLIMETRE * view.project(point)
        axes.scatter(at[0], at[1], s=25, color=colour, edgecolor=PAPER, zorder=8)
        label(axes, at, name, offsets[name], colour)


# ---- the side of an interlock that Figs. 5 and 6 look at ----


@dataclass(frozen=True)
class InterlockSide:
    """The two contacts on one side of an interlock, where the same two yarns touch twice.

    Contact 0 is the lower one (P1), contact 1 the upper one (P2); yarn 0 is the lower row's, yarn 1 the upper's.
    """

    yarn: np.ndarray  # (2,) numbers of the two yarns
    P: np.ndarray  # (2, 3) centroids of the contacts [m]
    C: np.ndarray  # (2, 2, 3) by contact and yarn [m]: C1 is [0, 0], C3 [0, 1], C2 [1, 0], C4 [1, 1]
    arc_length: np.ndarray  # (2, 2) of the points C on their centrelines [m]
    normal: np.ndarray  # (2, 3) contact normals, from yarn 0 to yarn 1
    plane: np.ndarray  # (2, 3) unit normals of the contact normal planes
    colours: list[str]  # of the two yarns, the same as in pictures of the whole knit

    @classmethod
    def in_the_middle(cls, knit: Fabric, contacts: xr.Dataset) -> InterlockSide:
        """Return the left side of the middle interlock; DataFileError when the contacts do not hold it."""
        row, column = knit.cells[1] // 2, knit.cells[0] // 2
        here = (contacts["row"] == row) & (contacts["column"] == column)
        places = [np.flatnonzero(here & (contacts["zone"] == zone)) for zone in LEFT_ZONES]
        if any(len(place) != 1 for place in places):
            raise DataFileError(
                f"contacts: row {row}, column {column} must have the zones {LEFT_ZONES}, once each"
            )
        pair = np.concatenate(places)
        points = joint_points(knit, contacts)
        normal = contact_normals(contacts)
        plane = contact_normal_planes(contacts)
        of_pair = (points.centroid, points.point, points.arc_length, normal, plane)
        yarn = points.yarn[pair[0]]
        colours = [yarn_colours(knit)[number] for number in yarn]
        P, C, arc_length, normal, plane = (array[pair] for array in of_pair)
        return cls(yarn, P, C, arc_length, normal, plane, colours)


def piece(
    knit: Fabric, yarn: int, span: tuple[float, float], radius: float, colour: str, opacity: float = 1.0
) -> Surface:
    """Return the tube about a yarn's centreline between two arc lengths [m], cut at its ends."""
    centreline = knit.centrelines[yarn]
    low, high = np.clip(span, 0.0, centreline.length)
    s = np.linspace(low, high, 160)
    return tube(centreline.position(s), radius, colour, opacity)


# ---- Fig. 6

WHOLE = View.orbit(turn=-18, tilt=16)
DETAIL = View.orbit(turn=34, tilt=-37)
BEAM, ARM = 0.26, 0.16  # radii in which beams and joints are drawn, over the yarn's
REACH_OF_JOINT = 2.2  # how much of the yarns the detail shows beyond the joints, in radii
AXIS = 1.7  # length of the springs in the detail, in radii
TURNS, COIL, WIRE = (
    6,
    0.13,
    0.03,
)  # of a drawn spring: turns, radii of the coil and of the wire over the yarn's
PLACES_OF_JOINT: dict[str, tuple[float, float]] = {
    "$C_1$": (-30, -8),
    "$C_2$": (-30, 12),
    "$C_3$": (32, 4),
    "$C_4$": (30, 14),
    "$P_1$": (-4, -28),
    "$P_2$": (10, 30),
}  # offsets of names from points [points]


@FIGURES.add(
    "fig06_joints",
    "Fig. 6: 3D reduced model and its joints",
    results=of_solid("isotropic-course", "geometry", "contacts")
    | {"rom3d": network("rom3d", "isotropic-course")},
)
def draw_joints(geometry: xr.Dataset, contacts: xr.Dataset, rom3d: xr.Dataset) -> Figure:
    """Draw the beams of the model between their nodes with the arms that join them, and the joints at P1 and P2."""
    knit = fabric_of(geometry)
    side = InterlockSide.in_the_middle(knit, contacts)
    radius = knit.radius
    axes = spring_axes(side.normal, "local")
    whole = _whole(knit, contacts, rom3d)
    joint = _joints(knit, side, rom3d, axes)
    pictures = [
        Picture(surfaces, view, bounds(surfaces, view, below), bar, directions=view is WHOLE)
        for surfaces, view, below, bar in ((whole, WHOLE, 3.0, 5), (joint, DETAIL, 0.5, 1))
    ]
    titles = "beams and joints", "joints of $C_1$, $C_3$ and $C_2$, $C_4$"
    drawing, (_, right) = draw_rows([pictures], titles=titles)
    points = {f"$C_{i + 1}$": side.C[i % 2, i // 2] for i in range(4)}
    points |= {f"$P_{i + 1}$": point for i, point in enumerate(side.P)}
    name_points(right, DETAIL, points, PLACES_OF_JOINT, ACCENT)
    for name, direction in zip("xyz", axes[0], strict=True):
        tip = side.P[0] + (AXIS + 0.25) * radius * direction
        write(right, MILLIMETRE * DETAIL.project(tip), f"${name}$")
    return drawing


def _whole(knit: Fabric, contacts: xr.Dataset, rom3d: xr.Dataset) -> list[Surface]:
    """Return every yarn's chain of straight beams, the arms from the points C to P, and the points C."""
    yarn, position = rom3d["yarn"].to_numpy(), rom3d["centreline"].to_numpy()
    points = joint_points(knit, contacts)
    radius = knit.radius
    surfaces = [
        tube(position[yarn == i], BEAM * radius, colour) for i, colour in enumerate(yarn_colours(knit))
    ]
    for pair, centroid in zip(points.point, points.centroid, strict=True):
        for end in pair:
            surfaces.append(tube([end, centroid], ARM * radius, ACCENT))
            surfaces.append(sphere(end, 1.35 * BEAM * radius, ACCENT))
    return surfaces


def _joints(knit: Fabric, side: InterlockSide, rom3d: xr.Dataset, axes: np.ndarray) -> list[Surface]:
    """Return the points C, their arms to the points P, the beam nodes around, and the springs along axes (2, 3, 3)."""
    radius = knit.radius
    reach = REACH_OF_JOINT * radius
    s, of_yarn = rom3d["arc_length"].to_numpy(), rom3d["yarn"].to_numpy()
    surfaces = []
    for point, directions in zip(side.P, axes, strict=True):
        for direction in directions:
            surfaces += spring(point, AXIS * radius * direction, radius)
    for yarn, middles, ends, colour in zip(
        side.yarn, side.arc_length.T, side.C.swapaxes(0, 1), side.colours, strict=True
    ):
        low, high = middles.min() - reach, middles.max() + reach
        nodes = rom3d["centreline"].to_numpy()[(of_yarn == yarn) & (s >= low) & (s <= high)]
        surfaces.append(piece(knit, yarn, (low, high), radius, colour, 0.15))
        surfaces.append(tube(nodes, 0.09 * radius, colour))
        surfaces += [sphere(node, 0.16 * radius, colour) for node in nodes]
        surfaces += [
            tube([end, point], 0.10 * radius, ACCENT) for end, point in zip(ends, side.P, strict=True)
        ]
    return surfaces


def spring(start: np.ndarray, vector: np.ndarray, radius: float) -> list[Surface]:
    """Return a coil from a point (3,) along a vector (3,) [m], and an arrow head at its end."""
    length = float(np.linalg.norm(vector))
    along = vector / length
    side = np.linalg.svd(along[None])[2][1:]  # two directions across
    share = np.linspace(0.0, 1.0, 30 * TURNS)
    turn = 2 * np.pi * TURNS * share
    wide = COIL * radius * np.minimum(1.0, 8 * np.minimum(share, 1 - share))  # narrow at both ends
    coil = wide[:, None] * (np.cos(turn)[:, None] * side[0] + np.sin(turn)[:, None] * side[1])
    middle = start + np.outer(0.75 * share, vector)
    tip = start + np.outer([0.75, 1.0], vector)
    head = tube(tip, radius * np.array([0.17, 0.0]), INK)
    return [tube(middle + coil, WIRE * radius, INK), head]
