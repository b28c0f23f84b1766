"""Yarns that are tied to each other have no contact; whether they stay apart beside the ties is watched instead."""

from __future__ import annotations

import numpy as np

from knitstudy.mechanics.contact.history import ContactHistory
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.solids.discretisation import Discretisation
from knitstudy.solids.tie import Tie
from knitstudy.solids.yarn_contact import MARGIN, contact_law
from knitstudy.study.scene import Scene


class BesideTies:
    """The gaps between pieces of yarn that are tied, away from the ties.

    Parameters
    ----------
    scene : Scene
    yarns : Discretisation
    tie : Tie
    pieces : ndarray of int, shape (R,)
        Interlock row that every ring is tied in; see `tied_crossings.tied_pieces`.
    """

    def __init__(self, scene: Scene, yarns: Discretisation, tie: Tie, pieces: np.ndarray) -> None:
        mesh = yarns.mesh
        rows = np.unique(pieces[pieces >= 0])
        meets = np.zeros((mesh.yarns, mesh.yarns), dtype=bool)
        meets[rows, rows + 1] = meets[rows + 1, rows] = True
        self._contact = Contact(
            tie.nodes,
            yarns.surfaces,
            contact_law(scene, yarns),
            meets=meets,
            points=1,
            margin=MARGIN * mesh.radius,
            overlap=np.inf,
        )
        self._pieces, self._rings = pieces, yarns.rings
        self._tie = tie
        # Nothing is remembered: with the same empty history all along, pairs of a search stay followed.
        self._history = ContactHistory.empty()

    def smallest_gap(self, nodes: np.ndarray) -> float:
        """Return the smallest gap of current nodes (N, 3) beside the ties [m]; inf if nothing is near."""
        points = self._contact.points(nodes, nodes, self._history)
        (xi, gap), pairs = self._contact.everywhere(points), points.followed
        quadrature = self._contact.quadrature
        own = self._piece(quadrature.surface[pairs.point], quadrature.xi[pairs.point, 0])
        other = self._piece(pairs.surface, xi[:, 0])
        near = np.flatnonzero(np.isfinite(gap) & (own == other) & (own >= 0))
        place = self._contact.reference(pairs.point[near])
        return float(gap[near[self._tie.beside(place)]].min(initial=np.inf))

    def _piece(self, yarn: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Return what places (k,) along yarns (k,) are tied in."""
        return self._pieces[self._rings.nearest(yarn, along)]
