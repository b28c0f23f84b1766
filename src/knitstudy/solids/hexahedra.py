"""Solid yarns of hexahedra: linear ones here, quadratic ones in `quadratic_hexahedra`."""

from __future__ import annotations

from functools import partial

import numpy as np

from knitstudy.crossings.rings import Rings
from knitstudy.gates.resolution import fewest_across, require_elements_across
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.contact.grids import Grids
from knitstudy.mechanics.elements import ELEMENTS, ElementGroup
from knitstudy.mechanics.elements.hexahedron import shape, shape_gradient
from knitstudy.mechanics.elements.inverse_map import InverseMap
from knitstudy.mesh.grips import grips
from knitstudy.mesh.memory import require_memory_to_simulate
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids import quadratic_hexahedra
from knitstudy.solids.discretisation import Discretisation
from knitstudy.solids.faces import linear_faces
from knitstudy.solids.hexahedral_elements import hexahedral_elements
from knitstudy.solids.yarn_surfaces import yarn_surfaces
from knitstudy.study.scene import Scene


def discretise(scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair) -> Discretisation:
    """Return the yarns of a scene as hexahedra.

    Raises
    ------
    MeshError
        If elements are too large for the yarn, or too many for the memory.
    """
    fewest = scene.gates.elements_across or fewest_across(scene.specimen, scene.mesh.refinement)
    require_elements_across(scene.yarn.diameter, scene.mesh.size, fewest)
    parts = divide(scene, mesh, specimen)
    each = parts.connectivity.shape[1]
    require_memory_to_simulate(parts.nodes.size, parts.bandwidth, scene.mesh.size, each)
    return parts


def divide(scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair) -> Discretisation:
    """Return the yarns of a scene as hexahedra, whether or not they are fit to be simulated.

    Raises
    ------
    MeshError
        If one is folded.
    """
    if ELEMENTS.find(scene.mesh.element).nodes == quadratic_hexahedra.NODES:
        return quadratic_hexahedra.divide(scene, mesh, specimen)
    station = np.repeat(np.arange(mesh.slices), mesh.section.size)
    return Discretisation(
        mesh=mesh,
        nodes=mesh.nodes,
        unity=np.ones(len(mesh.nodes)),
        yarn=mesh.yarn_of_slice[station],
        station=station,
        bandwidth=mesh.section.size + mesh.section.bandwidth,
        groups=partial(hexahedral_elements, scene, mesh.hexahedra),
        volume=partial(_volume, len(mesh.nodes)),
        surfaces=Grids(yarn_surfaces(mesh)),
        rings=Rings.of_rows(mesh.stations),
        ends=grips(mesh, scene, specimen),
        locate=InverseMap(
            mesh.nodes, mesh.hexahedra, mesh.yarn_of_slice[station], shape, shape_gradient
        ).locate,
        size=scene.mesh.smallest,
        connectivity=mesh.hexahedra,
        faces=linear_faces(mesh),
    )


def _volume(count: int, groups: tuple[ElementGroup, ...]) -> np.ndarray:
    """Return the volume (N,) of every node: an eighth of every element around it [m3]."""
    (group,) = groups
    hexahedra = group.connectivity
    each = group.elements.volume.reshape(-1, len(hexahedra)).sum(axis=0)  # of its integration points
    return np.bincount(hexahedra.ravel(), np.repeat(each / 8, 8), count)
