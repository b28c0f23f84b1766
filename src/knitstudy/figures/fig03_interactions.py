"""Fig. 3: which crossings of the knit are tied, which may touch with friction, and where the knit is gripped."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.annotation import MILLIMETRE
from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.front import front_view
from knitstudy.figures.shapes import tube
from knitstudy.figures.style import ACCENT, INK, PAPER, YARNS, styled, tint
from knitstudy.figures.view import FRONT
from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.catalogue import solid
from knitstudy.study.scene import Scene

STEP = 0.15
"""Distance of the points that yarns are drawn through, in radii."""

TIED = {"marker": "s", "s": 24, "facecolor": ACCENT, "edgecolor": PAPER, "label": "tied"}
FRICTION = {"marker": "o", "s": 30, "facecolor": PAPER, "edgecolor": INK, "label": "contact with friction"}

HELD = {"color": INK, "linewidth": 3.4, "label": "held"}
DRIVEN = {"color": "#D9740B", "linewidth": 3.4, "label": "driven"}

STUB = 1.0
"""Length of the ends that are drawn as gripped in course tension, where the grips are faces, in radii."""

PULL = 2.2
"""Length of the arrows of the load [mm]."""


@FIGURES.add(
    "fig03a_interactions",
    "Fig. 3a: crossings that are tied and that touch with friction, course tension",
    results={
        "geometry": solid("geometry", "isotropic-course"),
        "contacts": solid("contacts", "isotropic-course"),
    },
    scenes=True,
)
@FIGURES.add(
    "fig03b_interactions",
    "Fig. 3b: crossings that are tied and that touch with friction, wale tension",
    results={
        "geometry": solid("geometry", "isotropic-wale"),
        "contacts": solid("contacts", "isotropic-wale"),
    },
    scenes=True,
)
@styled
def draw(geometry: xr.Dataset, contacts: xr.Dataset, scenes: Mapping[str, Scene]) -> Figure:
    """Draw the undeformed knit with a mark at every crossing and its grips.

    Parameters
    ----------
    geometry, contacts : Dataset
        Of one direct simulation with isotropic friction (see docs/architecture.md).
    scenes : mapping of str to Scene
        Its scene as "dns".
    """
    knit = Fabric.from_dataset(geometry)
    radius = knit.radius
    surfaces = [
        tube(
            curve.position(np.linspace(0, curve.length, round(curve.length / (STEP * radius)))),
            radius,
            tint(YARNS[i % len(YARNS)]),
        )
        for i, curve in enumerate(knit.centrelines)
    ]
    drawing, axes = front_view(surfaces, room=0.7 * PULL)
    _draw_grips(axes, knit, scenes["dns"].load.direction)
    tied = contacts["tied"].to_numpy().astype(bool)
    place = MILLIMETRE * FRONT.project(knit.crossings.point.mean(axis=1))
    for which, look in ((tied, TIED), (~tied, FRICTION)):
        axes.scatter(*place[which].T, linewidth=1.2, zorder=6, **look)
    drawing.legend(loc="lower center", ncols=4, labelcolor=INK)
    return drawing


def grips(knit: Fabric, direction: str) -> list[list[tuple[int, np.ndarray]]]:
    """Return what is held and what is driven: yarns and arcs (2,) of each that are gripped; of ends a stub [m]."""
    stub = STUB * knit.radius

    def seen(yarn: int, arc: np.ndarray) -> np.ndarray:
        low, high = arc
        return arc if high > low else np.clip([low - stub, high + stub], 0.0, knit.centrelines[yarn].length)

    return [
        [(int(yarn), seen(yarn, arc)) for yarn, arc in zip(grip.yarn, grip.arc, strict=True)]
        for grip in knit.grips[direction]
    ]


def _draw_grips(axes: Axes, knit: Fabric, direction: str) -> None:
    """Draw the gripped arcs along the yarns, and arrows of the load at the driven ones."""
    pull = PULL * FRONT.project(np.eye(3)[0 if direction == "course" else 1])
    for look, gripped in zip((HELD, DRIVEN), grips(knit, direction), strict=True):
        label = look["label"]
        for yarn, arc in gripped:
            line = MILLIMETRE * FRONT.project(knit.centrelines[yarn].position(np.linspace(*arc, 40)))
            axes.plot(*line.T, **look | {"label": label}, marker="", solid_capstyle="butt", zorder=5)
            label = "_more"
            if look is DRIVEN:
                tail = line[-1] if direction == "course" else line[len(line) // 2]
                _draw_arrow(axes, tail, pull)


def _draw_arrow(axes: Axes, tail: np.ndarray, pull: np.ndarray) -> None:
    axes.annotate(
        "",
        tail + pull,
        tail,
        arrowprops={
            "arrowstyle": "-|>",
            "color": DRIVEN["color"],
            "linewidth": 1.4,
            "shrinkA": 0,
            "shrinkB": 0,
        },
        annotation_clip=False,
        zorder=7,
    )
