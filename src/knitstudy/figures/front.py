"""The whole knit seen from the front, with room for a scale bar and a legend below it."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.annotation import scale_bar, triad
from knitstudy.figures.picture import bounds, show
from knitstudy.figures.style import SINGLE, figure
from knitstudy.figures.surface import Surface
from knitstudy.figures.view import FRONT

WIDTH = 1.5 * SINGLE
SILL = 4.0
"""Room below the knit for the scale bar [mm of the knit]."""

FOOT = 9.0
"""Height of the legend [mm]."""


def front_view(surfaces: Sequence[Surface], room: float = 0.0) -> tuple[Figure, Axes]:
    """Return a figure of surfaces, and its axes in mm of the knit; `room` is left free on the right and above [mm]."""
    left, right, bottom, top = bounds(surfaces, FRONT, margin=0.03)
    window = (left, right + room, bottom - SILL, top + room)
    height = WIDTH * (window[3] - window[2]) / (window[1] - window[0])
    drawing = figure(WIDTH, height + FOOT)
    axes = drawing.add_axes((0, FOOT / (height + FOOT), 1, height / (height + FOOT)))
    show(axes, surfaces, FRONT, window)
    scale_bar(axes, 5, (0.02, 0.015))
    triad(axes, FRONT, 2.5, (0.90, 0.02))
    return drawing, axes
