"""Where a specimen is gripped: nodes that are held, and nodes that the load drives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.geometry.arcs import head_arcs, inside, sinker_arcs
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.study.scene import Scene

LOWER, UPPER = 0, 1
"""Yarns of a pair."""

ROUNDING = 1e-6
"""Height in radii over the middle plane of a yarn up to which a surface node is not turned away."""


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
    all nodes of their slices. Of a pair the lower yarn is held and the upper one driven, by ``pair.support``.

    Parameters
    ----------
    mesh : SweptMesh
        Of the scene's knit or pair.
    scene : Scene
    specimen : Knit or YarnPair
    """
    if scene.specimen == "knit" and scene.load.direction == "course":
        return Grips(mesh.end_nodes("left"), mesh.end_nodes("right"))
    if scene.specimen == "knit":
        top = mesh.yarns - 1
        return Grips(arc_nodes(mesh, 0, sinker_arcs(specimen)), arc_nodes(mesh, top, head_arcs(specimen)))
    nodes = end_slices if scene.pair.support == "ends" else back
    return Grips(nodes(mesh, LOWER), nodes(mesh, UPPER))


def arc_nodes(mesh: SweptMesh, yarn: int, arcs: np.ndarray) -> np.ndarray:
    """Return the nodes of all slices of a yarn whose arc length lies in arcs (a, 2) [m]."""
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
