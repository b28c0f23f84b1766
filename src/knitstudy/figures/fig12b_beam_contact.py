"""Fig. 12b: reaction force against strain of beams in contact and of solid yarns, with isotropic friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
import xarray as xr
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
from knitstudy.figures.style import BEAMS, MODELS, Look, styled
from knitstudy.measures.cases import label_of
from knitstudy.measures.catalogue import BEAM_MODELS, network, of_case, several, solid
from knitstudy.measures.reference import reference_of
from knitstudy.study.scene import Scene

DASHES = {"pinned": ":", "patch": "-."}
"""By ``beam.tie``; those of rigid ties are those of the section."""


@FIGURES.add(
    "fig12b_beam_contact",
    "Fig. 12b: force against strain of beams in contact and of solid yarns",
    results={
        "dns": solid("simulation", "isotropic-course"),
        "beams": several("simulation", *of_case("isotropic-course", BEAM_MODELS)),
        "rom3d": network("rom3d", "isotropic-course", optional=True),
        "tie_course_rom3d": network("rom3d", "tie-course", optional=True),
    },
    files=("reference",),
    scenes=True,
)
@styled
def draw(
    dns: xr.Dataset,
    beams: Mapping[str, xr.Dataset],
    scenes: Mapping[str, Scene],
    reference: pd.DataFrame,
    rom3d: xr.Dataset | None = None,
    tie_course_rom3d: xr.Dataset | None = None,
) -> Figure:
    """Draw force against strain; the legend gives secant stiffnesses over the reference's.

    Parameters
    ----------
    dns : Dataset
        History of the direct simulation with isotropic friction (see docs/architecture.md).
    beams : mapping of str to Dataset
        Histories of beams in contact by scene.
    scenes : mapping of str to Scene
        Their scenes, that of the DNS as "dns".
    reference : DataFrame
        ``resources/reference/reference.csv``.
    rom3d, tie_course_rom3d : Dataset, optional
        Histories of the main 3D reduced models with isotropic friction and with ties.
    """
    reduced = {"isotropic friction": rom3d, "ties": tie_course_rom3d}
    true = reference_of(reference, scenes["dns"])
    curves = [_curve(dns, MODELS["dns"], f"DNS, isotropic friction {stiffness_ratio(dns, true)}")]
    for look, (text, history) in zip((MODELS["rom3d"], BEAMS["tied"]), reduced.items(), strict=True):
        if history is not None:
            curves.append(_curve(history, look, f"3D ROM, {text} {stiffness_ratio(history, true)}"))
    named = list(curves)
    for name, history in beams.items():
        text = f"{label_of(scenes[name])} {stiffness_ratio(history, true)}"
        curves.append(_curve(history, _look(scenes[name]), text))
    drawing, axes = figure_over_legend()
    draw_reference(axes, true)
    for curve in curves:
        axes.plot(
            PERCENT * curve.strain, curve.value, label=curve.look.label, clip_on=False, **curve.look.line
        )
    axes.set(xlabel=strain_label(scenes["dns"].load.direction), ylabel="reaction force (N)")
    axes.set_xlim(0, PERCENT * max(float(curve.strain[-1]) for curve in curves))
    axes.set_ylim(0, None)
    draw_legend_below(drawing)
    name_ends(axes, named, "N")
    return drawing


def _curve(history: xr.Dataset, look: Look, label: str) -> Curve:
    return Curve(replace(look, label=label), np.asarray(history["strain"]), np.asarray(history["force"]))


def _look(scene: Scene) -> Look:
    """Return colour and marker of a section; ties that are not rigid have a dash of their own."""
    look = BEAMS[scene.beam.section]
    return replace(look, dash=DASHES.get(scene.beam.tie, look.dash))
