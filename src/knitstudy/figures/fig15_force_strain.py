"""Fig. 15: force against strain of the three models and their variants, and the reference, in four cases."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.curves import Curve, draw_curves, draw_reference, force_curve, legend_beside
from knitstudy.figures.style import DIRECT, DOUBLE, INCH, MODELS, Look, figure, panel_letter, tint
from knitstudy.measures.cases import Case, Simulation, cases_of
from knitstudy.measures.catalogue import (
    CASES,
    OTHER_SOLIDS,
    SOLIDS,
    network,
    of_case,
    reduced_models,
    several,
    solid,
)
from knitstudy.measures.discretisation import INTERACTIONS, is_direct
from knitstudy.study.scene import Scene

DASHES = ((0, (1, 1.2)), (0, (4, 1.5)), (0, (6, 1.5, 1, 1.5)), (0, (2, 2.5)), (0, (3, 1, 1, 1, 1, 1)))
"""Dashes of the variants of one model, in their order; further variants are lighter."""

SHARES = (1.0, 0.5)  # shares of a model's colour, for variants whose dashes are the same

SHOWN = [name for case in CASES for name in (*of_case(case, SOLIDS + OTHER_SOLIDS), *reduced_models(case))]
"""Names of the scenes."""

HEAD, HEIGHT, FOOT, BETWEEN = 7.0, 60.0, 11.0, 4.0
"""Above the axes, their height, below them for their labels, and below the legend [mm]."""


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
    drawing = figure(DOUBLE, 2 * HEIGHT)
    cases = [case for case in cases_of(every, scenes, reference) if len(case.main) == 2]
    panels = [_draw_case(drawing, case, "abcd"[k]) for k, case in enumerate(cases)]
    rows = [panels[k : k + 2] for k in range(0, len(panels), 2)]
    heights = [HEAD + HEIGHT + FOOT + max(legend for _, legend in row) + BETWEEN for row in rows]
    whole = sum(heights)
    drawing.set_size_inches(DOUBLE / INCH, whole / INCH)
    for k, row in enumerate(rows):
        bottom = whole - sum(heights[:k]) - HEAD - HEIGHT
        for column, (axes, _) in enumerate(row):
            axes.set_position((0.075 + 0.5 * column, bottom / whole, 0.35, HEIGHT / whole))
    return drawing


def _draw_case(drawing: Figure, case: Case, letter: str) -> tuple[Axes, float]:
    """Draw a case into axes of the right size; return the axes and the height of the legend below them [mm]."""
    axes = drawing.add_axes((0.075, 0.25, 0.35, 0.5))
    draw_reference(axes, case.reference)
    main = [(DIRECT, case.dns), *((MODELS[fidelity], case.main[fidelity]) for fidelity in ("rom3d", "rom2d"))]
    curves = [force_curve(look, model.history, case.reference) for look, model in main]
    names = {model.scene.name for _, model in main}
    variants = [model for model in (*case.others, *case.reduced) if model.scene.name not in names]
    draw_curves(axes, curves + _variants(variants, case), "reaction force", "N", case.direction)
    panel_letter(axes, letter, f"{INTERACTIONS[case.interaction]}, {case.direction} tension")
    legend = legend_beside(axes, (-0.15, 0.0), FOOT)
    return axes, INCH * legend.get_window_extent().height / drawing.dpi


def _variants(models: Sequence[Simulation], case: Case) -> list[Curve]:
    """Return thin curves in the colours of the models that they are variants of."""
    curves = []
    drawn: Counter[str] = Counter()
    for model in models:
        look = DIRECT if is_direct(model.scene) else MODELS[model.scene.fidelity]
        lighter, dash = divmod(drawn[look.label], len(DASHES))
        colour = tint(look.colour, SHARES[lighter % len(SHARES)])
        variant = Look(model.label, colour, DASHES[dash], "")
        curves.append(force_curve(variant, model.history, case.reference, named=False))
        drawn[look.label] += 1
    return curves
