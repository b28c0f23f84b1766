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


@dataclass(frozen=True, eq=False)
class Grid:
    """Nodes that one surface goes through."""

    # int (m, a), node numbers, at least 2 by 2; the normal (around x along) points outward
    nodes: np.ndarray
    closed: bool = True  # whether the last column is followed by the first
    # how far inside of the interpolated surface the contact surface lies [m]: a polygon inflated to the area of
    # its circle has its nodes outside of the circle
    offset: float = 0.0
    stretch: float = 1.0  # length of the tangents around, over Catmull and Rom's; see `circular_stretch`
    # (m, a, 2), where angles are not equal: what the chords before and behind a node contribute to its tangent
    # around, in place of half the stretch each; see `circular_chords`
    chords: np.ndarray | None = None


def circular_stretch(angles: int) -> float:
    """Return the stretch at which the curve through equal angles of a circle has its middles on the circle, too."""
    step = 2 * np.pi / angles
    return float(4 * (1 - np.cos(step / 2)) / (np.sin(step) * np.sin(step / 2)))


def circular_chords(
    angles: np.ndarray,  # (m, a), increasing in every row, once around [rad]
) -> np.ndarray:
    """Return the shares (m, a, 2) of the chords before and behind every node of a circle in its tangent.

    Tangents touch the circle then. Their length is the harmonic mean of those, 4 tan(step / 4), with which each of
    the two pieces would have its middle on the circle.
    """
    ahead = np.mod(np.roll(angles, -1, axis=1) - angles, 2 * np.pi)
    behind = np.roll(ahead, 1, axis=1)
    length = 8 / (1 / np.tan(behind / 4) + 1 / np.tan(ahead / 4))
    # Shares that go with 1 / sin(step / 2)^2 leave no part along the normal.
    scale = 0.5 * length / (1 / np.tan(behind / 2) + 1 / np.tan(ahead / 2))
    return np.stack([scale / np.sin(behind / 2) ** 2, scale / np.sin(ahead / 2) ** 2], axis=-1)


class Grids:
    """Surfaces through grids of nodes; see `surface.Surfaces`. The nodes are the carriers.

    Parameters
    ----------
    grids : sequence of Grid
    """

    block = 1

    def __init__(self, grids: list[Grid] | tuple[Grid, ...]) -> None:
        self.grids = tuple(grids)
        self.shape = np.array([grid.nodes.shape for grid in self.grids])  # (G, 2)
        self.closed = np.array([grid.closed for grid in self.grids])
        self.offset = np.array([grid.offset for grid in self.grids])
        self._stretch = np.array([grid.stretch for grid in self.grids])
        self.cells = self.shape - np.stack([np.ones(len(self.grids), int), ~self.closed], axis=1)
        self._first = np.concatenate([[0], np.cumsum(self.shape.prod(axis=1))])
        self._nodes = np.concatenate([np.asarray(grid.nodes).ravel() for grid in self.grids])
        self._skin = np.unique(self._nodes)
        self._chords = None
        if any(grid.chords is not None for grid in self.grids):
            self._chords = np.concatenate([_chords(grid).reshape(-1, 2) for grid in self.grids])
        # Between nodes that move by w at most, a place moves by at most 1/4 of what a tangent changes by farther: that
        # is w along, and twice the larger share of a chord times w around.
        largest_chord = max(float(_chords(grid).max()) for grid in self.grids)
        self.overshoot = 1.25 * (1 + 0.5 * largest_chord)

    def edges(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the parameters of the edges of cells along (m + 1,) and around (n + 1,): slices and angles."""
        along, around = self.cells[number] + 1
        return np.arange(along), np.arange(around)

    def cell(self, surface: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """Return the cells (k, 2) that places xi (k, 2) of surfaces (k,) lie in; around is counted on one turn."""
        cells = self.cells[surface]
        cell = np.floor(xi).astype(np.int64)
        cell[:, 0] = np.clip(cell[:, 0], 0, cells[:, 0] - 1)
        turned = np.where(self.closed[surface], cell[:, 1] % cells[:, 1], cell[:, 1])
        cell[:, 1] = np.clip(turned, 0, cells[:, 1] - 1)
        return cell

    def stencil(self, surface: np.ndarray, xi: np.ndarray) -> Stencil:
        """Return the stencils of places xi (k, 2) on surfaces (k,)."""
        cell = self.cell(surface, xi)
        shape, closed = self.shape[surface], self.closed[surface]
        straight, open_ended = np.ones(len(xi)), np.zeros(len(xi), dtype=bool)
        along = _curve(cell[:, 0], xi[:, 0] - cell[:, 0], shape[:, 0], open_ended, straight)
        share = xi[:, 1] - np.floor(xi[:, 1])
        share = np.where(closed, share, xi[:, 1] - cell[:, 1])
        around = _curve(cell[:, 1], share, shape[:, 1], closed, self._stretch[surface])
        index = along.index[:, :, None] * shape[:, 1][:, None, None] + around.index[:, None, :]
        index += self._first[surface][:, None, None]
        nodes = self._nodes[index.reshape(-1, 16)]
        if self._chords is None:
            across = around.weight[:, AROUND, None, :]
        else:
            across = _weights(share, self._chords[index[:, :, 1:3]])[:, AROUND]
        weights = along.weight[:, ALONG, :, None] * across
        return Stencil(nodes, weights.reshape(-1, 6, 16), key=nodes[:, 5])  # the cell's first corner

    def places(
        self, surface: np.ndarray, xi: np.ndarray, carriers: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return places, derivatives and second ones at xi (k, 2) on surfaces (k,)."""
        return self.stencil(surface, xi).places(carriers)

    def positions(self, surface: np.ndarray, xi: np.ndarray, carriers: np.ndarray) -> np.ndarray:
        """Return places (k, 3) alone."""
        stencil = self.stencil(surface, xi)
        return interpolate(stencil.value, stencil.nodes, carriers)

    def clamp(self, surface: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """Return xi (k, 2) moved to the nearest place within the surfaces' edges."""
        last = (self.shape[surface] - 1).astype(float)
        clamped = np.clip(xi, 0, last)
        clamped[:, 1] = np.where(self.closed[surface], xi[:, 1], clamped[:, 1])
        return clamped

    def carry(self, nodes: np.ndarray) -> np.ndarray:
        """Return the nodes: they carry the surface themselves."""
        return nodes

    def collect(self, force: np.ndarray) -> np.ndarray:
        """Return the forces."""
        return force

    def matrix(self, indptr: np.ndarray, indices: np.ndarray, data: np.ndarray) -> sp.bsr_matrix:
        """Return a matrix over all nodes from its pattern and blocks (nnz, 1, 9)."""
        size = 3 * (len(indptr) - 1)
        return sp.bsr_matrix((data.reshape(-1, 3, 3), indices, indptr), shape=(size, size))

    def centres(self, carriers: np.ndarray) -> np.ndarray:
        """Return the middles (R, 3) of all rows of nodes, grid by grid."""
        return np.concatenate([carriers[grid.nodes].mean(axis=1) for grid in self.grids])

    def ring(self, number: int, row: np.ndarray, carriers: np.ndarray) -> np.ndarray:
        """Return the nodes (k, n, 3) in rows (k,) of one grid."""
        return carriers[self.grids[number].nodes[row]]

    def controls(self, carriers: np.ndarray) -> np.ndarray:
        """Return the nodes (S, 1, 3) that the surfaces go through."""
        return carriers[self._skin, None]

    def influence(self, carriers: np.ndarray) -> float:
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


@dataclass(frozen=True)
class _Curve:
    index: np.ndarray  # (k, 4) positions in the row of nodes
    weight: np.ndarray  # (k, 3, 4): value, first and second derivative


def _curve(
    cell: np.ndarray, t: np.ndarray, count: np.ndarray, closed: np.ndarray, stretch: np.ndarray
) -> _Curve:
    """Weights of a curve at local parameters t (k,) of cells (k,) in rows of `count` nodes.

    Tangents are `stretch` (k,) times those of Catmull and Rom. At open ends the missing neighbour is the linear
    continuation of the last two nodes.
    """
    powers = np.stack([np.ones_like(t), t, t * t, t**3], axis=1)
    weight = powers @ _POINTS + stretch[:, None] * (powers @ _TANGENTS)
    weight = weight.reshape(-1, 3, 4)
    index = cell[:, None] + np.arange(-1, 3)
    low, high = ~closed & (cell == 0), ~closed & (cell == count - 2)
    weight[low, :, 1] += 2 * weight[low, :, 0]
    weight[low, :, 2] -= weight[low, :, 0]
    weight[low, :, 0] = 0
    weight[high, :, 2] += 2 * weight[high, :, 3]
    weight[high, :, 1] -= weight[high, :, 3]
    weight[high, :, 3] = 0
    index = np.where(closed[:, None], index % count[:, None], np.clip(index, 0, count[:, None] - 1))
    return _Curve(index, weight)


def _chords(grid: Grid) -> np.ndarray:
    """Return what the chords beside every node of a grid (m, a, 2) contribute to its tangent around."""
    if grid.chords is None:
        return np.full((*grid.nodes.shape, 2), 0.5 * grid.stretch)
    return grid.chords


def _weights(t: np.ndarray, chords: np.ndarray) -> np.ndarray:
    """Return weights (k, 3, r, 4) at local parameters t (k,) of r rows, with tangents of chords (k, r, 2 nodes, 2)."""
    powers = np.stack([np.ones_like(t), t, t * t, t**3], axis=1)
    before, behind = np.moveaxis(chords, -1, 0)
    tangents = np.zeros((*before.shape, 4))  # (k, r, 2 nodes, 4)
    for node in range(2):
        tangents[:, :, node, node] = -before[..., node]
        tangents[:, :, node, node + 1] = before[..., node] - behind[..., node]
        tangents[:, :, node, node + 2] = behind[..., node]
    points = (powers @ _POINTS).reshape(-1, 3, 1, 4)
    at_tangents = (powers @ _HERMITE).reshape(-1, 1, 3, 2)
    return points + (at_tangents @ tangents).swapaxes(1, 2)


def _with_derivatives(coefficients: np.ndarray) -> np.ndarray:
    """Return polynomials (4 powers, n nodes), their first and second derivatives, side by side: (4, 3 n)."""
    slope = np.zeros((4, 4))
    slope[[0, 1, 2], [1, 2, 3]] = 1, 2, 3  # of the powers of t
    return np.concatenate([coefficients, slope @ coefficients, slope @ slope @ coefficients], axis=1)


_POINTS = _with_derivatives(
    np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, -3.0, 3.0, 0.0], [0.0, 2.0, -2.0, 0.0]])
)
_TANGENTS = _with_derivatives(
    0.5
    * np.array([[0.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 1.0, 0.0], [2.0, 1.0, -2.0, -1.0], [-1.0, -1.0, 1.0, 1.0]])
)
"""What the nodes themselves and the tangents at them contribute. Rows: powers of t; columns: the four nodes."""

# What the tangents at the two nodes of a piece contribute, of any length. Columns: the two nodes.
_HERMITE = _with_derivatives(np.array([[0.0, 0.0], [1.0, 0.0], [-2.0, -1.0], [1.0, 1.0]]))
