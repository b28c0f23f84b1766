"""The ties of a scene, by whichever rule: what all that hold, see or write them ask for."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from knitstudy.crossings.tied_crossings import tied_crossings
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.solids.discretisation import Discretisation
from knitstudy.solids.facet_tie import tie_crossings
from knitstudy.solids.patch_tie import tie_patches
from knitstudy.study.scene import Scene


class Tie(Protocol):
    """What ties do to solid yarns.

    Attributes
    ----------
    nodes : ndarray, shape (N, 3)
        Undeformed nodes, moved where the ties need that [m].
    dependence : csr matrix, shape (N, N), or None
        Nodes as weighted sums of nodes that depend on no others.
    links : csr matrix, shape (N, N), or None
        Stiffness between nodes, the same for every component [N/m].
    joined : ndarray of int
        Nodes that the ties act on, ascending.
    area : ndarray, shape (K,)
        Tied area of every crossing [m2]; nan where it is not tied.
    centroid : ndarray, shape (K, 3)
        Its centroid [m]; nan where there is none.
    """

    nodes: np.ndarray
    dependence: sp.csr_matrix | None
    links: sp.csr_matrix | None
    joined: np.ndarray
    area: np.ndarray
    centroid: np.ndarray

    def attributes(self) -> dict[str, float]:
        """Return what a history says of the ties."""
        ...

    def resultants(self, node_force: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """Return the force (K, 3) of every tie on the lower row's yarn [N].

        From the internal forces of the elements (N, 3) [N] and the displacement (N, 3) [m] of the nodes.
        """
        ...

    def equations(self, fixed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the ties as rigid constraints: slave nodes (S,), and nodes (S, c) and weights (S, c) of their sums.

        Slaves are none of the nodes `fixed` (k,), where there is a choice; weights may be 0.
        """
        ...

    def beside(self, points: np.ndarray) -> np.ndarray:
        """Return which undeformed points (k, 3) [m] lie where the ties no longer hold the yarns together (k,)."""
        ...


def tie_of(scene: Scene, parts: Discretisation, specimen: Knit | YarnPair) -> Tie:
    """Return the ties of a scene's yarns.

    Raises
    ------
    MeshError
        If a crossing cannot be tied by the scene's rule.
    """
    tied = tied_crossings(scene, specimen.crossings)
    if scene.value("tie.rule") != "facets":  # solid yarns without facets have no such key
        return tie_patches(parts, specimen, tied, scene.tie.radius, scene.yarn.youngs_modulus)
    tie = tie_crossings(parts.mesh, specimen, scene.tie.tolerance, tied, parts.faces)
    return tie if parts.dependence is None else replace(tie, nodes=parts.dependence @ tie.nodes)
