"""Fig. 12a: degrees of freedom and memory of square knits against the number of cells in a row."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.cells_axis import draw_cells_axis
from knitstudy.figures.domain_line import domain_line
from knitstudy.figures.style import figure, panel_letter, styled
from knitstudy.measures.catalogue import SQUARES, several
from knitstudy.measures.cost import MEGABYTE, memory_growth
from knitstudy.measures.domain import Series, series_of
from knitstudy.study.scene import Scene

WIDTH, HEIGHT = 170.0, 92.0
"""Of the figure [mm]."""

SHOWN = np.geomspace(3.0, 30.0, 40)
"""Cells in a row between which laws are drawn."""


@FIGURES.add(
    "fig12a_domain_size",
    "Fig. 12a: degrees of freedom and memory against the size of the domain",
    results={"domain": several("simulation", *SQUARES, fewest=12)},
    files=("paper",),
    scenes=True,
)
@styled
def draw(domain: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene], paper: pd.DataFrame) -> Figure:
    """Draw degrees of freedom and growth of memory over the size.

    Parameters
    ----------
    domain : mapping of str to Dataset
        Histories of the series by scene (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by the same names.
    paper : DataFrame
        ``resources/reference/paper_tables.csv``.
    """
    found = series_of(scenes.values())
    drawing = figure(WIDTH, HEIGHT)
    left, right = drawing.subplots(1, 2)
    for series in found:
        dof = np.array([float(domain[scene.name].attrs["dof"]) for scene in series.scenes])
        memory = np.array([memory_growth(domain[scene.name]) for scene in series.scenes]) / MEGABYTE
        unknowns = series.unknowns(dof).at(SHOWN)
        _draw_series(left, series, dof, unknowns)
        _draw_series(right, series, memory, series.memory(dof, memory).at(unknowns))
    for axes, quantity in ((left, "degrees of freedom"), (right, "memory")):
        cells, values = _of_paper(paper, quantity)
        axes.plot(cells, values, "x", color="#8E1B5A", label="paper, contact")
        axes.set_yscale("log")
        draw_cells_axis(axes)
    left.set_ylabel("degrees of freedom")
    right.set_ylabel("memory growth (MB)")
    panel_letter(left, "a")
    panel_letter(right, "b")
    handles, labels = left.get_legend_handles_labels()
    drawing.legend(handles, labels, loc="lower center", ncols=4, fontsize=6.5, handlelength=2.5)
    drawing.subplots_adjust(left=0.09, right=0.985, top=0.93, bottom=0.28, wspace=0.25)
    return drawing


def _draw_series(axes: Axes, series: Series, values: np.ndarray, law: np.ndarray) -> None:
    """Draw values (k,), and the law that they follow at the sizes of `SHOWN`."""
    line = domain_line(series)
    axes.plot(series.cells, values, **line | {"linestyle": "", "markersize": 4.5})
    axes.plot(SHOWN, law, color=line["color"], linestyle=line["linestyle"], linewidth=0.7)


def _of_paper(paper: pd.DataFrame, quantity: str) -> tuple[np.ndarray, np.ndarray]:
    """Return cells in a row (k,) and the paper's values (k,) of Table 3."""
    rows = paper[(paper["table"].astype(str) == "3") & (paper["quantity"] == quantity)]
    return rows["case"].str.extract(r"c(\d+)w")[0].astype(float).to_numpy(), rows["value"].astype(
        float
    ).to_numpy()
