"""Smooth surfaces through the surface nodes of solids: tensor products of Catmull-Rom curves (Catmull and Rom 1974).

A surface is a grid of nodes, (slice, angle) on a yarn. Its parameters xi = (along, around) count slices and angles,
so that neighbours and stencils are index arithmetic. It is C1 everywhere, which flat facets are not: with 12 angles
these sag by 3.4% of the radius, more than the clearance of a knit, and a Catmull-Rom surface by 0.17%. On tubes the
tangents around are a little longer than Catmull and Rom's, so that the middle between two nodes lies on the circle too:
4e-7 of the radius are left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.contact.surface import ALONG, AROUND, Stencil, interpolate
from knitstudy.mechanics.core.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class Grid:
    """Nodes that one surface goes through."""

    # (m, a), node numbers, at least 2 by 2; the normal (around x along) points outward
    nodes: Ints
    closed: bool = True  # whether the last column is followed by the first
    # how far inside of the interpolated surface the contact surface lies [m]: a polygon inflated to the area of
    # its circle has its nodes outside of the circle
    offset: float = 0.0
    # (m, a, 2), shares of the chords before and behind a node in its tangent around: half of each, as Catmull
    # and Rom have it, if left out; see `circular_chords`
    chords: Floats | None = None

    def shares(self) -> Floats:
        """Return `chords`, or Catmull and Rom's."""
        if self.chords is not None:
            return self.chords
        halves = np.full((*np.shape(self.nodes), 2), 0.5)
        if not self.closed:
            halves[:, [0, -1]] = ENDS
        return halves


# Shares of the chords before and behind the first node of an open row, and the last: on goes the only one there is.
ENDS = np.array([[0.0, 1.0], [1.0, 0.0]])


def circular_chords(
    angles: Floats,  # (m, a), increasing in every row, once around [rad]
) -> Floats:
    """Return the shares (m, a, 2) of the chords before and behind every node of a circle in its tangent.

    Tangents touch the circle then. Their length is the harmonic mean of those, 4 tan(step / 4), with which each of
    the two pieces would have its middle on the circle.

    Examples
    --------
    >>> circular_chords(np.pi / 2 * np.arange(4)[None])[0, 0].round(3)  # of four nodes: 2 tan(pi / 8) each
    array([0.828, 0.828])
    """
    ahead = np.mod(np.roll(angles, -1, axis=1) - angles, 2 * np.pi)
    behind = np.roll(ahead, 1, axis=1)
    length = 8 / (1 / np.tan(behind / 4) + 1 / np.tan(ahead / 4))
    # Shares that go with 1 / sin(step / 2)^2 leave no part along the normal.
    scale = 0.5 * length / (1 / np.tan(behind / 2) + 1 / np.tan(ahead / 2))
    return np.stack([scale / np.sin(behind / 2) ** 2, scale / np.sin(ahead / 2) ** 2], axis=-1)


class Grids:
    """Surfaces through grids of nodes; see `surface.Surfaces`. The nodes are the carriers."""

    block = 1
    images = None

    def __init__(self, grids: list[Grid] | tuple[Grid, ...]) -> None:
        self.grids = tuple(grids)
        self.shape = np.array([grid.nodes.shape for grid in self.grids])  # (G, 2)
        self.closed = np.array([grid.closed for grid in self.grids])
        self.offset = np.array([grid.offset for grid in self.grids])
        self.cells = self.shape - np.stack([np.ones(len(self.grids), int), ~self.closed], axis=1)
        self._first = np.concatenate([[0], np.cumsum(self.shape.prod(axis=1))])
        self._nodes = np.concatenate([np.asarray(grid.nodes).ravel() for grid in self.grids])
        self._skin = np.unique(self._nodes)
        chords = [grid.shares() for grid in self.grids]
        self._chords = np.concatenate([shares.reshape(-1, 2) for shares in chords])
        graded = any(np.any(shares != shares[:1]) for shares in chords)
        # of four, those whose chords are weighed: one if all are alike
        self._rows = slice(None) if graded else slice(1)
        # Between nodes that move by w at most, a place moves by at most 1/4 of the change of a tangent farther: this
        # is w along, and twice the larger share of a chord times w around.
        self.overshoot = 1.25 * (1 + 0.5 * float(self._chords.max()))

    def edges(self, number: int) -> tuple[Ints, Ints]:
        """Return the parameters of the edges of cells along (m + 1,) and around (n + 1,): slices and angles."""
        along, around = self.cells[number] + 1
        return np.arange(along), np.arange(around)

    def stencil(self, surface: Ints, xi: Floats) -> Stencil:
        """Return the stencils of places xi (k, 2) on surfaces (k,)."""
        shape, closed = self.shape[surface], self.closed[surface]
        cell = np.floor(xi).astype(np.int64)
        inside = np.clip(cell, 0, self.cells[surface] - 1)
        cell[:, 0] = inside[:, 0]
        cell[:, 1] = np.where(closed, cell[:, 1], inside[:, 1])
        share = xi - cell
        row, column = np.moveaxis(cell[..., None] + np.arange(-1, 3), 1, 0)  # (k, 4) each
        row = np.clip(row, 0, shape[:, :1] - 1)
        column = np.where(closed[:, None], column % shape[:, 1:], np.clip(column, 0, shape[:, 1:] - 1))
        index = (self._first[surface][:, None] + row * shape[:, 1:])[:, :, None] + column[:, None]
        chords = np.full((len(xi), 1, 2, 2), 0.5)
        chords[cell[:, 0] == 0, 0, 0], chords[cell[:, 0] == shape[:, 0] - 2, 0, 1] = ENDS
        along = _weights(share[:, 0], chords)[:, ALONG, 0, :, None]
        around = _weights(share[:, 1], self._chords[index[:, self._rows, 1:3]])[:, AROUND]
        nodes = self._nodes[index.reshape(-1, 16)]
        # The key is the cell's first corner.
        return Stencil(nodes, (along * around).reshape(-1, 6, 16), key=nodes[:, 5])

    def places(self, surface: Ints, xi: Floats, carriers: Floats) -> tuple[Floats, Floats, Floats]:
        """Return places, derivatives and second ones at xi (k, 2) on surfaces (k,)."""
        return self.stencil(surface, xi).places(carriers)

    def positions(self, surface: Ints, xi: Floats, carriers: Floats) -> Floats:
        """Return places (k, 3) alone."""
        stencil = self.stencil(surface, xi)
        return interpolate(stencil.value, stencil.nodes, carriers)

    def clamp(self, surface: Ints, xi: Floats) -> Floats:
        """Return xi (k, 2) moved to the nearest place within the surfaces' edges."""
        last = (self.shape[surface] - 1).astype(float)
        clamped = np.clip(xi, 0, last)
        clamped[:, 1] = np.where(self.closed[surface], xi[:, 1], clamped[:, 1])
        return clamped

    def carry(self, nodes: Floats) -> Floats:
        """Return the nodes: they carry the surface themselves."""
        return nodes

    def collect(self, force: Floats) -> Floats:
        """Return the forces."""
        return force

    def matrix(self, indptr: np.ndarray, indices: np.ndarray, data: Floats) -> sp.bsr_matrix:
        """Return a matrix over all nodes from its pattern and a copy of its blocks (nnz, 1, 9)."""
        size = 3 * (len(indptr) - 1)
        return sp.bsr_matrix((data.reshape(-1, 3, 3).copy(), indices, indptr), shape=(size, size))

    def centres(self, carriers: Floats) -> Floats:
        """Return the middles (R, 3) of all rows of nodes, grid by grid."""
        return np.concatenate([carriers[grid.nodes].mean(axis=1) for grid in self.grids])

    def ring(self, number: int, row: Ints, carriers: Floats) -> Floats:
        """Return the nodes (k, n, 3) in rows (k,) of one grid."""
        return carriers[self.grids[number].nodes[row]]

    def controls(self, carriers: Floats) -> Floats:
        """Return the nodes (S, 1, 3) that the surfaces go through."""
        return carriers[self._skin, None]

    def influence(self, carriers: Floats) -> float:
        """Return how far nodes are from rings beside which places depend on them [m]: two slices away at most."""
        farthest = 0.0
        for grid in self.grids:
            ring = carriers[grid.nodes]
            middle = ring.mean(axis=1, keepdims=True)
            for step in range(min(3, len(ring))):
                last = len(ring) - step
                apart = np.concatenate([ring[step:] - middle[:last], ring[:last] - middle[step:]])
                farthest = max(farthest, float(np.linalg.norm(apart, axis=2).max()))
        return farthest


def _weights(t: Floats, chords: Floats) -> Floats:
    """Return weights (k, 3, r, 4) of r rows of four nodes, of places at t (k,) between the middle two and derivatives.

    The tangents at these two are sums of chords beside them, with shares (k, r, 2 nodes, 2 chords).
    """
    powers = np.stack([np.ones_like(t), t, t * t, t**3], axis=1)
    first, second, *tangents = np.moveaxis((powers @ _HERMITE).reshape(-1, 3, 1, 4), -1, 0)  # (k, 3, 1) each
    (before, behind), (nearer, farther) = (
        [tangent * share for share in np.moveaxis(chords[:, None, :, node], -1, 0)]
        for node, tangent in enumerate(tangents)
    )
    return np.stack(
        [-before, first + before - behind - nearer, second + behind + nearer - farther, farther], axis=-1
    )


def _with_derivatives(coefficients: Floats) -> Floats:
    """Return polynomials (4 powers, n nodes), their first and second derivatives, side by side: (4, 3 n)."""
    slope = np.zeros((4, 4))
    slope[[0, 1, 2], [1, 2, 3]] = 1, 2, 3  # of the powers of t
    return np.concatenate([coefficients, slope @ coefficients, slope @ slope @ coefficients], axis=1)


# Rows: powers of t. Columns: the two nodes of a piece, and the tangents there.
_HERMITE = _with_derivatives(
    np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [-3.0, 3.0, -2.0, -1.0], [2.0, -2.0, 1.0, 1.0]])
)
