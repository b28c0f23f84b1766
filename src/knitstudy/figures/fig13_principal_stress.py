"""Fig. 13: the flow of the maximum principal stress along the yarns, course and wale tension."""

from __future__ import annotations

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, PowerNorm, to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from knitstudy.figures.annotation import scale_bar, triad
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.picture import bounds, show
from knitstudy.figures.stress_flow import ribbons, streaks, yarn_surfaces
from knitstudy.figures.style import DOUBLE, figure, panel_letter, styled
from knitstudy.figures.surface import Surface
from knitstudy.figures.view import FRONT
from knitstudy.measures.catalogue import solid
from knitstudy.mesh.sweep import SweptMesh

MEGAPASCAL = 1e-6

YARN = "#EDEAE4"
"""Of yarns below the streaks."""

SHADES = 14
"""Colours of streaks."""

LARGEST = 98.0
"""Percentile of the values that the darkest colour begins at: stress peaks at few places where yarns touch."""

EVEN = 0.6
"""Power of the stress that colours are even in: most of a knit bears little."""

SPACING, AROUND, LENGTH = 0.5, 14, 1.9
"""Of streaks: distance along the yarn and length, over its radius, and number around it."""

WIDTH = (0.045, 0.14)
"""Of a streak without stress and with the largest one, over the yarn's radius."""

FOOT, HEAD = 15.0, 8.0
"""Room for colour bars below and for titles above [mm]."""

CLOSE = (1.25, 0.95)
"""Width and height of what the close views show, over the width of a cell."""

SILL = 3.0
"""Room below the knit for the scale bar [mm of the knit]."""


@FIGURES.add(
    "fig13_principal_stress",
    "Fig. 13: flow of the maximum principal stress, isotropic friction",
    results={
        "isotropic_course_dns_mesh": solid("mesh", "isotropic-course"),
        "isotropic_course_dns_stress": solid("stress", "isotropic-course"),
        "isotropic_wale_dns_mesh": solid("mesh", "isotropic-wale"),
        "isotropic_wale_dns_stress": solid("stress", "isotropic-wale"),
    },
)
@styled
def draw(**results: xr.Dataset) -> Figure:
    """Draw the deformed knits with streaks along the axes on their surfaces, darker where the stress is larger.

    Parameters
    ----------
    **results : Dataset
        Mesh and stresses of the direct simulations, course and wale tension (see docs/architecture.md).
    """
    knits = {}
    for direction in ("course", "wale"):
        mesh, stresses = (results[f"isotropic_{direction}_dns_{name}"] for name in ("mesh", "stress"))
        knits[direction] = (*flow(SweptMesh.from_dataset(mesh), stresses), stresses)
    windows = np.array([bounds(surfaces, FRONT) for surfaces, _, _ in knits.values()])
    window = (windows[:, 0].min(), windows[:, 1].max(), windows[:, 2].min() - SILL, windows[:, 3].max())
    panel = 0.485 * DOUBLE * (window[3] - window[2]) / (window[1] - window[0])
    close = 0.485 * DOUBLE * CLOSE[1] / CLOSE[0]
    height = panel + close + 2 * HEAD + FOOT
    drawing = figure(DOUBLE, height)
    for place, (direction, (surfaces, norm, stresses)) in enumerate(knits.items()):
        left = 0.01 + 0.5 * place
        axes = drawing.add_axes((left, (FOOT + close + HEAD) / height, 0.485, panel / height))
        show(axes, surfaces, FRONT, window)
        panel_letter(axes, "ab"[place], f"{direction} tension, {stresses.attrs['strain']:.2%} strain")
        scale_bar(axes, 5, (0.02, 0.0))
        triad(axes, FRONT, 2.5, (0.9, 0.0))
        axes = drawing.add_axes((left, FOOT / height, 0.485, close / height))
        show(axes, surfaces, FRONT, _cell(windows[place], stresses))
        panel_letter(axes, "cd"[place], "the centre cell")
        scale_bar(axes, 2, (0.02, 0.02))
        cax = drawing.add_axes((left + 0.1, 0.58 * FOOT / height, 0.285, 0.14 * FOOT / height))
        bar = drawing.colorbar(
            ScalarMappable(norm, colours()), cax=cax, orientation="horizontal", extend="max"
        )
        bar.set_ticks([tick for tick in MaxNLocator(4).tick_values(0, norm.vmax) if tick <= 0.95 * norm.vmax])
        bar.set_label("maximum principal stress (MPa)", labelpad=1)
    return drawing


def _cell(window: np.ndarray, stresses: xr.Dataset) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top about the middle of a knit in a window [mm]."""
    middle = np.array([window[0] + window[1], window[2] + window[3]]) / 2
    width = (window[1] - window[0]) / (int(stresses["segment_column"].max()) + 1)
    half = 0.5 * width * np.array(CLOSE)
    (left, bottom), (right, top) = middle - half, middle + half
    return float(left), float(right), float(bottom), float(top)


def flow(mesh: SweptMesh, stresses: xr.Dataset) -> tuple[list[Surface], PowerNorm]:
    """Return yarns with streaks, and the scale of their colours."""
    yarns = yarn_surfaces(mesh, stresses)
    radius = mesh.radius
    found = [streaks(yarn, SPACING * radius, AROUND, LENGTH * radius) for yarn in yarns]
    place, normal, value = (np.concatenate(each) for each in zip(*found, strict=True))
    value = MEGAPASCAL * value
    norm = PowerNorm(EVEN, 0, float(np.percentile(value, LARGEST)), clip=True)
    share = np.asarray(norm(value))
    shade = np.minimum((share * SHADES).astype(int), SHADES - 1)
    width = radius * (WIDTH[0] + share * (WIDTH[1] - WIDTH[0]))
    surfaces = [yarn.tube(YARN) for yarn in yarns]
    for number in np.unique(shade):
        here = shade == number
        colour = to_hex(colours()((number + 0.5) / SHADES))
        surfaces.append(ribbons(place[here], normal[here], width[here], colour))
    return surfaces, norm


def colours() -> LinearSegmentedColormap:
    """Return the colours from no stress, hardly darker than the yarn, to the largest."""
    every = matplotlib.colormaps["magma_r"](np.linspace(0.12, 0.95, 64))
    return LinearSegmentedColormap.from_list("flow", every)
