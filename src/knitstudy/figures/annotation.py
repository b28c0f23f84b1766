"""What is written over a three-dimensional picture: labels, a scale bar, and the axes."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation

from knitstudy.figures.style import INK, PAPER
from knitstudy.figures.view import View

MILLIMETRE = 1e3

HALO = (withStroke(linewidth=2.0, foreground=PAPER),)
"""Keeps letters and lines legible on any background."""


def label(
    axes: Axes, view: View, point: np.ndarray, text: str, offset: tuple[float, float], colour: str = INK
) -> Annotation:
    """Name a point (3,) [m] with a thin line from the text, which stands `offset` points away."""
    return axes.annotate(
        text,
        MILLIMETRE * view.project(point),
        xytext=offset,
        textcoords="offset points",
        ha="center",
        va="center",
        color=colour,
        path_effects=HALO,
        zorder=10,
        arrowprops={
            "arrowstyle": "-",
            "linewidth": 0.7,
            "color": colour,
            "shrinkA": 0,
            "shrinkB": 0,
            "path_effects": HALO,
        },
    )


def scale_bar(axes: Axes, length: float, place: tuple[float, float] = (0.03, 0.04)) -> None:
    """Draw a bar of a length [mm] that begins at a place in shares of the axes."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    x, y = left + place[0] * (right - left), bottom + place[1] * (top - bottom)
    axes.plot([x, x + length], [y, y], color=INK, linewidth=2.0, solid_capstyle="butt", marker="", zorder=10)
    axes.annotate(
        f"{length:g} mm",
        (x + length / 2, y),
        xytext=(0, 4),
        textcoords="offset points",
        ha="center",
        va="bottom",
        path_effects=HALO,
        zorder=10,
    )


def triad(axes: Axes, view: View, length: float, place: tuple[float, float] = (0.9, 0.06)) -> None:
    """Draw the directions x, y and z, arrows of a length [mm], from a place in shares of the axes.

    An axis that points to the eye is left out: it would be a dot.
    """
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    origin = np.array([left + place[0] * (right - left), bottom + place[1] * (top - bottom)])
    for name, direction in zip("xyz", np.eye(3), strict=True):
        arm = view.project(direction)
        if np.linalg.norm(arm) < 0.1:
            continue
        tip = origin + length * arm
        axes.annotate(
            "",
            tip,
            origin,
            arrowprops={"arrowstyle": "-|>", "linewidth": 0.9, "color": INK, "shrinkA": 0, "shrinkB": 0},
            zorder=10,
        )
        beyond = tip + 0.22 * length * arm / np.linalg.norm(arm)
        axes.text(*beyond, f"${name}$", ha="center", va="center", path_effects=HALO, zorder=10)
