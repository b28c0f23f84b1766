"""Interactions of solid yarns: ties of their displacement on discs, and contact of smooth tubes of the true radius.

At every tied crossing nine springs hold the relative displacement u of the upper yarn to the lower one,

    1/2 k_0 |mean u|^2 + 1/2 k_1 (|mean 2 xi u / a|^2 + |mean 2 eta u / a|^2),

with xi, eta on a disc of radius a, which lies in the tangent plane midway between the closest points of the yarns.
Each yarn is continued to the disc along its own radius: from its surface by the difference over a depth of one disc
radius. That is a weighted sum of the yarn's nodes, exact for affine motions. It stays bounded as elements become small;
a continuation by the gradient at the surface does not, and the tie would become softer without end (theory.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.linalg import qr
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from knitstudy.errors import MeshError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.scene.shared_sections import FacetContact
from knitstudy.knit.yarns.discretisation import Discretisation, project_on_tube
from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.cylinder import moments, polar_rule
from knitstudy.mechanics.core.model import DRAG


@dataclass(frozen=True)
class Discs:
    """Discs (D,) at some of the crossings of a fabric."""

    crossing: Ints  # (D,)
    centre: Floats  # (D, 3) middles of the closest points [m]
    axes: Floats  # (D, 2, 3) unit vectors in the tangent plane, the first along the lower row's yarn
    radius: float  # [m]

    @classmethod
    def of(cls, fabric: Fabric, crossing: Ints, radius: float) -> Discs:
        """Return the discs of a radius [m] at crossings (D,) of a fabric."""
        crossings = fabric.crossings
        ends = crossings.point[crossing]
        normal = ends[:, 1] - ends[:, 0]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        along = np.empty_like(normal)
        for yarn in np.unique(crossings.yarn[crossing, 0]):
            here = crossings.yarn[crossing, 0] == yarn
            along[here] = fabric.centrelines[yarn].tangent(crossings.arc_length[crossing[here], 0])
        along -= np.einsum("di,di->d", along, normal)[:, None] * normal
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        return cls(crossing, ends.mean(axis=1), np.stack([along, np.cross(normal, along)], axis=1), radius)

    def points(self, rule: Floats) -> Floats:
        """Return the places (D, q, 3) [m] of points (q, 2) of the unit disc."""
        return self.centre[:, None] + self.radius * rule @ self.axes


def _continued(
    fabric: Fabric, parts: Discretisation, discs: Discs, side: int, places: Floats
) -> sp.csr_matrix:
    """Return the weighted sums (D q, N) of nodes that one yarn, continued, is at points of the discs.

    Side 0 is the lower row's yarn, 1 the upper row's; `places` (D, q, 3) are the points [m].
    """
    crossings = fabric.crossings
    yarn = np.repeat(crossings.yarn[discs.crossing, side], places.shape[1])
    arc_length = np.repeat(crossings.arc_length[discs.crossing, side], places.shape[1])
    place = places.reshape(-1, 3)
    outward = np.empty_like(place)
    height = np.empty(len(place))
    for one in np.unique(yarn):
        here = yarn == one
        line = fabric.centrelines[one]
        u = project_on_tube(line, place[here], line.parameter(arc_length[here]))
        radial = place[here] - line.curve.value(u)
        far = np.linalg.norm(radial, axis=1)
        outward[here] = radial / far[:, None]
        height[here] = far - fabric.radius
    depth = discs.radius
    surface = place - height[:, None] * outward
    share = height / depth
    return sp.csr_matrix(
        _sums(parts, surface, yarn, 1 + share) - _sums(parts, surface - depth * outward, yarn, share)
    )


def _sums(parts: Discretisation, points: Floats, yarn: Ints, factor: Floats) -> sp.csr_matrix:
    """Return the weights (k, N) of nodes at points (k, 3), times factors (k,)."""
    nodes, weight = parts.locate(points, yarn)
    rows = np.arange(len(points) + 1) * nodes.shape[1]
    values = (factor[:, None] * weight).ravel()
    matrix = sp.csr_matrix((values, nodes.ravel(), rows), shape=(len(points), len(parts.nodes)))
    matrix.sum_duplicates()
    return matrix


# Of a tie where the yarns show all of the patch's compliance, over E R; ten times as much moves no force by 0.03 %
STIFFNESS = 100.0

RINGS = 3  # fewest rings of points on a disc

# Largest distance of rings, in elements: between them a disc would push elements that lie inside of it too little
WIDEST_STEP = 0.5

# Least radius of a disc, in elements. At 0.3 the force of a cell is 6 % (one point) to 15 % too large
# (docs/notes/ties.md)
NARROWEST = 0.25

# Distance from the middle of a disc, in its radii, from which on yarns touch each other: within it the tie does what
# contact would
BESIDE = 1.5


class Equations(NamedTuple):
    """Constraints x_slave = sum of weights times x_master."""

    slave: Ints  # (S,)
    master: Ints  # (S, c)
    weight: Floats  # (S, c); 0 is no term


@dataclass(frozen=True, eq=False)
class Ties:
    """Springs between the moments of two yarns' displacement on the discs of all tied crossings."""

    discs: Discs
    # (3 D, N) mean and linear moments of the upper yarn's displacement less the lower one's, as sums of nodes
    moments: sp.csr_matrix
    stiffness: Floats  # (D, 3) of the three moments [N/m]
    crossings: int  # K, whether tied or not

    @cached_property
    def links(self) -> sp.csr_matrix | None:
        """Their stiffness (N, N), the same for every component [N/m]; None if nothing is tied."""
        if not len(self.discs.crossing):
            return None
        matrix = sp.csr_matrix(self.moments.T @ sp.diags(self.stiffness.ravel()) @ self.moments)
        return sp.csr_matrix(0.5 * (matrix + matrix.T))

    @cached_property
    def joined(self) -> Ints:
        """Nodes that the ties act on, ascending."""
        return np.unique(self.moments.indices)

    def free(self, places: Floats) -> Bools:
        """Return which (k,) of undeformed places (k, 3) [m] lie outside of all ties."""
        within = BESIDE * self.discs.radius
        nearest = cKDTree(self.discs.centre).query(places, distance_upper_bound=within)[0]  # inf: none
        return np.asarray(nearest) >= within

    def constants(self) -> dict[str, Floats]:
        """Return whether crossings (K,) are tied, area [m2] and centroid [m] of ties, as variables of a history."""
        tied = np.zeros(self.crossings, dtype=np.int8)
        area = np.full(self.crossings, np.nan)
        centroid = np.full((self.crossings, 3), np.nan)
        at = self.discs.crossing
        tied[at] = 1
        area[at] = np.pi * self.discs.radius**2
        centroid[at] = self.discs.centre
        return {"crossing_tied": tied, "tied_area": area, "tied_centroid": centroid}

    def attributes(self) -> dict[str, float]:
        """Return the attributes of a history for the ties."""
        return {
            "tie_radius": self.discs.radius,
            "tie_nodes": len(self.joined),
            "tie_least_stiffness": float(self.stiffness.min(initial=np.inf)),
        }

    def resultants(self, displacement: Floats) -> Floats:
        """Return the force (K, 3) of every tie on the lower row's yarn [N], from displacements (N, 3) of nodes [m]."""
        total = np.zeros((self.crossings, 3))
        mean = (self.moments @ displacement).reshape(-1, 3, 3)[:, 0]  # of (disc, moment, component)
        total[self.discs.crossing] = self.stiffness[:, :1] * mean
        return total

    def equations(self, fixed: Ints) -> Equations:
        """Return the ties as rigid constraints whose slaves are none of the nodes `fixed` (k,).

        The three nodes of a disc that its moments weigh most are the slaves; discs that share nodes are solved
        together, so that no slave is in another's sum.
        """
        touched = sp.csr_matrix(abs(self.moments) > 0, dtype=np.int8)
        count, group = connected_components(touched @ touched.T, directed=False)
        slaves, sums = [], []
        for number in range(count):
            rows = self.moments[group == number]
            nodes = np.unique(rows.indices)
            dense = rows[:, nodes].toarray()
            allowed = np.isin(nodes, fixed, invert=True)
            order = np.flatnonzero(allowed)[qr(dense[:, allowed], mode="r", pivoting=True)[1]]
            chosen = order[: len(dense)]
            others = np.setdiff1d(np.arange(len(nodes)), order[: len(dense)])
            slaves.append(nodes[chosen])
            weight = -np.linalg.solve(dense[:, chosen], dense[:, others])
            sums += [(nodes[others], weights) for weights in weight]
        width = max((len(nodes) for nodes, _ in sums), default=0)
        master = np.zeros((len(sums), width), dtype=np.int64)
        weight = np.zeros((len(sums), width))
        for place, (nodes, weights) in enumerate(sums):
            master[place, : len(nodes)], weight[place, : len(nodes)] = nodes, weights
        return Equations(np.concatenate([np.empty(0, dtype=np.int64), *slaves]), master, weight)


def tie_crossings(
    parts: Discretisation,
    fabric: Fabric,
    tied: Bools,  # (K,)
    radius: float,  # of the discs, over the yarn's
    youngs_modulus: float,  # of the yarns [Pa]
) -> Ties:
    """Tie crossings of a fabric on discs.

    Raises MeshError if discs overlap each other, reach over the end of a yarn, or are narrower than elements can show.
    """
    crossing = np.flatnonzero(tied)
    discs = Discs.of(fabric, crossing, radius * fabric.radius)
    _require_room(fabric, discs, radius)
    least = NARROWEST * parts.size / fabric.radius
    if parts.missing_compliance is None and len(crossing) and radius < least:
        raise MeshError(
            f"tie.radius is {radius:g} radii, but elements of {parts.size:.4g} m show no patches of less than "
            f"{least:.3g}: use that at least, a smaller mesh.size or a larger mesh.refinement"
        )
    rings = int(np.ceil(discs.radius / (WIDEST_STEP * parts.size)))
    rule, weight = polar_rule(max(RINGS, rings))
    places = discs.points(rule)
    lower, upper = (_continued(fabric, parts, discs, side, places) for side in range(2))
    mean = sp.kron(sp.identity(len(crossing)), moments(rule) * weight, format="csr")  # (3 D, D q)
    joined = sp.csr_matrix(mean @ (upper - lower))
    joined.eliminate_zeros()
    compliance = np.full((len(crossing), 2), 1 / (STIFFNESS * youngs_modulus * fabric.radius))
    if parts.missing_compliance is not None:
        yarn, place = fabric.crossings.yarn[crossing], fabric.crossings.arc_length[crossing]
        compliance += sum(parts.missing_compliance(yarn[:, i], place[:, i], discs.radius) for i in range(2))
    return Ties(discs, joined, 1 / compliance[:, [0, 1, 1]], len(tied))


def _require_room(fabric: Fabric, discs: Discs, radius: float) -> None:
    """Refuse discs that overlap each other on a yarn, or reach over its end."""
    yarn, place = (values[discs.crossing] for values in (fabric.crossings.yarn, fabric.crossings.arc_length))
    length = np.array([line.length for line in fabric.centrelines])
    room = np.minimum(place, length[yarn] - place)  # (D, 2)
    if np.any(room < discs.radius):
        worst, side = np.unravel_index(np.argmin(room), room.shape)
        raise MeshError(
            f"tie.radius is {radius:g} radii, but crossing {discs.crossing[worst]} lies "
            f"{room[worst, side] / fabric.radius:.3g} radii from the end of yarn {yarn[worst, side]}: use a smaller one"
        )
    if len(discs.crossing) > 1:
        apart, other = map(np.asarray, cKDTree(discs.centre).query(discs.centre, k=2))
        closest = int(np.argmin(apart[:, 1]))
        if apart[closest, 1] < 2 * discs.radius:
            raise MeshError(
                f"tie.radius is {radius:g} radii, but crossings {discs.crossing[closest]} and "
                f"{discs.crossing[other[closest, 1]]} lie {apart[closest, 1] / fabric.radius:.3g} radii apart: use "
                "less than half of that"
            )


def penalties(keys: FacetContact, youngs_modulus: float, friction: float, size: float) -> Coulomb:
    """Return stiffnesses as ratios to E / h (Table 1), h = `size` [m]; no slip at all with infinite friction."""
    unit = youngs_modulus / size
    return Coulomb(keys.normal_stiffness * unit, keys.tangential_stiffness * unit, friction)


def drag_of(yarns: Discretisation, fixed: Ints, volume: Floats, youngs_modulus: float) -> Floats | None:
    """Return the drag (N,) on yarns that nothing but contact can hold, None if there are none [N/m].

    None of their nodes is `fixed` (k,) by a tie or a grip. `volume` (N,) is that of every node [m3].
    """
    free = ~np.isin(yarns.yarn, yarns.yarn[fixed])
    if not free.any():
        return None
    return np.where(free, DRAG * youngs_modulus * volume / yarns.size**2, 0.0)
