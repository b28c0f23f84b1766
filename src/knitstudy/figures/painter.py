"""Draws surfaces with matplotlib alone, from back to front, where VTK cannot render."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from knitstudy.figures.surface import Surface
from knitstudy.figures.view import View

MILLIMETRE = 1e3

LIGHT = np.array([-0.42, 0.57, 0.70])
"""Direction to the light in the axes of the picture: right, up, to the eye."""

AMBIENT = 0.45


def paint(axes: Axes, surfaces: Sequence[Surface], view: View) -> PolyCollection:
    """Add shaded facets to axes whose coordinates are mm in the plane of the picture.

    Facets are sorted by the distance of their centres: exact for small facets that do not cut each other.
    """
    facets = [_facets(surface, view) for surface in surfaces]
    corners = MILLIMETRE * np.concatenate([facet[0] for facet in facets])
    nearness, colour, edge = (np.concatenate([facet[i] for facet in facets]) for i in (1, 2, 3))
    order = np.argsort(nearness, kind="stable")
    collection = PolyCollection(
        corners[order], facecolors=colour[order], edgecolors=edge[order], linewidths=0.2, rasterized=True
    )
    axes.add_collection(collection, autolim=False)
    return collection


def _facets(surface: Surface, view: View) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return corners (f, 4, 2), nearness (f,) and colours (f, 4) of faces and edges that face the eye."""
    corner = surface.points[surface.faces]
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    facing = normal @ view.basis[2] > 0
    corner, normal = corner[facing], normal[facing] @ view.basis.T
    brightness = AMBIENT + (1 - AMBIENT) * np.clip(normal @ LIGHT, 0, 1)
    colour = np.column_stack(
        [brightness[:, None] * to_rgb(surface.colour), np.full(len(corner), surface.opacity)]
    )
    # Faces of closed tubes are drawn over their own edges to hide the seams between facets.
    edge = np.tile([0.35, 0.35, 0.35, 0.35], (len(corner), 1)) if surface.edges else colour.copy()
    if surface.opacity < 1 and not surface.edges:
        edge[:, 3] = 0.0
    return view.project(corner), view.nearness(corner.mean(axis=1)), colour, edge
