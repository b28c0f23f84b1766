"""Fig. 15: reaction force against strain of the three models and their variants, and the reference."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.curves import (
    PERCENT,
    Curve,
    draw_legend_below,
    draw_reference,
    figure_over_legend,
    name_ends,
    stiffness_ratio,
    strain_label,
)
from knitstudy.figures.style import MODELS, OTHER, styled, tint
from knitstudy.measures.cases import label_of
from knitstudy.measures.catalogue import OTHER_SOLIDS, VARIANTS, network, of_case, several, solid
from knitstudy.measures.discretisation import is_direct
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.study.scene import Scene

DASHES = ((0, (1, 1.2)), (0, (4, 1.5)), (0, (6, 1.5, 1, 1.5)), (0, (2, 2.5)), (0, (3, 1, 1, 1, 1, 1)))
"""Of the variants of one model, in their order; those after are lighter."""

SHARES = (1.0, 0.5)
"""Of a model's colour, that variants have whose dashes are the same."""


@FIGURES.add(
    "fig15a_force_strain",
    "Fig. 15a: force against strain in course direction, ties",
    results={
        "dns": solid("simulation", "tie-course"),
        "rom3d": network("rom3d", "tie-course"),
        "rom2d": network("rom2d", "tie-course"),
        "others": several("simulation", *of_case("tie-course", OTHER_SOLIDS), optional=True),
        "reduced": several("simulation", *of_case("tie-course", VARIANTS), optional=True),
    },
    files=("reference",),
    scenes=True,
    order=1,
)
@FIGURES.add(
    "fig15b_force_strain",
    "Fig. 15b: force against strain in wale direction, ties",
    results={
        "dns": solid("simulation", "tie-wale"),
        "rom3d": network("rom3d", "tie-wale"),
        "rom2d": network("rom2d", "tie-wale"),
        "others": several("simulation", *of_case("tie-wale", OTHER_SOLIDS), optional=True),
        "reduced": several("simulation", *of_case("tie-wale", VARIANTS), optional=True),
    },
    files=("reference",),
    scenes=True,
    order=2,
)
@FIGURES.add(
    "fig15c_force_strain",
    "Fig. 15c: force against strain in course direction, isotropic friction",
    results={
        "dns": solid("simulation", "isotropic-course"),
        "rom3d": network("rom3d", "isotropic-course"),
        "rom2d": network("rom2d", "isotropic-course"),
        "others": several("simulation", *of_case("isotropic-course", OTHER_SOLIDS), optional=True),
        "reduced": several("simulation", *of_case("isotropic-course", VARIANTS), optional=True),
    },
    files=("reference",),
    scenes=True,
    order=3,
)
@FIGURES.add(
    "fig15d_force_strain",
    "Fig. 15d: force against strain in wale direction, isotropic friction",
    results={
        "dns": solid("simulation", "isotropic-wale"),
        "rom3d": network("rom3d", "isotropic-wale"),
        "rom2d": network("rom2d", "isotropic-wale"),
        "others": several("simulation", *of_case("isotropic-wale", OTHER_SOLIDS), optional=True),
        "reduced": several("simulation", *of_case("isotropic-wale", VARIANTS), optional=True),
    },
    files=("reference",),
    scenes=True,
    order=4,
)
@styled
def draw(
    dns: xr.Dataset,
    rom3d: xr.Dataset,
    rom2d: xr.Dataset,
    scenes: Mapping[str, Scene],
    reference: pd.DataFrame,
    others: Mapping[str, xr.Dataset] | None = None,
    reduced: Mapping[str, xr.Dataset] | None = None,
) -> Figure:
    """Draw force against strain; the legend gives secant stiffnesses over the reference's.

    Parameters
    ----------
    dns, rom3d, rom2d : Dataset
        Histories (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by fidelity, and those of `others` and `reduced` by name.
    reference : DataFrame
        ``resources/reference/reference.csv``.
    others : mapping of str to Dataset, optional
        Histories of direct simulations of the same by other elements or on other meshes, by scene.
    reduced : mapping of str to Dataset, optional
        Histories of all reduced models by scene, of which the variants are drawn.
    """
    models = {"dns": dns, "rom3d": rom3d, "rom2d": rom2d}
    true = reference_of(reference, scenes["dns"])
    main = {scenes[fidelity].name for fidelity in models}
    beside = (others or {}) | (reduced or {})
    variants = {name: each for name, each in beside.items() if name not in main}
    drawing, axes = figure_over_legend()
    draw_reference(axes, true)
    for fidelity, history in models.items():
        look = MODELS[fidelity]
        text = f"{look.label} {stiffness_ratio(history, true)}"
        axes.plot(PERCENT * history["strain"], history["force"], label=text, clip_on=False, **look.line)
    _draw_variants(axes, variants, true, scenes)
    everything = [*models.values(), *variants.values()]
    axes.set(xlabel=strain_label(scenes["dns"].load.direction), ylabel="reaction force (N)")
    axes.set_xlim(0, PERCENT * max(float(history["strain"].max()) for history in everything))
    axes.set_ylim(0, None)
    draw_legend_below(drawing)
    name_ends(
        axes,
        [Curve(MODELS[fidelity], each["strain"], each["force"]) for fidelity, each in models.items()],
        "N",
    )
    return drawing


def _draw_variants(
    axes: Axes, variants: Mapping[str, xr.Dataset], true: Reference, scenes: Mapping[str, Scene]
) -> None:
    """Draw thin lines in the colours of the models that they are variants of."""
    drawn: Counter[str] = Counter()
    for name, history in variants.items():
        fidelity = "dns" if is_direct(scenes[name]) else scenes[name].fidelity
        lighter, dash = divmod(drawn[fidelity], len(DASHES))
        axes.plot(
            PERCENT * history["strain"],
            history["force"],
            color=tint(MODELS.get(fidelity, OTHER).colour, SHARES[lighter % len(SHARES)]),
            linestyle=DASHES[dash],
            linewidth=0.9,
            label=f"{label_of(scenes[name])} {stiffness_ratio(history, true)}",
            zorder=1.5,
        )
        drawn[fidelity] += 1
