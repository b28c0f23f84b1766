"""What solid yarns are divided into, for all that must not know: nodes, of which every place is a weighted sum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from knitstudy.crossings.rings import Rings
from knitstudy.mechanics.contact.surface import Surfaces
from knitstudy.mechanics.elements import ElementGroup
from knitstudy.mesh.grips import Grips
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.solids.faces import Faces

if TYPE_CHECKING:
    from knitstudy.geometry.pair import YarnPair
    from knitstudy.geometry.pattern import Knit
    from knitstudy.study.scene import Scene

Locate = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Discretisation:
    """Yarns of a specimen, divided.

    Undeformed places and displacements are the same weighted sums of nodes, so that yarns can move rigidly: nodes x go
    to Q x + unity t. Nodes are numbered yarn by yarn, station by station along the yarn.

    Attributes
    ----------
    mesh : SweptMesh
        Cross-sections at which motion is observed and drawn; its nodes are places.
    nodes : ndarray, shape (N, 3)
        Undeformed: places, or coefficients of them [m].
    unity : ndarray, shape (N,)
        Coefficients of the constant 1.
    yarn, station : ndarray of int, shape (N,)
        Yarn of a node, and its place along all yarns, both ascending.
    bandwidth : int
        Largest difference of the numbers of two nodes of an element, counted without nodes that depend on others.
    groups : callable
        Elements, from the nodes (N, 3) that ties may have moved; raises MeshError where one is folded.
    volume : callable
        Of every node (N,) [m3], from the groups.
    surfaces : Surfaces
        One of every yarn, for contact.
    ends : Grips
        Nodes that are held and driven.
    locate : callable
        Nodes (k, a) and weights (k, a) whose sum a material point is, from places (k, 3) [m] in or next to yarns (k,).
    size : float
        Length h of an element [m].
    sampling : csr matrix, shape (M, N), optional
        Nodes of `mesh` as weighted sums of nodes; None where they are the nodes.
    dependence : csr matrix, shape (N, N), optional
        Nodes as weighted sums of nodes that depend on no others; the identity if None.
    connectivity : ndarray of int, shape (E, a), optional
        Nodes of hexahedra, in the order of those of `mesh`, where the elements are hexahedra.
    faces : Faces, optional
        Of elements, where there are any on the surface: what ties by facets join.
    rings : Rings, optional
        Where the edges of the surfaces' cells across lie along the yarns; of those that contact knows.
    missing : callable, optional
        Compliance (k, 2) [m/N] of the mean and of the linear moments of a patch that the nodes cannot show, one yarn's
        alone: from yarns (k,), arc lengths (k,) [m] and the patch's radius [m]. None where refinement shows it all.
    """

    mesh: SweptMesh
    nodes: np.ndarray
    unity: np.ndarray
    yarn: np.ndarray
    station: np.ndarray
    bandwidth: int
    groups: Callable[[np.ndarray], tuple[ElementGroup, ...]]
    volume: Callable[[tuple[ElementGroup, ...]], np.ndarray]
    surfaces: Surfaces
    ends: Grips
    locate: Locate
    size: float
    sampling: sp.csr_matrix | None = None
    dependence: sp.csr_matrix | None = None
    connectivity: np.ndarray | None = None
    faces: Faces | None = None
    rings: Rings | None = None
    missing: Callable[[np.ndarray, np.ndarray, float], np.ndarray] | None = None

    def sampled(self, values: np.ndarray) -> np.ndarray:
        """Return what the nodes (N, ...) give at the nodes of `mesh` (M, ...)."""
        return values if self.sampling is None else self.sampling @ values

    def nodes_of(self, yarn: int) -> np.ndarray:
        """Return the nodes of a yarn, ascending."""
        return np.flatnonzero(self.yarn == yarn)


def discretised(scene: Scene, mesh: SweptMesh, specimen: Knit | YarnPair) -> Discretisation:
    """Return the yarns of a scene, divided as its fidelity says.

    Raises
    ------
    MeshError
        If elements are too large for the yarn, or too many for the memory.
    """
    return import_module(scene.kind.fidelity.solids).discretise(scene, mesh, specimen)
