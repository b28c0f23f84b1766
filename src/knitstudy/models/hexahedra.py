"""Solid yarns of hexahedra: linear ones of a swept mesh (section 2.3), and quadratic ones of the same mesh."""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.sparse as sp

from knitstudy.contacts.facets import Rings
from knitstudy.errors import ConfigurationError
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.gates import require_elements_across
from knitstudy.loading.solve import Problem
from knitstudy.mechanics.contact.grids import Grid, Grids, circular_chords
from knitstudy.mechanics.elements import ELEMENTS, ElementGroup
from knitstudy.mechanics.elements.hexahedron import InverseMap, shape
from knitstudy.mechanics.elements.quadratic import EDGES, NODES, quadratic_shape
from knitstudy.mechanics.materials import material_of
from knitstudy.mesh.mesher import Grips, grips
from knitstudy.mesh.quadratic import FACE_CENTRE, QuadraticMesh, quadratic_mesh
from knitstudy.mesh.quality import require_memory_to_simulate
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models import solids
from knitstudy.models.discretisation import Discretisation, yarn_surfaces
from knitstudy.study.scene import Scene


def _elements(scene: Scene, connectivity: np.ndarray, nodes: np.ndarray) -> tuple[ElementGroup, ...]:
    """Return the hexahedra (E, a) of a scene with nodes (N, 3) [m]; MeshError if one is folded."""
    material = material_of(scene.yarn)
    kind = ELEMENTS.find(scene.mesh.element)
    return (ElementGroup(connectivity, kind.build(nodes[connectivity], material, scene.solver.hourglass)),)


def _lumped() -> np.ndarray:
    """Return the share (20,) of a cube's volume that each node gets; three Gauss points are exact for the squares."""
    place, weight = np.polynomial.legendre.leggauss(3)
    natural = np.stack(np.meshgrid(place, place, place, indexing="ij"), axis=-1).reshape(-1, 3)
    squares = np.einsum("i,j,k->ijk", weight, weight, weight).ravel() @ quadratic_shape(natural) ** 2
    return squares / squares.sum()


LUMPED = _lumped()


def _divide_quadratic(scene: Scene, mesh: SweptMesh, fabric: Fabric) -> Discretisation:
    """Return the yarns of a scene as quadratic hexahedra, one for each of a swept mesh."""
    quadratic = quadratic_mesh(mesh, fabric.centrelines)
    return Discretisation(
        mesh=quadratic.corners,
        nodes=quadratic.nodes,
        unity=np.ones(len(quadratic.nodes)),
        yarn=quadratic.yarn,
        station=quadratic.station,
        bandwidth=quadratic.bandwidth,
        groups=partial(_elements, scene, quadratic.elements),
        volume=partial(_volume, len(quadratic.nodes)),
        surfaces=Grids(_grids(quadratic)),
        rings=Rings.of_rows(quadratic.arc_lengths),
        ends=_ends(quadratic, grips(quadratic.corners, scene, fabric)),
        locate=InverseMap(quadratic.nodes, quadratic.elements, quadratic.yarn, quadratic_shape).locate,
        size=scene.mesh.smallest,
        sampling=_sampling(quadratic),
        dependence=_dependence(quadratic),
        connectivity=quadratic.elements,
    )


def _grids(mesh: QuadraticMesh) -> list[Grid]:
    """Return the surface of every yarn, through nodes at half the spacing."""
    pairs = zip(mesh.grids, mesh.angles, strict=True)
    return [Grid(grid, chords=circular_chords(angles)) for grid, angles in pairs]


def _volume(count: int, groups: tuple[ElementGroup, ...]) -> np.ndarray:
    """Return the volume (N,) of every node [m3]: of each element in proportion to the squares of its functions.

    Hinton, Rock and Zienkiewicz (1976); integrals of the functions themselves are negative at corners.
    """
    (group,) = groups
    volume = group.elements.volume[:, None] * LUMPED
    return np.bincount(group.connectivity.ravel(), volume.ravel(), count)


def _ends(mesh: QuadraticMesh, corners: Grips) -> Grips:
    """Return gripped nodes, from gripped corners: a middle is gripped where both ends of its edge are."""
    return Grips(*(_with_middles(mesh, mesh.corner_nodes[nodes]) for nodes in (corners.held, corners.driven)))


def _with_middles(mesh: QuadraticMesh, nodes: np.ndarray) -> np.ndarray:
    gripped = np.zeros(len(mesh.nodes), dtype=bool)
    gripped[nodes] = True
    gripped[mesh.elements[:, 8:][gripped[mesh.elements[:, EDGES]].all(axis=2)]] = True
    return np.flatnonzero(gripped)


def _sampling(mesh: QuadraticMesh) -> sp.csr_matrix:
    """Return the matrix (M, N) that selects the corners."""
    count = len(mesh.corner_nodes)
    return sp.csr_matrix(
        (np.ones(count), (np.arange(count), mesh.corner_nodes)), shape=(count, len(mesh.nodes))
    )


def _dependence(mesh: QuadraticMesh) -> sp.csr_matrix:
    """Return nodes as weighted sums of nodes (N, N): the centres of faces are."""
    count = len(mesh.nodes)
    free = np.setdiff1d(np.arange(count), mesh.face_centres)
    rows = np.concatenate([free, np.repeat(mesh.face_centres, 8)])
    columns = np.concatenate([free, mesh.faces.ravel()])
    values = np.concatenate([np.ones(len(free)), np.tile(FACE_CENTRE, len(mesh.face_centres))])
    return sp.csr_matrix((values, (rows, columns)), shape=(count, count))


def build(scene: Scene, fabric: Fabric, mesh: SweptMesh) -> Problem:
    """Return a scene with yarns of hexahedra as a problem.

    Raises
    ------
    ConfigurationError
        If the fabric is endless or its yarns are arcs of others.
    MeshError
        If elements are too large for the yarn or folded, the simulation does not fit into memory, a crossing cannot be
        tied, or yarns overlap.
    """
    if len(fabric.periods) or fabric.arcs is not None:
        raise ConfigurationError(
            f"scene {scene.name!r}: specimen is {scene.specimen}, which hexahedra cannot model; use spline_yarns"
        )
    return solids.problem(scene, fabric, solids.assemble(scene, fabric, discretise(scene, fabric, mesh)))


def discretise(scene: Scene, fabric: Fabric, mesh: SweptMesh) -> Discretisation:
    """Return the yarns of a scene as hexahedra that are fit to be simulated.

    Raises MeshError if elements are too large for the yarn, or too many for the memory.
    """
    require_elements_across(scene)
    parts = divide(scene, mesh, fabric)
    each = parts.connectivity.shape[1]
    require_memory_to_simulate(parts.nodes.size, parts.bandwidth, scene.mesh.size, each)
    return parts


def divide(scene: Scene, mesh: SweptMesh, fabric: Fabric) -> Discretisation:
    """Return the yarns of a scene as hexahedra, whether or not they are fit to be simulated.

    Raises MeshError if one is folded.
    """
    if ELEMENTS.find(scene.mesh.element).nodes == NODES:
        return _divide_quadratic(scene, mesh, fabric)
    station = np.repeat(np.arange(mesh.slices), mesh.section.size)
    return Discretisation(
        mesh=mesh,
        nodes=mesh.nodes,
        unity=np.ones(len(mesh.nodes)),
        yarn=mesh.yarn_of_slice[station],
        station=station,
        bandwidth=mesh.section.size + mesh.section.bandwidth,
        groups=partial(_elements, scene, mesh.hexahedra),
        volume=partial(_volume_hexahedra, len(mesh.nodes)),
        surfaces=Grids(yarn_surfaces(mesh)),
        rings=Rings.of_rows(mesh.stations),
        ends=grips(mesh, scene, fabric),
        locate=InverseMap(mesh.nodes, mesh.hexahedra, mesh.yarn_of_slice[station], shape).locate,
        size=scene.mesh.smallest,
        connectivity=mesh.hexahedra,
    )


def _volume_hexahedra(count: int, groups: tuple[ElementGroup, ...]) -> np.ndarray:
    """Return the volume (N,) of every node: an eighth of every element around it [m3]."""
    (group,) = groups
    hexahedra = group.connectivity
    each = group.elements.volume.reshape(-1, len(hexahedra)).sum(axis=0)  # of its integration points
    return np.bincount(hexahedra.ravel(), np.repeat(each / 8, 8), count)
