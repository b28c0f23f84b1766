"""Fig. 12a: degrees of freedom and memory of square knits against the number of cells in a row."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.cells_axis import draw_cells_axis
from knitstudy.figures.style import MODELS, OTHER, Look, figure, panel_letter, styled
from knitstudy.measures.cost import MEGABYTE, memory_growth
from knitstudy.measures.discretisation import SOLID_YARNS, discretisation, is_direct
from knitstudy.measures.domain import Series, series_of
from knitstudy.study.scene import Scene

WIDTH, HEIGHT = 170.0, 92.0
"""Of the figure [mm]."""

SHOWN = np.array([3.0, 30.0])
"""Cells in a row between which laws are drawn."""

YARNS = Look(SOLID_YARNS, "#0072B2", "-", "D")


@FIGURES.add(
    "fig12a_domain_size",
    "Fig. 12a: degrees of freedom and memory against the size of the domain",
    needs=("domain", "scenes", "paper"),
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
    _panel(left, found, lambda scene: float(domain[scene.name].attrs["dof"]))
    _panel(right, found, lambda scene: memory_growth(domain[scene.name]) / MEGABYTE)
    for axes, quantity in ((left, "degrees of freedom"), (right, "memory")):
        cells, values = _of_paper(paper, quantity)
        axes.plot(cells, values, "x", color="#8E1B5A", label="paper, contact")
    left.set_ylabel("degrees of freedom")
    right.set_ylabel("memory growth (MB)")
    panel_letter(left, "a")
    panel_letter(right, "b")
    handles, labels = left.get_legend_handles_labels()
    drawing.legend(handles, labels, loc="lower center", ncols=4, fontsize=6.5, handlelength=2.5)
    drawing.subplots_adjust(left=0.09, right=0.985, top=0.93, bottom=0.28, wspace=0.25)
    return drawing


def _panel(axes: Axes, found: list[Series], value: Callable[[Scene], float]) -> None:
    for series in found:
        look, slides = _look(series.scenes[0]), series.scenes[0].interaction != "tie"
        values = np.array([value(scene) for scene in series.scenes])
        fill = "white" if slides else look.colour
        text = f"{look.label}, {'friction' if slides else 'ties'}"
        axes.plot(
            series.cells,
            values,
            look.marker,
            color=look.colour,
            markerfacecolor=fill,
            label=text,
            markersize=4.5,
        )
        law = series.growth(values)
        axes.plot(SHOWN, law.at(SHOWN), "--" if slides else "-", color=look.colour, linewidth=0.7, marker="")
    axes.set_yscale("log")
    draw_cells_axis(axes)


def _look(scene: Scene) -> Look:
    if is_direct(scene):
        return YARNS if discretisation(scene) == SOLID_YARNS else replace(MODELS["dns"], label="hexahedra")
    return MODELS.get(scene.fidelity, OTHER)


def _of_paper(paper: pd.DataFrame, quantity: str) -> tuple[np.ndarray, np.ndarray]:
    """Return cells in a row (k,) and the paper's values (k,) of Table 3."""
    rows = paper[(paper["table"].astype(str) == "3") & (paper["quantity"] == quantity)]
    return rows["case"].str.extract(r"c(\d+)w")[0].astype(float).to_numpy(), rows["value"].astype(
        float
    ).to_numpy()
