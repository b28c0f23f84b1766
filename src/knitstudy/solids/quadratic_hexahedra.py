"""Solid yarns of quadratic hexahedra."""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.sparse as sp

from knitstudy.crossings.rings import Rings
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.contact.grids import Grid, Grids, circular_chords, circular_stretch
from knitstudy.mechanics.elements import ElementGroup
from knitstudy.mechanics.elements.inverse_map import InverseMap
from knitstudy.mechanics.elements.quadratic import EDGES, NODES, shape, shape_gradient
from knitstudy.mesh.grips import Grips, grips
from knitstudy.mesh.quadratic import FACE_CENTRE, QuadraticMesh, quadratic_mesh
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.discretisation import Discretisation
from knitstudy.solids.faces import Faces, serendipity
from knitstudy.solids.hexahedral_elements import hexahedral_elements
from knitstudy.study.scene import Scene

__all__ = ["NODES", "divide"]


def _lumped() -> np.ndarray:
    """Return the share (20,) of a cube's volume that each node gets; three Gauss points are exact for the squares."""
    place, weight = np.polynomial.legendre.leggauss(3)
    natural = np.stack(np.meshgrid(place, place, place, indexing="ij"), axis=-1).reshape(-1, 3)
    squares = np.einsum("i,j,k->ijk", weight, weight, weight).ravel() @ shape(natural) ** 2
    return squares / squares.sum()


LUMPED = _lumped()


def divide(scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair) -> Discretisation:
    """Return the yarns of a scene as quadratic hexahedra, one for each of a swept mesh.

    Raises
    ------
    MeshError
        If one is folded.
    """
    quadratic = quadratic_mesh(mesh, specimen.centrelines)
    return Discretisation(
        mesh=quadratic.corners,
        nodes=quadratic.nodes,
        unity=np.ones(len(quadratic.nodes)),
        yarn=quadratic.yarn,
        station=quadratic.station,
        bandwidth=quadratic.bandwidth,
        groups=partial(hexahedral_elements, scene, quadratic.elements),
        volume=partial(_volume, len(quadratic.nodes)),
        surfaces=Grids(_grids(quadratic)),
        rings=Rings.of_rows(quadratic.arc_lengths),
        ends=_ends(quadratic, grips(quadratic.corners, scene, specimen)),
        locate=InverseMap(quadratic.nodes, quadratic.elements, quadratic.yarn, shape, shape_gradient).locate,
        size=scene.mesh.smallest,
        sampling=_sampling(quadratic),
        dependence=_dependence(quadratic),
        connectivity=quadratic.elements,
        faces=Faces(
            quadratic.nodes,
            tuple(quadratic.faces[_faces_of(quadratic, yarn)] for yarn in range(mesh.yarns)),
            serendipity,
        ),
    )


def _grids(mesh: QuadraticMesh) -> list[Grid]:
    """Return the surface of every yarn, through nodes at half the spacing."""
    stretch = circular_stretch(2 * mesh.section.ring_edges.size)
    if not mesh.corners.pull.any():
        return [Grid(grid, stretch=stretch) for grid in mesh.grids]
    pairs = zip(mesh.grids, mesh.angles, strict=True)
    return [Grid(grid, chords=circular_chords(angles)) for grid, angles in pairs]


def _volume(count: int, groups: tuple[ElementGroup, ...]) -> np.ndarray:
    """Return the volume (N,) of every node [m3]: of each element in proportion to the squares of its functions.

    Hinton, Rock and Zienkiewicz (1976): what the functions themselves hold is negative at corners.
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
    """Return what picks the corners (M, N)."""
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


def _faces_of(mesh: QuadraticMesh, yarn: int) -> slice:
    layers = mesh.corners.first_slice[yarn : yarn + 2] - np.arange(yarn, yarn + 2)
    first, last = layers * mesh.section.ring_edges.size
    return slice(int(first), int(last))
