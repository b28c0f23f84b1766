"""Accuracy and cost: error against time of every model and setting, with the front of each case (docs/accuracy.md)."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import fill

import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.style import DOUBLE, FAINT, INK, MODELS, figure, panel_letter, shared_legend
from knitstudy.measures.catalogue import is_whole_knit, several
from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.measures.questions import QUESTIONS
from knitstudy.measures.trade import points_of
from knitstudy.measures.trade_points import Point
from knitstudy.study.choice import front
from knitstudy.study.scene import Scene

# Interaction and direction of the panels, of knits of `CELLS`.
SHOWN = (("tie", "course"), ("tie", "wale"), ("isotropic", "course"), ("isotropic", "wale"))
CELLS = 3
LETTERS = 80  # of a name on a line: what a panel is wide enough for
SMALLEST = 1e-3  # error below which points lie on the lower edge [1]
BETWEEN = (1.0, 2.0, 5.0)  # numbers on an axis, times powers of ten
WIDE = 200.0  # largest over smallest value of an axis from which powers of ten are enough


def draw_fronts(points: list[Point]) -> Figure:
    """Draw points of one question, a panel a case, each with its front, whose points are named."""
    drawing = figure(DOUBLE, 190.0)
    panels = drawing.subplots(2, 2).ravel()
    for letter, axes, (interaction, direction) in zip("abcd", panels, SHOWN, strict=True):
        here = [
            point
            for point in points
            if point.interaction == interaction
            and point.scene.load.direction == direction
            and point.scene.pattern.loops == CELLS
        ]
        _panel(axes, here)
        panel_letter(axes, letter, f"{INTERACTIONS[interaction]}, {direction}")
    shared_legend(drawing, ncols=1 + len({point.scene.fidelity for point in points}), fontsize=6.5)
    drawing.subplots_adjust(left=0.095, right=0.985, top=0.96, bottom=0.1, wspace=0.24, hspace=0.24)
    return drawing


def _panel(axes: Axes, points: list[Point]) -> None:
    axes.set(
        xscale="log", yscale="log", xlabel="time of the simulation and of its sources (s)", ylabel="error (%)"
    )
    for point in points:
        look = MODELS[point.scene.fidelity]
        share = max(point.error.value, SMALLEST)
        dot = {"linestyle": "", "marker": look.marker, "markersize": 3, "label": look.label}
        axes.plot(point.expense.seconds, 100 * share, **dot, color=look.colour, alpha=0.6)
        bar = [100 * share, 100 * max(point.bound, SMALLEST)]
        axes.plot([point.expense.seconds] * 2, bar, color=look.colour, linewidth=0.4, alpha=0.6)
    on = front(points, lambda point: point.expense.seconds, lambda point: point.bound)
    if not on:
        axes.text(0.5, 0.5, "nothing measured", transform=axes.transAxes, ha="center", color=FAINT)
        axes.tick_params(which="both", length=0, labelleft=False, labelbottom=False)
        return
    seconds, errors = [point.expense.seconds for point in on], [100 * point.bound for point in on]
    last = 2 * max(point.expense.seconds for point in points)
    line = {"color": INK, "linewidth": 0.8, "label": "front: error at most"}
    axes.step([*seconds, last], [*errors, errors[-1]], where="post", **line)
    axes.plot(seconds, errors, "o", markerfacecolor="none", color=INK, markersize=5, linestyle="")
    for number, (x, y) in enumerate(zip(seconds, errors, strict=True), start=1):
        axes.annotate(str(number), (x, y), xytext=(4, 3), textcoords="offset points", fontsize=6.5)
    said = "\n".join(fill(f"{number} {point.called}", LETTERS) for number, point in enumerate(on, start=1))
    look = {"ha": "right", "va": "top", "fontsize": 4.6, "linespacing": 1.25}
    axes.text(0.985, 0.985, said, transform=axes.transAxes, **look)
    axes.set_ylim(top=axes.get_ylim()[1] * 10 ** (0.12 * (1 + said.count("\n"))))
    for axis in (axes.xaxis, axes.yaxis):
        low, high = axis.get_view_interval()
        axis.set_major_locator(LogLocator(subs=BETWEEN if high < WIDE * low else (1.0,), numticks=12))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter("")


for _number, _question in enumerate(QUESTIONS.values()):

    @FIGURES.add(
        f"fig_trade_{_question.name}",
        f"What accuracy costs: {_question.words}",
        results={
            "every": several("simulation", "*", where=is_whole_knit),
            "every_contacts": several("contacts", "*", where=is_whole_knit),
        },
        order=90 + _number,
    )
    def draw(
        every: Mapping[str, xr.Dataset],
        every_contacts: Mapping[str, xr.Dataset],
        scenes: Mapping[str, Scene],
        reference: pd.DataFrame,
        name: str = _question.name,
    ) -> Figure:
        """Draw the fronts of a question."""
        points = points_of(every, every_contacts, scenes, reference)
        return draw_fronts([point for point in points if point.question.name == name])
