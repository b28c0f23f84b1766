"""The axis of figures over the size of a square knit."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter, ScalarFormatter

MARKED = (1, 3, 6, 10, 20, 30)
"""Cells in a row that the axis names."""


def draw_cells_axis(axes: Axes) -> None:
    """Make the lower axis one of cells in a row, logarithmic."""
    axes.set(xscale="log", xlabel="cells in a row")
    axes.set_xticks(MARKED)
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())
