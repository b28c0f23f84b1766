"""Pictures of solids in axes, in rows that fill a figure, with labels, a scale bar and directions over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from knitstudy.figures import renderer
from knitstudy.figures.renderer import FRONT, MILLIMETRE, Picture, Surface, View, Window
from knitstudy.figures.style import DOUBLE, INCH, INK, PAPER, figure, place, resolution

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


def write(axes: Axes, place: Sequence[float], text: str, **said: object) -> None:
    """Write a text about a place in the coordinates of the axes, legible on any background."""
    look = {"ha": "center", "va": "center", "path_effects": HALO, "zorder": 10}
    axes.text(*place, text, **look | said)


def label(axes: Axes, place: np.ndarray, text: str, offset: tuple[float, float], colour: str = INK) -> None:
    """Name a place (2,) with a thin line from the text, which stands `offset` points away."""
    line = {"arrowstyle": "-", "linewidth": 0.7, "color": colour, "shrinkA": 0, "shrinkB": 0}
    look = {"ha": "center", "va": "center", "color": colour, "path_effects": HALO, "zorder": 10}
    line["path_effects"] = HALO
    axes.annotate(text, place, xytext=offset, textcoords="offset points", arrowprops=line, **look)


def draw_arrow(
    axes: Axes, tail: np.ndarray, vector: np.ndarray, colour: str, width: float, **said: object
) -> None:
    """Draw an arrow from a place (2,) along a vector (2,) in the coordinates of the axes."""
    look = {"arrowstyle": "-|>", "linewidth": width, "color": colour, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", np.add(tail, vector), tail, arrowprops=look | said, annotation_clip=False, zorder=7)


def scale_bar(axes: Axes, length: float, view: View | None = None) -> None:
    """Draw a bar of a length [mm] at the lower left corner, and the directions of a view at the lower right one."""
    x, y = axes.transLimits.inverted().transform((0.03, 0.02))
    axes.plot([x, x + length], [y, y], color=INK, linewidth=2.0, solid_capstyle="butt", marker="", zorder=10)
    look = {"ha": "center", "va": "bottom", "path_effects": HALO, "zorder": 10}
    axes.annotate(f"{length:g} mm", (x + length / 2, y), xytext=(0, 4), textcoords="offset points", **look)
    if view is not None:
        _draw_triad(axes, view, length / 2)


def _draw_triad(axes: Axes, view: View, length: float) -> None:
    """Draw x, y and z as arrows; an axis that points to the eye is left out: it would be a dot."""
    origin = axes.transLimits.inverted().transform((1.0, 0.03)) - [1.6 * length, 0.0]
    for name, direction in zip("xyz", np.eye(3), strict=True):
        arm = view.project(direction)
        if np.linalg.norm(arm) < 0.1:
            continue
        draw_arrow(axes, origin, length * arm, INK, 0.9)
        write(axes, origin + length * (1 + 0.22 / np.linalg.norm(arm)) * arm, f"${name}$")
