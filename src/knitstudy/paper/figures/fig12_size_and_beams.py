"""Fig. 12: cost of square knits against their size (a), and beams in contact with solid yarns for comparison (b, c)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.measures.reference import reference_of
from knitstudy.mechanics.beams.laws import LAWS
from knitstudy.paper.cases import label_of
from knitstudy.paper.figures import DIRECT, MODELS
from knitstudy.paper.figures.fig15_force_strain import draw_curves, draw_reference, force_curve, owners
from knitstudy.paper.scene_names import BEAM_MODELS, of_case, solid
from knitstudy.paper.square_knits import NONE, SIZES, counted_models
from knitstudy.run.catalogue import FIGURES, Datasets, Scenes, one, several
from knitstudy.use.style import ACCENT, DOUBLE, Look, Style, figure, panel_letter, place

SHOWN = np.geomspace(3.0, 30.0, 40)  # cells in a row between which fitted laws are drawn
DASHES = {"rigid": "-", "pinned": ":", "patch": "-."}  # of beams, by ``beam.tie``
HUES = {"rigid": "#0072B2", "hertz": "#009E73"}  # by ``beam.section``; of other laws their own colour
ABOVE, BELOW, LEAST = 70.0, 74.0, 60.0  # heights of the parts (a), (b) and (c) [mm]


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
    beams: Datasets,
    scenes: Scenes,
    reference: pd.DataFrame,
    paper: pd.DataFrame,
    untied: xr.Dataset | None = None,
    geometry: xr.Dataset | None = None,
) -> Figure:
    """Draw degrees of freedom against size, force against strain, and that of knits without tied rows, if known."""
    low = LEAST if untied is not None else 0.0
    drawing = figure(DOUBLE, (ABOVE if geometry is not None else 0.0) + BELOW + low)
    true = reference_of(reference, scenes["dns"])
    full = float(true.curve()[1][-1] if true.known else dns["force"][-1])
    quantity = f"force over the {owners([true])}\nat full strain"
    curves = [force_curve(DIRECT, dns, true)]
    for name, history in beams.items():
        section, tie = (scenes[name].value(key) for key in ("beam.section", "beam.tie"))
        colour, dash, marker = LAWS.find(section).look
        look = Look(label_of(scenes[name]), HUES.get(section, colour), DASHES.get(tie, dash), marker)
        curves.append(force_curve(look, history, true))
    axes = place(drawing, 0.11, low + 12.0, 0.5, BELOW - 20.0)
    draw_curves(axes, [replace(curve, value=curve.value / full) for curve in curves], quantity, "1", "course")
    draw_reference(axes, true, full)
    panel_letter(axes, "b", "beams in contact, isotropic friction")
    if untied is not None:
        curve = force_curve(replace(DIRECT, marker=""), untied, reference_of(reference, scenes["untied"]))
        axes = place(drawing, 0.11, 12.0, 0.5, low - 20.0)
        draw_curves(axes, [replace(curve, value=curve.value / full)], "force, as in (b)", "1", "course")
        panel_letter(axes, "c", "solid yarns without tied rows")
    if geometry is not None:
        axes = place(drawing, 0.11, low + BELOW + 12.0, 0.5, ABOVE - 20.0)
        _draw_size(axes, geometry, paper)
    return drawing


def _draw_size(axes: Axes, geometry: xr.Dataset, paper: pd.DataFrame) -> None:
    """Draw degrees of freedom over the size, counted (lines) and the paper's (crosses)."""
    lines = []
    for model in counted_models(fabric_of(geometry), paper):
        ink = MODELS.get(model.stem.split("-")[0], DIRECT).colour
        if model.multiplied is NONE:
            lines.append((model.name, model.unknowns, ink, "-"))
        else:
            lines.append(("hexahedra, contact by multipliers", model.multiplied, ink, "--"))
            lines.append(("paper, contact: its law", model.law, ACCENT, ":"))
    for name, law, colour, dash in lines:
        axes.plot(SHOWN, law(SHOWN), color=colour, linestyle=dash)
        end = law(SHOWN[-1])
        above = {"hexahedra, ties": -14, "paper, contact: its law": 6}.get(name, 0)
        look: Style = {"textcoords": "offset points", "va": "center", "color": colour}
        axes.annotate(f"{name}: {end / 1e6:.3g} million", (SHOWN[-1], end), (5, above), **look)
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
    axes.yaxis.set_major_formatter(EngFormatter())
    axes.xaxis.set_minor_formatter("")
    panel_letter(axes, "a", "size of square knits")
