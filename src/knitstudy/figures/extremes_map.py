"""Where models work and where they refuse: one square for every scene of the campaign `extremes`."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from knitstudy.figures.style import DOUBLE, FAINT, INK, figure, styled

CAUSES = {
    "ended": ("ended within its gates", "#C9DDEB"),
    "bounds": ("refused: bounds of a key", "#BDBDBD"),
    "keys": ("refused: keys that contradict each other", "#7F7F7F"),
    "loop": ("refused: no such loop or mesh", "#E69F00"),
    "gate": ("stopped by a gate", "#D55E00"),
    "balance": ("stopped: no equilibrium found", "#8E1B5A"),
    "time": ("beyond its processor time", "#56B4E9"),
    "silent": ("silent failure", "#000000"),
}
"""Label and colour of every way in which a scene may end."""

ROW, HEAD, FOOT = 3.6, 11.0, 20.0
"""Heights of a row, of the head above the rows and of the legend below them [mm]."""

MARK = 14.0
"""Area of a square [points squared]."""


@styled
def draw(table: pd.DataFrame) -> Figure:
    """Draw the map.

    Parameters
    ----------
    table : DataFrame
        With the columns ``group``, ``model``, ``number`` (from 1 on, in its group) and ``cause``, one of `CAUSES`.
    """
    groups, models = list(dict.fromkeys(table["group"])), list(dict.fromkeys(table["model"]))
    page = figure(DOUBLE, HEAD + FOOT + ROW * len(groups))
    axes = page.add_axes((0.3, FOOT / _height(page), 0.69, 1 - (HEAD + FOOT) / _height(page)))
    widest = int(table["number"].max()) + 1
    x = widest * table["model"].map(models.index) + table["number"]
    y = table["group"].map(groups.index)
    colours = [CAUSES[cause][1] for cause in table["cause"]]
    axes.scatter(x, y, s=MARK, c=colours, marker="s", linewidths=0)
    for place in range(1, len(models)):
        axes.axvline(widest * place + 0.1, color=FAINT, linewidth=0.3)
    axes.set_ylim(len(groups) - 0.4, -0.6)
    axes.set_xlim(0.1, widest * len(models) + 0.1)
    axes.set_yticks(range(len(groups)), groups)
    axes.set_xticks(
        widest * np.arange(len(models)) + 0.5 * (widest + 0.1), [name.replace("-", "\n") for name in models]
    )
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)
    counts = table["cause"].value_counts()
    handles = [
        Line2D([], [], linestyle="", marker="s", color=colour, label=f"{label} ({counts.get(cause, 0)})")
        for cause, (label, colour) in CAUSES.items()
    ]
    page.legend(handles=handles, loc="lower center", ncols=3, labelcolor=INK, handletextpad=0.3)
    return page


def _height(page: Figure) -> float:
    """Return the height of a page [mm]."""
    return 25.4 * page.get_figheight()
