"""Fig. 7b: reaction force against strain with isotropic friction, with the points 1 to 4 of the contact zones."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.curves import HEIGHT, PERCENT, WIDTH, explain_snapshots, mark_snapshots, strain_label
from knitstudy.figures.style import INTERACTIONS, figure, styled
from knitstudy.measures.catalogue import solid
from knitstudy.measures.centre_cell import snapshots


@FIGURES.add(
    "fig07b_force",
    "Fig. 7b: force against strain with isotropic friction",
    results={"dns": solid("simulation", "isotropic-course")},
)
@styled
def draw(dns: xr.Dataset) -> Figure:
    """Draw the force over strain.

    Parameters
    ----------
    dns : Dataset
        History of a direct simulation with isotropic friction (see docs/architecture.md).
    """
    drawing, points = figure(WIDTH, HEIGHT), snapshots(dns)
    axes = drawing.add_axes((0.13, 0.17, 0.83, 0.73))
    look = INTERACTIONS["isotropic"].line | {"linestyle": "-"}
    axes.plot(PERCENT * dns["strain"], dns["force"], clip_on=False, **look)
    axes.set(xlabel=strain_label("course"), ylabel="reaction force (N)")
    axes.set_xlim(0, PERCENT * float(dns["strain"][-1]))
    axes.set_ylim(0, None)
    mark_snapshots(axes, points)
    explain_snapshots(drawing, points)
    return drawing
