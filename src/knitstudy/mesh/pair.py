"""Solid mesh of two crossing yarns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from knitstudy.mesh.knit import RAMP, REACH, crossing_grading
from knitstudy.mesh.memory import require_memory_to_mesh
from knitstudy.mesh.quality import OVERLAP_TOLERANCE, check
from knitstudy.mesh.roll import Targets
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Spacing
from knitstudy.mesh.sweep import SweptMesh, sweep

if TYPE_CHECKING:
    from knitstudy.geometry.pair import YarnPair


def mesh_pair(
    pair: YarnPair,
    size: float,
    growth: float = 1.0,
    refinement: float = 1.0,
    overlap: float = OVERLAP_TOLERANCE,
) -> SweptMesh:
    """Mesh both yarns of a pair, and refuse the mesh if it fails a gate.

    The crossing lies in the middle of a layer of elements of each yarn, and the point of contact over the middle of
    a facet.

    Parameters
    ----------
    pair : YarnPair
    size : float
        Element size across the yarns, and along them near the crossing, m.
    growth : float
        Spacing of slices away from the crossing over ``size``.
    refinement : float
        ``size`` over the size of elements right at the crossing, along the yarns and across.
    overlap : float
        Share of the diameter by which the yarns may overlap.

    Raises
    ------
    MeshError
        If the sizes are not allowed, the mesh does not fit into memory, elements are folded, or the yarns overlap.
    """
    radius, crossings = pair.radius, pair.crossings
    require_memory_to_mesh(pair.centrelines, radius, size, growth)
    section = Section.for_size(2 * radius, size)
    grading = crossing_grading(radius, refinement, pair.angle)
    crossing = (crossings.arc_length[0, 0],)
    spacing = Spacing(size, growth, crossing, reach=REACH * radius, ramp=RAMP * radius, grading=grading)
    targets = [Targets(s, crossings.point.mean(axis=1)) for s in crossings.arc_length.T]
    mesh = sweep(pair.centrelines, section, radius, spacing, targets=targets, grading=grading)
    check(mesh, pair.centrelines, overlap)
    return mesh
