"""Bodies that nothing holds before contact does: led to their first contact by a drag that has died out by then.

A body without a grip or a tie can move rigidly for nothing, so that no equilibrium tells where it goes. In every
increment it therefore drags on its way from where the increment began, as with the contact stabilisation of
Abaqus/Standard: first by as much as lets contact find its places, then by next to nothing. As soon as such a state has
converged in which contact resists every rigid motion of all such bodies by itself, the drag is taken away and the
increment balanced anew, at the same load: what is accepted knows nothing of it. Before that, grips feel only drag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp

SHARE = 1e-4
"""Drag over E V / h^2, V the volume of a node, with which an increment begins."""

FADED = 1e-2
"""Share of it that stays where contact does not hold the bodies: next to nothing, enough for a linear solver."""

HELD = 1e-6
"""Resistance of contact to the easiest rigid motion over E V / h^2, from which on contact holds the bodies."""


@dataclass(frozen=True, eq=False)
class FreeBodies:
    """The bodies that nothing but contact can hold, and their drag.

    Attributes
    ----------
    nodes : tuple of ndarray of int
        Nodes of each body.
    unit : ndarray, shape (N,)
        E V / h^2 of their nodes [N/m]; 0 at all others.
    unity : ndarray, shape (N,)
        What the constant 1 has at the nodes: 1 where they are places, the coefficients where they are not.
    """

    nodes: tuple[np.ndarray, ...]
    unit: np.ndarray
    unity: np.ndarray

    @classmethod
    def of(
        cls,
        nodes: Sequence[np.ndarray],
        volume: np.ndarray,
        youngs_modulus: float,
        length: float,
        unity: np.ndarray | None = None,
    ) -> FreeBodies:
        """Return bodies from their nodes, the volume (N,) of every node [m3] and the length h of an element [m]."""
        unit = np.zeros(len(volume))
        for body in nodes:
            unit[body] = youngs_modulus * volume[body] / length**2
        return cls(tuple(nodes), unit, np.ones(len(volume)) if unity is None else unity)

    def drag(self) -> np.ndarray:
        """Return the stiffness (N,) against the way of all nodes within an increment [N/m]."""
        return SHARE * self.unit

    def held(self, contact: sp.sparray, position: np.ndarray) -> bool:
        """Return whether contact resists every rigid motion of these bodies, all others being fixed.

        Parameters
        ----------
        contact : sparse matrix, shape (3 N, 3 N)
            Symmetric stiffness of contact [N/m].
        position : ndarray, shape (N, 3)
            Where the nodes are [m].
        """
        modes = sp.block_array(
            [[self._modes(body, position, self.unity[body]) for body in self.nodes]]
        ).tocsr()
        resistance = (modes.T @ contact.tocsr() @ modes).toarray()
        unit = (modes.T @ sp.diags_array(np.repeat(self.unit, 3)) @ modes).toarray()
        easiest = scipy.linalg.eigh(resistance, unit, eigvals_only=True, subset_by_index=[0, 0])
        return bool(easiest[0] > HELD)

    @staticmethod
    def _modes(body: np.ndarray, position: np.ndarray, unity: np.ndarray) -> sp.csr_array:
        """Return the six rigid motions (3 N, 6) of a body, rotations about its middle and over its extent."""
        arm = position[body] - np.multiply.outer(unity, unity @ position[body] / (unity @ unity))
        arm /= np.abs(arm).max()
        motions = np.zeros((len(body), 3, 6))
        motions[:, :, :3] = unity[:, None, None] * np.eye(3)
        for axis in range(3):
            motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], arm)
        row = np.repeat(3 * body[:, None] + np.arange(3), 6)
        column = np.tile(np.arange(6), 3 * len(body))
        return sp.csr_array((motions.ravel(), (row, column)), shape=(position.size, 6))
