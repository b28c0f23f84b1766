"""Fig. 4: the two-dimensional reduced model, a honeycomb of beams, on the solid knit that it stands for."""

from __future__ import annotations

import xarray as xr
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.knit.models.rom2d import build as network_2d
from knitstudy.run.catalogue import FIGURES, of_solid
from knitstudy.use.solids import (
    FRONT,
    HALO,
    Picture,
    bounds,
    draw_rows,
    scale_bar,
    yarn_colours,
    yarn_of_mesh,
)
from knitstudy.use.style import ACCENT, INK, MILLIMETRE, MODELS, PAPER, SINGLE, shared_legend, tint

BEAM = {"linewidths": 2.2, "capstyle": "round", "path_effects": HALO, "zorder": 5}
ZONE = {"s": 26, "facecolor": PAPER, "edgecolor": ACCENT, "linewidth": 1.4, "zorder": 6}


@FIGURES.add(
    "fig04_honeycomb",
    "Fig. 4: 2D reduced model on the solid knit",
    results=of_solid("tie-course", "geometry", "mesh", "contacts"),
)
def draw(geometry: xr.Dataset, mesh: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the honeycomb over the undeformed mesh, with the contact zones that are its joints."""
    knit, swept = fabric_of(geometry), SweptMesh.from_dataset(mesh)
    surfaces = [yarn_of_mesh(swept, i, tint(colour)) for i, colour in enumerate(yarn_colours(knit))]
    picture = Picture(surfaces, FRONT, bounds(surfaces))
    drawing, (axes,) = draw_rows([[picture]], 1.5 * SINGLE, head=0, foot=9.0)
    scale_bar(axes, 5, FRONT)
    network = network_2d.planar_network(knit, contacts)
    nodes, colour = MILLIMETRE * FRONT.project(network.nodes), MODELS["rom2d"].colour
    beams = LineCollection(nodes[network.ends], colors=colour, label="beam of the 2D ROM", **BEAM)
    axes.add_collection(beams, autolim=False)
    zones = MILLIMETRE * FRONT.project(contacts["centroid"].to_numpy())
    axes.scatter(*zones.T, label="contact zone, a joint", **ZONE)
    # Nodes outside of contact zones are the corners and ends of yarns.
    axes.scatter(*nodes.T, s=9, color=colour, zorder=5.5, label="node without contact")
    shared_legend(drawing, ncols=3, labelcolor=INK)
    return drawing
