"""The derivative of contact's forces: points' tangents, summed over the nodes of both surfaces."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.contact.kinematics import Kinematics
from knitstudy.mechanics.contact.points import ContactPoints
from knitstudy.mechanics.contact.projection import Projection
from knitstudy.mechanics.contact.surface import Stencil

BLOCKS = 9
"""Entries of a block of two nodes."""


class CellPairs:
    """Pairs of cells that touch each other: 32 nodes each, and the pattern of the matrix that couples them.

    Parameters
    ----------
    nodes : ndarray of int, shape (g, 32)
    count : int
        Number of all nodes.
    """

    def __init__(self, nodes: np.ndarray, count: int) -> None:
        self.nodes = nodes
        row = np.repeat(nodes, 32, axis=1).ravel().astype(np.int64)
        key, place = np.unique(row * count + np.tile(nodes, (1, 32)).ravel(), return_inverse=True)
        self._shape = (3 * count, 3 * count)
        self._indptr = np.searchsorted(key, count * np.arange(count + 1, dtype=np.int64)).astype(np.int32)
        self._indices = (key % max(count, 1)).astype(np.int32)
        every = np.arange(place.size)
        self._sum = sp.csr_matrix((np.ones(place.size), (place.ravel(), every)), shape=(len(key), place.size))

    def matrix(self, blocks: np.ndarray) -> sp.bsr_matrix:
        """Return the sum of blocks (g, 32 x 32, 9) over all pairs."""
        data = (self._sum @ blocks.reshape(-1, BLOCKS)).reshape(-1, 3, 3)
        return sp.bsr_matrix((data, self._indices, self._indptr), shape=self._shape)


def stiffness(
    law: Coulomb,
    points: ContactPoints,
    weight: np.ndarray,
    own: Stencil,
    other: Stencil,
    count: int,
    before: CellPairs | None = None,
) -> tuple[sp.bsr_matrix, sp.bsr_matrix, CellPairs]:
    """Return the tangent and its symmetric positive part over `count` nodes, of one pattern, and that pattern.

    Points of one cell that face one cell share their 32 nodes: the rows of all of them, one below the other, make one
    product V^T (B V) a pair of cells.

    Parameters
    ----------
    law : Coulomb
    points : ContactPoints
    weight : ndarray, shape (a,)
        Area that each touching point stands for in its pass [m2].
    own, other : Stencil
        Of the touching points on their own surfaces and of their closest points.
    count : int
    before : CellPairs, optional
        Pattern of an earlier tangent, used again if the same cells touch.
    """
    active = points.active
    inner, positive = _point_tangents(law, points, active)
    inner *= weight[:, None, None]
    positive *= weight[:, None, None]
    nodes = np.concatenate([own.nodes, other.nodes], axis=1)  # (a, 32)
    rows = np.zeros((len(active), 3, 32))  # V
    rows[:, 0, :16], rows[:, 0, 16:] = own.value, -other.value
    rows[:, 1:, 16:] = other.first
    changes = inner.reshape(-1, 9, 3, 3).swapaxes(2, 3).reshape(-1, 27, 3) @ rows  # (a, (m, i, j), 32)
    pulls = positive.reshape(-1, 9, 1) * rows[:, None, 0]  # (a, (i, j), 32)

    _, first, pair = np.unique(nodes[:, [5, 10, 21, 26]], axis=0, return_index=True, return_inverse=True)
    pair = pair.ravel()
    order = np.argsort(pair, kind="stable")
    many = np.bincount(pair, minlength=len(first))
    within = np.arange(len(pair)) - np.repeat(np.cumsum(many) - many, many)
    most = int(many.max(initial=0))

    def stacked(values: np.ndarray) -> np.ndarray:
        """Values (a, ...) of points beside each other for every pair of cells, (g, most, ...), and zeros."""
        table = np.zeros((len(first), most, *values.shape[1:]))
        table[pair[order], within] = values[order]
        return table

    g = len(first)
    left = stacked(rows).reshape(g, most * 3, 32).swapaxes(1, 2)
    full = left @ stacked(changes.reshape(-1, 3, 288)).reshape(g, most * 3, 288)  # (g, 32, ((i, j), 32))
    left = stacked(rows[:, 0]).swapaxes(1, 2)
    symmetric = left @ stacked(pulls.reshape(-1, 288))
    pairs = before if before is not None and np.array_equal(before.nodes, nodes[first]) else None
    pairs = pairs or CellPairs(nodes[first], count)

    def blocks(product: np.ndarray) -> np.ndarray:
        return product.reshape(g, 32, BLOCKS, 32).swapaxes(2, 3)

    return pairs.matrix(blocks(full)), pairs.matrix(blocks(symmetric)), pairs


def _point_tangents(law: Coulomb, points: ContactPoints, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return B (a, 9, 9) of R's derivative V^T B V, and the symmetric stiffness (a, 3, 3), without weights."""
    projection = _active(points.projection, active)
    kinematics = Kinematics.of(projection)
    pressure, status = points.pressure[active], points.status[active]
    normal = projection.normal
    change = law.normal * normal[:, :, None] * kinematics.gap[:, None, :]
    change -= pressure[:, None, None] * kinematics.normal
    if law.friction > 0:
        slip = points.slip_share[active, None, None] * kinematics.xi
        slip += points.slip_rate[active][:, :, None] * kinematics.gap[:, None, :]
        trial = np.einsum("kai,kaz->kiz", projection.tangent, slip)
        trial += np.einsum("ka,kaiz->kiz", points.slip[active], kinematics.tangent)
        change += law.tangent(points.trial[active], law.tangential * trial, kinematics.gap, pressure, status)
    traction = points.traction[active] - pressure[:, None] * normal
    inner = np.empty((len(active), 9, 9))
    inner[:, :3] = change
    for a in range(2):
        inner[:, 3 + 3 * a : 6 + 3 * a] = -traction[:, :, None] * kinematics.xi[:, a, None, :]
    return inner, law.symmetric_stiffness(points.trial[active], normal, pressure, status)


def _active(projection: Projection, active: np.ndarray) -> Projection:
    return Projection(
        xi=projection.xi[active],
        found=projection.found[active],
        tangent=projection.tangent[active],
        curvature=projection.curvature[active],
        normal=projection.normal[active],
        distance=projection.distance[active],
    )
