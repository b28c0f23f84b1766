"""Facets and points in contact at every crossing; zones of contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from knitstudy.knit.geometry.crossings import Crossings
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.mechanics.contact.friction import OPEN, STICK, FrictionPoints
from knitstudy.mechanics.contact.interaction import PASS_SHARE, Contact
from knitstudy.mechanics.core.arrays import Floats, Ints

# ---- Contact zones: groups of surface facets that touch and hang together

# Half of the eight cells around a cell (along, around); cells of the other half have it as their neighbour.
NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1))


def count_zones(place: Ints, cell: Ints, around: int, places: int) -> Ints:
    """Return the number of zones (places,) at every place, such as the sides of crossings at increments.

    Facets whose edges or corners meet belong to one zone; facets of different places never do. Touching points (p,)
    have a place from 0 to `places` - 1 and a cell (p, 2), layer along the yarn and facet around it; one facet may be
    there several times. The last of the facets around a yarn is followed by the first.

    Examples
    --------
    >>> cell = np.array([[0, 0], [1, 11], [5, 6]])  # the first two meet at a corner
    >>> count_zones(np.zeros(3, dtype=int), cell, around=12, places=1).tolist()
    [2]
    """
    if not len(place):
        return np.zeros(places, dtype=np.int64)
    # A layer beyond the last one keeps neighbours from running into the next place.
    layers = int(cell[:, 0].max()) + 2

    def number(place: Ints, layer: Ints, facet: Ints) -> Ints:
        return (place * layers + layer) * around + facet % around

    facets, index = np.unique(number(place, *cell.T), return_index=True)
    place = place[index]
    layer, facet = cell[index].T
    edges = []
    for step, turn in NEIGHBOURS:
        neighbour = number(place, layer + step, facet + turn)
        position = np.minimum(np.searchsorted(facets, neighbour), len(facets) - 1)
        touching = np.flatnonzero(facets[position] == neighbour)
        edges.append(np.stack([touching, position[touching]]))
    start, end = np.concatenate(edges, axis=1)
    graph = coo_array((np.ones(len(start), dtype=bool), (start, end)), shape=(len(facets), len(facets)))
    _, zone = connected_components(graph, directed=False)
    # A zone counts where its first facet is.
    return np.bincount(place[np.unique(zone, return_index=True)[1]], minlength=places)


# ---- Where the rings of surfaces, the edges of contact's cells across a yarn, lie along their yarns


@dataclass(frozen=True, eq=False)
class Rings:
    """Rings of all yarns."""

    along: tuple[Floats, ...]  # of every yarn: the parameters of its rings, ascending
    arc_length: tuple[Floats, ...]  # their arc lengths, m

    @classmethod
    def of_rows(cls, arc_length: tuple[Floats, ...]) -> Rings:
        """Return the rings of grids whose rows of nodes, which count as parameters, lie at arc lengths in m."""
        return cls(tuple(np.arange(float(len(s))) for s in arc_length), arc_length)

    def arc_length_at(self, yarn: Ints, along: Floats) -> Floats:
        """Return arc lengths (k,) in m of places with parameters (k,) on yarns (k,)."""
        values = np.empty(len(yarn))
        for number in np.unique(yarn):
            here = yarn == number
            values[here] = np.interp(along[here], self.along[number], self.arc_length[number])
        return values


# ---- The crossings of a specimen on the surfaces of its mesh: facets that face each other, and the contact near them


REACH = 2.0  # distance along the yarn from a crossing, in radii, up to which contact is counted to it


@dataclass(frozen=True, eq=False)
class CrossingFacets:
    """Facets at the closest points of all crossings."""

    crossings: Crossings
    mesh: SweptMesh
    nodes: Ints  # (K, 2, 4) corners of the facet on each of the two yarns

    @classmethod
    def of(cls, crossings: Crossings, mesh: SweptMesh) -> CrossingFacets:
        """Find the facets: the layer that the closest point lies in, and the facet that faces the other yarn there."""
        across = crossings.point[:, ::-1] - crossings.point
        below = mesh.slice_below(crossings.yarn, crossings.arc_length)
        directors = (mesh.frames[below] + mesh.frames[below + 1])[:, :, :2]
        x, y = np.einsum("ksdi,ksi->dks", directors, across)
        facet = mesh.facet_at(below.ravel(), np.arctan2(y, x).ravel()).reshape(below.shape)
        return cls(crossings, mesh, mesh.facet_nodes(below, facet))

    def displacement(self, displacement: Floats) -> Floats:
        """Return the mean displacement (K, 2, 3) of the facets [m] from that of all nodes (N, 3)."""
        return displacement[self.nodes].mean(axis=2)

    def nearest(self, yarn: Ints, other: Ints, arc_length: Floats) -> tuple[Ints, Ints]:
        """Return crossing and side (k,) of places where two yarns touch; crossing -1 away from all of them.

        The places lie on yarns (k,) at arc lengths (k,) [m] and touch other yarns (k,).
        """
        side = np.where(yarn < other, 0, 1)
        crossings = self.crossings
        crossing = np.full(len(yarn), -1)
        for mine, theirs in np.unique(np.stack([yarn, other], axis=1), axis=0):
            here = np.flatnonzero((yarn == mine) & (other == theirs))
            end = side[here[0]]
            pair = [mine, theirs] if end == 0 else [theirs, mine]
            candidates = np.flatnonzero((crossings.yarn == pair).all(axis=1))
            if not len(candidates):
                continue
            apart = np.abs(arc_length[here, None] - crossings.arc_length[candidates, end])
            nearest = np.argmin(apart, axis=1)
            close = apart[np.arange(len(here)), nearest] <= REACH * self.mesh.radius
            crossing[here[close]] = candidates[nearest[close]]
        return crossing, side


# ---- Contact points in the history of a simulation: one row for every point that touches, at every increment


def touching_points(
    contact: Contact, points: FrictionPoints, facets: CrossingFacets, rings: Rings
) -> dict[str, Any]:
    """Return the columns of all points that touch, by the names that `knit.geometry.columns` has after ``contact_``.

    The points belong to a converged increment whose history is up to date.
    """
    quadrature, history = contact.quadrature, points.history
    active = np.flatnonzero(history.status != OPEN)
    point, target = history.point[active], history.surface[active]
    yarn, xi = quadrature.places(point)
    crossing, side = facets.nearest(yarn, target, rings.arc_length_at(yarn, xi[:, 0]))
    return {
        "crossing": crossing,
        "side": side,
        "yarn": yarn,
        "target": target,
        "cell": quadrature.row_and_column(point // quadrature.per_cell)[1],
        "position": points.position[active],
        "reference": contact.reference(point),
        "area": quadrature.area[point],
        "cell_area": quadrature.cell_area(point),
        "normal": points.projection.normal[active],
        "pressure": history.pressure[active],
        # Traction of the law acts with the internal force; on the yarn it is the reaction.
        "traction": -history.traction[active],
        "gap": history.gap[active],
        "slip": history.slip[active],
        "sticks": (history.status[active] == STICK).astype(np.int8),
    }


def crossing_forces(columns: Mapping[str, Any], count: int) -> Floats:
    """Return the force (count, 3) of contact on the yarn of side 0 at every crossing [N].

    Each side's points carry half of the stiffness; forces on the yarn of side 1 count with the other sign.
    """
    force = columns["pressure"][:, None] * columns["normal"] + columns["traction"]
    force *= (PASS_SHARE * columns["area"] * np.where(columns["side"] == 0, 1.0, -1.0))[:, None]
    total = np.zeros((count, 3))
    near = columns["crossing"] >= 0
    np.add.at(total, columns["crossing"][near], force[near])
    return total
