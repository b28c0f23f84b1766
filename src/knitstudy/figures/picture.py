"""Puts a three-dimensional picture into axes: rendered by VTK where that works, else drawn by matplotlib."""

from __future__ import annotations

import logging
import os
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.errors import ConfigurationError
from knitstudy.figures.painter import paint
from knitstudy.figures.renderer import Renderer
from knitstudy.figures.style import FAINT, INCH, resolution
from knitstudy.figures.surface import Surface
from knitstudy.figures.view import View
from knitstudy.figures.vtk_program import Job

log = logging.getLogger(__name__)

MILLIMETRE = 1e3

CHOICE = "KNITSTUDY_RENDERER"
"""Environment variable: ``vtk`` (default) or ``matplotlib``."""

VTK = Renderer()

FALLBACK = "drawn-without-vtk"
"""Group id of the note on figures that matplotlib drew."""


def show(
    axes: Axes, surfaces: Sequence[Surface], view: View, window: tuple[float, ...] | None = None
) -> None:
    """Fill axes with surfaces; their coordinates then are mm in the plane of the picture.

    Parameters
    ----------
    axes : Axes
        Placed in a figure; frame and ticks are taken away.
    surfaces : sequence of Surface
    view : View
    window : tuple of 4 floats, optional
        Left, right, bottom and top of what is shown [mm]; everything by default. It is widened in one
        direction to the shape of the axes.

    Raises
    ------
    ConfigurationError
        When the environment variable KNITSTUDY_RENDERER names no renderer, or KNITSTUDY_DPI no resolution.
    """
    size = _size(axes)
    window = _fitted(window or bounds(surfaces, view), size)
    axes.set(xlim=window[:2], ylim=window[2:], aspect="equal")
    axes.set_axis_off()
    pixels = tuple(int(resolution() / INCH * mm) for mm in size)
    image = _rendered(Job(tuple(surfaces), view, window, pixels))
    if image is not None:
        axes.imshow(image, extent=window, interpolation="none", zorder=0)
    else:
        paint(axes, surfaces, view)
        _note(axes.figure)


def bounds(
    surfaces: Sequence[Surface], view: View, margin: float = 0.04
) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top of surfaces in the picture [mm], with a margin as share of them."""
    flat = MILLIMETRE * view.project(np.concatenate([surface.points for surface in surfaces]))
    low, high = flat.min(axis=0), flat.max(axis=0)
    rim = margin * (high - low).max()
    return (low[0] - rim, high[0] + rim, low[1] - rim, high[1] + rim)


def is_fallback(figure: Figure) -> bool:
    """Whether a picture in a figure was drawn without VTK."""
    return any(text.get_gid() == FALLBACK for text in figure.texts)


def _size(axes: Axes) -> tuple[float, float]:
    """Return width and height of axes [mm]."""
    share = axes.get_position(original=True)
    width, height = axes.figure.get_size_inches()
    return INCH * width * share.width, INCH * height * share.height


def _fitted(window: tuple[float, ...], size: tuple[float, float]) -> tuple[float, float, float, float]:
    """Widen a window about its middle to the shape of the axes."""
    middle = np.array([window[0] + window[1], window[2] + window[3]]) / 2
    extent = np.array([window[1] - window[0], window[3] - window[2]])
    half = np.array(size) * (extent / size).max() / 2
    (left, bottom), (right, top) = middle - half, middle + half
    return float(left), float(right), float(bottom), float(top)


def _note(figure: Figure) -> None:
    if not is_fallback(figure):
        figure.text(
            0.995,
            0.996,
            "drawn without a 3D renderer",
            ha="right",
            va="top",
            fontsize=5.5,
            color=FAINT,
            gid=FALLBACK,
        )


def _rendered(job: Job) -> np.ndarray | None:
    """Return the picture as RGBA array, or None where VTK is not wanted or cannot render."""
    choice = os.environ.get(CHOICE, "vtk")
    if choice not in ("vtk", "matplotlib"):
        raise ConfigurationError(f"{CHOICE} is {choice!r}: allowed are 'vtk' and 'matplotlib'")
    if choice == "matplotlib":
        log.info("a picture is drawn by matplotlib, as %s asks for", CHOICE)
        return None
    return VTK.render(job)
