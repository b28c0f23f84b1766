"""Linear springs between two points that nodes carry by rigid arms, or between the nodes themselves.

With the points p0, p1 of a spring and their reference positions P0, P1

    d = (p1 - p0) - (P1 - P0),   f = k d,   W = f . d / 2

k is a symmetric matrix that does not turn with the points: axes of a spring keep their directions in space. -f acts
on the first point and f on the second. The two act on different lines as soon as the points are apart: no part of
the model takes up the couple (p1 - p0) x f. Where both points coincide in the reference it is of second order in the
stretch, otherwise of first order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class LinearSprings:
    """Springs between K pairs of points.

    Attributes
    ----------
    ends : ndarray of int, shape (K, 2)
        Nodes that carry the points.
    offsets : ndarray, shape (K, 2, 3)
        From the node to its point, in the reference [m].
    stiffness : ndarray, shape (K, 3, 3)
        Symmetric matrices k; diagonal if the springs stand along x, y and z [N/m].
    """

    ends: np.ndarray
    offsets: np.ndarray
    stiffness: np.ndarray

    @classmethod
    def none(cls) -> LinearSprings:
        """Return no springs."""
        return cls(np.empty((0, 2), dtype=int), np.empty((0, 2, 3)), np.empty((0, 3, 3)))

    def pull(self, stretch: np.ndarray) -> np.ndarray:
        """Return the forces f (K, 3) [N] for relative displacements d (K, 3) [m] of the second points to the first."""
        return np.einsum("kij,kj->ki", self.stiffness, stretch)

    def energy(self, stretch: np.ndarray) -> np.ndarray:
        """Return the stored energy (K,) [J]."""
        return 0.5 * np.einsum("ki,ki->k", self.pull(stretch), stretch)

    def at_points(self, stretch: np.ndarray) -> np.ndarray:
        """Return internal force and moment (K, 4, 3) at the first points, then at the second [N, N m]."""
        pull = self.pull(stretch)
        none = np.zeros_like(pull)
        return np.stack([-pull, none, pull, none], axis=1)

    def stiffness_at_points(self) -> np.ndarray:
        """Return the derivative (K, 12, 12) of `at_points` over the motion (u0, w0, u1, w1) of the points."""
        blocks = np.zeros((len(self.ends), 12, 12))
        for row, column, sign in ((0, 0, 1), (6, 6, 1), (0, 6, -1), (6, 0, -1)):
            blocks[:, row : row + 3, column : column + 3] = sign * self.stiffness
        return blocks
