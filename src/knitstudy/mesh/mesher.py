"""Meshes of all yarns of a fabric, and their nodes that a load holds and drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from knitstudy.errors import MeshError
from knitstudy.geometry.fabric import Fabric, Grip, fabric_of
from knitstudy.mesh.quality import (
    OVERLAP_TOLERANCE,
    check,
    check_bending,
    check_overlap,
    require_memory_to_mesh,
)
from knitstudy.mesh.section import Section
from knitstudy.mesh.spacing import UNIFORM, Grading, Spacing
from knitstudy.mesh.sweep import SweptMesh, Targets, sweep
from knitstudy.study.scene import Scene

REACH = 1.0
"""Distance from a crossing up to which slices stand at their closest, over the yarn's radius."""

RAMP = 2.0
"""Distance over which their spacing then grows, over the yarn's radius."""

PATCH = 0.5
"""Distance from a crossing of full refinement, over the radius: half of a patch, and what it slides."""

PATCH_RAMP = 1.0
"""Distance over which the refinement then ends, over the radius."""

ACROSS = 6
"""Elements over the diameter of sampled sections, and as close along the yarn near crossings."""

GROWTH = 3.0
"""Distance of sampled sections away from crossings over that near them."""

ROUNDING = 1e-6
"""Lengths in radii that are none: of a surface node over the middle plane of a yarn, of a slice from a grip's end."""


def mesh_fabric(
    fabric: Fabric,
    size: float,
    growth: float = 1.0,
    refinement: float = 1.0,
    load: str | None = None,
    overlap: float = OVERLAP_TOLERANCE,
) -> SweptMesh:
    """Mesh all yarns with hexahedra, and refuse the mesh if it fails a gate.

    Every crossing lies in the middle of a layer of elements, and the point of contact over the middle of a facet. Yarns
    that are copies of each other get the same slices and the same roll, but for slices where grips end.

    Parameters
    ----------
    fabric : Fabric
    size : float
        Element size across the yarn, and along it near crossings. [m]
    growth : float
        Spacing of slices away from crossings over ``size``.
    refinement : float
        ``size`` over the size of elements right at crossings, along the yarn and across.
    load : str, optional
        Direction of the load, which grips depend on.
    overlap : float
        Share of the diameter by which yarns may overlap.

    Raises
    ------
    MeshError
        If the sizes are not allowed, the mesh does not fit into memory, crossings are too close together for them,
        elements are folded, the yarn bends too tightly, or yarns overlap.
    """
    radius, curves = fabric.radius, fabric.centrelines
    require_memory_to_mesh(curves, radius, size, growth)
    grading = crossing_grading(radius, refinement, fabric.angle)
    targets, ends = contact_targets(fabric), fabric.grip_ends(load)
    for yarn, here in ends.items():
        targets[yarn] = targets[yarn].without(here)
    spacings = [crossing_spacing(fabric, yarn, size, growth, grading) for yarn in range(len(curves))]
    section = Section.for_size(2 * radius, size)
    mesh = sweep(curves, section, radius, spacings, fabric.repeats, targets, ends, grading)
    check(mesh, curves, overlap)
    return mesh


def crossing_grading(radius: float, refinement: float, angle: float = 90.0) -> Grading:
    """Return the refinement at crossings of yarns of a radius [m]; it reaches further at a small angle [degrees]."""
    return Grading(refinement, PATCH * radius / np.sin(np.radians(angle)), PATCH_RAMP * radius)


def crossing_spacing(
    fabric: Fabric, yarn: int, size: float, growth: float, grading: Grading = UNIFORM
) -> Spacing:
    """Return the spacing along a yarn: ``size`` [m] near all places where it or a copy of it is crossed."""
    radius, period = fabric.radius, fabric.centrelines[yarn].length / fabric.repeats
    stations = tuple(fabric.places_of_a_repeat(yarn).tolist())
    return Spacing(size, growth, stations, period, REACH * radius, RAMP * radius, grading)


def contact_targets(fabric: Fabric) -> list[Targets]:
    """Return crossings and points of contact of every yarn, as if it had the neighbours of all its copies."""
    return [Targets(*fabric.places(yarn)) for yarn in range(len(fabric.centrelines))]


def sampled_sections(fabric: Fabric) -> SweptMesh:
    """Return sections of all yarns in frames without twist, past the gates on the shape of the yarns.

    They show yarns that have no mesh of their own. Copies of a yarn are swept once.

    Raises
    ------
    MeshError
        If a yarn bends tighter than its radius, or yarns overlap.
    """
    radius = fabric.radius
    check_shape(fabric)
    section = Section.for_size(2 * radius, 2 * radius / ACROSS)
    swept = {
        yarn: sweep(
            fabric.centrelines[yarn : yarn + 1],
            section,
            radius,
            crossing_spacing(fabric, yarn, 2 * radius / ACROSS, GROWTH),
            fabric.repeats,
        )
        for yarn in np.unique(fabric.copy_of).tolist()
    }
    return _side_by_side([swept[one] for one in fabric.copy_of.tolist()], fabric.shift)


def check_shape(fabric: Fabric) -> None:
    """Refuse yarns that bend tighter than their radius or overlap; a smaller fabric that has all pairs stands for it.

    Raises
    ------
    MeshError
    """
    part = fabric.sample or fabric
    check_bending([part.centrelines[yarn] for yarn in np.unique(part.copy_of)], part.radius)
    check_overlap(part.centrelines, part.radius)


def _side_by_side(meshes: list[SweptMesh], shift: np.ndarray) -> SweptMesh:
    """Return meshes of one yarn each as one, moved by vectors (Y, 3) [m]."""
    names = ("nodes", "hexahedra", "centres", "frames", "arc_length")
    joined = {name: np.concatenate([getattr(mesh, name) for mesh in meshes]) for name in names}
    first = {name: np.cumsum([0, *(len(getattr(mesh, name)) for mesh in meshes)]) for name in names}
    for yarn, by in enumerate(shift):
        for name, step in (("nodes", by), ("centres", by), ("hexahedra", first["nodes"][yarn])):
            joined[name][slice(*first[name][yarn : yarn + 2])] += step.astype(joined[name].dtype)
    return replace(meshes[0], **joined, first_slice=first["arc_length"], pull=None)


def mesh_scene(scene: Scene, fabric: Fabric) -> SweptMesh:
    """Mesh a scene's fabric with hexahedra, as its keys say."""
    keys = scene.mesh
    return mesh_fabric(fabric, keys.size, keys.growth, keys.refinement, load_of(scene))


def mesh(scene: Scene, geometry: xr.Dataset) -> xr.Dataset:
    """Return the mesh of a scene, from its geometry; both in the formats of docs/files.md.

    Yarns without elements across are sampled instead.
    """
    fabric = fabric_of(scene, geometry)
    swept = sampled_sections(fabric) if scene.value("mesh.size") is None else mesh_scene(scene, fabric)
    return swept.to_dataset()


# ---- Grips


@dataclass(frozen=True, eq=False)
class Grips:
    """Nodes with prescribed displacements.

    Attributes
    ----------
    held : ndarray of int (h,)
    driven : ndarray of int (k,)
    """

    held: np.ndarray
    driven: np.ndarray


def load_of(scene: Scene) -> str | None:
    """Return the name of a scene's grips (`Fabric.grips`): the direction of its load, or how it is supported."""
    return scene.value("load.direction") or scene.value("pair.support")


def grips(mesh: SweptMesh, scene: Scene, fabric: Fabric) -> Grips:
    """Return the nodes of a mesh that a scene's load holds and drives: all of a slice in an arc that is gripped.

    Raises
    ------
    MeshError
        If no slice stands where an arc ends: the mesh was made for another direction.
    """
    load = load_of(scene)
    require_slices(mesh, fabric.grip_ends(load))
    return Grips(*(gripped_nodes(mesh, grip) for grip in fabric.grips[load]))


def require_slices(mesh: SweptMesh, ends: Mapping[int, np.ndarray]) -> None:
    """Refuse a mesh without a slice where a grip ends: what is gripped would be shorter by a part of an element.

    Raises
    ------
    MeshError
        Naming an arc length of `ends`, by yarn [m], at which no slice stands.
    """
    for yarn, own in ends.items():
        apart = np.abs(mesh.stations[yarn][:, None] - own).min(axis=0)
        if apart.size and apart.max() > ROUNDING * mesh.radius:
            raise MeshError(
                f"mesh of yarn {yarn}: no slice at s = {own[apart.argmax()]:.6g} m, where a grip ends; mesh the fabric "
                "for the direction of the load"
            )


def gripped_nodes(mesh: SweptMesh, grip: Grip) -> np.ndarray:
    """Return the nodes (n,) of all slices in gripped arcs, or those of the half of their surface that is gripped."""
    slices = np.flatnonzero(grip.holds(mesh.yarn_of_slice, mesh.arc_length))
    nodes = mesh.slice_nodes(slices)
    if grip.side is None:
        return nodes.ravel()
    surface = nodes[:, mesh.section.ring]
    height = (mesh.nodes[surface] - mesh.centres[slices, None]) @ grip.side
    return np.sort(surface[height > ROUNDING * mesh.radius])
