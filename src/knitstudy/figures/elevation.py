"""Deformed yarns coloured by their out-of-plane displacement, in steps that one bar explains."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from knitstudy.figures.picture import bounds, scale_bar, show, triad
from knitstudy.figures.renderer import FRONT, MILLIMETRE, Surface
from knitstudy.figures.shapes import graded_tube
from knitstudy.figures.style import DOUBLE, figure, panel_letter
from knitstudy.measures.response import Z

COLOURS = "cividis"
LEVELS = 12  # most steps of colour
CUT = 6.0  # distance of stations along a yarn, over the radius, that says that there is no yarn between them

FOOT, HEAD = 15.0, 11.0  # room for the colour bar below and for two lines of title above each panel [mm]

SILL = 3.0  # room below the knit for the scale bar [mm of the knit]


def elevation(history: xr.Dataset) -> np.ndarray:
    """Return u_z (S,) at full load along the yarns [m]."""
    return history["centreline_displacement"].to_numpy()[-1, :, Z]


def draw_elevations(
    rows: Sequence[Sequence[xr.Dataset]],
    titles: Sequence[Sequence[str]],
    radius: float,
    thickness: float = 1.0,
) -> Figure:
    """Return a figure of knits at full load, displacements true to scale, coloured on one scale.

    Parameters
    ----------
    rows : sequence of sequences of Dataset
        Two histories a row.
    titles : sequence of sequences of str
        Titles of the panels.
    radius : float
        Radius of the yarns [m].
    thickness : float
        Drawn over true diameter of the yarns.
    """
    norm = levels(np.concatenate([elevation(history) for row in rows for history in row]))
    surfaces = [[elevated_yarns(history, radius, norm, thickness) for history in row] for row in rows]
    windows = [bounds(found, FRONT) for row in surfaces for found in row]
    low, high = np.min(windows, axis=0), np.max(windows, axis=0)
    window = (low[0], high[1], low[2] - SILL, high[3])
    panel = 0.485 * DOUBLE * (window[3] - window[2]) / (window[1] - window[0])
    height = len(rows) * (panel + HEAD) + FOOT
    drawing = figure(DOUBLE, height)
    letters = iter("abcdefgh")
    for row, found in enumerate(surfaces):
        bottom = (height - (row + 1) * (panel + HEAD)) / height
        for column, title in enumerate(titles[row]):
            axes = drawing.add_axes((0.01 + 0.5 * column, bottom, 0.485, panel / height))
            show(axes, found[column], FRONT, window)
            panel_letter(axes, next(letters), title)
            if row == len(rows) - 1:
                scale_bar(axes, 5, (0.02, 0.0))
                triad(axes, FRONT, 2.5, (0.9, 0.0))
    colour_bar(drawing, norm, (0.25, 0.5), FOOT / height)
    return drawing


def elevated_yarns(
    history: xr.Dataset, radius: float, norm: BoundaryNorm, thickness: float = 1.0
) -> list[Surface]:
    """Return the yarns of a radius [m] at full load, displacements true to scale, drawn as thick as a share of it."""
    place = history["centreline"].to_numpy() + history["centreline_displacement"].to_numpy()[-1]
    colours = [to_hex(each) for each in matplotlib.colormaps[COLOURS](norm(MILLIMETRE * elevation(history)))]
    return [
        part
        for piece in _pieces(history, radius)
        for part in graded_tube(place[piece], thickness * radius, [colours[k] for k in piece])
    ]


def _pieces(history: xr.Dataset, radius: float) -> list[np.ndarray]:
    """Return the stations of every piece of yarn, in their order; the yarn's radius [m] tells where it is cut."""
    yarn, place = history["yarn"].to_numpy(), history["arc_length"].to_numpy()
    ends = (np.diff(yarn) != 0) | (np.diff(place) > CUT * radius)
    return np.split(np.arange(len(yarn)), np.flatnonzero(ends) + 1)


def levels(u_z: np.ndarray) -> BoundaryNorm:
    """Return steps of colour over all values of u_z (...,) [m], at round numbers of mm."""
    low, high = MILLIMETRE * float(u_z.min()), MILLIMETRE * float(u_z.max())
    if not high > low:
        low, high = low - 1e-3, high + 1e-3
    return BoundaryNorm(MaxNLocator(LEVELS).tick_values(low, high), matplotlib.colormaps[COLOURS].N)


def colour_bar(drawing: Figure, norm: BoundaryNorm, span: tuple[float, float], foot: float) -> None:
    """Draw the bar below panels, from a share of the width on and so wide; `foot` is the share of the height."""
    axes = drawing.add_axes((span[0], 0.58 * foot, span[1], 0.14 * foot))
    bar = drawing.colorbar(ScalarMappable(norm, COLOURS), cax=axes, orientation="horizontal", format="%.3g")
    bar.set_ticks(norm.boundaries[::2])
    bar.set_label("out-of-plane displacement $u_z$ (mm)", labelpad=1)
