"""What a simulation is expected to take of memory, before anything of it is made: for whoever places jobs on machines.

Unknowns are counted from the scene, bytes an unknown were measured (docs/notes/performance.md). Stages refuse what
does not fit, by their meshes; this is known before there is one.
"""

from __future__ import annotations

import psutil

from knitstudy.geometry.lay_out import initial_loop
from knitstudy.mesh.section import nodes_for_size
from knitstudy.study.scene import Scene

MEGABYTE = 1e6

PROCESS = 350e6  # Bytes of a process with all that it imports, and of a small model

BYTES_AN_UNKNOWN = {
    "one_point": {False: 3.5e3, True: 11e3},
    "quadratic": {False: 6e3, True: 9e3},
    None: {False: 6e3, True: 28e3},
}
"""Growth of memory with ties and with contact, by elements (none of polynomials): the most that was measured on knits
of 3 x 3 to 30 x 30."""

MORE_SLICES, MORE_SPANS = 0.65, 0.6
"""Share of a yarn that lies near crossings, where a mesh is refined and spans are shorter."""

UNEVEN = 1.12  # Slices over those of elements as long as `mesh.growth` lets them be
NODES_OF_QUADRATIC = 3.3  # Nodes of quadratic hexahedra over those of linear ones


def machine_memory() -> int:
    """Return the memory of this machine [MB]."""
    return int(psutil.virtual_memory().total / MEGABYTE)


def expected_memory(scene: Scene) -> int:
    """Return what a direct simulation is expected to take [MB]."""
    growth = unknowns(scene) * BYTES_AN_UNKNOWN[_element(scene)][scene.kind.interaction.touches]
    return round((PROCESS + growth) / MEGABYTE)


def unknowns(scene: Scene) -> float:
    """Return about how many unknowns a direct simulation has."""
    mesh, length, radius = scene.mesh, _yarn(scene), scene.yarn.radius
    if _element(scene) is None:
        degree = mesh.crossing_degree
        functions = (degree + 1) * (degree + 2) / 2
        near = 1 + MORE_SPANS * (mesh.span / mesh.crossing_span - 1)
        return 3 * functions * near * length / (mesh.span * radius)
    slices = UNEVEN * (1 + MORE_SLICES * (mesh.refinement - 1)) * length / (mesh.growth * mesh.size * radius)
    nodes = slices * nodes_for_size(2, mesh.size)
    return 3 * nodes * (NODES_OF_QUADRATIC if _element(scene) == "quadratic" else 1.0)


def _element(scene: Scene) -> str | None:
    element = scene.value("mesh.element")
    return element if element in BYTES_AN_UNKNOWN else "one_point"


def _yarn(scene: Scene) -> float:
    """Return the length of all yarns as they are drawn [m]."""
    if scene.specimen == "pair":
        return 2 * scene.pair.length
    pattern, cut = scene.pattern, scene.specimen == "cut_knit"
    return initial_loop(scene).curve.segment_lengths().sum() * pattern.loops * (pattern.rows + (not cut))
