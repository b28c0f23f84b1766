"""Fig. 5: from two contacts of an interlock to the points C1 to C4 of the three-dimensional reduced model."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.annotation import MILLIMETRE, label, scale_bar, triad
from knitstudy.figures.interlock import Interlock, piece
from knitstudy.figures.picture import bounds, show
from knitstudy.figures.style import ACCENT, INK, PAPER, SINGLE, YARNS, figure, styled
from knitstudy.figures.surface import Surface, arrow, plate
from knitstudy.figures.view import View
from knitstudy.geometry.pattern import Knit

VIEW = View.orbit(turn=-22, tilt=30)

WIDTH = 1.6 * SINGLE

SILL = 0.4
"""Room below the yarns for the scale bar [mm]."""

REACH = 3.6
"""How much of the yarns is shown on either side of a contact, in radii."""

ARROW = 2.6
"""Length of a drawn normal, in radii."""

PLACES = {
    "C_1": (-32, 20),
    "C_2": (14, 34),
    "C_3": (36, 20),
    "C_4": (-36, -8),
    "P_1": (-38, -22),
    "P_2": (42, -4),
}
"""Where the names stand, points from what they name."""


@styled
def draw(geometry: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the upper contacts of the middle interlock, with translucent yarns.

    Parameters
    ----------
    geometry, contacts : Dataset
        Of one direct simulation (see docs/architecture.md).
    """
    knit = Knit.from_dataset(geometry)
    interlock = Interlock.in_the_middle(knit, contacts)
    surfaces = _yarns(knit, interlock) + _marks(interlock, knit.loop.radius)
    left, right, bottom, top = bounds(surfaces, VIEW)
    window = (left, right, bottom - SILL, top)
    drawing = figure(WIDTH, WIDTH * (window[3] - window[2]) / (window[1] - window[0]))
    axes = drawing.add_axes((0, 0, 1, 1))
    show(axes, surfaces, VIEW, window)
    _names(axes, interlock, knit.loop.radius)
    scale_bar(axes, 1)
    triad(axes, VIEW, 0.8, (0.88, 0.1))
    return drawing


def _yarns(knit: Knit, interlock: Interlock) -> list[Surface]:
    """The lower yarn's head and the upper yarn's two legs as translucent tubes, with their centrelines."""
    radius = knit.loop.radius
    reach = REACH * radius
    lower, upper = interlock.yarn
    head, legs = interlock.arc_length[:, 0], interlock.arc_length[:, 1]
    spans = [(lower, head.min() - reach, head.max() + reach)]
    spans += [(upper, s - reach, s + reach) for s in legs]
    colour = {lower: YARNS[2], upper: YARNS[1]}
    tubes = [piece(knit, yarn, start, end, radius, colour[yarn], 0.38) for yarn, start, end in spans]
    return tubes + [piece(knit, yarn, start, end, 0.06 * radius, colour[yarn]) for yarn, start, end in spans]


def _marks(interlock: Interlock, radius: float) -> list[Surface]:
    """Contact normals and the plane that they span with P1 and P2."""
    line = interlock.P[1] - interlock.P[0]
    along = line / np.linalg.norm(line)
    across = np.cross(interlock.plane, along)
    half = np.linalg.norm(line) / 2 * along + 2.2 * radius * along
    middle, rise = interlock.P.mean(axis=0), 2.6 * radius * across
    corners = np.stack(
        [middle - half - rise, middle + half - rise, middle + half + rise, middle - half + rise]
    )
    marks = [plate(corners, "#B9B9B9", 0.35)]
    normals = zip(interlock.P, interlock.normal, strict=True)
    return marks + [arrow(point, ARROW * radius * normal, 0.06 * radius, ACCENT) for point, normal in normals]


def _names(axes: Axes, interlock: Interlock, radius: float) -> None:
    """Dots and names over the picture, so that no yarn dims them."""
    points = {f"C_{i + 1}": interlock.C[i % 2, i // 2] for i in range(4)}
    points |= {f"P_{i + 1}": interlock.P[i] for i in range(2)}
    for name, point in points.items():
        colour = ACCENT if name.startswith("P") else INK
        axes.scatter(*MILLIMETRE * VIEW.project(point), s=28, color=colour, edgecolor=PAPER, zorder=8)
        label(axes, VIEW, point, f"${name}$", PLACES[name], colour)
    for point, normal in zip(interlock.P, interlock.normal, strict=True):
        label(axes, VIEW, point + ARROW * radius * normal, r"$\mathbf{n}$", (10, -8), ACCENT)
