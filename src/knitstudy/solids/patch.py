"""Discs between crossing yarns, and what both yarns say of the points of a disc.

A disc lies in the tangent plane midway between the closest points of two centrelines, in the small gap that is left
between the yarns. A point of it belongs to neither; each yarn is continued to it along its own radius: from the yarn's
surface by the difference that it shows over a depth of one disc radius. That is a weighted sum of the yarn's nodes,
exact for affine motions, and it stays bounded as elements become small, which a continuation by the gradient at the
surface does not: the patch would become softer without end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit
from knitstudy.solids.discretisation import Discretisation
from knitstudy.solids.tube import project


@dataclass(frozen=True)
class Discs:
    """Discs (D,) at some of the crossings of a specimen.

    Attributes
    ----------
    crossing : ndarray of int, shape (D,)
    centre : ndarray, shape (D, 3)
        Middles of the closest points [m].
    axes : ndarray, shape (D, 2, 3)
        Unit vectors in the tangent plane, the first along the lower row's yarn.
    radius : float
        [m]
    """

    crossing: np.ndarray
    centre: np.ndarray
    axes: np.ndarray
    radius: float

    @classmethod
    def of(cls, specimen: Knit | YarnPair, crossing: np.ndarray, radius: float) -> Discs:
        """Return the discs of a radius [m] at crossings (D,) of a specimen."""
        crossings = specimen.crossings
        ends = crossings.point[crossing]
        normal = ends[:, 1] - ends[:, 0]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        along = np.empty_like(normal)
        for yarn in np.unique(crossings.yarn[crossing, 0]):
            here = crossings.yarn[crossing, 0] == yarn
            along[here] = specimen.centrelines[yarn].tangent(crossings.arc_length[crossing[here], 0])
        along -= np.einsum("di,di->d", along, normal)[:, None] * normal
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        return cls(crossing, ends.mean(axis=1), np.stack([along, np.cross(normal, along)], axis=1), radius)

    def points(self, rule: np.ndarray) -> np.ndarray:
        """Return the places (D, q, 3) [m] of points (q, 2) of the unit disc."""
        return self.centre[:, None] + self.radius * rule @ self.axes


def continued(
    specimen: Knit | YarnPair, parts: Discretisation, discs: Discs, side: int, places: np.ndarray
) -> sp.csr_matrix:
    """Return the weighted sums (D q, N) of nodes that a yarn is at points of the discs.

    Parameters
    ----------
    specimen : Knit or YarnPair
    parts : Discretisation
    discs : Discs
    side : int
        0 the lower row's yarn, 1 the upper row's.
    places : ndarray, shape (D, q, 3)
        [m]
    """
    crossings = specimen.crossings
    yarn = np.repeat(crossings.yarn[discs.crossing, side], places.shape[1])
    arc_length = np.repeat(crossings.arc_length[discs.crossing, side], places.shape[1])
    place = places.reshape(-1, 3)
    outward, height = np.empty_like(place), np.empty(len(place))
    for one in np.unique(yarn):
        here = yarn == one
        line = specimen.centrelines[one]
        u = project(line, place[here], line.parameter(arc_length[here]))
        radial = place[here] - line.curve.value(u)
        far = np.linalg.norm(radial, axis=1)
        outward[here], height[here] = radial / far[:, None], far - specimen.radius
    depth = discs.radius
    surface = place - height[:, None] * outward
    share = height / depth
    return sp.csr_matrix(
        _sums(parts, surface, yarn, 1 + share) - _sums(parts, surface - depth * outward, yarn, share)
    )


def _sums(parts: Discretisation, points: np.ndarray, yarn: np.ndarray, factor: np.ndarray) -> sp.csr_matrix:
    """Return what points (k, 3) are of the nodes, times factors (k,)."""
    found, weight = parts.locate(points, yarn)
    rows = np.arange(len(points) + 1) * found.shape[1]
    values = (factor[:, None] * weight).ravel()
    matrix = sp.csr_matrix((values, found.ravel(), rows), shape=(len(points), len(parts.nodes)))
    matrix.sum_duplicates()
    return matrix
