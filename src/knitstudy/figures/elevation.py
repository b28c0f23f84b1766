"""Colours of the out-of-plane displacement, in steps that one bar explains."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from knitstudy.figures.annotation import MILLIMETRE

COLOURS = "cividis"

LEVELS = 12
"""Most steps of colour."""


def levels(u_z: np.ndarray) -> BoundaryNorm:
    """Return steps of colour over all values of u_z (...,) [m], at round numbers of mm."""
    low, high = MILLIMETRE * float(u_z.min()), MILLIMETRE * float(u_z.max())
    if not high > low:
        low, high = low - 1e-3, high + 1e-3
    return BoundaryNorm(MaxNLocator(LEVELS).tick_values(low, high), matplotlib.colormaps[COLOURS].N)


def colours(u_z: np.ndarray, norm: BoundaryNorm) -> list[str]:
    """Return the colours of values of u_z (k,) [m]."""
    return [to_hex(colour) for colour in matplotlib.colormaps[COLOURS](norm(MILLIMETRE * u_z))]


def colour_bar(drawing: Figure, norm: BoundaryNorm, span: tuple[float, float], foot: float) -> None:
    """Draw the bar below panels, from a share of the width on and so wide; `foot` is the share of the height."""
    axes = drawing.add_axes((span[0], 0.58 * foot, span[1], 0.14 * foot))
    bar = drawing.colorbar(ScalarMappable(norm, COLOURS), cax=axes, orientation="horizontal", format="%.3g")
    bar.set_ticks(norm.boundaries[::2])
    bar.set_label("out-of-plane displacement $u_z$ (mm)", labelpad=1)
