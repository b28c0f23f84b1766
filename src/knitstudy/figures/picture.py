"""A picture of solids in axes, with labels, a scale bar and directions over it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from knitstudy.figures import renderer
from knitstudy.figures.renderer import FRONT, MILLIMETRE, Picture, Surface, View
from knitstudy.figures.style import INCH, INK, PAPER, figure, resolution

HALO = (withStroke(linewidth=2.0, foreground=PAPER),)  # keeps letters and lines legible on any background

SILL = 4.0  # room below the knit for the scale bar [mm of the knit]

LEGEND = 9.0  # height of the legend below a front view [mm]

Window = tuple[float, float, float, float]
"""Left, right, bottom and top of a picture [mm]."""


def show(axes: Axes, surfaces: Sequence[Surface], view: View, window: Window | None = None) -> None:
    """Fill axes with surfaces; their coordinates then are mm in the plane of the picture.

    Parameters
    ----------
    axes : Axes
        Placed in a figure; frame and ticks are taken away.
    surfaces : sequence of Surface
    view : View
    window : tuple of 4 floats, optional
        What is shown [mm]; everything by default. It is widened in one direction to the shape of the axes.

    Raises
    ------
    ConfigurationError
        When the environment variable KNITSTUDY_DPI names no resolution.
    RenderingError
        When VTK cannot render on this machine.
    """
    share = axes.get_position(original=True)
    size = INCH * axes.figure.get_size_inches() * [share.width, share.height]  # mm
    window = _fitted(window or bounds(surfaces, view), size)
    axes.set(xlim=window[:2], ylim=window[2:], aspect="equal")
    axes.set_axis_off()
    width, height = (int(resolution() / INCH * mm) for mm in size)
    image = renderer.rendered(Picture(tuple(surfaces), view, window, (width, height)))
    axes.imshow(image, extent=window, interpolation="none", zorder=0)


def bounds(surfaces: Sequence[Surface], view: View, margin: float = 0.04) -> Window:
    """Return the window of surfaces [mm], with a margin as share of it."""
    flat = MILLIMETRE * view.project(np.concatenate([surface.points for surface in surfaces]))
    low, high = flat.min(axis=0), flat.max(axis=0)
    rim = margin * (high - low).max()
    return (low[0] - rim, high[0] + rim, low[1] - rim, high[1] + rim)


def _fitted(window: Window, size: np.ndarray) -> Window:
    """Widen a window about its middle to the shape of the axes."""
    middle = np.array([window[0] + window[1], window[2] + window[3]]) / 2
    extent = np.array([window[1] - window[0], window[3] - window[2]])
    half = size * (extent / size).max() / 2
    (left, bottom), (right, top) = middle - half, middle + half
    return float(left), float(right), float(bottom), float(top)


def front_view(drawing: Figure, axes: Axes, surfaces: Sequence[Surface], window: Window) -> None:
    """Fill axes with the knit seen from the front, a scale bar and the directions."""
    show(axes, surfaces, FRONT, window)
    scale_bar(axes, 5, (0.02, 0.015))
    triad(axes, FRONT, 2.5, (0.90, 0.02))


def front_panels(
    surfaces: Sequence[Surface], panels: int, width: float, room: float = 0.0, head: float = 0.0
) -> tuple[Figure, list[Axes]]:
    """Return a figure of panels that all show surfaces from the front, with a legend's room below.

    Parameters
    ----------
    surfaces : sequence of Surface
    panels : int
        Panels side by side.
    width : float
        Width of the figure [mm].
    room, head : float
        Room on the right of the knit and above it [mm of the knit], and above the panels for titles [mm].
    """
    left, right, bottom, top = bounds(surfaces, FRONT, margin=0.03)
    window = (left, right + room, bottom - SILL, top + room)
    panel = width / panels * (window[3] - window[2]) / (window[1] - window[0])
    height = panel + LEGEND + head
    drawing = figure(width, height)
    places = [(k / panels, LEGEND / height, 1 / panels, panel / height) for k in range(panels)]
    axes = [drawing.add_axes(place) for place in places]
    for each in axes:
        front_view(drawing, each, surfaces, window)
    return drawing, axes


# ---- over the picture ----


def write(axes: Axes, place: Sequence[float], text: str, **said: object) -> None:
    """Write a text about a place in the coordinates of the axes, legible on any background."""
    look = {"ha": "center", "va": "center", "path_effects": HALO, "zorder": 10}
    axes.text(*place, text, **look | said)


def label(
    axes: Axes, view: View, point: np.ndarray, text: str, offset: tuple[float, float], colour: str = INK
) -> None:
    """Name a point (3,) [m] with a thin line from the text, which stands `offset` points away."""
    look = {"ha": "center", "va": "center", "color": colour, "path_effects": HALO, "zorder": 10}
    line = {
        "arrowstyle": "-",
        "linewidth": 0.7,
        "color": colour,
        "shrinkA": 0,
        "shrinkB": 0,
        "path_effects": HALO,
    }
    place = MILLIMETRE * view.project(point)
    axes.annotate(text, place, xytext=offset, textcoords="offset points", arrowprops=line, **look)


def draw_arrow(
    axes: Axes, tail: np.ndarray, vector: np.ndarray, colour: str, width: float, **said: object
) -> None:
    """Draw an arrow from a place (2,) along a vector (2,) in the coordinates of the axes."""
    look = {"arrowstyle": "-|>", "linewidth": width, "color": colour, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", np.add(tail, vector), tail, arrowprops=look | said, annotation_clip=False, zorder=7)


def scale_bar(axes: Axes, length: float, place: tuple[float, float] = (0.03, 0.04)) -> None:
    """Draw a bar of a length [mm] that begins at a place in shares of the axes."""
    x, y = _place(axes, place)
    axes.plot([x, x + length], [y, y], color=INK, linewidth=2.0, solid_capstyle="butt", marker="", zorder=10)
    look = {"ha": "center", "va": "bottom", "path_effects": HALO, "zorder": 10}
    axes.annotate(f"{length:g} mm", (x + length / 2, y), xytext=(0, 4), textcoords="offset points", **look)


def triad(axes: Axes, view: View, length: float, place: tuple[float, float] = (0.9, 0.06)) -> None:
    """Draw the directions x, y and z, arrows of a length [mm], from a place in shares of the axes.

    An axis that points to the eye is left out: it would be a dot.
    """
    origin = _place(axes, place)
    for name, direction in zip("xyz", np.eye(3), strict=True):
        arm = view.project(direction)
        if np.linalg.norm(arm) < 0.1:
            continue
        draw_arrow(axes, origin, length * arm, INK, 0.9)
        beyond = origin + (length + 0.22 * length / np.linalg.norm(arm)) * arm
        write(axes, beyond, f"${name}$")


def _place(axes: Axes, share: tuple[float, float]) -> np.ndarray:
    """Return the place (2,) at a share of the axes."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    return np.array([left + share[0] * (right - left), bottom + share[1] * (top - bottom)])
