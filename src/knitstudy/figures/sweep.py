"""Curves over course spacing or yarn diameter, one a reading of what is held fixed, and loops that cannot be made."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.curves import WIDTH
from knitstudy.figures.style import INK, figure
from knitstudy.measures.discretisation import INTERACTIONS, SOLID_YARNS
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.sweeps import HELD, Point, Sweep

LINE = 3.6
"""A line of the legend [mm]."""

COLOURS = {"wale_spacing": INK, "length": "#0072B2", "shape": "#D9740B"}
"""By what is held fixed."""

LOOKS = {"isotropic": ("-", "o"), "tie": ("--", "s")}
"""Dash and marker by interaction."""

CHECKS = {True: "D", False: "^"}
"""Marker of other discretisations: whether of solid yarns."""

PANEL, HEAD, FOOT, BETWEEN, LEFT, RIGHT = 52.0, 3.0, 12.0, 13.0, 15.0, 3.0
"""Heights of a panel, of what is above and below all, and between two; and what is beside them [mm]."""


def draw_sweep(
    series: Sequence[Sweep], loops: pd.DataFrame | None, label: str, scale: Callable[[Point], float]
) -> Figure:
    """Return a figure of the largest |u_z| and of its share of the diameter.

    Parameters
    ----------
    series : sequence of Series
    loops : DataFrame or None
        Swept values on the axis, ``at``, of loops that cannot be made, with what is ``held fixed``.
    label : str
        Of the swept value.
    scale : callable
        Swept value of a point on the axis.
    """
    labels = {_label(each) for each in series} | set([] if loops is None else loops["held fixed"])
    foot = FOOT + LINE * ((len(labels) + 1) // 2 + 1)
    height = HEAD + 2 * PANEL + BETWEEN + foot
    drawing = figure(WIDTH, height)
    width = (WIDTH - LEFT - RIGHT) / WIDTH
    bottoms = (foot + PANEL + BETWEEN, foot)
    panels = [drawing.add_axes((LEFT / WIDTH, bottom / height, width, PANEL / height)) for bottom in bottoms]
    quantities = (
        ("largest $|u_z|$ (mm)", lambda point: point.u_z.of(lambda value: 1e3 * value)),
        ("largest $|u_z|$ over diameter", lambda point: point.over_diameter),
    )
    for axes, (name, quantity) in zip(panels, quantities, strict=True):
        for each in series:
            _draw_series(axes, each, scale, quantity)
        axes.set(xlabel=label, ylabel=name)
        axes.set_ylim(0, None)
        if loops is not None:
            _draw_refused(axes, loops)
    handles, names = panels[0].get_legend_handles_labels()
    unique = dict(zip(names, handles, strict=True))
    drawing.legend(
        unique.values(),
        unique.keys(),
        loc="lower left",
        ncols=2,
        fontsize=6.0,
        borderaxespad=0.4,
        handlelength=3.0,
    )
    return drawing


def _draw_series(
    axes: Axes, series: Sweep, scale: Callable[[Point], float], quantity: Callable[[Point], Estimate]
) -> None:
    dash, marker = LOOKS[series.interaction]
    at = np.array([scale(point) for point in series.points])
    found = [quantity(point) for point in series.points]
    axes.errorbar(
        at,
        [each.value for each in found],
        np.nan_to_num([each.uncertainty for each in found]),
        color=COLOURS[series.keep],
        linestyle=dash if series.main else "none",
        marker=marker if series.main else CHECKS[series.made_of.startswith(SOLID_YARNS)],
        markersize=3.5 if series.main else 5.0,
        markerfacecolor=COLOURS[series.keep] if series.main else "none",
        linewidth=1.2,
        elinewidth=0.6,
        capsize=1.8,
        label=_label(series),
        clip_on=False,
    )


def _label(series: Sweep) -> str:
    return f"{HELD[series.keep]}, {INTERACTIONS[series.interaction]}" if series.main else series.made_of


def _draw_refused(axes: Axes, loops: pd.DataFrame) -> None:
    """Mark loops that cannot be made along the foot of the axes, a line a reading."""
    for line, (keep, of) in enumerate(loops.groupby("held fixed", sort=False)):
        axes.plot(
            of["at"],
            np.full(len(of), 0.03 + 0.05 * line),
            transform=axes.get_xaxis_transform(),
            color=COLOURS[keep],
            linestyle="none",
            marker="x",
            markersize=4.0,
            label=f"{HELD[keep]}: no such loop",
        )
