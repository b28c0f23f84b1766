"""Which point of an isoparametric element lies at a place: the inverse of its map, by Newton's method in batches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.errors import MeshError
from knitstudy.mechanics.batches import inverse

CANDIDATES = 8
"""Elements that are tried for a point, nearest centres first."""

STEPS = 25

CLOSE = 1e-12
"""Distance from the point, over the size of the element, at which the iteration ends."""

FARTHEST = 2.0
"""Largest natural coordinate at which an element still answers for a point outside of it."""

Functions = Callable[[np.ndarray], np.ndarray]
"""Shape functions (k, a), or their gradients (k, a, 3), at natural coordinates (k, 3)."""


@dataclass(frozen=True, eq=False)
class InverseMap:
    """Material points of all yarns, by their places.

    Attributes
    ----------
    nodes : ndarray, shape (N, 3)
        [m]
    elements : ndarray of int, shape (E, a)
    yarn : ndarray of int, shape (N,)
        Of every node.
    shape, gradient : callable
        Of the elements.
    """

    nodes: np.ndarray
    elements: np.ndarray
    yarn: np.ndarray
    shape: Functions
    gradient: Functions

    def locate(self, points: np.ndarray, yarn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the nodes (k, a) and weights (k, a) whose sum a material point is.

        A point outside is given by the element that it is least far out of, which goes on as its functions do.

        Parameters
        ----------
        points : ndarray, shape (k, 3)
            Places in or next to yarns [m].
        yarn : ndarray of int, shape (k,)
            The yarn that each belongs to.

        Raises
        ------
        MeshError
            If a place is too far from its yarn.
        """
        found = np.empty((len(points), self.elements.shape[1]), dtype=np.int64)
        natural = np.empty((len(points), 3))
        owner = self.yarn[self.elements[:, 0]]
        for number in np.unique(yarn):
            here = yarn == number
            found[here], natural[here] = self._nearest(self.elements[owner == number], points[here])
        reach = np.nan_to_num(np.abs(natural).max(axis=1, initial=0.0), nan=np.inf)
        if np.any(reach > FARTHEST):
            worst = int(np.argmax(reach))
            place = ", ".join(f"{value:.6g}" for value in points[worst])
            raise MeshError(
                f"the place ({place}) m is too far from yarn {yarn[worst]} to be a part of it: use a smaller "
                "pattern.clearance or tie.radius"
            )
        return found, self.shape(natural)

    def _nearest(self, elements: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return nodes (k, a) of the elements that points lie in, or least far out of, and where in them (k, 3)."""
        count = min(CANDIDATES, len(elements))
        near = cKDTree(self.nodes[elements].mean(axis=1)).query(points, k=count)[1]
        near = near.reshape(len(points), count)
        best, outside = np.full(points.shape, np.nan), np.full(len(points), np.inf)
        chosen = near[:, 0].copy()
        for candidate in near.T:
            asked = np.flatnonzero(outside > 1)
            corners = self.nodes[elements[candidate[asked]]]
            natural = natural_coordinates(corners, points[asked], self.shape, self.gradient)
            reach = np.abs(natural).max(axis=1)
            better = reach < outside[asked]  # not where it is nan
            these = asked[better]
            best[these], outside[these], chosen[these] = natural[better], reach[better], candidate[these]
        return elements[chosen], best


def natural_coordinates(
    corners: np.ndarray, points: np.ndarray, shape: Functions, gradient: Functions
) -> np.ndarray:
    """Return the natural coordinates (k, 3) of points in elements; nan where the iteration does not get there.

    Parameters
    ----------
    corners : ndarray, shape (k, a, 3)
        Nodes of one element for every point [m].
    points : ndarray, shape (k, 3)
        [m]
    shape, gradient : callable
        Of the element.
    """
    natural = np.zeros_like(points)
    size = np.ptp(corners, axis=1).max(axis=1)
    moving = np.arange(len(points))
    for _ in range(STEPS):
        here, own = natural[moving], corners[moving]
        apart = points[moving] - np.einsum("ka,kai->ki", shape(here), own)
        far = np.abs(apart).max(axis=1) > CLOSE * size[moving]
        moving = moving[far]
        if not len(moving):
            return natural
        jacobian = np.swapaxes(own[far], 1, 2) @ gradient(here[far])  # dX_i / dxi_j
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.einsum("kij,kj->ki", inverse(jacobian)[0], apart[far])
        # Far outside of an element its map can fold; steps of bounded length come back from there.
        natural[moving] = here[far] + np.clip(np.nan_to_num(step), -1, 1)
    natural[moving] = np.nan
    return natural
