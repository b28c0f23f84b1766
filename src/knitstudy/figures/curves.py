"""Curves over strain: one look each, with the value at the end of every curve beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.style import FAINT, INCH, INK, SINGLE, Look, figure
from knitstudy.measures.centre_cell import Snapshot
from knitstudy.measures.reference import Reference

PERCENT = 100.0

LINE_OF_TEXT = 0.055
"""Height of a line of text over the height of the axes."""

WIDTH, HEIGHT = 1.35 * SINGLE, 82.0
"""Of a figure of curves [mm]."""


def strain_label(direction: str) -> str:
    """Return the label of an axis of strain in a direction, "course" or "wale"."""
    return f"strain in {direction} direction (%)"


@dataclass(frozen=True)
class Curve:
    """A quantity over strain.

    Attributes
    ----------
    look : Look
    strain, value : array-like, shape (I,)
    """

    look: Look
    strain: np.ndarray
    value: np.ndarray


def draw_curves(curves: Sequence[Curve], quantity: str, unit: str, direction: str = "course") -> Figure:
    """Return a figure of curves over strain in a direction that begin at zero, with a legend."""
    drawing = figure(WIDTH, HEIGHT)
    axes = drawing.add_axes((0.13, 0.14, 0.70, 0.83))
    for curve in curves:
        axes.plot(
            PERCENT * curve.strain, curve.value, label=curve.look.label, clip_on=False, **curve.look.line
        )
    axes.set(xlabel=strain_label(direction), ylabel=f"{quantity} ({unit})")
    axes.set_xlim(0, PERCENT * max(float(curve.strain[-1]) for curve in curves))
    axes.set_ylim(0, None)
    axes.legend(loc="upper left", handlelength=3.2)
    name_ends(axes, curves, unit)
    return drawing


ROOM = (3.0, 66.0, 14.0)
"""Above the axes, their height, and below them for their labels [mm]."""


def figure_over_legend() -> tuple[Figure, Axes]:
    """Return a figure and its axes, for a legend that `draw_legend_below` draws when all curves are there."""
    drawing = figure(WIDTH, sum(ROOM))
    return drawing, drawing.add_axes((0.12, 0.0, 0.75, 1.0))


def draw_legend_below(drawing: Figure) -> None:
    """Draw the legend below the axes, in two columns if their width allows, and make room for it."""
    for columns in (2, 1):
        legend = drawing.legend(
            loc="lower left",
            ncols=columns,
            fontsize=6.0,
            handlelength=3.0,
            columnspacing=1.0,
            borderaxespad=0.4,
        )
        box = legend.get_window_extent()
        if columns == 1 or box.width <= drawing.bbox.width:
            break
        legend.remove()
    head, height, foot = ROOM
    below = foot + INCH * box.height / drawing.dpi
    whole = head + height + below
    drawing.set_size_inches(WIDTH / INCH, whole / INCH)
    drawing.axes[0].set_position((0.12, below / whole, 0.75, height / whole))


def stiffness_ratio(history: xr.Dataset, reference: Reference) -> str:
    """Return the secant stiffness over the reference's with its uncertainty, in brackets, for a legend."""
    return f"({reference.force_ratio(history)})"


def draw_reference(axes: Axes, reference: Reference) -> None:
    """Draw the reference's forces with their uncertainties, and the band between them; nothing where it has none."""
    if not reference.known:
        return
    strain, force, off = reference.curve()
    axes.fill_between(PERCENT * strain, force - off, force + off, color=FAINT, alpha=0.6, linewidth=0)
    axes.errorbar(
        PERCENT * strain[1:],
        force[1:],
        off[1:],
        color=INK,
        linestyle="none",
        marker="s",
        markersize=3.0,
        markerfacecolor="white",
        capsize=2.5,
        linewidth=0.8,
        label="reference",
        zorder=3,
        clip_on=False,
    )


def name_ends(axes: Axes, curves: Sequence[Curve], unit: str) -> None:
    """Write the last value beside the end of every curve, apart from its neighbours."""
    apart, lowest = LINE_OF_TEXT * axes.get_ylim()[1], -np.inf
    for curve in sorted(curves, key=lambda curve: float(curve.value[-1])):
        lowest = max(float(curve.value[-1]), lowest + apart)
        axes.annotate(
            f"{float(curve.value[-1]):.3g} {unit}",
            (PERCENT * float(curve.strain[-1]), lowest),
            xytext=(7, 0),
            textcoords="offset points",
            va="center",
            color=curve.look.colour,
            annotation_clip=False,
        )


def mark_snapshots(axes: Axes, points: Sequence[Snapshot]) -> None:
    """Draw a line at each point of Fig. 7, with its number above the axes.

    Numbers stand apart where the points are near each other; thin lines lead from them to their strains.
    """
    left, right = axes.get_xlim()
    apart, place = 0.045 * (right - left), -np.inf
    for point in points:
        x = PERCENT * point.strain
        place = max(x, place + apart)
        axes.axvline(x, color=FAINT, linewidth=0.7, linestyle=":", zorder=0)
        axes.annotate(
            str(point.number),
            (x, 1.0),
            (place, 1.06),
            xycoords=("data", "axes fraction"),
            textcoords=("data", "axes fraction"),
            ha="center",
            va="bottom",
            color=INK,
            fontweight="bold",
            arrowprops={"arrowstyle": "-", "linewidth": 0.7, "color": FAINT, "shrinkA": 1, "shrinkB": 0},
            annotation_clip=False,
        )


def explain_snapshots(drawing: Figure, points: Sequence[Snapshot]) -> None:
    """Write the strains of the marked points below a figure."""
    text = ";  ".join(point.label for point in points)
    drawing.text(0.5, 0.012, text, ha="center", va="bottom", fontsize=7.0)
