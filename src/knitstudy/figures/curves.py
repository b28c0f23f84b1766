"""Curves over strain: one look each, with the value at the end of a curve beside it, and the reference's band."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.transforms import ScaledTranslation

from knitstudy.figures.style import FAINT, INCH, INK, PERCENT, Look
from knitstudy.measures.reference import Reference

LINE_OF_TEXT = 0.055  # height of a line of text over the height of the axes


def strain_label(direction: str) -> str:
    """Return the label of an axis of strain in a direction, "course" or "wale"."""
    return f"strain in {direction} direction (%)"


@dataclass(frozen=True)
class Curve:
    """A quantity over strain.

    Attributes
    ----------
    look : Look
    strain, value : ndarray, shape (I,)
    label : str
        Name in the legend; that of the look by default.
    named : bool
        Whether the last value stands beside the end.
    width : float
        Width of the line [points].
    """

    look: Look
    strain: np.ndarray
    value: np.ndarray
    label: str = ""
    named: bool = True
    width: float = 1.4


def force_curve(
    look: Look,
    history: xr.Dataset,
    name: str,
    reference: Reference,
    named: bool = True,
    width: float = 1.4,
) -> Curve:
    """Return the force of a history, named with its secant stiffness over the reference's and the uncertainty."""
    label = f"{name} ({reference.force_ratio(history)})"
    return Curve(look, history["strain"].to_numpy(), history["force"].to_numpy(), label, named, width)


def draw_curves(
    axes: Axes, curves: Sequence[Curve], quantity: str, unit: str, direction: str = "course"
) -> None:
    """Draw curves over strain in a direction that begin at zero, without a legend."""
    for curve in curves:
        axes.plot(
            PERCENT * curve.strain,
            curve.value,
            label=curve.label or curve.look.label,
            linewidth=curve.width,
            zorder=2 if curve.named else 1.5,
            clip_on=False,
            **curve.look.line,
        )
    axes.set(xlabel=strain_label(direction), ylabel=f"{quantity} ({unit})")
    axes.set_xlim(0, PERCENT * max(float(curve.strain.max()) for curve in curves))
    axes.set_ylim(0, None)
    _name_ends(axes, [curve for curve in curves if curve.named], unit)


def draw_reference(axes: Axes, reference: Reference) -> None:
    """Draw the reference's forces with their uncertainties, and the band between them; nothing where it has none."""
    if not reference.known:
        return
    strain, force, off = reference.curve()
    axes.fill_between(PERCENT * strain, force - off, force + off, color=FAINT, alpha=0.6, linewidth=0)
    look = {"color": INK, "linestyle": "none", "marker": "s", "markersize": 3.0, "markerfacecolor": "white"}
    look |= {"capsize": 2.5, "linewidth": 0.8, "label": "reference", "zorder": 3, "clip_on": False}
    axes.errorbar(PERCENT * strain[1:], force[1:], off[1:], **look)


def legend_beside(axes: Axes, corner: tuple[float, float], down: float, **said: object) -> Legend:
    """Draw a legend whose upper left corner stands at a share of the axes, and some mm lower."""
    lower = ScaledTranslation(0, -down / INCH, axes.figure.dpi_scale_trans)
    place = {"loc": "upper left", "bbox_to_anchor": corner, "bbox_transform": axes.transAxes + lower}
    return axes.legend(**place, fontsize=6.0, handlelength=3.0, columnspacing=1.0, borderaxespad=0, **said)


def _name_ends(axes: Axes, curves: Sequence[Curve], unit: str) -> None:
    """Write the last value beside the end of every curve, apart from its neighbours."""
    apart, lowest = LINE_OF_TEXT * axes.get_ylim()[1], -np.inf
    for curve in sorted(curves, key=lambda curve: float(curve.value[-1])):
        lowest = max(float(curve.value[-1]), lowest + apart)
        look = {"va": "center", "color": curve.look.colour, "annotation_clip": False}
        place = (PERCENT * float(curve.strain[-1]), lowest)
        text = f"{float(curve.value[-1]):.3g} {unit}"
        axes.annotate(text, place, xytext=(7, 0), textcoords="offset points", **look)
