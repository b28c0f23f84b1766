"""The derivative of contact's forces: points' tangents, summed over the nodes of both surfaces."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.contact.kinematics import Kinematics
from knitstudy.mechanics.contact.points import ContactPoints
from knitstudy.mechanics.contact.projection import Projection
from knitstudy.mechanics.contact.surface import Stencil

CHUNK = 256
"""Points whose stiffness is formed at once: 32 x 32 blocks each."""


def stiffness(
    law: Coulomb, points: ContactPoints, weight: np.ndarray, own: Stencil, other: Stencil, count: int
) -> tuple[sp.bsr_matrix, sp.bsr_matrix]:
    """Return the tangent and its symmetric positive part over `count` nodes, of one pattern.

    Parameters
    ----------
    law : Coulomb
    points : ContactPoints
    weight : ndarray, shape (a,)
        Area that each touching point stands for in its pass [m2].
    own, other : Stencil
        Of the touching points on their own surfaces and of their closest points.
    count : int
    """
    active = points.active
    inner, positive = _point_tangents(law, points, active)
    inner *= weight[:, None, None]
    positive *= weight[:, None, None]
    nodes = np.concatenate([own.nodes, other.nodes], axis=1)  # (a, 32)
    rows = np.zeros((len(active), 3, 32))  # V
    rows[:, 0, :16], rows[:, 0, 16:] = own.value, -other.value
    rows[:, 1:, 16:] = other.first
    # Points of one cell that face one cell share their 32 nodes: summed before they are scattered.
    _, group = np.unique(nodes[:, [5, 10, 21, 26]], axis=0, return_inverse=True)
    order, start = _sorted(group.ravel())
    shared = nodes[order[start]]
    full, symmetric = (np.zeros((len(start), 32 * 32, 9)) for _ in range(2))
    bounds = np.append(start, len(order))
    first = 0
    while first < len(start):
        last = max(first + 1, int(np.searchsorted(bounds, bounds[first] + CHUNK, side="right")) - 1)
        here = order[bounds[first] : bounds[last]]
        begin = bounds[first:last] - bounds[first]
        v = rows[here]
        left = np.swapaxes(v, 1, 2) @ inner[here].reshape(-1, 3, 27)  # (k, 32, (i, m, j))
        left = left.reshape(-1, 32, 3, 3, 3).transpose(0, 1, 2, 4, 3).reshape(-1, 32 * 9, 3)
        blocks = (left @ v).reshape(-1, 32, 9, 32).transpose(0, 1, 3, 2).reshape(-1, 1024, 9)
        full[first:last] = np.add.reduceat(blocks, begin, axis=0)
        pair = (v[:, 0, :, None] * v[:, 0, None, :]).reshape(-1, 1024, 1)
        symmetric[first:last] = np.add.reduceat(pair * positive[here].reshape(-1, 1, 9), begin, axis=0)
        first = last
    return _scatter(shared, full, symmetric, count)


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
        stencil=projection.stencil,
        tangent=projection.tangent[active],
        curvature=projection.curvature[active],
        normal=projection.normal[active],
        distance=projection.distance[active],
    )


def _sorted(key: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the order (k,) of ascending keys (k,), none negative, and where each new one starts in it."""
    order = np.argsort(key, kind="stable")
    return order, np.flatnonzero(np.diff(key[order], prepend=-1))


def _scatter(
    nodes: np.ndarray, full: np.ndarray, symmetric: np.ndarray, count: int
) -> tuple[sp.bsr_matrix, sp.bsr_matrix]:
    """Sum blocks (e, 1024, 9) of elements with nodes (e, 32) into two matrices over `count` nodes, of one pattern."""
    shape = (3 * count, 3 * count)
    row = np.repeat(nodes, 32, axis=1).ravel().astype(np.int64)
    column = np.tile(nodes, (1, 32)).ravel()
    key = row * count + column
    order, start = _sorted(key)
    unique = key[order[start]]
    indptr = np.searchsorted(unique, count * np.arange(count + 1, dtype=np.int64)).astype(np.int32)
    indices = (unique % count).astype(np.int32)
    matrices = []
    for blocks in (full, symmetric):
        if len(start):
            data = np.add.reduceat(blocks.reshape(-1, 9)[order], start, axis=0).reshape(-1, 3, 3)
        else:
            data = np.zeros((0, 3, 3))
        matrices.append(sp.bsr_matrix((data, indices, indptr), shape=shape))
    return matrices[0], matrices[1]
