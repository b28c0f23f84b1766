"""Elements of hexahedra, of the kind and the material that a scene names."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.elements import ELEMENTS, ElementGroup
from knitstudy.mechanics.materials import Material
from knitstudy.study.scene import Scene


def hexahedral_elements(
    scene: Scene, connectivity: np.ndarray, nodes: np.ndarray
) -> tuple[ElementGroup, ...]:
    """Return the hexahedra of a scene.

    Parameters
    ----------
    scene : Scene
    connectivity : ndarray of int, shape (E, a)
        Nodes of every hexahedron.
    nodes : ndarray, shape (N, 3)
        Undeformed [m].

    Raises
    ------
    MeshError
        If one is folded.
    """
    yarn = scene.yarn
    material = Material(yarn.material, yarn.youngs_modulus, yarn.poisson_ratio)
    kind = ELEMENTS.find(scene.mesh.element)
    return (ElementGroup(connectivity, kind.build(nodes[connectivity], material, scene.solver.hourglass)),)
