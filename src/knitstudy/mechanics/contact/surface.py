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


@dataclass(frozen=True, eq=False)
class Grid:
    """Nodes that one surface goes through.

    Attributes
    ----------
    nodes : ndarray of int, shape (m, a)
        Node numbers, at least 2 by 2; the normal (around x along) points outward.
    closed : bool
        Whether the last column is followed by the first.
    stretch : float
        Length of the tangents around, over Catmull and Rom's; see `circular_stretch`.
    chords : ndarray, shape (m, a, 2), optional
        Where angles are not equal: what the chords before and behind a node contribute to its tangent around, in place
        of half the stretch each; see `circular_chords`.
    offset : float
        How far inside of the interpolated surface the contact surface lies [m]: a polygon inflated to the area of
        its circle has its nodes outside of the circle.
    """

    nodes: np.ndarray
    closed: bool = True
    offset: float = 0.0
    stretch: float = 1.0
    chords: np.ndarray | None = None


def circular_stretch(angles: int) -> float:
    """Return the stretch at which the curve through equal angles of a circle has its middles on the circle, too."""
    step = 2 * np.pi / angles
    return float(4 * (1 - np.cos(step / 2)) / (np.sin(step) * np.sin(step / 2)))


def circular_chords(angles: np.ndarray) -> np.ndarray:
    """Return the shares (m, a, 2) of the chords before and behind every node of a circle in its tangent.

    Tangents touch the circle then. Their length is the harmonic mean of those, 4 tan(step / 4), with which each of
    the two pieces would have its middle on the circle.

    Parameters
    ----------
    angles : ndarray, shape (m, a)
        Increasing in every row, once around [rad].
    """
    ahead = np.mod(np.roll(angles, -1, axis=1) - angles, 2 * np.pi)
    behind = np.roll(ahead, 1, axis=1)
    length = 8 / (1 / np.tan(behind / 4) + 1 / np.tan(ahead / 4))
    # Shares that go with 1 / sin(step / 2)^2 leave no part along the normal.
    scale = 0.5 * length / (1 / np.tan(behind / 2) + 1 / np.tan(ahead / 2))
    return np.stack([scale / np.sin(behind / 2) ** 2, scale / np.sin(ahead / 2) ** 2], axis=-1)


@dataclass(frozen=True, eq=False)
class Stencil:
    """Sixteen nodes that places on a surface depend on, and their weights.

    Attributes
    ----------
    nodes : ndarray of int, shape (k, 16)
    weights : ndarray, shape (k, 6, 16)
        Of the place, its derivatives along and around, and its second ones: along, mixed, around.
    """

    nodes: np.ndarray
    weights: np.ndarray

    @property
    def value(self) -> np.ndarray:
        """Weights (k, 16) of the places."""
        return self.weights[:, 0]

    @property
    def first(self) -> np.ndarray:
        """Weights (k, 2, 16) of the derivatives along and around."""
        return self.weights[:, 1:3]

    @property
    def second(self) -> np.ndarray:
        """Weights (k, 3, 16) of the second derivatives along, mixed and around."""
        return self.weights[:, 3:]

    def places(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return places (k, 3), derivatives (k, 2, 3) and second ones (k, 3, 3) for nodes (N, 3)."""
        all_six = self.weights @ nodes[self.nodes]
        return all_six[:, 0], all_six[:, 1:3], all_six[:, 3:]


class Surfaces:
    """All smooth surfaces of a model.

    Parameters
    ----------
    grids : sequence of Grid
    """

    def __init__(self, grids: list[Grid] | tuple[Grid, ...]) -> None:
        self.grids = tuple(grids)
        self.shape = np.array([grid.nodes.shape for grid in self.grids])  # (G, 2)
        self.closed = np.array([grid.closed for grid in self.grids])
        self.offset = np.array([grid.offset for grid in self.grids])
        self._stretch = np.array([grid.stretch for grid in self.grids])
        self.cells = self.shape - np.stack([np.ones(len(self.grids), int), ~self.closed], axis=1)
        self._first = np.concatenate([[0], np.cumsum(self.shape.prod(axis=1))])
        self._nodes = np.concatenate([np.asarray(grid.nodes).ravel() for grid in self.grids])
        self._chords = None
        if any(grid.chords is not None for grid in self.grids):
            self._chords = np.concatenate([_chords(grid).reshape(-1, 2) for grid in self.grids])

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
        weights = along.weight[:, _ALONG, :, None]
        if self._chords is None:
            weights = weights * around.weight[:, _AROUND, None, :]
        else:
            chords = self._chords[index[:, :, 1:3]]  # (k, 4 rows, 2 nodes, 2)
            weights = weights * _weights(share, chords).swapaxes(1, 2)[:, _AROUND]
        return Stencil(self._nodes[index.reshape(-1, 16)], weights.reshape(-1, 6, 16))

    def inside(self, surface: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """Return whether places xi (k, 2) lie within their surfaces' edges."""
        last = (self.shape[surface] - 1).astype(float)
        within = (xi >= 0) & (xi <= last)
        within[:, 1] |= self.closed[surface]
        return within.all(axis=1)

    def clamp(self, surface: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """Return xi (k, 2) moved to the nearest place within the surfaces' edges."""
        last = (self.shape[surface] - 1).astype(float)
        clamped = np.clip(xi, 0, last)
        clamped[:, 1] = np.where(self.closed[surface], xi[:, 1], clamped[:, 1])
        return clamped


def interpolate(weight: np.ndarray, nodes: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return weighted sums (k, ..., 3) of nodal values (N, 3): weights (k, ..., c) at nodes (k, c)."""
    return weight @ values[nodes] if weight.ndim > 2 else (weight[:, None] @ values[nodes])[:, 0]


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
    """Return weights (k, r, 3, 4) at local parameters t (k,) of r rows, with tangents of chords (k, r, 2, 2)."""
    powers = np.stack([np.ones_like(t), t, t * t, t**3], axis=1)
    before, behind = chords[..., 0], chords[..., 1]  # (k, r, 2 nodes)
    tangents = np.zeros((*chords.shape[:2], 2, 4))
    for node in range(2):
        tangents[:, :, node, node] = -before[..., node]
        tangents[:, :, node, node + 1] = before[..., node] - behind[..., node]
        tangents[:, :, node, node + 2] = behind[..., node]
    points = (powers @ _POINTS).reshape(-1, 1, 3, 4)
    at_tangents = (powers @ _HERMITE).reshape(-1, 1, 3, 2)
    return points + at_tangents @ tangents


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

_HERMITE = _with_derivatives(np.array([[0.0, 0.0], [1.0, 0.0], [-2.0, -1.0], [1.0, 1.0]]))
"""What the tangents at the two nodes of a piece contribute, of any length. Columns: the two nodes."""

_ALONG, _AROUND = [0, 1, 0, 2, 1, 0], [0, 0, 1, 0, 1, 2]
"""Orders of the derivatives whose weights a stencil has."""
