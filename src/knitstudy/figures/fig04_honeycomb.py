"""Fig. 4: the two-dimensional reduced model, a honeycomb of beams, on the solid knit that it stands for."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.picture import HALO, front_panels
from knitstudy.figures.renderer import FRONT, MILLIMETRE
from knitstudy.figures.shapes import yarn_of_mesh
from knitstudy.figures.style import ACCENT, INK, MODELS, PAPER, SINGLE, YARNS, tint
from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.catalogue import solid
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models import network_2d
from knitstudy.models.network_3d import Network


@FIGURES.add(
    "fig04_honeycomb",
    "Fig. 4: 2D reduced model on the solid knit",
    results={
        "geometry": solid("geometry", "tie-course"),
        "mesh": solid("mesh", "tie-course"),
        "contacts": solid("contacts", "tie-course"),
    },
)
def draw(geometry: xr.Dataset, mesh: xr.Dataset, contacts: xr.Dataset) -> Figure:
    """Draw the honeycomb over the undeformed mesh, with the contact zones that are its joints."""
    solid = SweptMesh.from_dataset(mesh)
    network = network_2d.planar_network(Fabric.from_dataset(geometry), contacts)
    surfaces = [yarn_of_mesh(solid, i, tint(YARNS[i % len(YARNS)])) for i in range(solid.yarns)]
    drawing, (axes,) = front_panels(surfaces, 1, 1.5 * SINGLE)
    _draw_network(axes, network)
    zones = MILLIMETRE * FRONT.project(contacts["centroid"].to_numpy())
    axes.scatter(*zones.T, s=26, facecolor=PAPER, edgecolor=ACCENT, linewidth=1.4, zorder=6)
    _legend(drawing)
    return drawing


def _draw_network(axes: Axes, network: Network) -> None:
    """Draw beams as lines and their nodes outside of contact zones, the yarns' corners and ends, as dots."""
    nodes = MILLIMETRE * FRONT.project(network.nodes)
    colour = MODELS["rom2d"].colour
    lines = LineCollection(
        nodes[network.ends], colors=colour, linewidths=2.2, capstyle="round", path_effects=HALO, zorder=5
    )
    axes.add_collection(lines, autolim=False)
    axes.scatter(*nodes.T, s=9, color=colour, zorder=5.5)


def _legend(drawing: Figure) -> None:
    colour, dot = MODELS["rom2d"].colour, {"linestyle": "", "marker": "o"}
    zone = {"markersize": 5, "markeredgewidth": 1.4, "markerfacecolor": PAPER, "markeredgecolor": ACCENT}
    handles = [
        Line2D([], [], color=colour, linewidth=2.2, label="beam of the 2D ROM"),
        Line2D([], [], **dot, **zone, label="contact zone, a joint"),
        Line2D([], [], **dot, markersize=3.5, color=colour, label="node without contact"),
    ]
    drawing.legend(handles=handles, loc="lower center", ncols=3, labelcolor=INK)
