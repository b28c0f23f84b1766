"""Fig. 15: force against strain of the three models and their variants, and the reference, in four cases."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.style import (
    DIRECT,
    DOUBLE,
    FAINT,
    INK,
    MODELS,
    PERCENT,
    Look,
    figure,
    panel_letter,
    place,
    tint,
)
from knitstudy.measures.cases import Case, cases_of
from knitstudy.measures.catalogue import (
    CASES,
    OTHER_SOLIDS,
    REDUCED,
    SOLIDS,
    network,
    of_case,
    several,
    solid,
)
from knitstudy.measures.discretisation import INTERACTIONS, is_direct
from knitstudy.measures.reference import Reference
from knitstudy.study.scene import Scene

# Dashes of the variants of one model, in their order; further variants are lighter.
DASHES = ((0, (1, 1.2)), (0, (4, 1.5)), (0, (6, 1.5, 1, 1.5)), (0, (2, 2.5)), (0, (3, 1, 1, 1, 1, 1)))
SHARES = (1.0, 0.5)  # shares of a model's colour, for variants whose dashes are the same

# Names of the scenes.
SHOWN = [name for case in CASES for name in of_case(case, SOLIDS + OTHER_SOLIDS + REDUCED)]

# Above the axes, their height, below them for their labels, and of a line of the legend [mm].
HEAD, HEIGHT, FOOT, LINE = 7.0, 60.0, 11.0, 3.4
BESIDE = {"loc": "upper left", "fontsize": 6.0, "handlelength": 3.0, "columnspacing": 1.0, "borderaxespad": 0}
LINE_OF_TEXT = 0.055  # height of a line of text over the height of the axes


@FIGURES.add(
    "fig15_force_strain",
    "Fig. 15: force against strain of the direct simulation and the reduced models",
    results={
        "every": several("simulation", *SHOWN),
        "dns": solid("simulation", "tie-course"),
        "rom3d": network("rom3d", "tie-course"),
        "rom2d": network("rom2d", "tie-course"),
    },
    order=1,
)
def draw(
    every: Mapping[str, xr.Dataset],
    scenes: Mapping[str, Scene],
    reference: pd.DataFrame,
    **first: xr.Dataset,
) -> Figure:
    """Draw a panel for each case that has all three models; legends give secant stiffnesses over the reference's.

    The models of the first case are asked for by themselves: a study without them has no such figure.
    """
    cases = [case for case in cases_of(every, scenes, reference) if len(case.main) == 2]
    curves = [_curves(case) for case in cases]
    rows = range(0, len(cases), 2)
    lines = [2 + max(map(len, curves[first : first + 2])) for first in rows]
    heights = [HEAD + HEIGHT + FOOT + LINE * count for count in lines]
    drawing = figure(DOUBLE, sum(heights))
    for k, case in enumerate(cases):
        row, column = divmod(k, 2)
        bottom = sum(heights[row:]) - HEAD - HEIGHT
        axes = place(drawing, 0.075 + 0.5 * column, bottom, 0.35, HEIGHT)
        draw_reference(axes, case.reference)
        draw_curves(axes, curves[k], "reaction force", "N", case.direction)
        panel_letter(axes, "abcd"[k], f"{INTERACTIONS[case.interaction]}, {case.direction} tension")
        axes.legend(**BESIDE, bbox_to_anchor=(-0.19, -FOOT / HEIGHT))
    return drawing


def _curves(case: Case) -> list[Curve]:
    """Return the curves of the main models, and thin ones in the same colours of their variants."""
    main = [(DIRECT, case.dns), *((MODELS[fidelity], case.main[fidelity]) for fidelity in ("rom3d", "rom2d"))]
    curves = [force_curve(look, model.history, case.reference) for look, model in main]
    names = {model.scene.name for _, model in main}
    drawn: Counter[str] = Counter()
    for model in (*case.others, *case.reduced):
        if model.scene.name in names:
            continue
        look = DIRECT if is_direct(model.scene) else MODELS[model.scene.fidelity]
        lighter, dash = divmod(drawn[look.label], len(DASHES))
        colour = tint(look.colour, SHARES[lighter % len(SHARES)])
        variant = Look(model.label, colour, DASHES[dash], "")
        curves.append(force_curve(variant, model.history, case.reference, named=False))
        drawn[look.label] += 1
    return curves


# ---- curves over strain, with the value at the end of a curve beside it, and the reference's band ----


@dataclass(frozen=True)
class Curve:
    """A quantity over strain, drawn thin if its look has no marker."""

    look: Look
    strain: np.ndarray  # (I,)
    value: np.ndarray  # (I,)
    named: bool = True  # whether the last value stands beside the end


def force_curve(look: Look, history: xr.Dataset, reference: Reference, named: bool = True) -> Curve:
    """Return the force of a history, named with its secant stiffness over the reference's and the uncertainty."""
    look = replace(look, label=f"{look.label} ({reference.force_ratio(history)})")
    return Curve(look, history["strain"].to_numpy(), history["force"].to_numpy(), named)


def draw_curves(
    axes: Axes, curves: Sequence[Curve], quantity: str, unit: str, direction: str = "course"
) -> None:
    """Draw curves over strain in a direction that begin at zero, without a legend."""
    for curve in curves:
        look = curve.look.line | {"label": curve.look.label, "linewidth": 1.4 if curve.look.marker else 0.9}
        zorder = 2 if curve.named else 1.5
        axes.plot(PERCENT * curve.strain, curve.value, zorder=zorder, clip_on=False, **look)
    axes.set(xlabel=f"strain in {direction} direction (%)", ylabel=f"{quantity} ({unit})")
    axes.set(xlim=(0, PERCENT * max(curve.strain.max() for curve in curves)), ylim=(0, None))
    # The last values stand beside the ends of the curves, apart from each other.
    apart, lowest = LINE_OF_TEXT * axes.get_ylim()[1], -np.inf
    for curve in sorted((curve for curve in curves if curve.named), key=lambda curve: curve.value[-1]):
        lowest = max(float(curve.value[-1]), lowest + apart)
        look = {"va": "center", "color": curve.look.colour, "annotation_clip": False}
        text, at = f"{float(curve.value[-1]):.3g} {unit}", (PERCENT * float(curve.strain[-1]), lowest)
        axes.annotate(text, at, xytext=(7, 0), textcoords="offset points", **look)


def draw_reference(axes: Axes, reference: Reference) -> None:
    """Draw the reference's forces with their uncertainties, and the band between them; nothing where it has none."""
    if not reference.known:
        return
    strain, force, off = reference.curve()
    axes.fill_between(PERCENT * strain, force - off, force + off, color=FAINT, alpha=0.6, linewidth=0)
    look = {"color": INK, "linestyle": "none", "marker": "s", "markersize": 3.0, "markerfacecolor": "white"}
    look |= {"capsize": 2.5, "linewidth": 0.8, "label": "reference", "zorder": 3, "clip_on": False}
    axes.errorbar(PERCENT * strain[1:], force[1:], off[1:], **look)
