"""What accuracy costs: errors over seconds of all models on the knits of a sample, and what is promised of them."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from knitstudy.figures.style import DOUBLE, FAINT, YARNS, figure, place, shared_legend, styled

ERROR, SECONDS = "error [1]", "seconds [s]"

LEAST, MOST = 1e-4, 10.0  # Errors that are drawn; what failed stands at the upper edge

QUESTIONS = {
    "force": "force",
    "out_of_plane": "out-of-plane motion",
    "contact": "contact force and slip",
    "stress": "normal stress",
}

HIGH, GAP, FOOT, HEAD = 34.0, 5.0, 26.0, 6.0  # of a row, between rows, below and above them [mm]


@styled
def draw(table: pd.DataFrame, bounds: pd.DataFrame) -> Figure:
    """Draw a panel a case and question: dots are knits, large marks are medians of seconds and promised errors.

    Parameters
    ----------
    table : DataFrame
        Errors and prices of knits (``resources/trade.csv``).
    bounds : DataFrame
        With the columns ``case``, ``question``, ``rung``, the promised ``error [1]`` and the median ``seconds [s]``.
    """
    table = table.dropna(subset=ERROR)
    cases, rungs = list(dict.fromkeys(table["case"])), list(dict.fromkeys(table["rung"]))
    colours = dict(zip(rungs, (*YARNS, "#56B4E9", "#7B3294", "#1A1A1A", "#8C8C8C", "#8E1B5A"), strict=False))
    page = figure(DOUBLE, HEAD + FOOT + len(cases) * (HIGH + GAP))
    for row, case in enumerate(cases):
        for column, (question, words) in enumerate(QUESTIONS.items()):
            bottom = FOOT + (len(cases) - 1 - row) * (HIGH + GAP)
            axes = place(page, 0.08 + 0.235 * column, bottom, 0.20, HIGH)
            for rung, colour in colours.items():
                here = _rows(table, case, question, rung)
                errors = here[ERROR].clip(LEAST, MOST)
                axes.scatter(here[SECONDS].fillna(1200), errors, s=4, color=colour, alpha=0.5, linewidths=0)
                bound = _rows(bounds, case, question, rung)
                bound = bound[np.isfinite(bound[ERROR])]
                look = {"s": 26, "marker": "D", "edgecolors": "white", "linewidths": 0.6, "color": colour}
                axes.scatter(bound[SECONDS], bound[ERROR].clip(LEAST, MOST), **look, label=rung, zorder=3)
            axes.set(xscale="log", yscale="log", xlim=(0.05, 2000), ylim=(LEAST, 1.3 * MOST))
            axes.axhline(MOST, color=FAINT, linewidth=0.4)
            if row == 0:
                axes.set_title(words, fontsize=8)
            if column == 0:
                axes.set_ylabel(f"{case.replace('-', ' ')}\nerror")
            if row == len(cases) - 1:
                axes.set_xlabel("processor time [s]")
    shared_legend(page, ncols=5)
    return page


def _rows(table: pd.DataFrame, case: str, question: str, rung: str) -> pd.DataFrame:
    found = (table["case"] == case) & (table["question"] == question) & (table["rung"] == rung)
    return table[found]
