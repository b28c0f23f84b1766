"""Loops that fit over course and wale spacing, with the curvature of the yarn, and what limits those that do not."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.style import INK, SINGLE, figure, shared_legend
from knitstudy.geometry.feasible import OUTCOMES
from knitstudy.geometry.fit import TIGHT
from knitstudy.measures.catalogue import one

LIMITS = {
    "curvature": ("the yarn bends too tightly", "#D55E00"),
    "row": ("yarns of a row touch", "#E69F00"),
    "rows": ("yarns of neighbouring rows touch", "#56B4E9"),
    "interlock": ("no interlock", "#8C8C8C"),
}


@FIGURES.add(
    "fig_loops",
    "Loops that fit over course and wale spacing",
    results={"feasible": one("loop_map", "sweep-wale-tie-course")},
)
def draw(feasible: xr.Dataset) -> Figure:
    """Draw squares for loops that are found, coloured by their curvature, and crosses for the others by their limit."""
    wale, course = np.meshgrid(feasible["wale"], feasible["course"])
    outcome = feasible["outcome"].to_numpy().astype(int)
    drawing = figure(1.35 * SINGLE, 1.2 * SINGLE, layout="constrained")
    axes = drawing.subplots()
    here = outcome == 0
    bend = feasible["bend"].to_numpy()[here]
    dots = axes.scatter(
        wale[here], course[here], c=bend, s=32.0, marker="s", cmap="cividis", label="a loop fits"
    )
    drawing.colorbar(dots, ax=axes, label="radius over smallest radius of curvature (1)")
    for name, (label, colour) in LIMITS.items():
        lost = outcome == OUTCOMES.index(name)
        if lost.any():
            axes.scatter(wale[lost], course[lost], color=colour, s=14.0, marker="x", label=label)
    axes.plot(
        *TIGHT, "o", color=INK, markerfacecolor="none", markersize=8.0, label="Peirce 1947, yarns touch"
    )
    axes.set(xlabel="wale spacing over diameter (1)", ylabel="course spacing over diameter (1)")
    shared_legend(drawing, loc="outside lower left", ncols=2)
    return drawing
