"""Fig. 3: which crossings of the knit are tied, which may touch with friction, and where the knit is gripped."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.run.catalogue import FIGURES, solid
from knitstudy.use.solids import (
    FRONT,
    Picture,
    bounds,
    draw_arrow,
    draw_rows,
    scale_bar,
    yarn_colours,
    yarn_tubes,
)
from knitstudy.use.style import ACCENT, INK, MILLIMETRE, PAPER, panel_letter, shared_legend, tint

TIED = {"marker": "s", "s": 20, "facecolor": ACCENT, "edgecolor": PAPER, "label": "tied"}
FRICTION = {"marker": "o", "s": 25, "facecolor": PAPER, "edgecolor": INK, "label": "contact with friction"}
HELD = {"color": INK, "linewidth": 3.4, "label": "held"}
DRIVEN = {"color": "#D9740B", "linewidth": 3.4, "label": "driven"}
STUB = 1.0  # length of the ends that are drawn as gripped where the grips are faces, in radii
PULL = 2.2  # length of the arrows of the load [mm]


@FIGURES.add(
    "fig03_interactions",
    "Fig. 3: crossings that are tied and that touch with friction, and grips",
    results={
        "geometry": solid("geometry", "isotropic-course"),
        "course": solid("contacts", "isotropic-course"),
        "wale": solid("contacts", "isotropic-wale"),
    },
)
def draw(geometry: xr.Dataset, course: xr.Dataset, wale: xr.Dataset) -> Figure:
    """Draw the undeformed knit with a mark at every crossing and its grips, in course and in wale tension."""
    knit = fabric_of(geometry)
    surfaces = yarn_tubes(knit, [tint(colour) for colour in yarn_colours(knit)])
    left, right, bottom, top = bounds(surfaces)
    picture = Picture(surfaces, FRONT, (left, right + 0.7 * PULL, bottom, top + 0.7 * PULL))
    drawing, panels = draw_rows([(picture, picture)], foot=9.0)
    place = MILLIMETRE * FRONT.project(knit.crossings.point.mean(axis=1))
    for axes, letter, (direction, contacts) in zip(
        panels, "ab", {"course": course, "wale": wale}.items(), strict=True
    ):
        _draw_grips(axes, knit, direction)
        tied = contacts["tied"].to_numpy().astype(bool)
        for which, look in ((tied, TIED), (~tied, FRICTION)):
            axes.scatter(*place[which].T, linewidth=1.2, zorder=6, **look)
        panel_letter(axes, letter, f"{direction} tension")
        scale_bar(axes, 5, FRONT)
    shared_legend(drawing, ncols=4, labelcolor=INK)
    return drawing


def _draw_grips(axes: Axes, knit: Fabric, direction: str) -> None:
    """Draw the gripped arcs along the yarns, of ends a stub, and arrows of the load at the driven ones."""
    pull = PULL * FRONT.project(np.eye(3)[0 if direction == "course" else 1])
    stub = STUB * knit.radius
    for look, grip in zip((HELD, DRIVEN), knit.grips[direction], strict=True):
        for yarn, (low, high) in zip(grip.yarn.tolist(), grip.arc, strict=True):
            curve = knit.centrelines[yarn]
            arc = (low, high) if high > low else (low - stub, high + stub)
            line = MILLIMETRE * FRONT.project(curve.position(np.linspace(*np.clip(arc, 0, curve.length), 40)))
            axes.plot(*line.T, **look, marker="", solid_capstyle="butt", zorder=5)
            if look is DRIVEN:
                draw_arrow(axes, line[np.argmax(line @ pull)], pull, DRIVEN["color"], 1.4)
