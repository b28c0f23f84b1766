"""Loops that fit over course and wale spacing, with the curvature of the yarn, and what limits those that do not."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.style import INK, PAPER, SINGLE, figure, shared_legend
from knitstudy.geometry.feasible import OUTCOMES
from knitstudy.geometry.fit import TIGHT
from knitstudy.measures.catalogue import Scenes, one

LIMITS = {
    "curvature": ("yarn bends too tightly", "#D55E00", "x"),
    "row": ("yarns of one row touch", "#009E73", "|"),
    "rows": ("yarns of several rows touch", "#0072B2", "_"),
    "interlock": ("no interlock", "#8C8C8C", "."),
}
"""Label, colour and marker of what limits a loop that does not fit."""


@FIGURES.add(
    "fig_loops",
    "Loops that fit over course and wale spacing",
    results={"feasible": one("loop_map", "sweep-wale-tie-course")},
)
def draw(feasible: xr.Dataset, scenes: Scenes) -> Figure:
    """Draw cells for loops that are found, coloured by their curvature, and marks for the others by their limit."""
    wale, course = np.meshgrid(feasible["wale"], feasible["course"])
    outcome = feasible["outcome"].to_numpy().astype(int)
    drawing = figure(1.4 * SINGLE, 1.25 * SINGLE, layout="constrained")
    axes = drawing.subplots()
    bend = np.where(outcome == 0, feasible["bend"], np.nan)
    cells = axes.pcolormesh(feasible["wale"], feasible["course"], bend, cmap="cividis", shading="nearest")
    drawing.colorbar(cells, ax=axes, label="yarn radius over smallest radius of curvature (1)")
    for name, (label, colour, marker) in LIMITS.items():
        lost = outcome == OUTCOMES.index(name)
        if lost.any():
            axes.scatter(wale[lost], course[lost], color=colour, s=18.0, marker=marker, lw=1.0, label=label)
    pattern, diameter = scenes["feasible"].pattern, scenes["feasible"].yarn.diameter
    paper = pattern.wale_spacing / diameter, pattern.course_spacing / diameter
    look = {"color": INK, "linestyle": "none", "markersize": 6.0, "markerfacecolor": PAPER, "clip_on": False}
    axes.plot(*paper, "D", label="loop of the paper", **look)
    axes.plot(*TIGHT[::-1], "o", label="Peirce's loop, yarns touch", **look)
    axes.set(xlabel="wale spacing over yarn diameter (1)", ylabel="course spacing over yarn diameter (1)")
    shared_legend(drawing, loc="outside lower left", ncols=2)
    return drawing
