"""Memory and time that a simulation is expected to take, from its scene alone: for the placement of jobs.

Unknowns are counted from the scene, bytes and seconds an unknown were measured (docs/notes/performance.md). Stages
refuse a scene that does not fit, by its mesh; the expectation is there before the mesh is.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Any

import psutil

from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.specimens import Looped

MEGABYTE = 1e6

PROCESS = 350e6  # Bytes of a process with all that it imports, and of a small model

BYTES_AN_UNKNOWN = {
    "one_point": {False: 3.5e3, True: 11e3},
    "quadratic": {False: 6e3, True: 9e3},
    "eight_point": {False: 3.5e3, True: 11e3},
    "polynomials": {False: 6e3, True: 16e3},
}
"""Growth of memory with ties and with contact, by elements: the most that was measured on knits of 3 x 3 to 30 x 30."""

FOLLOWED = 300e6  # Bytes of pairs of points that polynomials in contact follow, whatever the size of the knit
LARGE, BYTES_OF_LARGE = 60e3, 7.3e3
"""Unknowns of the largest knits that the most was measured on, and bytes that polynomials in contact take beyond them:
30 x 30 cells took a tenth less than the law."""

SECONDS_AN_UNKNOWN = {
    "one_point": {False: 0.22e-3, True: 1.1e-3},
    "quadratic": {False: 1.0e-3, True: 3.4e-3},
    "eight_point": {False: 0.5e-3, True: 1.5e-3},
    "polynomials": {False: 1.0e-3, True: 6.8e-3},
}
"""Processor time by elements, with ties and with contact: the most that was measured in `INCREMENTS` on knits of 1 x 1
to 10 x 10 with tied outer yarns; outer yarns without ties take up to ten times as long."""

POLYNOMIALS = "polynomials"  # of spline yarns, in the place of elements
INCREMENTS = 12
SPARE = 3  # Limit of a job over its expected time
START = 10  # Minutes on top, for a start on a busy file system

MORE_SLICES, MORE_SPANS = 0.65, 0.6
"""Share of a yarn that lies near crossings, where a mesh is refined and spans are shorter."""

UNEVEN = 1.12  # Number of slices over that of elements of the largest length, `GROWTH` times the size
NODES_OF_QUADRATIC = 3.3  # Number of nodes of quadratic hexahedra over that of linear ones


def machine_memory() -> int:
    """Return the memory of this machine [MB]."""
    return int(psutil.virtual_memory().total / MEGABYTE)


@dataclass(frozen=True)
class Cost:
    """What a result is expected to take: memory [MB], processor time at most [s], unknowns of a direct simulation."""

    memory: int = 1000
    seconds: float = 3.0
    unknowns: float = 0.0


def expected_cost(scene: Scene) -> Cost:
    """Return what a simulation is expected to take."""
    model = scene.kind.fidelity
    touches = scene.kind.interaction.touches
    increments = max(1.0, scene.solver.increments / INCREMENTS)
    if not model.solid:
        cells = scene.value("pattern.loops") * scene.value("pattern.rows")
        memory = round(model.memory + cells * model.memory_a_cell)
        return Cost(memory, increments * model.seconds_a_cell * cells)
    mesh = scene.value("mesh")
    elements = elements_of(mesh)
    if isinstance(scene, Looped):
        from knitstudy.knit.geometry.lay_out import initial_loop  # imports SciPy

        one_more = scene.specimen != "cut_knit"
        length = initial_loop(scene).length * scene.pattern.loops * (scene.pattern.rows + one_more)
    else:
        length = 2 * scene.value("pair.length")
    count = unknowns(mesh, length / scene.yarn.radius)
    seconds = increments * count * SECONDS_AN_UNKNOWN[elements][touches]
    return Cost(memory_of_solids(elements, touches, count), seconds, count)


def memory_of_solids(elements: str, touches: bool, unknowns: float) -> int:
    """Return the memory of a direct simulation [MB] by its elements, whether yarns are in contact, and its unknowns."""
    bytes_an_unknown = BYTES_AN_UNKNOWN[elements][touches]
    growth = unknowns * bytes_an_unknown
    if touches and elements == POLYNOMIALS:
        followed = FOLLOWED + min(unknowns, LARGE) * bytes_an_unknown
        beyond = max(unknowns - LARGE, 0.0)
        growth = followed + beyond * BYTES_OF_LARGE
    return round((PROCESS + growth) / MEGABYTE)


def time_limit(seconds: float) -> int:
    """Return the time after which a queue may end a job of an expected processor time [s] [min]."""
    return START + ceil(SPARE * seconds / 60)


def elements_of(mesh: Any) -> str:
    """Return the elements of a section ``mesh`` of solid yarns, by which their cost was measured."""
    element = getattr(mesh, "element", POLYNOMIALS)
    return element if element in BYTES_AN_UNKNOWN else "one_point"


def unknowns(mesh: Any, length: float) -> float:
    """Return about how many unknowns yarns of a drawn length [yarn radii] have by a section ``mesh`` of solid yarns."""
    if elements_of(mesh) == POLYNOMIALS:
        degree = mesh.crossing_degree
        functions = (degree + 1) * (degree + 2) / 2
        near = 1 + MORE_SPANS * (mesh.span / mesh.crossing_span - 1)
        return 3 * functions * near * length / mesh.span
    from knitstudy.knit.mesh.section import GROWTH, nodes_for_size

    slices = UNEVEN * (1 + MORE_SLICES * (mesh.refinement - 1)) * length / (GROWTH * mesh.size)
    nodes = slices * nodes_for_size(2, mesh.size)
    return 3 * nodes * (NODES_OF_QUADRATIC if elements_of(mesh) == "quadratic" else 1.0)
