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
from knitstudy.figures.fig15_force_strain import draw_curves, draw_reference, force_curve
from knitstudy.figures.renderer import MILLIMETRE
from knitstudy.figures.style import (
    DIRECT,
    DOUBLE,
    MODELS,
    PAPER,
    Look,
    figure,
    panel_letter,
    place,
    shared_legend,
)
from knitstudy.measures.cases import label_of
from knitstudy.measures.catalogue import BEAM_MODELS, SQUARES, of_case, several, solid
from knitstudy.measures.cost import MEGABYTE, Series, domain_response, memory_growth, series_of
from knitstudy.measures.discretisation import problem_of
from knitstudy.measures.reference import reference_of
from knitstudy.study.scene import Scene

SHOWN = np.geomspace(3.0, 30.0, 40)  # cells in a row between which fitted laws are drawn
MARKED = (1, 3, 6, 10, 20, 30)  # cells in a row that the axis names
DASHES = {"pinned": ":", "patch": "-."}  # by ``beam.tie``; those of rigid ties are those of the section
ABOVE, BELOW = 92.0, 82.0  # heights of the parts (a) and (b) [mm]
UNTIED = (
    "inputs-untied-isotropic-course",
    "yarns-untied-course",
)  # direct simulations of which no row is tied
LOOSE = "v"  # marker where yarns touch and no row is tied
BEAMS = {"rigid": Look("", "#0072B2", "-", "v"), "hertz": Look("", "#56B4E9", "--", "^")}  # by their section


@FIGURES.add(
    "fig12_size_and_beams",
    "Fig. 12: cost against the size of the knit, and beams in contact",
    results={
        "dns": solid("simulation", "isotropic-course"),
        "beams": several("simulation", *of_case("isotropic-course", BEAM_MODELS)),
        "untied": several("simulation", *UNTIED, optional=True),
        "squares": several("simulation", *SQUARES, fewest=12, optional=True),
    },
)
def draw(
    dns: xr.Dataset,
    beams: Mapping[str, xr.Dataset],
    scenes: Mapping[str, Scene],
    reference: pd.DataFrame,
    paper: pd.DataFrame,
    untied: Mapping[str, xr.Dataset] | None = None,
    squares: Mapping[str, xr.Dataset] | None = None,
) -> Figure:
    """Draw the cost of the models above, if the study has knits of several sizes, and force against strain below."""
    drawing = figure(DOUBLE, BELOW + (ABOVE if squares else 0.0))
    axes = place(drawing, 0.085, 13.0, 0.5, BELOW - 20.0)
    solids = {"dns": dns} | dict(untied or {})
    full, curves = {}, []
    for name, history in (solids | dict(beams)).items():
        scene = scenes[name]
        problem, true = problem_of(scene), reference_of(reference, scene)
        # Every problem has its own reference; without one its first direct simulation is in the place of it.
        if problem not in full and (true.known or name in solids):
            full[problem] = float(true.curve()[1][-1] if true.known else history["force"][-1])
        if problem not in full:
            continue
        words = DIRECT.label if name in solids else label_of(scene)
        if scene.contact.tied_edges == "none":
            words += ", no row tied"
        look = DIRECT if name in solids else BEAMS[scene.beam.section]
        dash = ":" if scene.contact.tied_edges == "none" else DASHES.get(scene.value("beam.tie"), look.dash)
        curve = force_curve(replace(look, label=words, dash=dash), history, true)
        curves.append(replace(curve, value=curve.value / full[problem]))
    draw_curves(axes, curves, "force over its reference's at full strain", "1", scenes["dns"].load.direction)
    draw_reference(axes, reference_of(reference, scenes["dns"]), full[problem_of(scenes["dns"])])
    panel_letter(axes, "b", "beams in contact, isotropic friction")
    if squares:
        _draw_cost(drawing, [scenes[name] for name in squares], squares, paper)
    return drawing


def _draw_cost(
    drawing: Figure, scenes: list[Scene], squares: Mapping[str, xr.Dataset], paper: pd.DataFrame
) -> None:
    """Draw degrees of freedom and growth of memory over the size in the upper part of a figure."""
    left, right = (place(drawing, start, BELOW + 26.0, 0.4, ABOVE - 33.0) for start in (0.085, 0.585))
    for series in series_of(scenes):
        histories, line = [squares[scene.name] for scene in series.scenes], series_line(series)
        dof = np.array([float(history.attrs["dof"]) for history in histories])
        memory = np.array([memory_growth(history) for history in histories]) / MEGABYTE
        unknowns = series.unknowns(dof)(SHOWN)
        law = {"color": line["color"], "linestyle": line["linestyle"], "linewidth": 0.7}
        for axes, values, fitted in (
            (left, dof, unknowns),
            (right, memory, series.memory(dof, memory)(unknowns)),
        ):
            axes.plot(series.cells, values, **line | {"linestyle": "", "markersize": 4.5})
            axes.plot(SHOWN, fitted, **law)
    for axes, quantity in ((left, "degrees of freedom"), (right, "memory")):
        rows = paper[(paper["table"].astype(str) == "3") & (paper["quantity"] == quantity)]
        cells = rows["case"].str.extract(r"c(\d+)w")[0].astype(float)
        axes.plot(cells, rows["value"].astype(float), "x", color="#8E1B5A", label="paper, contact")
        axes.set_yscale("log")
        _draw_cells_axis(axes)
    left.set_ylabel("degrees of freedom (1)")
    right.set_ylabel("memory growth (MB)")
    panel_letter(left, "a", "cost in course tension")
    left.legend(loc="upper center", bbox_to_anchor=(1.12, -0.2), ncols=4, fontsize=6.5, handlelength=2.5)


# ---- response of square knits against their size, a figure of its own ----

STRAIN = 0.05  # at which sizes are compared; series that end before are left out

PANELS = (
    ("force", "force over width (N/mm)", 1e-3),
    ("out_of_plane", "largest $|u_z|$ (mm)", MILLIMETRE),
    ("normal", "normal force, centre cell (N)", 1.0),
)


@FIGURES.add(
    "fig_domain_response",
    "Response of square knits against their size",
    results={
        "squares": several("simulation", *SQUARES, fewest=12),
        "squares_contacts": several("contacts", *SQUARES),
    },
)
def draw_response(
    squares: Mapping[str, xr.Dataset], squares_contacts: Mapping[str, xr.Dataset], scenes: Mapping[str, Scene]
) -> Figure:
    """Draw force, out-of-plane motion and contact force over the size."""
    drawing = figure(DOUBLE, 72.0, layout="constrained")
    panels = drawing.subplots(1, 3)
    for series in series_of(scenes[name] for name in squares):
        if series.scenes[0].load.strain < STRAIN:
            continue
        answers = [domain_response(scene, squares, squares_contacts) for scene in series.scenes]
        for axes, (name, _, unit) in zip(panels, PANELS, strict=True):
            values = unit * np.array([getattr(answer, name) for answer in answers])
            axes.plot(series.cells, values, **series_line(series))
    for axes, letter, (_, label, _) in zip(panels, "abc", PANELS, strict=True):
        _draw_cells_axis(axes)
        axes.set(ylabel=label, ylim=(0, None))
        panel_letter(axes, letter)
    shared_legend(drawing, loc="outside lower center", ncols=3, fontsize=6.5, handlelength=3.0)
    return drawing


def _draw_cells_axis(axes: Axes) -> None:
    """Make the lower axis one of cells in a row, logarithmic."""
    axes.set(xscale="log", xlabel="cells in a row (1)", xticks=MARKED)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")


def series_line(series: Series) -> dict:
    """Return keywords of a line: colour and marker show the model, dash and filling the interaction."""
    scene = series.scenes[0]
    look = MODELS[scene.fidelity]
    touches = scene.kind.interaction.touches
    held = "ties" if not touches else "friction, no row tied" if series.free else "friction"
    return {
        "color": look.colour,
        "linestyle": ":" if series.free else "--" if touches else "-",
        "marker": LOOSE if series.free else look.marker,
        "markerfacecolor": PAPER if touches else look.colour,
        "label": f"{look.label}, {held}",
    }
