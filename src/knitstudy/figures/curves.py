"""Curves over strain: one look each, with the value at the end of a curve beside it, and the reference's band."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
    """A quantity over strain, drawn thin if its look has no marker."""

    look: Look
    strain: np.ndarray  # (I,)
    value: np.ndarray  # (I,)
    named: bool = True  # whether the last value stands beside the end


def force_curve(look: Look, history: xr.Dataset, reference: Reference, named: bool = True) -> Curve:
    """Return the force of a history, named with its secant stiffness over the reference's and the uncertainty."""
    look = replace(look, label=f"{look.label} ({reference.force_ratio(history)})")
    return Curve(look, history["strain"].to_numpy(), history["force"].to_numpy(), named)


def draw_curves(
    axes: Axes, curves: Sequence[Curve], quantity: str, unit: str, direction: str = "course"
) -> None:
    """Draw curves over strain in a direction that begin at zero, without a legend."""
    for curve in curves:
        look = curve.look.line | {"label": curve.look.label, "linewidth": 1.4 if curve.look.marker else 0.9}
        zorder = 2 if curve.named else 1.5
        axes.plot(PERCENT * curve.strain, curve.value, zorder=zorder, clip_on=False, **look)
    axes.set(xlabel=strain_label(direction), ylabel=f"{quantity} ({unit})")
    axes.set_xlim(0, PERCENT * max(float(curve.strain.max()) for curve in curves))
    axes.set_ylim(0, None)
    # The last values stand beside the ends of the curves, apart from each other.
    apart, lowest = LINE_OF_TEXT * axes.get_ylim()[1], -np.inf
    for curve in sorted((curve for curve in curves if curve.named), key=lambda curve: curve.value[-1]):
        lowest = max(float(curve.value[-1]), lowest + apart)
        look = {"va": "center", "color": curve.look.colour, "annotation_clip": False}
        text, at = f"{float(curve.value[-1]):.3g} {unit}", (PERCENT * float(curve.strain[-1]), lowest)
        axes.annotate(text, at, xytext=(7, 0), textcoords="offset points", **look)


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
