"""Yarns that are tied to each other have no contact; whether they stay apart beside the ties is watched instead."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.contact.interaction import Contact, ContactHistory
from knitstudy.contact.tie import Tie, facet_size
from knitstudy.contact.yarns import MARGIN, contact_law, yarn_surfaces
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.scene import Scene

BESIDE = 1.0
"""Distance from tied nodes, in facets, within which the tie itself has moved the surfaces into each other."""


class TiedRows:
    """The gaps between yarns that are tied, away from the tied facets.

    Parameters
    ----------
    scene : Scene
    mesh : SweptMesh
    tie : Tie
    rows : ndarray of int
        Tied interlock rows; row r joins yarns r and r + 1.
    """

    def __init__(self, scene: Scene, mesh: SweptMesh, tie: Tie, rows: np.ndarray) -> None:
        meets = np.zeros((mesh.yarns, mesh.yarns), dtype=bool)
        meets[rows, rows + 1] = meets[rows + 1, rows] = True
        self._contact = Contact(
            tie.nodes,
            yarn_surfaces(mesh),
            contact_law(scene),
            meets=meets,
            points=1,
            margin=MARGIN * mesh.radius,
            overlap=np.inf,
        )
        self._tied = cKDTree(tie.nodes[np.union1d(tie.slave, tie.master)])
        self._beside = BESIDE * facet_size(mesh)

    def smallest_gap(self, nodes: np.ndarray) -> float:
        """Return the smallest gap of current nodes (N, 3) beside the ties [m]; inf if nothing is near."""
        points = self._contact.points(nodes, nodes, ContactHistory.empty())
        gap = points.gap
        near = np.flatnonzero(np.isfinite(gap))
        place = self._contact.reference(points.history.point[near])
        away = self._tied.query(place)[0] > self._beside
        return float(gap[near[away]].min(initial=np.inf))
