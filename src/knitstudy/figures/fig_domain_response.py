"""How force, out-of-plane motion and contact forces of a square knit depend on its size."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.annotation import MILLIMETRE
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.cells_axis import draw_cells_axis
from knitstudy.figures.domain_line import domain_line
from knitstudy.figures.style import figure, panel_letter, styled
from knitstudy.measures.catalogue import SQUARES, several
from knitstudy.measures.domain import domain_response, series_of
from knitstudy.study.scene import Scene

WIDTH, HEIGHT = 170.0, 72.0
"""Of the figure [mm]."""

STRAIN = 0.05
"""At which sizes are compared; series that end before are left out."""

PANELS = (
    ("force", "force over width (N/mm)", 1e-3),
    ("out_of_plane", "largest $|u_z|$ (mm)", MILLIMETRE),
    ("normal", "normal force, centre cell (N)", 1.0),
)


@FIGURES.add(
    "fig_domain_response",
    "Response of square knits against their size",
    results={
        "domain": several("simulation", *SQUARES, fewest=12),
        "domain_contacts": several("contacts", *SQUARES, fewest=12),
    },
    scenes=True,
)
@styled
def draw(
    domain: Mapping[str, xr.Dataset], domain_contacts: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]
) -> Figure:
    """Draw what knits answer over their size.

    Parameters
    ----------
    domain, domain_contacts : mapping of str to Dataset
        Histories of the series by scene, and contacts of the direct simulations among them (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    """
    found = [series for series in series_of(scenes.values()) if series.scenes[0].load.strain >= STRAIN]
    drawing = figure(WIDTH, HEIGHT)
    responses = [[domain_response(scene, domain, domain_contacts) for scene in each.scenes] for each in found]
    for axes, letter, (name, label, unit) in zip(drawing.subplots(1, 3), "abc", PANELS, strict=True):
        for series, answers in zip(found, responses, strict=True):
            values = unit * np.array([getattr(answer, name) for answer in answers])
            axes.plot(series.cells, values, **domain_line(series))
        draw_cells_axis(axes)
        axes.set_ylabel(label)
        axes.set_ylim(0, None)
        panel_letter(axes, letter)
    handles, labels = drawing.axes[0].get_legend_handles_labels()
    drawing.legend(handles, labels, loc="lower center", ncols=3, fontsize=6.5, handlelength=3.0)
    drawing.subplots_adjust(left=0.08, right=0.985, top=0.91, bottom=0.34, wspace=0.36)
    return drawing
