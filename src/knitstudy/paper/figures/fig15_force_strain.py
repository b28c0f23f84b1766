"""Fig. 15: force against strain of the three models and the reference in four cases; their variants."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator

from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import FORCE
from knitstudy.paper.cases import Case, cases_of, label_of
from knitstudy.paper.columns import rows_of
from knitstudy.paper.figures import DIRECT, INTERACTIONS, MODELS
from knitstudy.paper.scene_names import CASES, OTHER_SOLIDS, REDUCED, SOLIDS, network, of_case, solid
from knitstudy.run.catalogue import FIGURES, Datasets, Scenes, several
from knitstudy.use.style import (
    DOUBLE,
    FAINT,
    INK,
    PAPER,
    PERCENT,
    Look,
    Style,
    figure,
    height,
    panel_letter,
    place,
    shared_legend,
)

# Names of the scenes.
SHOWN = [name for case in CASES for name in of_case(case, SOLIDS + OTHER_SOLIDS + REDUCED)]

RESULTS = {
    "every": several("simulation", *SHOWN),
    "dns": solid("simulation", "tie-course"),
    "rom3d": network("rom3d", "tie-course"),
    "rom2d": network("rom2d", "tie-course"),
}

# Above the axes, their height, below them for their labels, and of a line of variants [mm].
HEAD, HEIGHT, FOOT, LINE = 7.0, 48.0, 12.0, 4.6
CUT = 2.5  # an axis is broken where the largest value is more than so many times the second largest
BREAK, BEYOND = 1.3, 0.3  # the break, over the second largest value; share of the height that is beyond it
LINE_OF_TEXT = 3.5  # height [mm]
MAIN = {"dns": "DNS, main", "rom3d": "3D ROM, main", "rom2d": "2D ROM, main"}  # above all variants
# Variants that no study runs, and why: springs along z would have a negative stiffness (table2_springs)
REFUSED = {"3D ROM, springs along x, y, z": "refused: k < 0"}
# Looks of variants
WAYS: dict[str, Style] = {
    "course": {"fmt": "s", "color": INK},
    "wale": {"fmt": "o", "color": "#D9740B", "markerfacecolor": PAPER},
}


@FIGURES.add(
    "fig15_force_strain",
    "Fig. 15: force against strain of the direct simulation and the reduced models",
    results=RESULTS,
    order=1,
)
def draw(every: Datasets, scenes: Scenes, reference: pd.DataFrame, **first: xr.Dataset) -> Figure:
    """Draw a panel for each case that has all three models.

    The models of the first case are asked for by themselves: a study without them has no such figure.
    """
    cases = [case for case in cases_of(rows_of(scenes, every), reference) if len(case.main) == 2]
    rows = -(-len(cases) // 2)
    drawing = figure(DOUBLE, rows * (HEAD + HEIGHT + FOOT))
    for k, case in enumerate(cases):
        row, column = divmod(k, 2)
        bottom = (rows - row) * (HEAD + HEIGHT + FOOT) - HEAD - HEIGHT
        axes = place(drawing, 0.075 + 0.5 * column, bottom, 0.27, HEIGHT)
        main = [(DIRECT, case.dns), *((MODELS[name], case.main[name]) for name in ("rom3d", "rom2d"))]
        curves = [force_curve(look, model.history, case.reference) for look, model in main]
        draw_curves(axes, curves, "reaction force", "N", case.direction, CUT)
        draw_reference(axes, case.reference)
        panel_letter(axes, "abcd"[k], f"{INTERACTIONS[case.interaction].label}, {case.direction} tension")
    return drawing


@FIGURES.add(
    "fig15_variants",
    "Fig. 15, variants: forces on other meshes and of other joints and springs",
    results=RESULTS,
    order=1.5,
)
def draw_variants(every: Datasets, scenes: Scenes, reference: pd.DataFrame, **first: xr.Dataset) -> Figure:
    """Draw forces at full strain over the reference's: a panel for each interaction, a line for each model."""
    cases = [case for case in cases_of(rows_of(scenes, every), reference) if len(case.main) == 2]
    ratios = variants_of(cases)
    names = list(dict.fromkeys([*MAIN.values(), *(name for name, *_ in ratios), *REFUSED]))
    kinds = list(dict.fromkeys(case.interaction for case in cases))
    high = LINE * len(names)
    whole = HEAD + high + 1.6 * FOOT
    drawing = figure(DOUBLE, whole)
    places = [place(drawing, 0.44 + 0.292 * k, 1.6 * FOOT, 0.14, high) for k in range(len(kinds))]
    for axes in places[1:]:
        axes.sharex(places[0])
    for (name, kind, way), ratio in ratios.items():
        look = WAYS[way] | {"label": f"{way} tension", "xerr": ratio.uncertainty}
        axes = places[kinds.index(kind)]
        axes.errorbar(ratio.value, names.index(name), **look)
        _write_beside(axes, names.index(name), f"{ratio.value:#.3g}".rstrip("."), way)
    for letter, kind, axes in zip("ab", kinds, places, strict=False):
        for name in names:
            if not any((name, kind, way) in ratios for way in WAYS):
                _write_beside(axes, names.index(name), _why_not(name, kind))
        axes.axvline(1.0, color=FAINT, linewidth=0.8, zorder=0)
        axes.axhline(len(MAIN) - 0.5, color=INK, linewidth=0.6)
        axes.set(xscale="log", ylim=(len(names) - 0.5, -0.5), yticks=range(len(names)))
        axes.set_yticklabels(names if axes is places[0] else [])
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter("")
        axes.grid(axis="y", linewidth=0.4, color=FAINT, alpha=0.5)
        panel_letter(axes, letter, INTERACTIONS[kind].label)
    quantity = f"force at full strain over the {owners(case.reference for case in cases)} (1)"
    drawing.supxlabel(quantity, x=0.64, y=0.7 * FOOT / whole, fontsize=8.0)
    shared_legend(drawing, ncols=2, bbox_to_anchor=(0.64, 0.0))
    return drawing


def variants_of(cases: Iterable[Case]) -> dict[tuple[str, str, str], Estimate]:
    """Return the forces of all models over the reference's or the DNS's, by name, interaction and direction."""
    ratios = {}
    for case in cases:
        main = {MAIN["dns"]: case.dns} | {MAIN[name]: model for name, model in case.main.items()}
        rest = [model for model in (*case.others, *case.reduced) if model not in main.values()]
        for name, model in [*main.items(), *((label_of(model.scene), model) for model in rest)]:
            ratio = case.ratio(model)
            if not ratio.known:
                ratio = Estimate(float(model.history["force"][-1] / case.dns.history["force"][-1]), 0.0)
            ratios[name, case.interaction, case.direction] = ratio
    return ratios


def _why_not(name: str, interaction: str) -> str:
    """Return why there is no force of a model with an interaction."""
    if "springs" in name and interaction == "tie":
        return "no springs"
    return REFUSED.get(name, "not run")


def _write_beside(axes: Axes, line: int, text: str, way: str = "") -> None:
    """Write a number of a direction to the right of a line, or why there is none."""
    across = {"course": 1.38, "wale": 1.78}.get(way, 1.08)
    look: Style = {"ha": "right", "color": WAYS[way]["color"]} if way else {"ha": "left", "color": FAINT}
    axes.text(across, line, text, transform=axes.get_yaxis_transform(), va="center", **look)


# ---- curves over strain, with name and last value at their ends, and the reference's band ----


@dataclass(frozen=True)
class Curve:
    """A quantity over strain."""

    look: Look
    strain: np.ndarray  # (I,)
    value: np.ndarray  # (I,)
    note: str = ""  # follows the last value


def force_curve(look: Look, history: xr.Dataset, reference: Reference) -> Curve:
    """Return the force of a history; its note is the secant stiffness over the reference's, with the uncertainty."""
    note = f"\n({reference.force_ratio(history)})" if reference.known else ""
    return Curve(look, history["strain"].to_numpy(), history["force"].to_numpy(), note)


def owners(references: Iterable[Reference]) -> str:
    """Return in words whose force others are divided by: the reference's, without one the DNS's, or both."""
    return " or the ".join(
        sorted({"reference's" if reference.known else "DNS's" for reference in references}, reverse=True)
    )


def draw_curves(
    axes: Axes, curves: Sequence[Curve], quantity: str, unit: str, direction: str = "course", cut: float = inf
) -> None:
    """Draw curves over strain in a direction that begin at zero; names and last values stand at their ends.

    Where one curve rises above `cut` times all others the axis is broken above these: its scale is condensed beyond.
    """
    top, *rest = sorted((float(curve.value.max()) for curve in curves), reverse=True)
    second = max(rest, default=top)
    broken = top > cut * second
    limit = (BREAK * second if broken else 1.05 * top) or 1.0
    axes.set(xlabel=f"strain in {direction} direction (%)", ylabel=f"{quantity} ({unit})")
    axes.set(xlim=(0, PERCENT * max(curve.strain.max() for curve in curves)), ylim=(0, limit))
    share = break_axis(axes, limit, 1.05 * top) if broken else partial(np.interp, xp=[0.0, limit], fp=[0, 1])
    # Labels stand apart from each other, and none above the axes.
    line = LINE_OF_TEXT / height(axes)
    highest = 1.0
    for curve in sorted(curves, key=lambda curve: curve.value[-1], reverse=True):
        axes.plot(
            PERCENT * curve.strain, curve.value, clip_on=False, label=curve.look.label, **curve.look.line
        )
        end = f"{f'{curve.value[-1]:#.3g}'.rstrip('.')} {unit.strip('1')}".rstrip()
        # A force over the reference's is the ratio that the note gives with its uncertainty.
        note = curve.note.strip(" ()\n") if curve.note and unit == "1" else f"{end}{curve.note}"
        text = f"{curve.look.label}\n{note}"
        high = 0.5 * line * (1 + text.count("\n"))
        middle = min(share(float(curve.value[-1])), highest - high)
        highest = middle - high
        look: Style = {"va": "center", "color": curve.look.colour, "annotation_clip": False}
        at = (PERCENT * float(curve.strain[-1]), middle)
        offset: Style = {"xytext": (7, 0), "textcoords": "offset points"}
        axes.annotate(text, at, xycoords=("data", "axes fraction"), **offset, **look)


def break_axis(axes: Axes, limit: float, top: float) -> Callable[[float], float]:
    """Let an axis of values end at a top, with a condensed scale beyond a limit; return the share of height of a value.

    The break is marked by a dotted line and two strokes across the axis.
    """
    values = [-limit, 0.0, limit, top, 2 * top - limit]
    shares = [BEYOND - 1, 0.0, 1 - BEYOND, 1.0, 1 + BEYOND]
    share = partial(np.interp, xp=values, fp=shares)
    axes.set_yscale("function", functions=(share, partial(np.interp, xp=shares, fp=values)))
    axes.set_ylim(0, top)
    below = [tick for tick in MaxNLocator(4).tick_values(0, limit) if tick < 0.97 * limit]
    above = [tick for tick in MaxNLocator(2).tick_values(limit, top) if 1.1 * limit < tick <= top]
    axes.set_yticks([*below, *above])
    axes.axhline(limit, color=FAINT, linewidth=0.7, linestyle=":", zorder=0)
    stroke: Style = {"marker": [(-1, -0.5), (1, 0.5)], "markersize": 7, "color": INK, "linestyle": "none"}
    axes.plot([0, 0], [0.99 - BEYOND, 1.01 - BEYOND], transform=axes.transAxes, clip_on=False, **stroke)
    return share


def draw_reference(
    axes: Axes, reference: Reference, unit: float = 1.0, quantity: str = FORCE, colour: str = ""
) -> None:
    """Draw the reference's values over a unit with bars of uncertainty, as far as the axis of strains goes.

    Without a colour of its own there is a band between the bars.
    """
    strain, value, off = reference.curve(axes.get_xlim()[1] / PERCENT, quantity)
    if len(strain) < 2:
        return
    value, off = value / unit, off / unit
    if not colour:
        axes.fill_between(PERCENT * strain, value - off, value + off, color=FAINT, alpha=0.6, linewidth=0)
    look: Style = {"fmt": "s", "color": colour or INK, "markersize": 3.0, "markerfacecolor": "white"}
    look |= {"capsize": 2.5, "linewidth": 0.8, "label": "reference", "zorder": 3, "clip_on": False}
    drawn = axes.errorbar(PERCENT * strain[1:], value[1:], off[1:], **look)
    axes.legend(handles=[drawn], loc="lower right", handlelength=1.0)  # curves have labels where they end
