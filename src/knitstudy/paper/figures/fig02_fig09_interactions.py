"""Figs. 2 and 9: schematic of ties and contact with friction, and what they do to force and out-of-plane motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import reference_of
from knitstudy.measures.response import FORCE, LARGEST_U_Z, out_of_plane
from knitstudy.paper.figures import INTERACTIONS
from knitstudy.paper.figures.fig15_force_strain import Curve, draw_curves, draw_reference
from knitstudy.paper.scene_names import solid
from knitstudy.run.catalogue import FIGURES, Scenes
from knitstudy.use.solids import Place, draw_arrow, write
from knitstudy.use.style import (
    ACCENT,
    DOUBLE,
    INK,
    MILLIMETRE,
    PAPER,
    YARNS,
    Style,
    figure,
    panel_letter,
    tint,
)

SLAVE, MASTER = YARNS[1], YARNS[2]
HALF = 3.0  # half the width of a panel; all lengths of the schematic are in one arbitrary unit
GAP = 0.55  # distance between the tied surfaces, so that the ties can be seen
CONTACT = 1.15  # half the width of the contact zone
MASTER_NODES, SLAVE_NODES = np.linspace(-2.7, 2.7, 7), np.linspace(-2.25, 2.25, 10)

Profile = Callable[[np.ndarray], np.ndarray]


@FIGURES.add("fig02_interfaces", "Fig. 2: tie constraint and contact with friction")
def draw_interfaces() -> Figure:
    """Draw both panels: sketches without measurements."""
    drawing = figure(DOUBLE, 66)
    left, right = (drawing.add_axes((start, 0.02, 0.47, 0.88)) for start in (0.015, 0.515))
    panel_letter(left, "a", "tie constraint")
    _draw_tie(left)
    panel_letter(right, "b", "contact with friction")
    _draw_contact(right)
    return drawing


def _draw_tie(axes: Axes) -> None:
    """Every slave node hangs on the master facet below it; the facet's nodes carry it."""

    def lower(x: np.ndarray) -> np.ndarray:
        return -0.06 * x**2

    def upper(x: np.ndarray) -> np.ndarray:
        return GAP + 0.06 * x**2

    formula = r"$\mathbf{u}^{s}=\sum_i N_i\,\mathbf{u}_i^{*}$"
    _draw_bodies(axes, lower, upper, f"{formula}   no relative motion")
    ties = SLAVE_NODES[3:7]
    feet = np.interp(ties, MASTER_NODES, lower(MASTER_NODES))  # on the straight facets
    axes.vlines(ties, feet, upper(ties), color=ACCENT, linewidth=2.2, zorder=4)
    axes.plot(ties, feet, "D", color=ACCENT, markersize=3.5, zorder=5)
    line = {"arrowstyle": "-", "linewidth": 0.7, "shrinkB": 4}
    for text, point, where in (
        ("slave node $s$", (ties[-1], upper(ties[-1])), (2.1, 1.35)),
        ("facet with nodes $i$", (1.35, -0.12), (1.75, -1.1)),
    ):
        axes.annotate(text, point, where, ha="center", va="center", arrowprops=line, zorder=9)


def _draw_contact(axes: Axes) -> None:
    """Surfaces press on each other with p and exchange a traction t_T in their common tangent plane."""

    def lower(x: np.ndarray) -> np.ndarray:
        return -0.13 * np.maximum(np.abs(x) - CONTACT, 0) ** 2 - 0.02 * (np.abs(x) > CONTACT)

    formula = r"$p\geq 0$,   $\Vert\mathbf{t}_T\Vert\leq\mu\,p$"
    _draw_bodies(axes, lower, lambda x: -lower(x), f"{formula},   equal where it slides")
    # The normal n of the master and its tangents; t2 points to the reader.
    origin = np.array([1.8, *lower(np.array([1.8]))])
    along = np.array([1, -0.26 * (origin[0] - CONTACT)])
    along /= np.linalg.norm(along)
    normal = np.array([-along[1], along[0]])
    axes.plot(*origin, "o", color=PAPER, markeredgecolor=INK, markersize=7, zorder=7)
    axes.plot(*origin, "o", color=INK, markersize=2.2, zorder=8)
    arrows: list[tuple[Place, Place, str, float]] = [
        ((x, 0.06), (0, 0.95 * np.sqrt(1 - (x / CONTACT) ** 2)), ACCENT, 0.9)
        for x in np.linspace(-0.93, 0.93, 9)
    ]
    arrows += [
        ((0.45, -0.28), (-1.3, 0), ACCENT, 2.0),
        ((1.25, 1.45), (1.1, 0), SLAVE, 2.0),
        (origin, 0.95 * normal, INK, 1.2),
        (origin, 0.85 * along, INK, 1.2),
    ]
    for start, vector, colour, width in arrows:
        draw_arrow(axes, start, vector, colour, width, mutation_scale=6 + 3 * width)
    texts: tuple[tuple[Place, str, str], ...] = (
        ((1.02, 0.8), "$p$", ACCENT),
        ((-1.0, -0.3), r"$\mathbf{t}_T$", ACCENT),
        ((0.42, 1.45), "sliding of the slave", SLAVE),
        (origin + 1.1 * normal, r"$\mathbf{n}$", INK),
        (origin + 0.9 * along + [0.1, 0.22], r"$\mathbf{t}_1$", INK),
        (origin - [0.1, 0.36], r"$\mathbf{t}_2$", INK),
    )
    for place, text, colour in texts:
        write(axes, place, text, color=colour)


def _draw_bodies(axes: Axes, lower: Profile, upper: Profile, formula: str) -> None:
    """Draw master and slave with their nodes and names, and the formula below."""
    axes.set(xlim=(-HALF, HALF), ylim=(-1.95, 2.1), aspect="equal")
    axes.set_axis_off()
    axes.text(-0.1, -1.75, formula, ha="center", va="center")
    x = np.linspace(-HALF, HALF, 241)
    for name, colour, profile, end, nodes, marker, height in (
        ("master", MASTER, lower, -1.35, MASTER_NODES, "s", -1.1),
        ("slave", SLAVE, upper, 1.7, SLAVE_NODES, "o", 1.45),
    ):
        axes.fill_between(x, end, profile(x), color=tint(colour, 0.22), linewidth=0)
        axes.plot(x, profile(x), color=colour, linewidth=1.4)
        rim: Style = {"markeredgecolor": colour, "markeredgewidth": 1.3}
        axes.plot(nodes, profile(nodes), marker, color=PAPER, markersize=5, zorder=6, **rim)
        write(axes, (-2.9, height), f"{name} surface", color=colour, ha="left")


# ---- Fig. 9


@FIGURES.add(
    "fig09_interactions",
    "Fig. 9: force and out-of-plane motion with ties, rough contact and isotropic friction",
    results={
        "tie": solid("simulation", "tie-course"),
        "rough": solid("simulation", "rough-course"),
        "isotropic": solid("simulation", "isotropic-course"),
    },
)
def draw_interactions(scenes: Scenes, reference: pd.DataFrame, **histories: xr.Dataset) -> Figure:
    """Draw the reaction force, and the largest |u_z| along the centrelines, over strain, with their references."""
    drawing = figure(DOUBLE, 76.0)
    known = {name: reference_of(reference, scenes[name]) for name in histories}
    quantities = (
        ("reaction force", "N", FORCE, 1.0),
        ("largest out-of-plane motion $|u_z|$", "mm", LARGEST_U_Z, 1 / MILLIMETRE),
    )
    for k, (label, unit, quantity, size) in enumerate(quantities):
        axes = drawing.add_axes((0.075 + 0.5 * k, 0.14, 0.24, 0.77))
        curves = []
        for name, history in histories.items():
            value = out_of_plane(history) if quantity == LARGEST_U_Z else history["force"].to_numpy()
            true = known[name].at(quantity, float(history["strain"][-1]))
            note = (
                f"\n(reference:\n{Estimate(true.value / size, true.uncertainty / size)})"
                if true.known
                else ""
            )
            curves.append(Curve(INTERACTIONS[name], history["strain"].to_numpy(), value / size, note))
        draw_curves(axes, curves, label, unit)
        for name in histories:
            draw_reference(axes, known[name], size, quantity, INTERACTIONS[name].colour)
        panel_letter(axes, "ab"[k])
    return drawing
