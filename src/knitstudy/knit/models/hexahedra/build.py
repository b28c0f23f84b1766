"""Solid yarns of hexahedra: linear ones of a swept mesh (section 2.3), and quadratic ones of the same mesh."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConfigurationError, MeshError
from knitstudy.knit.contacts.facets import Rings
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.loading.gates import (
    fewest_across,
    least_stiffness,
    require_elements_across,
)
from knitstudy.knit.loading.solve import Problem
from knitstudy.knit.mesh.mesher import Grips, grips, load_of
from knitstudy.knit.mesh.quadratic import FACE_CENTRE, QuadraticMesh, quadratic_mesh
from knitstudy.knit.mesh.quality import require_memory_to_simulate
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.knit.models.hexahedra import Hexahedra, HexahedralScene, PairOfHexahedra
from knitstudy.knit.yarns import solids
from knitstudy.knit.yarns.discretisation import ContactOfSolids, Discretisation, yarn_surfaces
from knitstudy.knit.yarns.interactions import penalties
from knitstudy.mechanics.contact.grids import Grid, Grids, circular_chords
from knitstudy.mechanics.contact.solid import Penetration
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.materials import material_of
from knitstudy.mechanics.solids.elements import ELEMENTS, ElementGroup
from knitstudy.mechanics.solids.elements.hexahedron import EDGES, NODES, InverseMap, quadratic_shape, shape

# Shares of an element's volume by its number of nodes; of quadratic ones in proportion to the squares of the functions,
# whose own integrals are negative at corners (Hinton, Rock and Zienkiewicz 1976)
LUMPED = {8: np.full(8, 1 / 8), 20: np.repeat([7 / 248, 2 / 31], [8, 12])}


def _volume(count: int, groups: tuple[ElementGroup, ...]) -> Floats:
    """Return the volume (N,) of every node [m3], from the elements around it."""
    (group,) = groups
    elements = group.connectivity
    volume = group.elements.volume.reshape(-1, len(elements)).sum(axis=0)  # of its integration points
    shares = volume[:, None] * LUMPED[elements.shape[1]]
    return np.bincount(elements.ravel(), shares.ravel(), count).astype(float)


def _ends(mesh: QuadraticMesh, corners: Grips) -> Grips:
    """Return gripped nodes, from gripped corners: a middle is gripped where both ends of its edge are."""
    ends = []
    for nodes in (corners.held, corners.driven):
        gripped = np.zeros(len(mesh.nodes), dtype=bool)
        gripped[mesh.corner_nodes[nodes]] = True
        gripped[mesh.elements[:, 8:][gripped[mesh.elements[:, EDGES]].all(axis=2)]] = True
        ends.append(np.flatnonzero(gripped))
    return Grips(*ends)


def _dependence(mesh: QuadraticMesh) -> sp.csr_matrix:
    """Return nodes as weighted sums of nodes (N, N): the centres of faces are."""
    count = len(mesh.nodes)
    free = np.setdiff1d(np.arange(count), mesh.face_centres)
    rows = np.concatenate([free, np.repeat(mesh.face_centres, 8)])
    columns = np.concatenate([free, mesh.faces.ravel()])
    values = np.concatenate([np.ones(len(free)), np.tile(FACE_CENTRE, len(mesh.face_centres))])
    return sp.csr_matrix((values, (rows, columns)), shape=(count, count))


def build(scene: HexahedralScene, fabric: Fabric, mesh: SweptMesh) -> Problem:
    """Return a scene with yarns of hexahedra as a problem.

    Raises ConfigurationError if the fabric is endless; MeshError if elements are too large for the yarn or folded, the
    simulation does not fit into memory, a crossing cannot be tied, or yarns overlap.
    """
    if len(fabric.periods):
        raise ConfigurationError(
            f"scene {scene.name!r}: specimen is {scene.specimen}, which hexahedra cannot model; use spline_yarns"
        )
    return solids.problem(
        scene, fabric, solids.assemble(scene, scene.tie, fabric, discretise(scene, fabric, mesh))
    )


def discretise(scene: HexahedralScene, fabric: Fabric, mesh: SweptMesh) -> Discretisation:
    """Return the yarns of a scene as hexahedra that are fit to be simulated.

    Raises MeshError if elements are too large for the yarn, or too many for the memory; or if penalties of contact are
    softer than the yarns.
    """
    fewest = scene.gates.elements_across or fewest_across(scene.specimen, scene.mesh.refinement)
    require_elements_across(scene.mesh.size, fewest)
    parts = divide(scene, mesh, fabric)
    nodes_an_element = kind_of(scene).nodes
    require_memory_to_simulate(parts.nodes.size, parts.bandwidth, scene.mesh.size, nodes_an_element)
    if not isinstance(scene, Hexahedra | PairOfHexahedra):
        return parts
    contact, yarn, friction = scene.contact, scene.yarn, scene.friction
    stiffness = contact.tangential_stiffness
    if stiffness < (least := least_stiffness(yarn.poisson_ratio, patch=np.pi)):  # of a facet's size
        fact = f"contact.tangential_stiffness is {stiffness:g}: contact would be softer than yarns are there"
        raise MeshError(f"{fact}; use {least:.2g} or more")
    deepest = contact.penetration * parts.size
    remedy = "Use a larger contact.normal_stiffness or contact.augmentations"
    law = penalties(contact, yarn.youngs_modulus, friction, parts.size)
    limit = Penetration(deepest, contact.augmentations, remedy)
    return replace(parts, contact=ContactOfSolids(law, deepest, limit))


def kind_of(scene: HexahedralScene) -> Any:
    """Return the class of a scene's elements."""
    return ELEMENTS.find(scene.mesh.element)


def divide(scene: HexahedralScene, mesh: SweptMesh, fabric: Fabric) -> Discretisation:
    """Return the yarns of a scene as hexahedra, whether or not they are fit to be simulated; nodes are places.

    Quadratic ones are made one for each of the swept mesh. Raises MeshError if one is folded.
    """
    kind = kind_of(scene)
    material = material_of(scene.yarn)
    load = load_of(scene) or ""
    own: dict[str, Any]
    if kind.nodes == NODES:
        quadratic = quadratic_mesh(mesh, fabric.centrelines)
        function = quadratic_shape
        nodes, elements, yarn, mesh = quadratic.nodes, quadratic.elements, quadratic.yarn, quadratic.corners
        grids = zip(quadratic.grids, quadratic.angles, strict=True)  # through nodes at half the spacing
        own = {
            "station": quadratic.station,
            "bandwidth": quadratic.bandwidth,
            "surfaces": Grids([Grid(grid, chords=circular_chords(angles)) for grid, angles in grids]),
            "rings": Rings.of_rows(quadratic.arc_lengths),
            "ends": _ends(quadratic, grips(mesh, fabric, load)),
            "sampling": sp.identity(len(nodes), format="csr")[quadratic.corner_nodes],
            "dependence": _dependence(quadratic),
        }
    else:
        station = np.repeat(np.arange(mesh.slices), mesh.section.size)
        function = shape
        nodes = mesh.nodes
        elements = mesh.hexahedra
        yarn = mesh.yarn_of_slice[station]
        own = {
            "station": station,
            "bandwidth": mesh.section.size + mesh.section.bandwidth,
            "surfaces": Grids(yarn_surfaces(mesh)),
            "rings": Rings.of_rows(mesh.stations),
            "ends": grips(mesh, fabric, load),
        }

    def groups(places: Floats) -> tuple[ElementGroup, ...]:
        return (ElementGroup(elements, kind(places[elements], material, scene.solver.hourglass)),)

    return Discretisation(
        mesh=mesh,
        nodes=nodes,
        unity=np.ones(len(nodes)),
        yarn=yarn,
        groups=groups,
        volume=partial(_volume, len(nodes)),
        locate=InverseMap(nodes, elements, yarn, function).locate,
        size=scene.mesh.smallest * scene.yarn.radius,
        connectivity=elements,
        **own,
    )
