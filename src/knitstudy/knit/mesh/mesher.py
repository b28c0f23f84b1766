"""Meshes of all yarns of a fabric, and their nodes that a load holds and drives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from knitstudy.errors import MeshError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.mesh.quality import check_bending, check_folding, check_overlap, require_memory_to_mesh
from knitstudy.knit.mesh.section import GROWTH, UNIFORM, Grading, SectionMesh, Spacing, place_slices
from knitstudy.knit.mesh.sweep import SweptMesh, Targets, sweep
from knitstudy.knit.scene.scene import Scene
from knitstudy.mechanics.core.arrays import Floats, Ints

# Distances from a crossing over the yarn's radius.
REACH = 1.0  # up to which slices stand at their closest
RAMP = 2.0  # over which their spacing then grows
PATCH = 0.5  # of full refinement: half of a patch, and the length that it slides
PATCH_RAMP = 1.0  # over which the refinement then ends

ACROSS = 6  # elements over the diameter of sampled sections, and as close along the yarn near crossings
SAMPLED_GROWTH = 3.0  # distance of sampled sections away from crossings over that near them
# Lengths in radii that are none: of a surface node over the middle plane of a yarn, of a slice from a grip's end.
ROUNDING = 1e-6


def mesh_fabric(
    fabric: Fabric,
    size: float,  # of elements across the yarn, and along it near crossings, in yarn radii
    growth: float = 1.0,  # spacing of slices away from crossings over `size`
    refinement: float = 1.0,  # `size` over the size of elements right at crossings, along the yarn and across
    load: str | None = None,  # its direction, which grips depend on
) -> SweptMesh:
    """Mesh all yarns with hexahedra, and refuse the mesh if it fails a gate.

    Every crossing lies in the middle of a layer of elements, and the point of contact over the middle of a facet. Yarns
    that are copies of each other get the same slices and the same roll, but for slices where grips end.
    Raises MeshError if the sizes are not allowed, the mesh does not fit into memory, crossings are too close together
    for them, elements are folded, the yarn bends too tightly, or yarns overlap.

    Examples
    --------
    >>> from knitstudy.knit.geometry.specimens import yarn_pair
    >>> pair = yarn_pair(radius=0.9e-3, angle=90, length=10e-3, clearance=0.0)
    >>> mesh_fabric(pair, size=0.5, growth=1.2, refinement=1.0).hexahedra.shape
    (798, 8)
    """
    radius, curves = fabric.radius, fabric.centrelines
    require_memory_to_mesh(curves, radius, size, growth)
    size *= radius
    # Refinement reaches further where yarns cross at a small angle
    grading = Grading(refinement, PATCH * radius / np.sin(np.radians(fabric.angle)), PATCH_RAMP * radius)
    yarns = range(len(curves))
    ends = fabric.grip_ends(load)
    targets = [Targets(*fabric.places(yarn)) for yarn in yarns]
    for yarn, here in ends.items():
        targets[yarn] = targets[yarn].without(here)
    spacings = [crossing_spacing(fabric, yarn, size, growth, grading) for yarn in yarns]
    section = SectionMesh.for_size(2 * radius, size)
    mesh = sweep(curves, section, radius, spacings, fabric.repeats, targets, ends, grading)
    check_bending(curves, radius)
    check_folding(mesh)
    check_overlap(curves, radius)
    return mesh


def crossing_spacing(
    fabric: Fabric, yarn: int, size: float, growth: float, grading: Grading = UNIFORM
) -> Spacing:
    """Return the spacing along a yarn: ``size`` [m] near all places where it or a copy of it is crossed."""
    radius = fabric.radius
    period = fabric.centrelines[yarn].length / fabric.repeats
    stations = tuple(fabric.places_of_a_repeat(yarn).tolist())
    return Spacing(size, growth, stations, period, REACH * radius, RAMP * radius, grading)


def slices_of(fabric: Fabric, size: float, growth: float = 1.0) -> int:
    """Return how many slices `mesh_fabric` gives a fabric gripped at ends alone, without refinement; its arguments."""
    yarns = range(len(fabric.centrelines))
    spacings = [crossing_spacing(fabric, yarn, size * fabric.radius, growth) for yarn in yarns]
    return sum(
        len(place_slices(curve.length, spacing, fabric.repeats, fabric.places(yarn)[0]))
        for yarn, (curve, spacing) in enumerate(zip(fabric.centrelines, spacings, strict=True))
    )


def sampled_sections(fabric: Fabric) -> SweptMesh:
    """Return sections of all yarns in frames without twist, past the gates on the shape of the yarns.

    They show yarns that have no mesh of their own. Copies of a yarn are swept once.
    Raises MeshError if a yarn bends tighter than its radius, or yarns overlap.
    """
    check_shape(fabric)
    radius = fabric.radius
    size = 2 * fabric.radius / ACROSS
    section = SectionMesh.for_size(2 * radius, size)
    swept = {}
    for yarn in np.unique(fabric.copy_of).tolist():
        spacing = crossing_spacing(fabric, yarn, size, SAMPLED_GROWTH)
        swept[yarn] = sweep([fabric.centrelines[yarn]], section, radius, spacing, fabric.repeats)
    return _side_by_side([swept[one] for one in fabric.copy_of.tolist()], fabric.shift)


def check_shape(fabric: Fabric) -> None:
    """Refuse yarns that bend tighter than their radius or overlap; raises MeshError."""
    part = fabric.sample or fabric  # the smaller one has all pairs
    check_bending([part.centrelines[yarn] for yarn in np.unique(part.copy_of)], part.radius)
    check_overlap(part.centrelines, part.radius)


def _side_by_side(meshes: list[SweptMesh], shift: Floats) -> SweptMesh:
    """Return meshes of one yarn each as one, moved by vectors (Y, 3) [m]."""
    nodes, centres = (
        np.concatenate([getattr(mesh, name) + by for mesh, by in zip(meshes, shift, strict=True)])
        for name in ("nodes", "centres")
    )
    names = ("frames", "arc_length", "pull")
    joined: dict[str, Any] = {
        name: np.concatenate([getattr(mesh, name) for mesh in meshes]) for name in names
    }
    first = np.cumsum([0, *(mesh.slices for mesh in meshes)])
    return replace(meshes[0], nodes=nodes, centres=centres, first_slice=first, **joined)


def mesh_scene(scene: Scene, fabric: Fabric) -> SweptMesh:
    """Mesh a scene's fabric with hexahedra, as its keys say."""
    keys = scene.value("mesh")
    return mesh_fabric(fabric, keys.size, GROWTH, keys.refinement, load_of(scene))


def mesh(scene: Scene, geometry: xr.Dataset) -> xr.Dataset:
    """Return the mesh of a scene, from its geometry; both in the formats of docs/reference/files.md.

    Yarns without elements across are sampled instead.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> from knitstudy.knit.geometry.lay_out import lay_out
    >>> pair = load_scene("pair-slid-90")
    >>> mesh(pair, lay_out(pair)).sizes["element"]
    2990
    """
    fabric = fabric_of(geometry)
    swept = sampled_sections(fabric) if scene.value("mesh.size") is None else mesh_scene(scene, fabric)
    return swept.to_dataset()


# ---- Grips


@dataclass(frozen=True, eq=False)
class Grips:
    """Nodes with prescribed displacements."""

    held: Ints
    driven: Ints


def load_of(scene: Scene) -> str | None:
    """Return the name of a scene's grips (`Fabric.grips`): the direction of its load, or how it is supported."""
    return scene.value("load.direction") or scene.value("pair.support")


def grips(mesh: SweptMesh, fabric: Fabric, load: str) -> Grips:
    """Return the nodes of a mesh that a load holds and drives, by the name of its grips.

    These are the nodes of all slices in gripped arcs, or of the gripped half of their surface.
    Raises MeshError if no slice stands where an arc ends: the mesh was made for another direction, and the grip
    would be shorter by a part of an element.
    """
    for yarn, ends in fabric.grip_ends(load).items():
        apart = np.abs(mesh.stations[yarn][:, None] - ends).min(axis=0)
        if apart.size and apart.max() > ROUNDING * mesh.radius:
            raise MeshError(
                f"mesh of yarn {yarn}: no slice at s = {ends[apart.argmax()]:.6g} m, where a grip ends; mesh the "
                "fabric for the direction of the load"
            )
    gripped = []
    for grip in fabric.grips[load]:
        slices = np.flatnonzero(grip.holds(mesh.yarn_of_slice, mesh.arc_length))
        nodes = mesh.slice_nodes(slices)
        if grip.side is not None:
            nodes = nodes[:, mesh.section.ring]
            height = (mesh.nodes[nodes] - mesh.centres[slices, None]) @ grip.side
            nodes = np.sort(nodes[height > ROUNDING * mesh.radius])
        gripped.append(nodes.ravel())
    return Grips(*gripped)
