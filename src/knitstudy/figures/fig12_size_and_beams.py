"""Fig. 12: cost of square knits against their size (a), and beams in contact beside solid yarns (b)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.fig15_force_strain import draw_curves, draw_reference, force_curve, owners
from knitstudy.figures.style import (
    ACCENT,
    DIRECT,
    DOUBLE,
    MODELS,
    Look,
    figure,
    panel_letter,
    place,
)
from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.cases import label_of
from knitstudy.measures.catalogue import BEAM_MODELS, of_case, one, several, solid
from knitstudy.measures.reference import reference_of
from knitstudy.measures.unknowns import NONE, SIZES, counted_models
from knitstudy.study.scene import Scene

SHOWN = np.geomspace(3.0, 30.0, 40)  # cells in a row between which fitted laws are drawn
DASHES = {"pinned": ":", "patch": "-."}  # by ``beam.tie``; those of rigid ties are those of the section
ABOVE, BELOW = 82.0, 82.0  # heights of the parts (a) and (b) [mm]
BEAMS = {"rigid": Look("", "#0072B2", "-", "v"), "hertz": Look("", "#56B4E9", "--", "^")}  # by their section


@FIGURES.add(
    "fig12_size_and_beams",
    "Fig. 12: cost against the size of the knit, and beams in contact",
    results={
        "dns": solid("simulation", "isotropic-course"),
        "beams": several("simulation", *of_case("isotropic-course", BEAM_MODELS)),
        "untied": one("simulation", "inputs-untied-isotropic-course", optional=True),
        "geometry": one("geometry", "dns-tie-course", optional=True),
    },
)
def draw(
    dns: xr.Dataset,
    beams: Mapping[str, xr.Dataset],
    scenes: Mapping[str, Scene],
    reference: pd.DataFrame,
    paper: pd.DataFrame,
    untied: xr.Dataset | None = None,
    geometry: xr.Dataset | None = None,
) -> Figure:
    """Draw degrees of freedom against size above, if the study has the paper's mesh, and force against strain below."""
    drawing = figure(DOUBLE, BELOW + (ABOVE if geometry is not None else 0.0))
    axes = place(drawing, 0.085, 13.0, 0.5, BELOW - 20.0)
    true = reference_of(reference, scenes["dns"])
    full = float(true.curve()[1][-1] if true.known else dns["force"][-1])
    curves = [force_curve(DIRECT, dns, true)]
    if untied is not None:
        look = replace(DIRECT, label=f"{DIRECT.label}, no row tied", dash=":", marker="")
        curves.append(force_curve(look, untied, reference_of(reference, scenes["untied"])))
    for name, history in beams.items():
        look = BEAMS[scenes[name].beam.section]
        dash = DASHES.get(scenes[name].value("beam.tie"), look.dash)
        curves.append(force_curve(replace(look, label=label_of(scenes[name]), dash=dash), history, true))
    curves = [replace(curve, value=curve.value / full) for curve in curves]
    draw_curves(axes, curves, f"force over the {owners([true])} at full strain", "1", "course")
    draw_reference(axes, true, full)
    panel_letter(axes, "b", "beams in contact, isotropic friction")
    if geometry is not None:
        _draw_size(
            place(drawing, 0.085, BELOW + 13.0, 0.5, ABOVE - 20.0), geometry, scenes["geometry"], paper
        )
    return drawing


def _draw_size(axes: Axes, geometry: xr.Dataset, scene: Scene, paper: pd.DataFrame) -> None:
    """Draw degrees of freedom over the size, counted (lines) and the paper's (crosses)."""
    lines = []
    for model in counted_models(Fabric.from_dataset(geometry), scene, paper):
        look = MODELS[model.stem.split("-")[0]].colour
        if model.multiplied is NONE:
            lines.append((model.name.removesuffix(", ties"), model.unknowns, look, "-"))
        else:
            lines.append(("hexahedra, contact by multipliers", model.multiplied, look, "--"))
            lines.append(("paper, contact: its law", model.law, ACCENT, ":"))
    for name, law, colour, dash in lines:
        axes.plot(SHOWN, law(SHOWN), color=colour, linestyle=dash)
        end = {
            "xytext": (5, -10 if name == "hexahedra" else 2),
            "textcoords": "offset points",
            "va": "center",
            "color": colour,
            "fontsize": 7,
        }
        axes.annotate(f"{name}: {law(SHOWN[-1]) / 1e6:.3g} million", (SHOWN[-1], law(SHOWN[-1])), **end)
    rows = paper[
        paper["table"].astype(str).isin(["3", "5", "fig12a"]) & (paper["quantity"] == "degrees of freedom")
    ]
    cells = rows["case"].str.extract(r"(\d+)[wx]")[0].astype(float)
    axes.plot(cells, rows["value"].astype(float), "x", color=ACCENT, label="paper: Tables 3 and 5, Fig. 12a")
    axes.legend(loc="upper left")
    axes.set(
        xscale="log", yscale="log", xlabel="cells in a row (1)", ylabel="degrees of freedom (1)", xticks=SIZES
    )
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
    panel_letter(axes, "a", "size of square knits")
