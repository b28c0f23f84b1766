"""Meshes of the yarns of a specimen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr

from knitstudy.geometry.cut import grip_ends
from knitstudy.geometry.lay_out import read_specimen
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mesh.memory import require_memory_to_mesh
from knitstudy.mesh.quality import OVERLAP_TOLERANCE, check, check_bending, check_overlap
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import Grading, Spacing
from knitstudy.mesh.sweep import SweptMesh, Targets, sweep
from knitstudy.study.scene import Scene

# ---- Solid mesh of two crossing yarns


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


# ---- Solid mesh of a knit


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


# ---- Cross-sections at which yarns without a mesh of their own are seen and drawn


ACROSS = 6
"""Elements over the diameter, and as close along the yarn near crossings."""

GROWTH = 3.0
"""Distance of sections on legs over that near crossings."""


def sampled_sections(specimen: Knit | YarnPair) -> SweptMesh:
    """Return sections of all yarns in frames without twist, past the gates on their shape.

    All yarns of a knit are one, moved, and what three loops of three yarns do all others do: a large knit takes no
    longer to check.

    Raises
    ------
    MeshError
        If a yarn bends tighter than its radius, or yarns overlap.
    """
    radius, curves = specimen.radius, specimen.centrelines
    knit = None if isinstance(specimen, YarnPair) else specimen
    size, periods = 2 * radius / ACROSS, knit.loops if knit else 1
    spacing = Spacing(
        size,
        GROWTH,
        crossing_stations(specimen),
        curves[0].length / periods,
        reach=REACH * radius,
        ramp=RAMP * radius,
    )
    section = Section.for_size(2 * radius, size)
    part = replace(knit, loops=min(knit.loops, 3), rows=min(knit.rows, 2)) if knit else specimen
    check_bending(part.centrelines[:1] if knit else curves, radius)
    check_overlap(part.centrelines, radius)
    if knit is None:
        return sweep(curves, section, radius, spacing)
    rise = np.array([0.0, knit.loop.course_spacing, 0.0])
    return _repeated(sweep(curves[:1], section, radius, spacing, periods), len(curves), rise)


def _repeated(mesh: SweptMesh, yarns: int, step: np.ndarray) -> SweptMesh:
    """Return a yarn and its images, each moved by `step` (3,) [m] from the one before."""
    shift = np.multiply.outer(np.arange(yarns), step)[:, None]
    nodes = len(mesh.nodes) * np.arange(yarns, dtype=np.int32)[:, None, None]
    return replace(
        mesh,
        nodes=(mesh.nodes + shift).reshape(-1, 3),
        hexahedra=(mesh.hexahedra + nodes).reshape(-1, 8),
        centres=(mesh.centres + shift).reshape(-1, 3),
        frames=np.tile(mesh.frames, (yarns, 1, 1)),
        arc_length=np.tile(mesh.arc_length, yarns),
        first_slice=mesh.slices * np.arange(yarns + 1),
        pull=None,
    )


def crossing_stations(specimen: Knit | YarnPair) -> tuple[float, ...]:
    """Return the arc lengths of all places of a loop, or of a pair's yarn, at which it is crossed [m]."""
    if isinstance(specimen, YarnPair):
        return (float(specimen.crossings.arc_length[0, 0]),)
    return tuple(loop_contacts(specimen).arc_length.tolist())


# ---- Solid mesh of whatever a scene simulates


def mesh_specimen(
    specimen: Knit | YarnPair,
    size: float,
    growth: float,
    refinement: float = 1.0,
    direction: str | None = None,
) -> SweptMesh:
    """Mesh a knit or a pair of yarns; see `mesh_knit` and `mesh_pair` for the sizes and the errors.

    The direction of the load tells where a knit is gripped; a pair has none.
    """
    if isinstance(specimen, YarnPair):
        return mesh_pair(specimen, size, growth, refinement)
    return mesh_knit(specimen, size, growth, refinement, direction)


def mesh_scene(scene: Scene, specimen: Knit | YarnPair) -> SweptMesh:
    """Mesh a scene's specimen with hexahedra, as its keys say."""
    keys, direction = scene.mesh, scene.value("load.direction")
    return mesh_specimen(specimen, keys.size, keys.growth, keys.refinement, direction)


def mesh(scene: Scene, geometry: xr.Dataset) -> xr.Dataset:
    """Return the solid mesh of a scene, from its geometry; both in the formats of docs/architecture.md.

    Yarns without elements across are sampled instead.
    """
    specimen = read_specimen(geometry)
    swept = sampled_sections(specimen) if scene.value("mesh.size") is None else mesh_scene(scene, specimen)
    return swept.to_dataset()
