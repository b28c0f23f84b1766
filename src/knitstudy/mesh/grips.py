"""Where a specimen is gripped: nodes that are held, and nodes that the load drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from knitstudy.errors import MeshError
from knitstudy.geometry.cut import grip_ends, gripped_arcs, inside
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.study.scene import Scene

LOWER, UPPER = 0, 1
"""Yarns of a pair."""

ROUNDING = 1e-6
"""Lengths in radii that are none: of a surface node over the middle plane of a yarn, of a slice from a grip's end."""


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


def grips(mesh: SweptMesh, scene: Scene, specimen: Knit | YarnPair) -> Grips:
    """Return the nodes at which a specimen is held and driven.

    Of a knit in course tension (section 2.3 of the paper) the left ends of all yarns are held and the right ends
    driven. In wale tension the sinker arcs of the bottom yarn are held and the head arcs of the top yarn driven, with
    all nodes of their slices, those at the ends of the arcs too. Of a pair the lower yarn is held and the upper one
    driven, by ``pair.support``.

    Parameters
    ----------
    mesh : SweptMesh
        Of the scene's knit or pair.
    scene : Scene
    specimen : Knit or YarnPair

    Raises
    ------
    MeshError
        If no slice stands where an arc ends: the mesh was made for another direction.
    """
    if scene.specimen == "knit" and scene.load.direction == "course":
        return Grips(mesh.end_nodes("left"), mesh.end_nodes("right"))
    if scene.specimen == "knit":
        require_slices(mesh, grip_ends(specimen, scene.load.direction))
        arcs = gripped_arcs(specimen, scene.load.direction)
        return Grips(*(arc_nodes(mesh, yarn, arcs[yarn]) for yarn in sorted(arcs)))
    nodes = end_slices if scene.pair.support == "ends" else back
    return Grips(nodes(mesh, LOWER), nodes(mesh, UPPER))


def require_slices(mesh: SweptMesh, ends: Mapping[int, np.ndarray]) -> None:
    """Refuse a mesh without a slice where a grip ends: what is gripped would be shorter by a part of an element.

    Raises
    ------
    MeshError
        Naming an arc length of `ends`, by yarn [m], at which no slice stands.
    """
    for yarn, own in ends.items():
        apart = np.abs(mesh.stations[yarn][:, None] - own).min(axis=0)
        if apart.max() > ROUNDING * mesh.radius:
            raise MeshError(
                f"mesh of yarn {yarn}: no slice at s = {own[apart.argmax()]:.6g} m, where a grip in wale tension ends; "
                "mesh the knit with direction='wale'"
            )


def arc_nodes(mesh: SweptMesh, yarn: int, arcs: np.ndarray) -> np.ndarray:
    """Return the nodes of all slices of a yarn whose arc length lies in arcs (a, 2) [m], ends included."""
    slices = np.flatnonzero((mesh.yarn_of_slice == yarn) & inside(mesh.arc_length, arcs))
    return mesh.slice_nodes(slices).ravel()


def end_slices(mesh: SweptMesh, yarn: int) -> np.ndarray:
    """Return the nodes (2 q,) of both end slices of a yarn."""
    first, last = mesh.first_slice[yarn], mesh.first_slice[yarn + 1] - 1
    return mesh.slice_nodes(np.array([first, last])).ravel()


def back(mesh: SweptMesh, yarn: int) -> np.ndarray:
    """Return the surface nodes (b,), ascending, of the half of a pair's yarn that is turned away from the other one."""
    middle = [mesh.centres[mesh.yarn_of_slice == each].mean(axis=0) for each in (yarn, UPPER - yarn)]
    away = middle[0] - middle[1]
    surface = mesh.surface_nodes(yarn)
    centres = mesh.centres[mesh.yarn_of_slice == yarn]
    height = (mesh.nodes[surface] - centres[:, None]) @ (away / np.linalg.norm(away))
    return np.sort(surface[height > ROUNDING * mesh.radius])
