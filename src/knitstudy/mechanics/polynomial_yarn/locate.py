"""Which material point of a solid yarn lies at a place: the inverse of its undeformed shape."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.errors import MeshError
from knitstudy.mechanics.polynomial_yarn.space import Space, YarnSpace

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
