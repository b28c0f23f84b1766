"""Fig. 3a: which crossings of the knit are tied, and which may touch with friction, in course tension."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from knitstudy.figures.annotation import MILLIMETRE
from knitstudy.figures.front import front_view
from knitstudy.figures.style import ACCENT, INK, PAPER, YARNS, styled, tint
from knitstudy.figures.surface import tube
from knitstudy.figures.view import FRONT
from knitstudy.geometry.pattern import Knit

STEP = 0.15
"""Distance of the points that yarns are drawn through, in radii."""

TIED = {"marker": "s", "s": 24, "facecolor": ACCENT, "edgecolor": PAPER, "label": "tied"}
FRICTION = {"marker": "o", "s": 30, "facecolor": PAPER, "edgecolor": INK, "label": "contact with friction"}


@styled
def draw(geometry: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the undeformed knit with a mark at every crossing.

    Parameters
    ----------
    geometry, contacts : Dataset
        Of one direct simulation with isotropic friction (see docs/architecture.md).
    """
    knit = Knit.from_dataset(geometry)
    radius = knit.loop.radius
    surfaces = [
        tube(
            curve.position(np.linspace(0, curve.length, round(curve.length / (STEP * radius)))),
            radius,
            tint(YARNS[i % len(YARNS)]),
        )
        for i, curve in enumerate(knit.centrelines)
    ]
    drawing, axes = front_view(surfaces)
    tied = contacts["tied"].to_numpy().astype(bool)
    place = MILLIMETRE * FRONT.project(knit.crossings.point.mean(axis=1))
    for which, look in ((tied, TIED), (~tied, FRICTION)):
        axes.scatter(*place[which].T, linewidth=1.2, zorder=6, **look)
    drawing.legend(loc="lower center", ncols=2, labelcolor=INK)
    return drawing
