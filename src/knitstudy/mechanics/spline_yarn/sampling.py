"""Points of a spline yarn: find the parameters of a point, evaluate many points at once."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from knitstudy.errors import MeshError
from knitstudy.mechanics.spline_yarn import basis as disc
from knitstudy.mechanics.spline_yarn.space import Space, YarnSpace

# ---- Which material point of a solid yarn lies at a place: the inverse of its undeformed shape


SAMPLES = 4
"""Points a span among which Newton's method finds its start."""

ITERATIONS = 20

ACCURACY = 1e-12
"""Last step, over the radius and over a span."""


def locate(
    space: Space, nodes: np.ndarray, points: np.ndarray, yarn: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the coordinates x (k, 2), over the radius, and s (k,) [m] of places in or next to yarns.

    Outside of a yarn its shape goes on as the polynomials do.

    Parameters
    ----------
    space : Space
    nodes : ndarray, shape (N, 3)
        Undeformed coefficients [m].
    points : ndarray, shape (k, 3)
        Places [m].
    yarn : ndarray of int, shape (k,)
        The yarn that each belongs to.

    Raises
    ------
    MeshError
        If a place is too far from its yarn.
    """
    x, s = np.zeros((len(points), 2)), np.zeros(len(points))
    for number in np.unique(yarn):
        here = yarn == number
        own = space.yarns[number]
        x[here], s[here] = _start(own, nodes[space.first_node[number] :][: own.size], points[here])
    shortest = np.array([np.diff(each.spline.spans, axis=1).min() for each in space.yarns])
    moving = np.arange(len(points))
    for _ in range(ITERATIONS):
        place, slope = shape(space, nodes, yarn[moving], x[moving], s[moving])
        step = np.linalg.solve(slope, (points[moving] - place)[..., None])[..., 0]
        x[moving] += step[:, :2]
        s[moving] += step[:, 2]
        size = np.maximum(np.abs(step[:, :2]).max(axis=1), np.abs(step[:, 2]) / shortest[yarn[moving]])
        moving = moving[~(size <= ACCURACY)]
        if not len(moving):
            return x, s
    place = points[moving[0]]
    raise MeshError(
        f"the place ({place[0]:.6g}, {place[1]:.6g}, {place[2]:.6g}) m is too far from yarn {yarn[moving[0]]} to be "
        "a part of it: use a smaller pattern.clearance or tie.radius"
    )


def shape(
    space: Space, nodes: np.ndarray, yarn: np.ndarray, x: np.ndarray, s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return places (k, 3) [m] and their derivatives (k, 3, 3), columns by x1, x2 [m] and s, of coordinates."""
    found = []
    for derivative in (None, 0, 1, 2):
        at, weights = space.weights(yarn, x, s, derivative)
        found.append(np.einsum("kc,kci->ki", weights, nodes[at]))
    return found[0], np.stack(found[1:], axis=-1)


def _start(yarn: YarnSpace, nodes: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return coordinates from the nearest of some points of the centreline."""
    low, high = yarn.spline.spans.T
    share = (np.arange(SAMPLES) + 0.5) / SAMPLES
    s = (low[:, None] + (high - low)[:, None] * share).ravel()
    first, values = yarn.spline.basis(s)
    at = yarn.first_node[first[:, None] + np.arange(values.shape[2])]
    centre, half1, half2 = (np.einsum("kj,kji->ki", values[0], nodes[at + k]) for k in range(3))
    nearest = cKDTree(centre).query(points)[1]
    out = points - centre[nearest]
    # Of phi_1 and phi_2 the coefficients are half the directors.
    x = [np.einsum("ki,ki->k", out, d[nearest]) / (2 * (d[nearest] ** 2).sum(axis=1)) for d in (half1, half2)]
    return np.stack(x, axis=-1), s[nearest]


# ---- What solid yarns are at many sections, all sampled at the same points: sums along the yarn first, then across


class Sampling:
    """A linear map from nodes (N, ...) to the points (S q, ...) of sections, as a product: ``sampling @ nodes``.

    As one sparse matrix it would have (d + 1) n_p entries a point.

    Parameters
    ----------
    space : Space
    yarn : ndarray of int, shape (S,)
        Of every section.
    s : ndarray, shape (S,)
        Its arc length [m].
    points : ndarray, shape (q, 2)
        In a section, over the radius.
    """

    def __init__(self, space: Space, yarn: np.ndarray, s: np.ndarray, points: np.ndarray) -> None:
        degree = max(each.degree for each in space.yarns)
        self._across = disc.values(degree, points)
        functions = disc.size(degree)
        rows, columns, values = [], [], []
        for number, own in enumerate(space.yarns):
            here = np.flatnonzero(yarn == number)
            first, along = own.spline.basis(s[here])
            spline = first[:, None] + np.arange(along.shape[2])
            count = disc.size(own.degrees)[spline]
            k = np.arange(functions)
            there = k < count[..., None]
            rows.append(np.broadcast_to((here[:, None, None] * functions + k), there.shape)[there])
            columns.append((space.first_node[number] + own.first_node[spline][..., None] + k)[there])
            values.append(np.broadcast_to(along[0][..., None], there.shape)[there])
        rows, columns, values = (np.concatenate(parts) for parts in (rows, columns, values))
        self._along = sp.csr_matrix((values, (rows, columns)), shape=(len(s) * functions, space.size))
        self.shape = (len(s) * len(points), space.size)

    def __matmul__(self, nodes: np.ndarray) -> np.ndarray:
        """Return the values (S q, ...) of nodes (N, ...)."""
        functions = self._across.shape[1]
        sums = (self._along @ nodes.reshape(len(nodes), -1)).reshape(-1, functions, nodes[0].size)
        return (self._across @ sums).reshape(-1, *nodes.shape[1:])
