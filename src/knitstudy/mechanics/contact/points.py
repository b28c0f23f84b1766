"""Pairs of a point and a surface in one configuration: all of those that are followed which can touch there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.contact.friction import OPEN, Coulomb
from knitstudy.mechanics.contact.history import ContactHistory
from knitstudy.mechanics.contact.projection import Projection


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Pairs in one configuration; all that is not here is open.

    Attributes
    ----------
    history : ContactHistory
        What they remember, in the same order.
    followed : ContactHistory
        Of all pairs that are followed.
    number : ndarray of int, shape (c,)
        Which of those these are.
    least : ndarray, shape (f,)
        What the gaps of all pairs that are followed are at least [m].
    carriers : ndarray, shape (M, 3)
        Of the surfaces, in this configuration [m].
    position : ndarray, shape (c, 3)
        Points [m].
    projection : Projection
        Against the surfaces that they face.
    gap : ndarray, shape (c,)
        Gaps [m]; inf where there is no closest point.
    slip : ndarray, shape (c, 2)
        Convected coordinates since the anchor, s.
    slip_rate : ndarray, shape (c, 2)
        ds/dg of points that have touched within this increment, else 0.
    slip_share : ndarray, shape (c,)
        ds/dxi: 1, or the share of the increment in contact.
    trial : ndarray, shape (c, 3)
        Trial traction epsT s [Pa].
    pressure : ndarray, shape (c,)
    traction : ndarray, shape (c, 3)
        Tangential part [Pa].
    status : ndarray of int, shape (c,)
        OPEN, STICK or SLIP.
    law : Coulomb
        With the stiffnesses of all pairs.
    angle : ndarray, shape (c,), or None
        Between the first parameters' lines of both surfaces at the last converged increment, if the law asks for it.
    """

    history: ContactHistory
    followed: ContactHistory
    number: np.ndarray
    least: np.ndarray
    carriers: np.ndarray
    position: np.ndarray
    projection: Projection
    gap: np.ndarray
    slip: np.ndarray
    slip_rate: np.ndarray
    slip_share: np.ndarray
    trial: np.ndarray
    pressure: np.ndarray
    traction: np.ndarray
    status: np.ndarray
    law: Coulomb
    angle: np.ndarray | None

    @property
    def active(self) -> np.ndarray:
        """Pairs (a,) that touch."""
        return np.flatnonzero(self.status != OPEN)

    def signature(self) -> np.ndarray:
        """Return points, surfaces and status (a, 3) of the pairs that touch: what must not change any more."""
        active = self.active
        table = np.stack(
            [self.history.point[active], self.history.surface[active], self.status[active]], axis=1
        )
        return table[np.lexsort(table.T)]
