"""Fig. 15: force against strain of the three models and the reference in four cases; their variants."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import Reference
from knitstudy.paper.cases import cases_of, label_of
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
CUT = 1.6  # an axis ends at so much of the second largest value where the largest one lies beyond
LINE_OF_TEXT = 3.5  # height [mm]
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
    others = [
        (case, model)
        for case in cases
        for model in (*case.others, *case.reduced)
        if model not in (case.dns, *case.main.values())
    ]
    names = list(dict.fromkeys(label_of(model.scene) for _, model in others))
    kinds = list(dict.fromkeys(case.interaction for case in cases))
    high = LINE * max(len(names), 1)
    whole = HEAD + high + 1.6 * FOOT
    drawing = figure(DOUBLE, whole)
    places = [place(drawing, 0.45 + 0.28 * k, 1.6 * FOOT, 0.26, high) for k in range(len(kinds))]
    for axes in places[1:]:
        axes.sharex(places[0])
    for case, model in others:
        ratio = case.ratio(model)
        if not ratio.known:
            ratio = Estimate(float(model.history["force"][-1] / case.dns.history["force"][-1]), 0.0)
        look = WAYS[case.direction] | {"label": f"{case.direction} tension", "xerr": ratio.uncertainty}
        places[kinds.index(case.interaction)].errorbar(
            ratio.value, names.index(label_of(model.scene)), **look
        )
    for letter, kind, axes in zip("ab", kinds, places, strict=False):
        axes.axvline(1.0, color=FAINT, linewidth=0.8, zorder=0)
        axes.set(xscale="log", ylim=(len(names) - 0.5, -0.5), yticks=range(len(names)))
        axes.set_yticklabels(names if axes is places[0] else [])
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter("")
        axes.grid(axis="y", linewidth=0.4, color=FAINT, alpha=0.5)
        panel_letter(axes, letter, INTERACTIONS[kind].label)
    quantity = f"force at full strain over the {owners(case.reference for case in cases)} (1)"
    drawing.supxlabel(quantity, x=0.71, y=0.7 * FOOT / whole, fontsize=8.0)
    shared_legend(drawing, ncols=2, bbox_to_anchor=(0.71, 0.0))
    return drawing


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

    Where one curve rises above `cut` times all others the axis ends there.
    """
    top, *rest = sorted((float(curve.value.max()) for curve in curves), reverse=True)
    limit = min(1.05 * top, cut * max(rest, default=top)) or 1.0
    axes.set(xlabel=f"strain in {direction} direction (%)", ylabel=f"{quantity} ({unit})")
    axes.set(xlim=(0, PERCENT * max(curve.strain.max() for curve in curves)), ylim=(0, limit))
    line = LINE_OF_TEXT * limit / height(axes)
    # Labels stand apart from each other, and none above the axes.
    highest = limit
    for curve in sorted(curves, key=lambda curve: curve.value[-1], reverse=True):
        beyond = curve.value.max() > limit
        axes.plot(
            PERCENT * curve.strain, curve.value, clip_on=beyond, label=curve.look.label, **curve.look.line
        )
        end = f"{'↑ ' if beyond else ''}{f'{curve.value[-1]:#.3g}'.rstrip('.')} {unit.strip('1')}".rstrip()
        # A force over the reference's is the ratio that the note gives with its uncertainty.
        note = curve.note.strip(" ()\n") if curve.note and unit == "1" else f"{end}{curve.note}"
        text = f"{curve.look.label}\n{note}"
        high = 0.5 * line * (1 + text.count("\n"))
        middle = min(float(curve.value[-1]), highest - high)
        highest = middle - high
        look: Style = {"va": "center", "color": curve.look.colour, "annotation_clip": False}
        at = (PERCENT * float(curve.strain[-1]), middle)
        axes.annotate(text, at, xytext=(7, 0), textcoords="offset points", **look)


def draw_reference(axes: Axes, reference: Reference, unit: float = 1.0) -> None:
    """Draw the reference's forces over a unit [N], and the band of uncertainty, as far as the axis of strains goes."""
    strain, force, off = reference.curve(axes.get_xlim()[1] / PERCENT)
    if len(strain) < 2:
        return
    force, off = force / unit, off / unit
    axes.fill_between(PERCENT * strain, force - off, force + off, color=FAINT, alpha=0.6, linewidth=0)
    look: Style = {"fmt": "s", "color": INK, "markersize": 3.0, "markerfacecolor": "white", "capsize": 2.5}
    look |= {"linewidth": 0.8, "label": "reference", "zorder": 3, "clip_on": False}
    drawn = axes.errorbar(PERCENT * strain[1:], force[1:], off[1:], **look)
    axes.legend(handles=[drawn], loc="lower right", handlelength=1.0)  # curves have labels where they end
