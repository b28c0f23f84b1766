"""Where models work and where they refuse: one square for every scene of the campaign `extremes`."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from knitstudy.figures.style import DOUBLE, FAINT, INK, figure, place, shared_legend, styled

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

ROW, HEAD, FOOT = 3.6, 11.0, 20.0  # heights of a row, the head above and the legend below [mm]


@styled
def draw(table: pd.DataFrame) -> Figure:
    """Draw the map.

    Parameters
    ----------
    table : DataFrame
        With the columns ``group``, ``model``, ``number`` (from 1 on, in its group) and ``cause``, one of `CAUSES`.
    """
    (y, groups), (model, models) = (pd.factorize(table[name]) for name in ("group", "model"))
    high = ROW * len(groups)
    page = figure(DOUBLE, HEAD + FOOT + high)
    axes = place(page, 0.3, FOOT, 0.69, high)
    widest = int(table["number"].max()) + 1
    x = widest * model + table["number"]
    for cause, (label, colour) in CAUSES.items():
        here = table["cause"] == cause
        look = {"s": 14.0, "marker": "s", "linewidths": 0, "color": colour}
        axes.scatter(x[here], y[here], **look, label=f"{label} ({here.sum()})")
    starts = widest * np.arange(len(models)) + 0.1
    axes.vlines(starts[1:], -0.6, len(groups) - 0.4, color=FAINT, linewidth=0.3)
    axes.set(xlim=(0.1, widest * len(models) + 0.1), ylim=(len(groups) - 0.4, -0.6))
    axes.set_yticks(range(len(groups)), groups)
    axes.set_xticks(starts + 0.5 * widest, [name.replace("-", "\n") for name in models])
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    shared_legend(page, ncols=3, labelcolor=INK, handletextpad=0.3)
    return page
