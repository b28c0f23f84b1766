"""Solid yarns of a scene, put together: mesh, ties, contact, and the grips that hold and drive them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.crossings.facets import CrossingFacets
from knitstudy.crossings.tied_crossings import tied_crossings, tied_pieces
from knitstudy.gates.resolution import ELEMENTS_ACROSS, require_elements_across
from knitstudy.geometry.pair import Pair
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.elements import ELEMENTS, Hexahedron
from knitstudy.mechanics.free_bodies import FreeBodies
from knitstudy.mechanics.materials import Material
from knitstudy.mechanics.solid import Penetration, SolidModel
from knitstudy.mechanics.stabilisation import Stabilisation
from knitstudy.mesh.grips import Grips, grips
from knitstudy.mesh.memory import require_memory_to_simulate
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.beside_ties import BesideTies
from knitstudy.solids.free_yarns import free_yarns
from knitstudy.solids.tie import Tie, tie_crossings
from knitstudy.solids.yarn_contact import yarn_contact
from knitstudy.study.scene import Scene


@dataclass(frozen=True, eq=False)
class SolidYarns:
    """A specimen of solid yarns.

    Attributes
    ----------
    mesh : SweptMesh
    model : SolidModel
    tie : Tie
    facets : CrossingFacets
    beside : BesideTies or None
        Watches tied yarns where others are in contact.
    ends : Grips
    """

    mesh: SweptMesh
    model: SolidModel
    tie: Tie
    facets: CrossingFacets
    beside: BesideTies | None
    ends: Grips


def assemble(scene: Scene, mesh: SweptMesh, specimen: Knit | Pair) -> SolidYarns:
    """Return the solid yarns of a scene.

    Raises
    ------
    MeshError
        If elements are too large for the yarn, the simulation does not fit into memory, an element is folded after
        the tied nodes were moved, a crossing cannot be tied, or yarns overlap.
    """
    _require_resolution(scene, mesh)
    tied = tied_crossings(scene, specimen.crossings)
    tie = tie_crossings(mesh, specimen, scene.tie.tolerance, tied)
    pieces = tied_pieces(mesh, specimen.crossings, tied)
    ends = grips(mesh, scene, specimen)
    model = _model(scene, mesh, tie, pieces, ends)
    watched = model.contact is not None and tied.any()
    return SolidYarns(
        mesh=mesh,
        model=model,
        tie=tie,
        facets=CrossingFacets.of(specimen.crossings, mesh),
        beside=BesideTies(scene, mesh, tie, pieces) if watched else None,
        ends=ends,
    )


def _require_resolution(scene: Scene, mesh: SweptMesh) -> None:
    """Refuse meshes that are too coarse for the yarn, or too fine for the memory."""
    fewest = scene.gates.elements_across or ELEMENTS_ACROSS[scene.specimen]
    require_elements_across(scene.yarn.diameter, scene.mesh.size, fewest)
    require_memory_to_simulate(mesh.nodes.size, mesh.section.size + mesh.section.bandwidth, scene.mesh.size)


def _node_volume(elements: Hexahedron, mesh: SweptMesh) -> np.ndarray:
    """Return an eighth of the volume of all elements at every node (N,) [m3]."""
    return np.bincount(mesh.hexahedra.ravel(), np.repeat(elements.volume / 8, 8), len(mesh.nodes))


def _model(scene: Scene, mesh: SweptMesh, tie: Tie, pieces: np.ndarray, ends: Grips) -> SolidModel:
    yarn, size = scene.yarn, scene.mesh.size
    material = Material(yarn.material, yarn.youngs_modulus, yarn.poisson_ratio)
    corners = tie.nodes[mesh.hexahedra]
    elements = ELEMENTS.find(scene.mesh.element).build(corners, material, scene.solver.hourglass)
    dependence = tie.dependence() if len(tie.slave) else None
    contact = stabilisation = free = None
    limits = Penetration()
    if scene.kind.interaction.touches:
        contact = yarn_contact(scene, mesh, tie.nodes, pieces)
        limits = Penetration(scene.contact.penetration * size, scene.contact.augmentations)
        if yarns := free_yarns(mesh, tie, ends):
            free = FreeBodies.of(yarns, _node_volume(elements, mesh), yarn.youngs_modulus, size)
    if scene.solver.stabilisation > 0:
        volume = _node_volume(elements, mesh)
        kept = volume if dependence is None else dependence.T @ volume
        stabilisation = Stabilisation.of(scene.solver.stabilisation, yarn.youngs_modulus, size, kept)
    return SolidModel(
        tie.nodes, mesh.hexahedra, elements, size, dependence, contact, limits, stabilisation, free
    )
