"""Surfaces of yarns of hexahedra: smooth through the nodes of their meshes."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.contact.grids import Grid, circular_chords, circular_stretch
from knitstudy.mesh.sweep import SweptMesh


def yarn_surfaces(mesh: SweptMesh) -> list[Grid]:
    """Return the surface of every yarn; its polygon is inflated, the contact surface has the true radius."""
    inflated = mesh.radius * float(np.linalg.norm(mesh.section.points[mesh.section.ring], axis=1).mean())
    stretch = circular_stretch(mesh.section.ring.size)
    graded = circular_chords(mesh.angles) if mesh.pull.any() else None
    grids = []
    for yarn in range(mesh.yarns):
        chords = None if graded is None else graded[slice(*mesh.first_slice[yarn : yarn + 2])]
        grid = Grid(mesh.surface_nodes(yarn), offset=inflated - mesh.radius, stretch=stretch, chords=chords)
        grids.append(grid)
    return grids
