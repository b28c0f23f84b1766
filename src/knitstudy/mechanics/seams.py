"""Seams: sections of solids that nodes of beams carry, without a jump in force.

A solid yarn whose displacement is a sum over orthonormal functions of the section ends in a section whose mean place is
the coefficient X_0 and whose linear moments are X_1 and X_2, half the radius times the directors d_1 and d_2
(`mechanics.polynomial_yarn`). A node with place x and rotation Q carries them:

    X_0 = x,    X_k = Q (R/2 d_k + sum_l E_kl d_l),    E = [[e_0, e_2], [e_2, e_1]]

so that the section's mean moves and its best plane turns with the node. Its widening E in its own plane and all higher
coefficients, warping among them, are its own: a rod under tension may contract where solid and beam meet. All of it is
eliminated, u = u(x, Q, e): forces on the section act on the node as the transposed of the derivative says.

    f_x = f_0,    m = sum_k X_k x f_k,    g_kl = f_k . Q d_l
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.rotation import hat

WIDTHS = 3
"""Unknowns e of a section [m]: how much wider it is along d_1, along d_2, and sheared in its plane."""

MOTIONS = 9
"""Place, spin and widths of a seam, and components of its three coefficients."""


@dataclass(frozen=True, eq=False)
class Seams:
    """Sections (S,) that nodes carry.

    Attributes
    ----------
    section : ndarray of int, shape (S, 3)
        Nodes of the solids: mean and linear moments of every section.
    node : ndarray of int, shape (S,)
        Nodes of the beams.
    arms : ndarray, shape (S, 2, 3)
        X_1 and X_2 in the reference, of equal length and at right angles [m].
    """

    section: np.ndarray
    node: np.ndarray
    arms: np.ndarray

    @property
    def count(self) -> int:
        """Number of seams S."""
        return len(self.node)

    def arms_at(self, rotation: np.ndarray, width: np.ndarray) -> np.ndarray:
        """Return X_1 and X_2 (S, 2, 3) [m] of rotations (S, 3, 3) and widths (S, 3) [m]."""
        widened = self.arms + np.einsum("sw,wkl,sli->ski", width, _WIDENING, self._directors)
        return np.einsum("sij,skj->ski", rotation, widened)

    def displacement(self, position: np.ndarray, rotation: np.ndarray, width: np.ndarray) -> np.ndarray:
        """Return how far the three coefficients (S, 3, 3) are from those of a node at the reference place X_0.

        Parameters
        ----------
        position : ndarray, shape (S, 3)
            Of the nodes, less where they were [m].
        rotation : ndarray, shape (S, 3, 3)
            Of the nodes.
        width : ndarray, shape (S, 3)
            e [m].
        """
        moments = self.arms_at(rotation, width) - self.arms
        return np.concatenate([position[:, None], moments], axis=1)

    def derivative(self, rotation: np.ndarray, width: np.ndarray) -> np.ndarray:
        """Return the derivative (S, 9, 9) of the coefficients over place, spin and widths."""
        slope = np.zeros((self.count, MOTIONS, MOTIONS))
        slope[:, :3, :3] = np.eye(3)
        arms = self.arms_at(rotation, width)
        for k in range(2):
            rows = slice(3 + 3 * k, 6 + 3 * k)
            slope[:, rows, 3:6] = -hat(arms[:, k])
            slope[:, rows, 6:] = self._widen(rotation)[:, k]
        return slope

    def turning(self, rotation: np.ndarray, width: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Return the derivative (S, 9, 9) of force, moment and g for fixed forces (S, 3, 3) on the coefficients.

        As in `rigid_arm` it is not symmetric where the moment is not balanced: spins act from the left.
        """
        turn = np.zeros((self.count, MOTIONS, MOTIONS))
        arms, widen = self.arms_at(rotation, width), self._widen(rotation)
        for k in range(2):
            pull = hat(force[:, 1 + k])
            turn[:, 3:6, 3:6] += pull @ hat(arms[:, k])  # d(X x f) = (w x X) x f
            turn[:, 3:6, 6:] -= pull @ widen[:, k]
        turn[:, 6:, 3:6] = np.swapaxes(turn[:, 3:6, 6:], 1, 2)
        return turn

    @property
    def _directors(self) -> np.ndarray:
        return self.arms / np.linalg.norm(self.arms, axis=2, keepdims=True)

    def _widen(self, rotation: np.ndarray) -> np.ndarray:
        """Derivative (S, 2, 3, 3) of X_1 and X_2 over the widths."""
        return np.einsum("sij,wkl,slj->skiw", rotation, _WIDENING, self._directors)


_WIDENING = np.array([[[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]])
"""E of each of the widths."""
