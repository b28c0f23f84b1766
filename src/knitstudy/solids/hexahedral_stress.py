"""Stress in hexahedra, from the forces of their nodes.

With nodes x_a and forces f_a that an element resists with, sum_a f_a (x) x_a is the integral of P F^T over the
undeformed element, that is, of the Cauchy stress over the deformed one: exactly what the element balances by,
whatever its quadrature and its inner modes. Hourglass control adds a term of second order in the displacements.
"""

from __future__ import annotations

import numpy as np

from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.elements import ElementGroup
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.cell_stress import CellStress
from knitstudy.solids.hexahedra import divide
from knitstudy.solids.tie import tie_of
from knitstudy.study.scene import Scene

CHUNK = 4096
"""Elements that answer at once; bounds the memory."""

CORNERS = 8
"""Nodes of an element whose mean is its middle; those at the middles of edges follow them."""


def cell_stress(
    scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair, displacement: np.ndarray
) -> CellStress:
    """Return the stress in every element from the displacement (N, 3) of the nodes [m]."""
    parts = divide(scene, mesh, specimen)
    nodes = tie_of(scene, parts, specimen).nodes
    moved = nodes + displacement
    (group,), (after,) = parts.groups(nodes), parts.groups(moved)
    corners = group.connectivity[:, :CORNERS]
    return CellStress(
        integral=stress_integral(group, nodes, displacement),
        volume=after.elements.volume,
        reference=nodes[corners].mean(axis=1),
        place=moved[corners].mean(axis=1),
    )


def stress_integral(group: ElementGroup, nodes: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Return the integrals (E, 3, 3) of the Cauchy stress over deformed elements [N m].

    Parameters
    ----------
    group : ElementGroup
    nodes, displacement : ndarray, shape (N, 3)
        Undeformed places and their displacements [m].
    """
    count = len(group.connectivity)
    integral = np.empty((count, 3, 3))
    for first in range(0, count, CHUNK):
        batch = slice(first, min(first + CHUNK, count))
        own = group.connectivity[batch]
        force = group.elements.respond(batch, displacement[own], False).force
        integral[batch] = np.swapaxes(force, 1, 2) @ (nodes + displacement)[own]
    return 0.5 * (integral + np.swapaxes(integral, 1, 2))  # symmetric but for rounding
