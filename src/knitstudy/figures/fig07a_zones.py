"""Fig. 7a: number and area of the contact zones in the centre cell against strain."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.curves import PERCENT, WIDTH, explain_snapshots, mark_snapshots, strain_label
from knitstudy.figures.style import FAINT, INTERACTIONS, figure, styled
from knitstudy.measures.catalogue import solid
from knitstudy.measures.centre_cell import area_of_cell, snapshots, zones_of_cell

HEIGHT = 100.0
"""Of the figure [mm]."""

SQUARE_MILLIMETRES = 1e6


@FIGURES.add(
    "fig07a_zones",
    "Fig. 7a: contact zones in the centre cell, their number and area",
    results={"contacts": solid("contacts", "isotropic-course")},
)
@styled
def draw(contacts: xr.Dataset) -> Figure:
    """Draw both over strain, one above the other.

    Parameters
    ----------
    contacts : Dataset
        Of a direct simulation with isotropic friction (see docs/architecture.md).
    """
    drawing = figure(WIDTH, HEIGHT)
    strain, points = PERCENT * contacts["strain"].to_numpy(), snapshots(contacts)
    look = INTERACTIONS["isotropic"].line | {"linestyle": "-"}
    above, below = drawing.add_axes((0.13, 0.56, 0.83, 0.36)), drawing.add_axes((0.13, 0.15, 0.83, 0.36))
    # A number of zones holds until the next increment shows another one.
    above.plot(strain, zones_of_cell(contacts), clip_on=False, drawstyle="steps-post", **look)
    above.set(ylabel="contact zones (1)", xticklabels=[])
    above.yaxis.set_major_locator(MaxNLocator(integer=True))
    below.plot(strain, SQUARE_MILLIMETRES * area_of_cell(contacts), clip_on=False, **look)
    below.set(xlabel=strain_label("course"), ylabel="contact area (mm²)")
    for axes in (above, below):
        axes.set_xlim(0, strain[-1])
        axes.set_ylim(0, None)
    mark_snapshots(above, points)
    for point in points:
        below.axvline(PERCENT * point.strain, color=FAINT, linewidth=0.7, linestyle=":", zorder=0)
    explain_snapshots(drawing, points)
    return drawing
