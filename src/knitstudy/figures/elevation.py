"""Deformed yarns coloured by their out-of-plane displacement, in steps that one bar explains."""

from __future__ import annotations

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from knitstudy.figures.annotation import MILLIMETRE
from knitstudy.figures.shapes import graded_tube
from knitstudy.figures.surface import Surface
from knitstudy.measures.response import Z

COLOURS = "cividis"

LEVELS = 12
"""Most steps of colour."""


CUT = 6.0
"""Distance of stations along a yarn, over the radius, that says that there is no yarn between them."""


def elevation(history: xr.Dataset) -> np.ndarray:
    """Return u_z (S,) at full load along the yarns [m]."""
    return history["centreline_displacement"].to_numpy()[-1, :, Z]


def pieces(history: xr.Dataset, radius: float) -> list[np.ndarray]:
    """Return the stations of every piece of yarn, in their order; the yarn's radius [m] tells where it is cut."""
    yarn, place = history["yarn"].to_numpy(), history["arc_length"].to_numpy()
    ends = (np.diff(yarn) != 0) | (np.diff(place) > CUT * radius)
    return np.split(np.arange(len(yarn)), np.flatnonzero(ends) + 1)


def elevated_yarns(
    history: xr.Dataset, radius: float, norm: BoundaryNorm, thickness: float = 1.0
) -> list[Surface]:
    """Return the yarns of a radius [m] at full load, displacements true to scale, drawn as thick as a share of it."""
    place = history["centreline"].to_numpy() + history["centreline_displacement"].to_numpy()[-1]
    u_z = elevation(history)
    return [
        part
        for piece in pieces(history, radius)
        for part in graded_tube(place[piece], thickness * radius, colours(u_z[piece], norm))
    ]


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
