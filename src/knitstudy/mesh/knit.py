"""Solid mesh of a knit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from knitstudy.geometry.arcs import grip_ends
from knitstudy.mesh.grading import Grading
from knitstudy.mesh.memory import require_memory_to_mesh
from knitstudy.mesh.quality import OVERLAP_TOLERANCE, check
from knitstudy.mesh.roll import Targets
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import SweptMesh, sweep

if TYPE_CHECKING:
    from knitstudy.geometry.pattern import Knit

REACH = 1.0
"""Distance from a crossing up to which slices stand at their closest, over the yarn's radius."""

RAMP = 2.0
"""Distance over which their spacing then grows, over the yarn's radius."""

PATCH = 0.5
"""Distance from a crossing of full refinement, over the radius: half of a patch, and what it slides."""

PATCH_RAMP = 1.0
"""Distance over which the refinement then ends, over the radius."""


def mesh_knit(
    knit: Knit,
    size: float,
    growth: float = 1.0,
    refinement: float = 1.0,
    direction: str | None = None,
    overlap: float = OVERLAP_TOLERANCE,
) -> SweptMesh:
    """Mesh all yarns of a knit, and refuse the mesh if it fails a gate.

    Every crossing lies in the middle of a layer of elements, and the point of contact over the middle of a
    facet. All loops get the same slices and the same roll, those of the outer yarns too, which are crossed on
    one side only; but where a grip in wale tension ends, on the other side, there is a slice.

    Parameters
    ----------
    knit : Knit
    size : float
        Element size across the yarn, and along it near crossings, m.
    growth : float
        Spacing of slices away from crossings over ``size``.
    refinement : float
        ``size`` over the size of elements right at crossings, along the yarn and across.
    direction : str, optional
        Of the load.
    overlap : float
        Share of the diameter by which yarns may overlap.

    Raises
    ------
    MeshError
        If the sizes are not allowed, the mesh does not fit into memory, crossings are too close together for them,
        elements are folded, the yarn bends too tightly, or yarns overlap.
    """
    radius = knit.loop.radius
    require_memory_to_mesh(knit.centrelines, radius, size, growth)
    section = Section.for_size(2 * radius, size)
    spacing = crossing_spacing(knit, size, growth, refinement)
    targets, ends = contact_targets(knit), grip_ends(knit, direction)
    for yarn, here in ends.items():
        targets[yarn] = targets[yarn].without(here)
    mesh = sweep(knit.centrelines, section, radius, spacing, knit.loops, targets, ends, spacing.grading)
    check(mesh, knit.centrelines, overlap)
    return mesh


def crossing_grading(radius: float, refinement: float, angle: float = 90.0) -> Grading:
    """Refinement at the crossings of yarns of a radius [m]; patches grow longer where the angle [degrees] is small."""
    return Grading(refinement, PATCH * radius / np.sin(np.radians(angle)), PATCH_RAMP * radius)


def crossing_spacing(knit: Knit, size: float, growth: float, refinement: float = 1.0) -> Spacing:
    """Spacing along a yarn: ``size`` near all places of a loop that are crossed in any row (m)."""
    radius = knit.loop.radius
    grading = crossing_grading(radius, refinement)
    stations = loop_contacts(knit).arc_length
    period = knit.centrelines[0].length / knit.loops
    return Spacing(size, growth, tuple(stations), period, REACH * radius, RAMP * radius, grading)


def contact_targets(knit: Knit) -> list[Targets]:
    """Crossings and points of contact of every yarn, as if all yarns were crossed on both sides."""
    loop, contacts = knit.loop, loop_contacts(knit)
    period = knit.centrelines[0].length / knit.loops
    column = np.arange(knit.loops)[:, None]
    arc_length = (contacts.arc_length + period * column).ravel()
    along, rise = np.diag([loop.wale_spacing, loop.course_spacing, 0.0])[:2]
    points = (contacts.point + column[..., None] * along).reshape(-1, 3)
    return [Targets(arc_length, points + yarn * rise) for yarn in range(knit.rows + 1)]


def loop_contacts(knit: Knit) -> Targets:
    """Crossings of the first loop of yarn 0 with the yarns above and below it, and their points of contact.

    A point of contact lies in the middle between the closest points of the two centrelines. The yarn below
    need not exist: its crossings are those that yarn 1 has with yarn 0, one row lower.
    """
    loop, crossings = knit.loop, knit.crossings
    here = (crossings.row == 0) & (crossings.column == 0)
    middle = crossings.point[here].mean(axis=1)  # (4, 3)
    lower_row = middle - [0.0, loop.course_spacing, 0.0]
    period = knit.centrelines[0].length / knit.loops
    turn, arc_length = np.divmod(crossings.arc_length[here].T.ravel(), period)
    point = np.concatenate([middle, lower_row]) - turn[:, None] * [loop.wale_spacing, 0.0, 0.0]
    order = np.argsort(arc_length)
    return Targets(arc_length[order], point[order])
