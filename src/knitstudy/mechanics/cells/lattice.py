"""Lattices of endless sheets.

A sheet repeats itself by two lattice vectors t in its plane. From a point X to its image X + t the macroscopic field
(docs/theory/theory.md, section 11) jumps by

    E t + z K t   in the plane,    - X . K t - t . K t / 2   out of it:

a translation and a rotation, linear in X, so that nodes that are coefficients take it as well. Strains in the plane
may be finite; a curved sheet is one to first order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.core.arrays import Floats

STRAINS = ("x", "y", "xy")  # components in the plane; of curvatures and moments as well


@dataclass(frozen=True, eq=False)
class Lattice:
    """How a sheet repeats itself."""

    vectors: Floats  # (2, 3), from a point to its images, in the plane of x and y [m]
    reference: float = 0.0  # height of the plane of reference [m]

    @property
    def area(self) -> float:
        """Of a cell [m2]."""
        return float(abs(np.cross(*self.vectors)[2]))

    @property
    def lengths(self) -> Floats:
        """Edges of the cell (3,) by which strains in the plane are multiplied for a displacement [m]."""
        return np.linalg.norm(self.vectors, axis=1)[[0, 1, 1]]

    def jumps(
        self,
        number: int,  # of the vector
        nodes: Floats,  # (N, 3), undeformed places, or coefficients of them [m]
        unity: Floats,  # (N,), coefficients of the constant 1
    ) -> Floats:
        """Return the jumps (N, 3, 6) of nodes to their images by one of the vectors, for each generalised strain."""
        t = self.vectors[number, :2]
        way = np.array([[t[0], 0, 0.5 * t[1]], [0, t[1], 0.5 * t[0]]])  # E t, and K t, by components of E, K
        height = nodes[:, 2] - self.reference * unity
        jump = np.zeros((len(nodes), 3, 6))
        jump[:, :2, :3] = unity[:, None, None] * way
        jump[:, :2, 3:] = height[:, None, None] * way
        jump[:, 2, 3:] = -(nodes[:, :2] + 0.5 * np.multiply.outer(unity, t)) @ way
        return jump
