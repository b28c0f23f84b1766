"""Contact between the yarns of a specimen: smooth tubes of the true radius, and which of them may touch."""

from __future__ import annotations

import numpy as np

from knitstudy.contact.friction import Coulomb
from knitstudy.contact.interaction import Contact
from knitstudy.contact.surface import Grid, circular_stretch
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.scene import Scene

MARGIN = 0.3
"""Distance up to which pairs of points and surfaces are followed, over the yarn's radius."""


def yarn_contact(scene: Scene, mesh: SweptMesh, nodes: np.ndarray, tied_rows: np.ndarray) -> Contact:
    """Return the contact of all yarns of a scene with each other and with themselves.

    Yarns that an interlock row ties to each other do not touch: what the tie does would be done twice there.

    Parameters
    ----------
    scene : Scene
    mesh : SweptMesh
    nodes : ndarray, shape (N, 3)
        Undeformed nodes, adjusted to the ties [m].
    tied_rows : ndarray of int
        Interlock rows that are tied; row r joins yarns r and r + 1.

    Raises
    ------
    MeshError
        If yarns overlap before anything moves.
    """
    meets = np.ones((mesh.yarns, mesh.yarns), dtype=bool)
    meets[tied_rows, tied_rows + 1] = meets[tied_rows + 1, tied_rows] = False
    return Contact(
        nodes,
        yarn_surfaces(mesh),
        contact_law(scene),
        meets=meets,
        points=scene.contact.points,
        margin=MARGIN * mesh.radius,
        overlap=scene.contact.penetration * scene.mesh.size,
    )


def yarn_surfaces(mesh: SweptMesh) -> list[Grid]:
    """Return the surface of every yarn; its polygon is inflated, the contact surface has the true radius."""
    inflated = mesh.radius * float(np.linalg.norm(mesh.section.points[mesh.section.ring], axis=1).mean())
    stretch = circular_stretch(mesh.section.ring.size)
    return [
        Grid(mesh.surface_nodes(yarn), offset=inflated - mesh.radius, stretch=stretch)
        for yarn in range(mesh.yarns)
    ]


def contact_law(scene: Scene) -> Coulomb:
    """Return the law of a scene: stiffnesses as ratios to E / h (Table 1), no slip at all where contact is rough."""
    unit = scene.yarn.youngs_modulus / scene.mesh.size
    return Coulomb(
        normal=scene.contact.normal_stiffness * unit,
        tangential=scene.contact.tangential_stiffness * unit,
        friction=np.inf if scene.interaction == "rough" else scene.contact.friction,
    )


def tied_rows(scene: Scene, rows: int) -> np.ndarray:
    """Return the interlock rows of a specimen that are tied: all, none, or the outer ones (Fig. 3a)."""
    if scene.interaction == "tie":
        return np.arange(rows)
    if scene.specimen == "pair" or scene.contact.tied_rows == "none":
        return np.arange(0)
    return np.array([0, rows - 1])
