"""Surfaces of solids in contact: interpolation, kinematics, projection of points.

Places and their derivatives are weighted sums over *carriers*: nodes of a grid (`grids`), or functions of the angle
times splines along a yarn (`cylinders`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.batches import Chosen, by_parts

# Orders of the derivatives whose weights a stencil has.
ALONG, AROUND = [0, 1, 0, 2, 1, 0], [0, 0, 1, 0, 1, 2]


@dataclass(frozen=True, eq=False)
class Stencil:
    """The carriers that places on surfaces depend on, and their weights."""

    nodes: Ints  # (k, c), carriers
    # (k, 6, c), of the place, its derivatives along and around, and its second ones: along, mixed, around
    weights: Floats
    key: Ints  # (k,), places with the same key have the same carriers

    @property
    def value(self) -> Floats:
        """Weights (k, c) of the places."""
        return self.weights[:, 0]

    @property
    def first(self) -> Floats:
        """Weights (k, 2, c) of the derivatives along and around."""
        return self.weights[:, 1:3]

    @property
    def second(self) -> Floats:
        """Weights (k, 3, c) of the second derivatives along, mixed and around."""
        return self.weights[:, 3:]

    def places(self, carriers: Floats) -> tuple[Floats, Floats, Floats]:
        """Return places (k, 3), derivatives (k, 2, 3) and second ones (k, 3, 3) for carriers (M, 3)."""
        all_six = self.weights @ carriers[self.nodes]
        return all_six[:, 0], all_six[:, 1:3], all_six[:, 3:]


class Surfaces(Protocol):
    """All smooth surfaces of a model.

    A place is a surface and two parameters xi = (along, around). Surfaces are divided into cells, which carry the
    Gauss points; rings, the edges of cells across a surface, are where the search begins.
    """

    cells: Ints  # (G, 2), cells of every surface, along and around
    closed: Bools  # (G,), whether it closes around
    offset: np.ndarray  # (G,), how far inside of the interpolated surface the contact surface lies [m]
    # (C,), cells that repeat others in a periodic structure: points face them, and they have none; None: no cell
    images: Bools | None
    block: int  # carriers come in runs of so many; a run is in a stencil as a whole
    # how many times as far as the farthest control point that it depends on a place may move
    overshoot: float

    def edges(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the parameters of one surface's edges of cells, along (m + 1,) and around (n + 1,)."""

    def stencil(self, surface: Ints, xi: Floats) -> Stencil:
        """Return the stencils of places xi (k, 2) on surfaces (k,)."""

    def places(self, surface: Ints, xi: Floats, carriers: Floats) -> tuple[np.ndarray, np.ndarray, Floats]:
        """Return the result of `Stencil.places` at places xi (k, 2) on surfaces (k,), for carriers (M, 3)."""

    def positions(self, surface: Ints, xi: Floats, carriers: Floats) -> Floats:
        """Return places (k, 3) alone [m]."""

    def clamp(self, surface: Ints, xi: Floats) -> Floats:
        """Return xi (k, 2) moved to the nearest place within the surfaces' edges."""

    def carry(self, nodes: Floats) -> Floats:
        """Return the carriers (M, 3) for the model's nodes (N, 3)."""

    def collect(self, force: Floats) -> Floats:
        """Return forces (N, 3) on the model's nodes from those on carriers (M, 3)."""

    def matrix(self, indptr: np.ndarray, indices: np.ndarray, data: Floats) -> sp.bsr_matrix:
        """Return the matrix (3 N, 3 N) over the model's nodes, in blocks of 3, of one over carriers.

        That one has a CSR pattern over runs of carriers, and blocks (nnz, b b, 9) of pairs of carriers of two runs.
        """

    def centres(self, carriers: Floats) -> Floats:
        """Return the middles (R, 3) of all rings, surface by surface."""

    def ring(self, number: int, row: Ints, carriers: Floats) -> np.ndarray:
        """Return places (k, n, 3) on rings (k,) of one surface, at the edges of cells around."""

    def controls(self, carriers: Floats) -> Floats:
        """Return control points (S, a, 3): an affine map of all of them is one of the surfaces."""

    def influence(self, carriers: Floats) -> float:
        """Return how far control points are from rings beside which places depend on them [m]."""


def interpolate(weight: Floats, nodes: Ints, values: Floats) -> Floats:
    """Return weighted sums (k, ..., 3) of values (M, 3): weights (k, ..., c) at carriers (k, c).

    Examples
    --------
    >>> values = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]])
    >>> interpolate(np.array([[0.25, 0.75]]), np.array([[0, 1]]), values).tolist()
    [[3.0, 0.0, 0.0]]
    """
    return weight @ values[nodes] if weight.ndim > 2 else (weight[:, None] @ values[nodes])[:, 0]


# How gap, normal and convected coordinates of a contact point change with the motion of both surfaces
# All changes are linear in z = (e, a_1, a_2), nine numbers a point: e = Dx - Dy at fixed xi, and a_a = Dy,_a. In terms
# of the nodal displacements, z = V Du with the rows [N, -M], [0, M,_1], [0, M,_2] of V.


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Derivatives with respect to z = (e, a_1, a_2), flattened to nine columns."""

    xi: Floats  # (k, 2, 9), Dxi = A^-1 (tau . e + g n . a), A = m - g k with the distance g
    gap: Floats  # (k, 9), Dg = n . e
    tangent: Floats  # (k, 2, 3, 9), Dtau_a = a_a + y,_ab Dxi^b
    normal: Floats  # (k, 3, 9), Dn = -tau^a (n . Dtau_a)

    @classmethod
    def of(cls, projection: Projection) -> Kinematics:
        """Return the derivatives at closest points."""
        tangent, normal, distance = projection.tangent, projection.normal, projection.distance
        k = len(normal)
        m = np.einsum("kai,kbi->kab", tangent, tangent)
        bend = np.einsum("kai,ki->ka", projection.curvature, normal)
        inverse = _inverse(m - distance[:, None, None] * bend[:, [0, 1, 1, 2]].reshape(-1, 2, 2))
        pull = np.zeros((k, 2, 9))  # tau_a . e + g n . a_a
        pull[:, :, :3] = tangent
        pull[:, 0, 3:6] = pull[:, 1, 6:9] = distance[:, None] * normal
        xi = inverse @ pull
        gap = np.zeros((k, 9))
        gap[:, :3] = normal
        second = projection.curvature[:, [0, 1, 1, 2]].reshape(k, 2, 2, 3)
        turned = np.einsum("kabi,kbz->kaiz", second, xi)
        turned[:, 0, :, 3:6] += np.eye(3)
        turned[:, 1, :, 6:9] += np.eye(3)
        dual = _inverse(m) @ tangent
        tilt = np.einsum("ki,kaiz->kaz", normal, turned)
        return cls(xi=xi, gap=gap, tangent=turned, normal=-np.einsum("kai,kaz->kiz", dual, tilt))


def _inverse(matrix: Floats) -> Floats:
    """Return the inverses of symmetric matrices (k, 2, 2)."""
    determinant = matrix[:, 0, 0] * matrix[:, 1, 1] - matrix[:, 0, 1] ** 2
    inverse = -matrix
    inverse[:, [0, 1], [0, 1]] = matrix[:, [1, 0], [1, 0]]
    return inverse / determinant[:, None, None]


# Closest points on smooth surfaces, for many points at once (section 6 of the formulation: tau_a . (x - y) = 0)

# Newton steps after which a point counts as having no closest point within the surface's edges.
ITERATIONS = 40
# Last Newton step, in units of the parameters, at which the closest point is found; the next one would be rounding.
ACCURACY = 1e-11
CHUNK = 2_000  # points that a thread projects at once; bounds the memory of stencils
# Step between the same whole numbers after which the next one of a converging Newton's method would be rounding.
QUADRATIC = 1e-6


@dataclass(frozen=True, eq=False)
class Projection(Chosen):
    """Points against the surfaces that they face."""

    xi: Floats  # (k, 2), parameters of the closest points
    # (k,), whether the closest point lies within the surface's edges; what else is here holds only then
    found: Bools
    tangent: Floats  # (k, 2, 3), tau_a [m]
    curvature: Floats  # (k, 3, 3) y,_ab for ab = 11, 12, 22 [m]
    normal: Floats  # (k, 3), outward unit normal n
    # (k,) n . (x - y) [m]; the gap is larger by the offsets of the two contact surfaces.
    distance: Floats


def project(surfaces: Surfaces, carriers: Floats, surface: Ints, points: Floats, guess: Floats) -> Projection:
    """Find the closest places on surfaces (k,) of current carriers (M, 3) to points (k, 3), from guesses (k, 2).

    Newton's method on the squared distance, with steps of at most one unit; where that is not convex, curvature is
    left out.
    """

    def of_some(part: slice) -> Projection:
        return _project(surfaces, carriers, surface[part], points[part], guess[part])

    return by_parts(of_some, len(points), CHUNK)


def _project(
    surfaces: Surfaces, carriers: Floats, surface: Ints, points: Floats, guess: Floats
) -> Projection:
    xi = surfaces.clamp(surface, guess)
    moving = np.arange(len(xi))
    converged = np.zeros(len(xi), dtype=bool)
    for _ in range(ITERATIONS):
        if not len(moving):
            break
        here = surface[moving]
        step, exact = _step(surfaces, carriers, here, points[moving], xi[moving])
        aim = xi[moving] + step
        exact &= (np.floor(aim) == np.floor(xi[moving])).all(axis=1)
        xi[moving] = surfaces.clamp(here, aim)
        still = np.abs(step).max(axis=1) < np.where(exact, QUADRATIC, ACCURACY)
        # A step that goes on pushing over an edge never comes to rest.
        beyond = np.abs(xi[moving] - aim).max(axis=1) > ACCURACY
        still &= ~(beyond & exact)
        converged[moving[still]] = True
        stuck = beyond & (np.abs(xi[moving] - (aim - step)).max(axis=1) < ACCURACY)
        moving = moving[~(still | stuck)]
    place, tangent, curvature = surfaces.places(surface, xi, carriers)
    normal = np.cross(tangent[:, 1], tangent[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Projection(
        xi=xi,
        found=converged,
        tangent=tangent,
        curvature=curvature,
        normal=normal,
        distance=np.einsum("ki,ki->k", normal, points - place),
    )


def _step(
    surfaces: Surfaces, carriers: Floats, surface: Ints, points: Floats, xi: Floats
) -> tuple[Floats, Bools]:
    """Return Newton's steps (k, 2) for the closest points, and where (k,) curvature is not left out."""
    place, tangent, curvature = surfaces.places(surface, xi, carriers)
    apart = points - place
    slope = np.einsum("kai,ki->ak", tangent, apart)
    m11, m12, m22 = metric(tangent)
    b11, b12, b22 = np.einsum("kai,ki->ak", curvature, apart)
    h11, h12, h22 = m11 - b11, m12 - b12, m22 - b22
    convex = (h11 > 0.05 * m11) & (h11 * h22 - h12**2 > 0.05 * (m11 * m22 - m12**2))
    h11, h12, h22 = np.where(convex, h11, m11), np.where(convex, h12, m12), np.where(convex, h22, m22)
    return np.clip(_solved(h11, h12, h22, slope), -1.0, 1.0), convex


def follows(tangent: Floats, way: Floats) -> Floats:
    """Return how closest places with tangents (k, 2, 3) follow points that move by ways (k, 3): parameters (k, 2).

    To first order, of surfaces that are flat beside the way.

    Examples
    --------
    >>> follows(np.array([[[2.0, 0, 0], [0, 1.0, 0]]]), np.array([[1.0, 3.0, 5.0]])).tolist()
    [[0.5, 3.0]]
    """
    return _solved(*metric(tangent), np.einsum("kai,ki->ak", tangent, way))


def metric(tangent: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the products m11, m12 and m22 (k,) of tangents (k, 2, 3) with each other.

    Examples
    --------
    >>> [product.tolist() for product in metric(np.array([[[2.0, 0, 0], [1.0, 1.0, 0]]]))]
    [[4.0], [2.0], [2.0]]
    """
    one, other = tangent[:, 0], tangent[:, 1]
    # All four at once, as the product of two matrices, take ten times as long.
    return tuple(np.einsum("ki,ki->k", *both) for both in ((one, one), (one, other), (other, other)))


def _solved(h11: Floats, h12: Floats, h22: Floats, right: Floats) -> Floats:
    """Return the solutions (k, 2) of symmetric 2 x 2 systems with right-hand sides (2, k)."""
    solution = np.stack([h22 * right[0] - h12 * right[1], h11 * right[1] - h12 * right[0]], axis=1)
    return solution / (h11 * h22 - h12**2)[:, None]
