"""Fig. 1: the unit cell before and after optimisation; white spheres where yarns penetrate each other."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.picture import bounds, scale_bar, show, triad
from knitstudy.figures.renderer import MILLIMETRE, Surface, View
from knitstudy.figures.shapes import sphere, yarn_tubes
from knitstudy.figures.style import PAPER, YARNS, figure, panel_letter
from knitstudy.geometry.fabric import Fabric, plain_knit
from knitstudy.measures.catalogue import solid
from knitstudy.measures.centre_cell import loop_of

WIDTH = 130.0  # of the figure [mm]
VIEW = View.orbit(turn=-24, tilt=14)
COLOURS = (YARNS[0], YARNS[2], YARNS[1])  # the middle one of three is blue, as in the paper
BULGE = 1.7  # radius of a sphere over the yarn's: it must show outside of both yarns that it marks
STATES = ("before", "after")


@FIGURES.add(
    "fig01_unit_cell",
    "Fig. 1: unit cell before and after optimisation",
    results={"geometry": solid("geometry", "tie-course")},
)
def draw(geometry: xr.Dataset) -> Figure:
    """Draw three yarns of one loop, the middle one with both its neighbours."""
    knits = [plain_knit(loop_of(geometry, state), loops=1, rows=2) for state in STATES]
    surfaces = [yarn_tubes(knit, COLOURS) for knit in knits]
    window = np.array([bounds(each, VIEW) for each in surfaces])
    window = (window[:, 0].min() - 2, window[:, 1].max() + 2, window[:, 2].min() - 2, window[:, 3].max())
    # As high as two panels side by side need.
    drawing = figure(WIDTH, 0.48 * WIDTH * (window[3] - window[2]) / (window[1] - window[0]) / 0.85)
    for k, (letter, state) in enumerate(zip("ab", STATES, strict=True)):
        axes = drawing.add_axes((0.01 + 0.5 * k, 0.08, 0.48, 0.85))
        show(axes, surfaces[k] + overlaps(knits[k]), VIEW, window)
        scale_bar(axes, 5)
        panel_letter(axes, letter, f"{state} optimisation")
        _state_numbers(axes, geometry.sel(state=state), float(geometry["radius"]))
    triad(drawing.axes[0], VIEW, 2.0)
    return drawing


def overlaps(knit: Fabric) -> list[Surface]:
    """Return a sphere halfway between centrelines that come nearer than 2R, a little thicker than a yarn."""
    crossings, radius = knit.crossings, knit.radius
    deep = crossings.distance < 2 * radius
    return [sphere(point.mean(axis=0), BULGE * radius, PAPER) for point in crossings.point[deep]]


def _state_numbers(axes: Axes, state: xr.Dataset, radius: float) -> None:
    penetration, gap = float(state["penetration"]), float(state["gap"])
    if penetration > 0:
        text = f"deepest penetration {MILLIMETRE * penetration:.2f} mm ({penetration / radius:.2f} $R$)"
    else:
        text = f"no penetration, smallest gap\n{MILLIMETRE * gap:.3f} mm ({gap / radius:.3f} $R$)"
    axes.text(0.5, -0.02, text, transform=axes.transAxes, ha="center", va="top")
