"""Ties of facets (Fig. 2a of the paper): slave nodes follow the facet of the master yarn that they lie on.

What commercial programs do; the tied area is that of facets, and shrinks with them (docs/ties.md).
The yarn of the upper row is the slave. Tied are, at every crossing, the slave facet nearest to the master's tube
(two where they are equally near) and all facets whose four nodes are within the tolerance. Their nodes are moved,
free of strain, onto the master's surface: only then are the weights exact for rigid motions, and a tie carries no
load when the pair rotates.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from knitstudy.errors import MeshError
from knitstudy.geometry.fabric import Fabric
from knitstudy.mesh.sweep import SweptMesh
from knitstudy.models.discretisation import Faces, distance_to_tube, linear_faces, project_on_tube

SAMPLES = 6
"""Points along each side of a facet in the search for the nearest one; those on edges belong to both sides."""

ROUNDING = 1e-6
"""Difference of gaps, in radii, up to which facets are equally near."""


@dataclass(frozen=True)
class FacetTie:
    """Linear constraints of all tied crossings, x_slave = sum of weights times x_master.

    Attributes
    ----------
    slave : ndarray of int, shape (S,)
        Slave nodes, each once.
    master : ndarray of int, shape (S, c)
        Their master nodes, those of a facet.
    weight : ndarray, shape (S, c)
        Rows sum to 1.
    crossing : ndarray of int, shape (S,)
        Crossing that a slave belongs to.
    nodes : ndarray, shape (N, 3)
        Nodes with the slaves moved onto the masters [m].
    adjustment : ndarray, shape (S,)
        How far they were moved [m].
    area : ndarray, shape (K,)
        Tied area of every crossing [m2]; nan where it is not tied.
    centroid : ndarray, shape (K, 3)
        Centroid of the tied area [m]; nan where there is none.
    tolerance : float
        Largest gap beyond the clearance that was tied [m].
    facet : float
        Size of a facet [m].
    """

    slave: np.ndarray
    master: np.ndarray
    weight: np.ndarray
    crossing: np.ndarray
    nodes: np.ndarray
    adjustment: np.ndarray
    area: np.ndarray
    centroid: np.ndarray
    tolerance: float
    facet: float

    links: ClassVar[None] = None

    @cached_property
    def dependence(self) -> sp.csr_matrix | None:
        """Every node as a weighted sum of nodes that are not slaves (N, N); None if nothing is tied."""
        if not len(self.slave):
            return None
        free = np.setdiff1d(np.arange(len(self.nodes)), self.slave)
        rows = np.concatenate([free, np.repeat(self.slave, self.master.shape[1])])
        columns = np.concatenate([free, self.master.ravel()])
        values = np.concatenate([np.ones(len(free)), self.weight.ravel()])
        return sp.csr_matrix((values, (rows, columns)), shape=(len(self.nodes), len(self.nodes)))

    @cached_property
    def joined(self) -> np.ndarray:
        """Nodes that the ties act on, ascending."""
        return np.union1d(self.slave, self.master)

    def attributes(self) -> dict[str, float]:
        """Return what a history says of the ties."""
        return {
            "tie_tolerance": self.tolerance,
            "tie_nodes": len(self.slave),
            "tie_largest_adjustment": float(self.adjustment.max(initial=0.0)),
        }

    def resultants(self, node_force: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """Return the force (K, 3) of every crossing's tie on the lower row's yarn [N].

        Parameters
        ----------
        node_force : ndarray, shape (N, 3)
            Internal forces of the elements; at a slave they are what the tie supplies.
        displacement : ndarray, shape (N, 3)
            Of the nodes [m].
        """
        total = np.zeros((len(self.area), 3))
        np.subtract.at(total, self.crossing, node_force[self.slave])
        return total

    def equations(self, fixed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return slave nodes (S,), and nodes (S, c) and weights (S, c) of the sums that they are.

        `fixed` is not looked at: there is no choice of slaves.
        """
        return self.slave, self.master, self.weight

    def beside(self, points: np.ndarray) -> np.ndarray:
        """Return which undeformed points (k, 3) [m] lie beside the tied facets (k,), farther from them than their size.

        Nearer ones the tie itself has moved.
        """
        if not len(self.slave):
            return np.ones(len(points), dtype=bool)
        return cKDTree(self.nodes[self.joined]).query(points)[0] > self.facet


def tie_crossings(
    mesh: SweptMesh,
    knit: Fabric,
    tolerance: float,
    tied: np.ndarray | None = None,
    faces: Faces | None = None,
) -> FacetTie:
    """Tie the crossings of a specimen.

    Parameters
    ----------
    mesh : SweptMesh
    knit : Fabric
    tolerance : float
        Gap beyond the clearance within which nodes count as touching, as a share of the facet size.
    tied : ndarray of bool, shape (K,), optional
        Which crossings are tied; all if omitted.
    faces : Faces, optional
        What the facets of the mesh are faces of; linear hexahedra if omitted.

    Raises
    ------
    MeshError
        If a node would be slave and master at once.
    """
    facet = facet_size(mesh)
    reach = tolerance * facet
    row_of_crossing = knit.crossings.row
    chosen = np.ones(len(row_of_crossing), dtype=bool) if tied is None else tied
    faces = faces or linear_faces(mesh)
    count = faces.of_yarn[0].shape[1]
    found = [(np.empty((0, count), dtype=np.int64), np.empty(0, dtype=np.int64))]
    for row in np.unique(row_of_crossing[chosen]):
        here = np.flatnonzero(chosen & (row_of_crossing == row))
        facets, crossing = _tie_row(mesh, knit, row, here, reach)
        found.append((faces.of_yarn[row + 1][facets], crossing))
    facets, crossing = (np.concatenate([row[i] for row in found]) for i in range(2))
    slave, first = np.unique(facets, return_index=True)
    owner = np.repeat(crossing, count)[first]
    master = np.empty((len(slave), count), dtype=np.int64)
    weight = np.empty((len(slave), count))
    row = row_of_crossing[owner]
    for lower in np.unique(row):
        these = row == lower
        guess = _parameter(knit, lower, owner[these])
        facet, place = _facets_under(mesh, knit, lower, faces.nodes[slave[these]], guess)
        master[these], weight[these] = faces.of_yarn[lower][facet], faces.weights(*place)
    if np.isin(master, slave).any():
        raise MeshError(
            "tie.tolerance: a node would be slave of one crossing and master of another; use a smaller value "
            f"than {tolerance} or a finer mesh.size"
        )
    nodes = faces.nodes.copy()
    nodes[slave] = np.einsum("sm,smi->si", weight, faces.nodes[master])
    area, centroid = _areas(nodes, facets[:, :4], crossing, len(knit.crossings.row))
    return FacetTie(
        slave=slave,
        master=master,
        weight=weight,
        crossing=owner,
        nodes=nodes,
        adjustment=np.linalg.norm(nodes[slave] - faces.nodes[slave], axis=1),
        area=area,
        centroid=centroid,
        tolerance=reach,
        facet=facet,
    )


def facet_size(mesh: SweptMesh) -> float:
    """Return the square root of the mean area of the surface facets [m]."""
    quads = np.concatenate([mesh.surface_quads(yarn) for yarn in range(mesh.yarns)])
    return float(np.sqrt(np.mean(_facet_areas(mesh.nodes[quads]))))


def _facet_areas(corners: np.ndarray) -> np.ndarray:
    diagonals = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    return 0.5 * np.linalg.norm(np.cross(*diagonals), axis=1)


def _tie_row(
    mesh: SweptMesh, knit: Fabric, row: int, here: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return tied facets (f,) of the upper yarn of an interlock row at crossings `here`, and the crossing of each."""
    middle = cKDTree(knit.crossings.point[here].mean(axis=1))
    quads = mesh.surface_quads(row + 1)
    apart, owner = middle.query(mesh.nodes[quads].mean(axis=1), distance_upper_bound=mesh.radius)
    candidates = np.flatnonzero(np.isfinite(apart))
    owner = owner[candidates]
    points = _facet_points(mesh, row + 1, candidates)  # (f, p, 3)
    start = np.repeat(_parameter(knit, row, here[owner]), points.shape[1])
    far = distance_to_tube(knit.centrelines[row], points.reshape(-1, 3), start)
    gap = far.reshape(points.shape[:2]) - mesh.radius * (1 + knit.clearance)
    corners = np.ravel_multi_index(([0, 0, -1, -1], [0, -1, 0, -1]), (SAMPLES, SAMPLES), mode="wrap")
    tied = gap[:, corners].max(axis=1) <= reach
    smallest = gap.min(axis=1)
    nearest = np.full(len(here), np.inf)
    np.minimum.at(nearest, owner, smallest)
    # Where the crossing lies on an edge, rounding must not choose between the facets beside it.
    tied |= smallest <= nearest[owner] + ROUNDING * mesh.radius
    return candidates[tied], here[owner[tied]]


def _parameter(knit: Fabric, row: int, crossing: np.ndarray) -> np.ndarray:
    """Return the spline parameters (k,) of crossings on the lower yarn of a row."""
    return knit.centrelines[row].parameter(knit.crossings.arc_length[crossing, 0])


def _facet_points(mesh: SweptMesh, yarn: int, facets: np.ndarray) -> np.ndarray:
    """Return points (f, SAMPLES^2, 3) of facets on the tube of the true radius."""
    layer, j = np.divmod(facets, mesh.section.ring.size)
    first = mesh.first_slice[yarn] + layer
    share = np.linspace(0, 1, SAMPLES)
    along, around = (grid.ravel() for grid in np.meshgrid(share, share, indexing="ij"))
    low, high = ((1 - along) * a[first, j, None] + along * a[first + 1, j, None] for a in mesh.facet_edges)
    theta = low + (high - low) * around  # (f, p)
    centre = _between(mesh.centres, first, along)
    frame = _between(mesh.frames, first, along)  # (f, p, 3, 3)
    radial = np.cos(theta)[..., None] * frame[..., 0, :] + np.sin(theta)[..., None] * frame[..., 1, :]
    radial /= np.linalg.norm(radial, axis=-1, keepdims=True)
    return centre + mesh.radius * radial


def _between(values: np.ndarray, first: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Interpolate slice values (S, ...) linearly from slices `first` (f,) at shares `along` (p,)."""
    weight = along.reshape(1, -1, *([1] * (values.ndim - 1)))
    return (1 - weight) * values[first][:, None] + weight * values[first + 1][:, None]


def _facets_under(
    mesh: SweptMesh, knit: Fabric, yarn: int, points: np.ndarray, guess: np.ndarray
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Return the facet (k,) of a yarn that points (k, 3) lie radially over, and where: shares along and around it."""
    centreline = knit.centrelines[yarn]
    s = centreline.arc_length(project_on_tube(centreline, points, guess))
    first, last = mesh.first_slice[yarn : yarn + 2]
    stations = mesh.arc_length[first:last]
    layer = np.clip(np.searchsorted(stations, s, side="right") - 1, 0, len(stations) - 2)
    along = (s - stations[layer]) / (stations[layer + 1] - stations[layer])
    blend = along[:, None]
    centre = (1 - blend) * mesh.centres[first + layer] + blend * mesh.centres[first + layer + 1]
    frame = (1 - blend[..., None]) * mesh.frames[first + layer] + blend[..., None] * mesh.frames[
        first + layer + 1
    ]
    radial = np.einsum("ki,kdi->kd", points - centre, frame)
    j, around = mesh.facet_at(first + layer, np.arctan2(radial[:, 1], radial[:, 0]), along)
    return layer * mesh.section.ring.size + j, (along, around)


def _areas(
    nodes: np.ndarray, facets: np.ndarray, crossing: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return tied area (K,) and its centroid (K, 3)."""
    corners = nodes[facets]
    area = _facet_areas(corners)
    total = np.full(count, np.nan)
    total[np.unique(crossing)] = 0.0
    np.add.at(total, crossing, area)
    moment = np.stack(
        [np.bincount(crossing, area * corners.mean(axis=1)[:, i], count) for i in range(3)], axis=1
    )
    return total, moment / total[:, None]
