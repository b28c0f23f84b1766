"""Fig. 1: the unit cell before and after optimisation; white spheres where yarns penetrate each other.

The cell is cut through the legs of its loops: one head (blue) between two feet (red and green), as in the paper.
"""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.specimens import cut_cells
from knitstudy.measures.centre_cell import loop_of
from knitstudy.run.catalogue import FIGURES, solid
from knitstudy.use.solids import (
    Picture,
    Surface,
    View,
    bounds,
    draw_rows,
    scale_bar,
    sphere,
    yarn_tubes,
)
from knitstudy.use.style import MILLIMETRE, PAPER, YARNS, panel_letter

WIDTH = 120.0  # of the figure [mm]
VIEW = View.orbit(turn=-24, tilt=14)
COLOURS = (YARNS[2], YARNS[0], YARNS[1])  # of the head, the left foot and the right one
BULGE = 1.7  # radius of a sphere over the yarn's: it must show outside of both yarns that it marks
STATES = ("before", "after")


@FIGURES.add(
    "fig01_unit_cell",
    "Fig. 1: unit cell before and after optimisation",
    results={"geometry": solid("geometry", "tie-course")},
)
def draw(geometry: xr.Dataset) -> Figure:
    """Draw the three pieces of yarn of a cell."""
    knits = [cut_cells(loop_of(geometry, state), loops=1, rows=1) for state in STATES]
    yarns = [yarn_tubes(knit, COLOURS) for knit in knits]
    window = bounds([*yarns[0], *yarns[1]], VIEW)
    pictures = [
        Picture(tubes + overlaps(knit), VIEW, window) for tubes, knit in zip(yarns, knits, strict=True)
    ]
    drawing, panels = draw_rows([pictures], WIDTH, foot=13.0)
    for axes, letter, state in zip(panels, "ab", STATES, strict=True):
        scale_bar(axes, 5, VIEW)
        panel_letter(axes, letter, f"{state} optimisation")
        text = _numbers(geometry.sel(state=state), float(geometry["radius"]))
        axes.text(0.5, -0.06, text, transform=axes.transAxes, ha="center", va="top")
    return drawing


def overlaps(knit: Fabric) -> list[Surface]:
    """Return a sphere halfway between centrelines that come nearer than 2R, a little thicker than a yarn."""
    crossings, radius = knit.crossings, knit.radius
    deep = crossings.distance < 2 * radius
    return [sphere(point.mean(axis=0), BULGE * radius, PAPER) for point in crossings.point[deep]]


def _numbers(state: xr.Dataset, radius: float) -> str:
    penetration, gap = float(state["penetration"]), float(state["gap"])
    if penetration > 0:
        return f"deepest penetration {MILLIMETRE * penetration:.2f} mm ({penetration / radius:.2f} $R$)"
    return f"no penetration, smallest gap\n{MILLIMETRE * gap:.3f} mm ({gap / radius:.3f} $R$)"
