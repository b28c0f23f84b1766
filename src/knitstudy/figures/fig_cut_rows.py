"""Out-of-plane motion of knits of whole yarns and of cells cut out of a knit (docs/notes/sensitivity.md)."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.annotation import MILLIMETRE, scale_bar, triad
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.elevation import colour_bar, elevated_yarns, elevation, levels
from knitstudy.figures.picture import bounds, show
from knitstudy.figures.style import DOUBLE, figure, panel_letter, styled
from knitstudy.figures.view import FRONT
from knitstudy.measures.catalogue import one, solid

FOOT, HEAD = 15.0, 11.0
"""Room for the colour bar below and for two lines of title above the panels [mm]."""

SILL = 3.0
"""Room below the knits for the scale bar [mm of the knit]."""


@FIGURES.add(
    "fig_cut_rows",
    "Where a knit is cut off: out-of-plane motion, course tension, isotropic friction",
    results={
        "geometry": solid("geometry", "isotropic-course"),
        "dns": solid("simulation", "isotropic-course"),
        "cut": one("simulation", "inputs-cut-isotropic-course"),
    },
)
@styled
def draw(geometry: xr.Dataset, dns: xr.Dataset, cut: xr.Dataset) -> Figure:
    """Draw both at full load, displacements true to scale, coloured on one scale.

    Parameters
    ----------
    geometry : Dataset
        Result of the geometry stage, for the yarn's radius.
    dns, cut : Dataset
        Histories of the knit, and of cells cut out of it (see docs/architecture.md).
    """
    radius = float(geometry["radius"])
    histories = {"whole yarns": dns, "cells cut out": cut}
    norm = levels(np.concatenate([elevation(history) for history in histories.values()]))
    surfaces = [elevated_yarns(history, radius, norm) for history in histories.values()]
    windows = [bounds(found, FRONT) for found in surfaces]
    low, high = np.min(windows, axis=0), np.max(windows, axis=0)
    window = (low[0], high[1], low[2] - SILL, high[3])
    panel = 0.485 * DOUBLE * (window[3] - window[2]) / (window[1] - window[0])
    height = panel + HEAD + FOOT
    drawing = figure(DOUBLE, height)
    for column, (name, history) in enumerate(histories.items()):
        axes = drawing.add_axes((0.01 + 0.5 * column, FOOT / height, 0.485, panel / height))
        show(axes, surfaces[column], FRONT, window)
        largest = MILLIMETRE * float(np.abs(elevation(history)).max())
        force = float(history["force"][-1])
        said = f"{name}\n{float(history['strain'][-1]):.2%} strain: {force:.3g} N, largest $|u_z|$ {largest:.3g} mm"
        panel_letter(axes, "ab"[column], said)
        scale_bar(axes, 5, (0.02, 0.0))
        triad(axes, FRONT, 2.5, (0.9, 0.0))
    colour_bar(drawing, norm, (0.25, 0.5), FOOT / height)
    return drawing
