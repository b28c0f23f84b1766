"""Figs. 1, 3 and 4: the unit cell, the crossings and grips of the knit, and the two-dimensional model on it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.specimens import cut_cells
from knitstudy.knit.loading.history import DIRECTIONS
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.knit.models.rom2d import build as network_2d
from knitstudy.measures.centre_cell import loop_of
from knitstudy.paper.figures import MODELS
from knitstudy.paper.scene_names import of_solid, solid
from knitstudy.run.catalogue import FIGURES
from knitstudy.use.solids import (
    FRONT,
    HALO,
    Picture,
    Surface,
    View,
    bounds,
    draw_arrow,
    draw_rows,
    sphere,
    yarn_colours,
    yarn_of_mesh,
    yarn_tubes,
)
from knitstudy.use.style import ACCENT, INK, MILLIMETRE, PAPER, SINGLE, YARNS, Style, shared_legend, tint

WIDTH = 120.0  # of the figure [mm]
VIEW = View.orbit(turn=-24, tilt=14)
COLOURS = (YARNS[2], YARNS[0], YARNS[1])  # of the head, the left foot and the right one
BULGE = 1.7  # radius of a sphere over the yarn's: it must show outside of both yarns that it marks
STATES = ("before", "after")


@FIGURES.add(
    "fig01_unit_cell",
    "Fig. 1: unit cell before and after optimisation",
    results={"geometry": solid("geometry", "tie-course")},
)
def draw_unit_cell(geometry: xr.Dataset) -> Figure:
    """Draw the three pieces of yarn of a cell: one head (blue) between two feet (red and green), as in the paper.

    White spheres mark where yarns penetrate each other.
    """
    knits = [cut_cells(loop_of(geometry, state), loops=1, rows=1) for state in STATES]
    yarns = [yarn_tubes(knit, COLOURS) for knit in knits]
    window = bounds([*yarns[0], *yarns[1]], VIEW)
    pictures = [
        Picture(tubes + overlaps(knit), VIEW, window, 5) for tubes, knit in zip(yarns, knits, strict=True)
    ]
    titles = [f"{state} optimisation" for state in STATES]
    drawing, panels = draw_rows([pictures], WIDTH, foot=13.0, titles=titles)
    for axes, state in zip(panels, STATES, strict=True):
        text = _numbers(geometry.sel(state=state), float(geometry["radius"]))
        axes.text(0.5, -0.06, text, transform=axes.transAxes, ha="center", va="top")
    return drawing


def overlaps(knit: Fabric) -> list[Surface]:
    """Return a sphere halfway between centrelines that come nearer than 2R, a little thicker than a yarn."""
    crossings, radius = knit.crossings, knit.radius
    deep = crossings.distance < 2 * radius
    return [sphere(point.mean(axis=0), BULGE * radius, PAPER) for point in crossings.point[deep]]


def _numbers(state: xr.Dataset, radius: float) -> str:
    penetration, gap = float(state["penetration"]), float(state["gap"])
    if penetration > 0:
        return f"deepest penetration {MILLIMETRE * penetration:.2f} mm ({penetration / radius:.2f} $R$)"
    return f"no penetration, smallest gap\n{MILLIMETRE * gap:.3f} mm ({gap / radius:.3f} $R$)"


# ---- Fig. 3

TIED: Style = {"label": "tied", "marker": "s", "s": 20, "facecolor": ACCENT, "edgecolor": PAPER}
TOUCHING: Style = {"label": "contact with friction", "s": 25, "facecolor": PAPER, "edgecolor": INK}
HELD: Style = {"color": INK, "linewidth": 3.4, "label": "held"}
DRIVEN: Style = {"color": "#D9740B", "linewidth": 3.4, "label": "driven"}
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
def draw_interactions(geometry: xr.Dataset, course: xr.Dataset, wale: xr.Dataset) -> Figure:
    """Draw the undeformed knit with a mark at every crossing and its grips, in course and in wale tension."""
    knit = fabric_of(geometry)
    surfaces = yarn_tubes(knit, [tint(colour) for colour in yarn_colours(knit)])
    left, right, bottom, top = bounds(surfaces)
    picture = Picture(surfaces, FRONT, (left, right + 0.7 * PULL, bottom, top + 0.7 * PULL), 5)
    drawing, panels = draw_rows([(picture, picture)], foot=9.0, titles=("course tension", "wale tension"))
    place = MILLIMETRE * FRONT.project(knit.crossings.point.mean(axis=1))
    for axes, direction, contacts in zip(panels, DIRECTIONS, (course, wale), strict=True):
        _draw_grips(axes, knit, direction)
        tied = contacts["tied"].to_numpy().astype(bool)
        for which, look in ((tied, TIED), (~tied, TOUCHING)):
            axes.scatter(*place[which].T, linewidth=1.2, zorder=6, **look)
    shared_legend(drawing, ncols=4, labelcolor=INK)
    return drawing


def _draw_grips(axes: Axes, knit: Fabric, direction: str) -> None:
    """Draw the gripped arcs along the yarns, of ends a stub, and arrows of the load at the driven ones."""
    pull = PULL * FRONT.project(np.eye(3)[0 if direction == "course" else 1])
    stub = STUB * knit.radius
    for look, grip in zip((HELD, DRIVEN), knit.grips[direction], strict=True):
        for yarn, (low, high) in zip(grip.yarn.tolist(), grip.arc, strict=True):
            curve = knit.centrelines[yarn]
            first, last = np.clip((low, high) if high > low else (low - stub, high + stub), 0, curve.length)
            line = MILLIMETRE * FRONT.project(curve.position(np.linspace(first, last, 40)))
            axes.plot(*line.T, **look, marker="", solid_capstyle="butt", zorder=5)
            if look is DRIVEN:
                draw_arrow(axes, line[np.argmax(line @ pull)], pull, DRIVEN["color"], 1.4)


# ---- Fig. 4

BEAM: Style = {"linewidths": 2.2, "capstyle": "round", "path_effects": HALO, "zorder": 5}
ZONE: Style = {"s": 26, "facecolor": PAPER, "edgecolor": ACCENT, "linewidth": 1.4, "zorder": 6}


@FIGURES.add(
    "fig04_honeycomb",
    "Fig. 4: 2D reduced model on the solid knit",
    results=of_solid("tie-course", "geometry", "mesh", "contacts"),
)
def draw_honeycomb(geometry: xr.Dataset, mesh: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the honeycomb over the undeformed mesh, with the contact zones that are its joints."""
    knit = fabric_of(geometry)
    swept = SweptMesh.from_dataset(mesh)
    surfaces = [yarn_of_mesh(swept, i, tint(colour)) for i, colour in enumerate(yarn_colours(knit))]
    picture = Picture(surfaces, FRONT, bounds(surfaces), 5)
    drawing, (axes,) = draw_rows([[picture]], 1.5 * SINGLE, head=0, foot=9.0)
    network = network_2d.planar_network(knit, contacts)
    nodes = MILLIMETRE * FRONT.project(network.nodes)
    colour = MODELS["rom2d"].colour
    beams = LineCollection([*nodes[network.ends]], colors=colour, label="beam of the 2D ROM", **BEAM)
    axes.add_collection(beams, autolim=False)
    zones = MILLIMETRE * FRONT.project(contacts["centroid"].to_numpy())
    axes.scatter(*zones.T, label="contact zone, a joint", **ZONE)
    # Nodes outside of contact zones are the corners and ends of yarns.
    axes.scatter(nodes[:, 0], nodes[:, 1], s=9, color=colour, zorder=5.5, label="node without contact")
    shared_legend(drawing, ncols=3, labelcolor=INK)
    return drawing
