"""The space of displacements of solid yarns, and how its coefficients are numbered.

    u(x1, x2, s) = sum_j sum_(k < n_p(j)) phi_k(x1, x2) N_j(s) U_jk

phi_k are Zernike's polynomials on the unit disc (`basis`), N_j B-splines. The degree p belongs to the
spline j: where it falls there are fewer unknowns, and elements are smaller. Coefficients U_jk are the "nodes": yarn by
yarn, spline by spline along a yarn, k within; every yarn is a narrow band. The undeformed yarn lies in the same space,
so rigid motions do as well: x -> Q x + t maps coefficients X_jk to Q X_jk + t where k = 0, to Q X_jk where not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from knitstudy.errors import MeshError
from knitstudy.mechanics.core import basis as disc
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.basis import Spline
from knitstudy.mechanics.solids.elements.hexahedron import CLOSE, inverted, require_near
from knitstudy.mechanics.solids.spline_yarn import LARGEST_DEGREE

LEAST_DEGREE = 2  # of a yarn that bends


@dataclass(frozen=True, eq=False)
class YarnSpace:
    """The space of one yarn."""

    spline: Spline  # over arc length [m]
    degrees: Ints  # (J,) p of every coefficient along the yarn, at least 1
    # Spans before and after those of the yarn itself: its images, where it repeats itself
    beyond: int = 0

    @property
    def own(self) -> slice:
        """Its spans without those of its images."""
        return slice(self.beyond, len(self.spline.spans) - self.beyond)

    @cached_property
    def first_node(self) -> Ints:
        """First node (J + 1,) of every coefficient along the yarn, then the number of nodes."""
        return np.concatenate([[0], np.cumsum(disc.size(self.degrees))])

    @property
    def size(self) -> int:
        """Number of nodes."""
        return int(self.first_node[-1])

    @property
    def degree(self) -> int:
        """Largest p."""
        return int(self.degrees.max())

    @property
    def stride(self) -> int:
        """Functions over the section of the largest p."""
        return disc.size(self.degree)

    @property
    def span_sizes(self) -> Ints:
        """Number of nodes (E,) of every span."""
        first = self.spline.first
        return self.first_node[first + self.spline.degree + 1] - self.first_node[first]

    @property
    def bandwidth(self) -> int:
        """Largest difference of the numbers of two nodes that share a span."""
        return int(self.span_sizes.max()) - 1

    def weights(
        self,
        first: Ints,  # (k,), first spline
        along: Floats,  # (k, d + 1), values or derivatives of the splines
        across: Floats,  # (k, n_p), of the functions over the section, up to the largest degree
    ) -> tuple[Ints, Floats]:
        """Return nodes and weights (k, (d + 1) n_p) of sums over functions, zero where a coefficient has fewer."""
        spline = first[:, None] + np.arange(along.shape[1])
        k = np.arange(across.shape[1])
        there = k < disc.size(self.degrees)[spline][..., None]
        nodes = self.first_node[spline][..., None] + np.where(there, k, 0)
        weights = np.where(there, along[..., None] * across[:, None], 0.0)
        return nodes.reshape(len(first), -1), weights.reshape(len(first), -1)

    def fitted(self, s: Floats, centre: Floats, directors: Floats, radius: float) -> Floats:
        """Return the nodes (N, 3) of a round yarn by centreline (k, 3) and unit directors (k, 2, 3) at places (k,)."""
        values = self.spline.fit(s, np.concatenate([centre, directors[:, 0], directors[:, 1]], axis=1))
        return self.coefficients(values[:, :3], values[:, 3:6], values[:, 6:], radius)

    def coefficients(self, centre: Floats, d1: Floats, d2: Floats, radius: float) -> Floats:
        """Return the nodes (N, 3) of a round yarn from the coefficients (J, 3) of centreline and unit directors."""
        nodes = np.zeros((self.size, 3))
        at = self.first_node[:-1]
        nodes[at] = centre
        nodes[at + 1] = 0.5 * radius * d1  # phi_1 = 2 x1
        nodes[at + 2] = 0.5 * radius * d2
        return nodes


@dataclass(frozen=True, eq=False)
class Space:
    """The spaces of all yarns, numbered one after the other."""

    yarns: tuple[YarnSpace, ...]

    @cached_property
    def first_node(self) -> Ints:
        """First node (Y + 1,) of every yarn, then the number of nodes N."""
        return np.concatenate([[0], np.cumsum([yarn.size for yarn in self.yarns])])

    @property
    def size(self) -> int:
        """Number of nodes N."""
        return int(self.first_node[-1])

    @property
    def stride(self) -> int:
        """Largest number of functions over a section."""
        return max(yarn.stride for yarn in self.yarns)

    @cached_property
    def yarn(self) -> Ints:
        """Yarn (N,) of every node."""
        return np.repeat(np.arange(len(self.yarns)), np.diff(self.first_node))

    @cached_property
    def station(self) -> Ints:
        """Number (N,) of every node's spline among the splines of all yarns."""
        counts = disc.size(np.concatenate([yarn.degrees for yarn in self.yarns]))
        return np.repeat(np.arange(len(counts)), counts)

    @cached_property
    def order(self) -> Ints:
        """k (N,) of every node."""
        return np.arange(self.size) - np.searchsorted(self.station, self.station)

    @property
    def unity(self) -> Floats:
        """Coefficients (N,) of the constant 1."""
        return (self.order == 0).astype(float)

    def weights(
        self,
        yarn: Ints,  # (k,)
        x: Floats,  # (k, 2), place in the section over the radius, also outside of it
        s: Floats,  # (k,), arc length [m]
        derivative: int | None = None,  # 0 or 1 across, 2 along [1/m]
    ) -> tuple[Ints, Floats]:
        """Return nodes and weights (k, c) of places, or of a first derivative there."""
        splines = 1 + max(yarn.spline.degree for yarn in self.yarns)
        nodes = np.zeros((len(s), splines * self.stride), dtype=np.int64)
        weights = np.zeros(nodes.shape)
        for number, space in enumerate(self.yarns):
            here = np.flatnonzero(yarn == number)
            if not here.size:
                continue
            first, along = space.spline.basis(s[here], orders=1)
            value, gradient = disc.gradients(space.degree, x[here])
            across = value if derivative in (None, 2) else gradient[..., derivative]
            node, weight = space.weights(first, along[int(derivative == 2)], across)
            nodes[here] = node[:, :1] + self.first_node[number]
            nodes[here, : node.shape[1]] = node + self.first_node[number]
            weights[here, : node.shape[1]] = weight
        return nodes, weights

    def matrix(self, yarn: Ints, x: Floats, s: Floats) -> sp.csr_matrix:
        """Return the weights (k, N) of places as a matrix; arguments as of `weights`."""
        nodes, weights = self.weights(yarn, x, s)
        indptr = np.arange(len(nodes) + 1) * nodes.shape[1]
        matrix = sp.csr_matrix((weights.ravel(), nodes.ravel(), indptr), shape=(len(nodes), self.size))
        matrix.sum_duplicates()
        matrix.eliminate_zeros()
        return matrix


def yarn_space(
    breaks: np.ndarray,  # (E + 1,), ends of the spans [m]
    degrees: Ints | int,  # (E,), p of every span
    spline_degree: int = 3,  # d
    sharp: np.ndarray | Sequence[int] = (),  # breaks where a grip ends
    beyond: int = 0,  # spans before and after the yarn that continue it as it repeats itself
) -> YarnSpace:
    """Return the space of a yarn whose spans have the given degrees over the section.

    A coefficient takes the largest degree of the spans that it reaches over, so that no span has less.

    Raises MeshError for degrees and breaks that are not allowed.

    Examples
    --------
    >>> yarn_space(np.linspace(0, 1e-2, 5), degrees=3).size  # 7 cubic splines times 10 functions over the section
    70
    """
    degrees = np.broadcast_to(np.asarray(degrees, dtype=int), (len(breaks) - 1,))
    if beyond:
        period = breaks[-1] - breaks[0]
        breaks = np.concatenate([breaks[-1 - beyond : -1] - period, breaks, breaks[1 : 1 + beyond] + period])
        degrees = np.concatenate([degrees[-beyond:], degrees, degrees[:beyond]])
    if np.any(degrees == 1):
        raise MeshError(
            f"the degree over the section is 1, but must be at least {LEAST_DEGREE}: sections that stay flat and "
            "linear cannot widen where a bent yarn is compressed, which makes it (1 - nu) / ((1 + nu) (1 - 2 nu)) "
            "times too stiff, 2.1 at nu = 0.4"
        )
    if degrees.min() < LEAST_DEGREE or degrees.max() > LARGEST_DEGREE:
        raise MeshError(
            f"the degrees over the section are {degrees.min()} to {degrees.max()}, but must be whole numbers from "
            f"{LEAST_DEGREE} to {LARGEST_DEGREE}"
        )
    spline = Spline.on(breaks, spline_degree, sharp)
    largest = np.zeros(spline.size, dtype=int)
    for function in range(spline_degree + 1):
        np.maximum.at(largest, spline.first + function, degrees)
    return YarnSpace(spline, largest, beyond)


# Places and their derivatives at the same points of many sections of one yarn: sums along it first, then across


def along(yarn: YarnSpace, nodes: Floats, s: Floats) -> Floats:
    """Return coefficients over the section and their derivatives (2, k, n_p, m) of nodes (n, m) at arc lengths (k,)."""
    k = np.arange(yarn.stride)
    there = k < np.diff(yarn.first_node)[:, None]
    coefficients = np.where(there[..., None], nodes[np.where(there, yarn.first_node[:-1, None] + k, 0)], 0.0)
    first, splines = yarn.spline.basis(s, orders=1)
    here = coefficients[first[:, None] + np.arange(splines.shape[2])]  # (k, d + 1, n_p, m)
    return np.einsum("okj,kjni->okni", splines, here, optimize=True)


def sections(
    yarn: YarnSpace,
    nodes: np.ndarray,  # (n, 3), of this yarn: places or displacements [m]
    s: np.ndarray,  # (k,), arc lengths of the sections [m]
    x: np.ndarray,  # (q, 2), points in a section, over the radius
) -> tuple[np.ndarray, np.ndarray]:
    """Return values (k, q, 3) and derivatives (k, q, 3, 3), the last axis by x1, x2 [m] and s, of nodes of a yarn."""
    value, slope = along(yarn, nodes, s)
    phi, gradient = disc.gradients(yarn.degree, x)
    across = np.moveaxis(gradient, -1, 0)[:, None] @ value  # (2, k, q, 3)
    return phi @ value, np.stack([*across, phi @ slope], axis=-1)


def deformation_gradient(slope: Floats, change: Floats) -> Floats:
    """Return F (..., 3, 3) from the derivatives of undeformed places and of displacements that `sections` gives.

    Examples
    --------
    >>> deformation_gradient(2 * np.eye(3), np.diag([0.2, 0.0, 0.0])).diagonal().tolist()
    [1.1, 1.0, 1.0]
    """
    return np.eye(3) + change @ np.linalg.inv(slope)


# Which material point of a solid yarn lies at a place: the inverse of its undeformed shape

SAMPLES = 4  # points a span among which Newton's method finds its start


def locate(
    space: Space,
    nodes: Floats,  # (N, 3), undeformed coefficients [m]
    points: Floats,  # (k, 3), places [m]
    yarn: Ints,  # (k,), the yarn that each belongs to
) -> tuple[Floats, Floats]:
    """Return the coordinates x (k, 2), over the radius, and s (k,) [m] of places in or next to yarns.

    Outside of a yarn its shape goes on as the polynomials do.

    Raises MeshError if a place is too far from its yarn.
    """
    start = np.empty_like(points)
    size = np.empty(len(points))
    for number in np.unique(yarn):
        here = yarn == number
        own = space.yarns[number]
        start[here], size[here] = _start(own, nodes[space.first_node[number] :][: own.size], points[here])

    def mapped(number: Ints, places: Floats) -> tuple[Floats, Floats]:
        return shape(space, nodes, yarn[number], places[:, :2], places[:, 2])

    places = inverted(mapped, points, start, CLOSE * size)
    require_near(np.isfinite(places[:, 0]), points, yarn)
    return places[:, :2], places[:, 2]


def shape(space: Space, nodes: Floats, yarn: Ints, x: Floats, s: Floats) -> tuple[Floats, Floats]:
    """Return places (k, 3) [m] and their derivatives (k, 3, 3), columns by x1, x2 [m] and s, of coordinates."""
    shapes = []
    for derivative in (None, 0, 1, 2):
        at, weights = space.weights(yarn, x, s, derivative)
        shapes.append(np.einsum("kc,kci->ki", weights, nodes[at]))
    return shapes[0], np.stack(shapes[1:], axis=-1)


def _start(yarn: YarnSpace, nodes: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return coordinates (k, 3) from the nearest of some points of the centreline, and the yarn's radius (k,) there."""
    low, high = yarn.spline.spans.T
    share = (np.arange(SAMPLES) + 0.5) / SAMPLES
    s = (low[:, None] + (high - low)[:, None] * share).ravel()
    centre, *halves = np.moveaxis(along(yarn, nodes, s)[0, :, :3], 1, 0)
    nearest = cKDTree(centre).query(points)[1]
    # Of phi_1 and phi_2 the coefficients are half the directors.
    half = np.stack(halves, axis=1)[nearest]
    square = (half**2).sum(axis=2)
    x = np.einsum("ki,kji->kj", points - centre[nearest], half) / (2 * square)
    return np.column_stack([x, s[nearest]]), 2 * np.sqrt(square[:, 0])


@dataclass(frozen=True, eq=False)
class Sampling:
    """The map from nodes (N, ...) to the same points of many sections (S q, ...): ``sampling @ nodes``."""

    space: Space
    yarn: Ints  # (S,), of every section
    s: Floats  # (S,), its arc length [m]
    points: Floats  # (q, 2), in a section, over the radius

    def __matmul__(self, nodes: Floats) -> Floats:
        """Return the values (S q, ...) of nodes (N, ...)."""
        flat = nodes.reshape(len(nodes), -1)
        values = np.empty((len(self.s), len(self.points), flat.shape[1]))
        for number, own in enumerate(self.space.yarns):
            here = self.yarn == number
            value, _ = along(own, flat[self.space.first_node[number] :][: own.size], self.s[here])
            values[here] = disc.values(own.degree, self.points) @ value
        return values.reshape(-1, *nodes.shape[1:])
