"""Pictures of solids: their surfaces, rows of pictures that fill a figure, and the labels over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.mesh.sweep import SweptMesh, rotation_minimising
from knitstudy.use import renderer
from knitstudy.use.renderer import FRONT, MILLIMETRE, Picture, Surface, View, Window
from knitstudy.use.style import DOUBLE, INCH, INK, PAPER, YARNS, figure, place, resolution

HALO = (withStroke(linewidth=2.0, foreground=PAPER),)  # keeps letters and lines legible on any background
SILL = 4.0  # room below a knit for the scale bar [mm of the knit]
BAR = 15.0  # room for a bar of colours and its label [mm]
GAP = 0.015  # between pictures side by side, over the width of the figure


def window_around(points: np.ndarray, room: Sequence[float], view: View = FRONT) -> Window:
    """Return the window about points (k, 3) [m], with room (2,) on the right and left and above and below [mm]."""
    flat = MILLIMETRE * view.project(points)
    (left, bottom), (right, top) = flat.min(axis=0) - room, flat.max(axis=0) + room
    return float(left), float(right), float(bottom), float(top)


def bounds(surfaces: Sequence[Surface], view: View = FRONT, below: float = SILL) -> Window:
    """Return the window of surfaces with a margin, and with room `below` them [mm]."""
    points = np.concatenate([surface.points for surface in surfaces])
    margin = 0.03 * MILLIMETRE * np.ptp(view.project(points), axis=0).max()
    left, right, bottom, top = window_around(points, (margin, margin), view)
    return left, right, bottom - below, top


def draw_rows(
    rows: Sequence[Sequence[Picture | None]],
    width: float = DOUBLE,
    head: float = 7.0,
    foot: float = 0.0,
    above: float = 0.0,
) -> tuple[Figure, list[Axes]]:
    """Return a figure that rows of pictures fill, and their axes, row by row.

    Parameters
    ----------
    rows : sequence of sequences of Picture
        From above to below. Pictures of a row are equally wide, the row is as high as the highest of them; where one
        is None the axes stay empty.
    width : float
        Width of the figure [mm].
    head, foot, above : float
        Room above each row for titles, below all rows, and above all of them [mm].
    """

    def high(row: Sequence[Picture | None]) -> float:
        wide = width * (1 / len(row) - GAP)
        windows = [picture.window for picture in row if picture]
        return head + wide * max((top - bottom) / (right - left) for left, right, bottom, top in windows)

    bottom = foot + sum(map(high, rows))
    drawing, panels = figure(width, bottom + above), []
    for row in rows:
        bottom -= high(row)
        for k, picture in enumerate(row):
            left = k / len(row) + GAP / 2
            panels.append(place(drawing, left, bottom, 1 / len(row) - GAP, high(row) - head))
            if picture:
                show(panels[-1], picture)
    return drawing, panels


def show(axes: Axes, picture: Picture) -> None:
    """Fill axes with a picture; their coordinates are mm in its plane. Its window is widened to the shape of the axes.

    Raises ConfigurationError when the environment variable KNITSTUDY_DPI names no resolution, and RenderingError when
    VTK cannot render on this machine.
    """
    share = axes.get_position(original=True)
    size = INCH * axes.figure.get_size_inches() * [share.width, share.height]  # mm
    corners = np.reshape(picture.window, (2, 2))  # left and right, bottom and top
    half = size * (np.ptp(corners, axis=1) / size).max() / 2
    middle = corners.mean(axis=1)
    window = tuple(np.column_stack([middle - half, middle + half]).ravel().tolist())
    axes.set(xlim=window[:2], ylim=window[2:], aspect="equal")
    axes.set_axis_off()
    pixels = tuple((resolution() / INCH * size).astype(int).tolist())
    image = renderer.rendered(replace(picture, window=window, pixels=pixels))
    axes.imshow(image, extent=window, interpolation="none", zorder=0)


def colour_bar(
    drawing: Figure, scale: ScalarMappable, label: str, left: float, width: float, **look: object
) -> Colorbar:
    """Draw a bar of colours in the lowest `BAR` mm of a figure, from a share of its width on and so wide."""
    axes = place(drawing, left, 0.58 * BAR, width, 0.14 * BAR)
    bar = drawing.colorbar(scale, cax=axes, orientation="horizontal", **look)
    bar.set_label(label, labelpad=1)
    return bar


# ---- over the picture ----


def write(axes: Axes, place: Sequence[float], text: str, **options: object) -> None:
    """Write a text about a place in the coordinates of the axes, legible on any background."""
    look = {"ha": "center", "va": "center", "path_effects": HALO, "zorder": 10}
    axes.text(*place, text, **look | options)


def label(axes: Axes, place: np.ndarray, text: str, offset: tuple[float, float], colour: str = INK) -> None:
    """Name a place (2,) with a thin line from the text, which stands `offset` points away."""
    both = {"color": colour, "path_effects": HALO}
    line = {"arrowstyle": "-", "linewidth": 0.7, "shrinkA": 0, "shrinkB": 0, **both}
    look = {"ha": "center", "va": "center", "zorder": 10, **both}
    axes.annotate(text, place, xytext=offset, textcoords="offset points", arrowprops=line, **look)


def draw_arrow(
    axes: Axes, tail: np.ndarray, vector: np.ndarray, colour: str, width: float, **options: object
) -> None:
    """Draw an arrow from a place (2,) along a vector (2,) in the coordinates of the axes."""
    look = {"arrowstyle": "-|>", "linewidth": width, "color": colour, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", np.add(tail, vector), tail, arrowprops=look | options, annotation_clip=False, zorder=7)


def scale_bar(axes: Axes, length: float, view: View | None = None, left: float = 0.03) -> None:
    """Draw a bar of a length [mm] at the foot from a share of the axes on, and the directions of a view."""
    x, y = axes.transLimits.inverted().transform((left, 0.02))
    axes.plot([x, x + length], [y, y], color=INK, linewidth=2.0, solid_capstyle="butt", marker="", zorder=10)
    look = {"ha": "left", "va": "bottom", "path_effects": HALO, "zorder": 10}
    axes.annotate(f"{length:g} mm", (x, y), xytext=(0, 4), textcoords="offset points", **look)
    if view is None:
        return
    # An axis that points to the eye is left out: it would be a dot.
    arms = {name: view.project(direction) for name, direction in zip("xyz", np.eye(3), strict=True)}
    arms = {name: length / 2 * arm for name, arm in arms.items() if np.linalg.norm(arm) > 0.1}
    lowest = min(0.0, *(arm[1] for arm in arms.values()))
    origin = axes.transLimits.inverted().transform((1.0, 0.03)) - [0.8 * length, lowest]
    for name, arm in arms.items():
        draw_arrow(axes, origin, arm, INK, 0.9)
        write(axes, origin + (1 + 0.11 * length / np.linalg.norm(arm)) * arm, f"${name}$")


# ---- surfaces ----


AROUND = 40  # facets around a tube
STEP = 0.15  # distance of the points that yarns are drawn through, in radii


def tube(centreline: np.ndarray, radius: float | np.ndarray, colour: str, opacity: float = 1.0) -> Surface:
    """Return a closed tube about a curve through points (k, 3) [m], of one radius or one at every point (k,) [m]."""
    centreline = np.asarray(centreline, dtype=float)
    tangent = np.gradient(centreline, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = rotation_minimising(centreline, tangent)
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    radial = np.einsum("ad,kdi->kai", np.stack([np.cos(angle), np.sin(angle)], axis=1), frame[:, :2])
    rings = centreline[:, None] + np.reshape(radius, (-1, 1, 1)) * radial
    # The caps are rings of radius zero.
    first, last = (np.repeat(centreline[[k], None], AROUND, axis=1) for k in (0, -1))
    rings = np.concatenate([first, rings, last])
    number = np.arange(rings.shape[0] * AROUND).reshape(-1, AROUND)
    ahead = np.roll(number, -1, axis=1)
    faces = np.stack([number[:-1], ahead[:-1], ahead[1:], number[1:]], axis=-1)
    return Surface(rings.reshape(-1, 3), faces.reshape(-1, 4), colour, opacity)


def yarn_colours(fabric: Fabric, colours: Sequence[str] = YARNS) -> list[str]:
    """Return a colour for every yarn, again and again from the first; all pieces of a cut yarn have the same."""
    whole = fabric.arcs.yarn if fabric.arcs else np.arange(len(fabric.centrelines))
    return [colours[number % len(colours)] for number in whole]


def yarn_tubes(fabric: Fabric, colours: Sequence[str]) -> list[Surface]:
    """Return the undeformed yarns of a fabric in colours by yarn."""
    surfaces = []
    for curve, colour in zip(fabric.centrelines, colours, strict=True):
        s = np.linspace(0, curve.length, round(curve.length / (STEP * fabric.radius)))
        surfaces.append(tube(curve.position(s), fabric.radius, colour))
    return surfaces


def graded_tube(centreline: np.ndarray, radius: float, colours: Sequence[str]) -> list[Surface]:
    """Return a closed tube about a curve through points (k, 3) [m] whose colours (k,) change from point to point."""
    whole = tube(centreline, radius, colours[0])
    # Rings of facets: the first cap, k - 1 between the points, the last cap.
    ahead = np.concatenate([[colours[0]], colours[1:], [colours[-1]]])
    of_face = np.repeat(ahead, AROUND)
    return [
        Surface(whole.points, whole.faces[of_face == colour], str(colour)) for colour in np.unique(of_face)
    ]


def sphere(centre: np.ndarray, radius: float, colour: str, opacity: float = 1.0) -> Surface:
    """Return a sphere [m]."""
    angle = np.linspace(0, np.pi, 25)
    axis = np.array([0.0, 0.0, radius])
    return tube(centre - np.outer(np.cos(angle), axis), radius * np.sin(angle), colour, opacity)


def arrow(start: np.ndarray, vector: np.ndarray, radius: float, colour: str) -> Surface:
    """Return an arrow whose shaft has a radius [m] and whose head is three times as thick."""
    neck = 1 - 8 * radius / np.linalg.norm(vector)
    place = start + np.outer([0, neck, neck, 1], vector)
    return tube(place, radius * np.array([1, 1, 3, 0]), colour)


def yarn_of_mesh(mesh: SweptMesh, yarn: int, colour: str) -> Surface:
    """Return the lateral surface of one yarn of a mesh, with the edges of its facets."""
    corners, faces = np.unique(mesh.surface_quads(yarn), return_inverse=True)
    return Surface(mesh.nodes[corners], faces.reshape(-1, 4), colour, edges=True)
