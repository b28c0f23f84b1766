"""What accuracy costs: errors over seconds of all models on the knits of a sample, and what is promised of them."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from knitstudy.figures.style import DOUBLE, YARNS, figure, place, shared_legend, styled
from knitstudy.measures.questions import QUESTIONS
from knitstudy.study.choice import ERROR, SECONDS

COLOURS = (*YARNS, "#56B4E9", "#7B3294", "#1A1A1A", "#8C8C8C", "#8E1B5A")  # of rungs

ENDS = (1e-4, 20.0)  # Errors that are drawn
FAILED = (1200.0, 10.0)  # Seconds and error where failed runs stand

HIGH, GAP, FOOT, HEAD = 34.0, 5.0, 26.0, 6.0  # of a row, between rows, below and above them [mm]


@styled
def draw(table: pd.DataFrame, bounds: pd.DataFrame) -> Figure:
    """Draw a panel a case and question: dots are knits, large marks are median seconds and promised errors.

    Parameters
    ----------
    table : DataFrame
        Errors and prices of knits (``resources/trade.csv``).
    bounds : DataFrame
        What is promised of every rung (`knitstudy.stages.trade.bounds`).
    """
    table = table.dropna(subset=[ERROR])
    cases, rungs = list(dict.fromkeys(table["case"])), list(dict.fromkeys(table["rung"]))
    page = figure(DOUBLE, HEAD + FOOT + len(cases) * (HIGH + GAP))
    for number, case in enumerate(reversed(cases)):
        for column, question in enumerate(QUESTIONS.values()):
            if table.query(f"case == {case!r} and question == {question.name!r}").empty:
                continue
            axes = place(page, 0.11 + 0.225 * column, FOOT + number * (HIGH + GAP), 0.205, HIGH)
            axes.tick_params(labelleft=column == 0, labelbottom=number == 0)
            axes.set(xscale="log", yscale="log", xlim=(0.03, 2000), ylim=ENDS)
            for rung, colour in zip(rungs, COLOURS, strict=False):
                which = f"case == {case!r} and question == {question.name!r} and rung == {rung!r}"
                knits, bound = table.query(which), bounds.query(which)
                of_knits = {"s": 5, "alpha": 0.5, "linewidths": 0}
                seconds, errors = knits[SECONDS].fillna(FAILED[0]), knits[ERROR].clip(ENDS[0], FAILED[1])
                axes.scatter(seconds, errors, color=colour, **of_knits)
                of_rung = {"s": 26, "marker": "D", "edgecolors": "white", "linewidths": 0.6, "zorder": 3}
                axes.scatter(bound[SECONDS], bound[ERROR], color=colour, label=rung, **of_rung)
            axes.set_title(question.words if number == len(cases) - 1 else "", fontsize=8)
            axes.set_ylabel("" if column else f"{case.replace('-', ' ')}\nerror [1]")
            axes.set_xlabel("" if number else "processor time [s]")
    shared_legend(page, ncols=5)
    return page
