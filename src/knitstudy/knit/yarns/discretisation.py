"""Discretisations of solid yarns: nodes, elements and surfaces, and which weighted sum of nodes every place is.

Ties, contact, observers and solvers know nothing else of `hexahedra` and `spline_yarns`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from knitstudy.errors import ConfigurationError
from knitstudy.knit.contacts.facets import Rings
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.spline import Centreline, evenly
from knitstudy.knit.mesh.mesher import Grips
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.mechanics.contact.cylinders import Cylinders
from knitstudy.mechanics.contact.friction import Coulomb
from knitstudy.mechanics.contact.grids import Grid, circular_chords
from knitstudy.mechanics.contact.indentation import Indentation
from knitstudy.mechanics.contact.solid import Penetration
from knitstudy.mechanics.contact.surface import Surfaces
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.solids.elements import ElementGroup
from knitstudy.mechanics.solids.spline_yarn.space import Sampling, Space, YarnSpace


def project_on_tube(
    centreline: Centreline,
    points: Floats,  # (k, 3) within a radius of curvature of the centreline [m]
    guess: Floats,  # (k,) spline parameters near the nearest points
) -> Floats:
    """Return the spline parameters (k,) of the nearest points of a centreline.

    Newton's method on (x - r(u)) . r'(u) = 0; where the curve bends away so strongly that its slope loses its
    sign, the step of a straight line is taken.
    """
    curve = centreline.curve
    u = np.array(guess, dtype=float)
    for _ in range(30):
        gap = points - curve.value(u)
        along = curve.d1(u)
        square = np.einsum("ki,ki->k", along, along)
        slope = square - np.einsum("ki,ki->k", gap, curve.d2(u))
        move = np.einsum("ki,ki->k", gap, along) / np.maximum(slope, 0.1 * square)
        u = u + move
        if np.max(np.abs(move), initial=0.0) < 1e-12 * curve.period:
            break
    return u


def yarn_surfaces(mesh: SweptMesh) -> list[Grid]:
    """Return the surface of every yarn; its polygon is inflated, the contact surface has the true radius."""
    inflated = mesh.radius * float(np.linalg.norm(mesh.section.points[mesh.section.ring], axis=1).mean())
    chords = circular_chords(mesh.angles)
    return [
        Grid(
            mesh.surface_nodes(yarn),
            offset=inflated - mesh.radius,
            chords=chords[slice(*mesh.first_slice[yarn : yarn + 2])],
        )
        for yarn in range(mesh.yarns)
    ]


@dataclass(frozen=True, eq=False)
class ContactOfSolids:
    """Law and limits of the contact of yarns that are divided in one way."""

    law: Coulomb | Indentation
    points: int  # Gauss points along each side of a cell
    overlap: float  # largest penetration of undeformed yarns [m]
    penetration: Penetration


@dataclass(frozen=True, eq=False)
class Discretisation:
    """Yarns of a specimen, divided.

    Undeformed places and displacements are the same weighted sums of nodes, so that yarns can move rigidly: nodes x go
    to Q x + unity t. Nodes are numbered yarn by yarn, station by station along the yarn.
    """

    mesh: SweptMesh  # cross-sections at which motion is observed and drawn; its nodes are places
    nodes: Floats  # (N, 3) undeformed: places, or coefficients of them [m]
    unity: Floats  # (N,) coefficients of the constant 1
    yarn: Ints  # (N,) of a node, ascending
    station: Ints  # (N,) place of a node along all yarns, ascending
    # Largest difference of the numbers of two nodes of an element, counted without nodes that depend on others
    bandwidth: int
    # Elements, from nodes (N, 3); raises MeshError where one is folded
    groups: Callable[[Floats], tuple[ElementGroup, ...]]
    volume: Callable[[tuple[ElementGroup, ...]], Floats]  # of every node (N,) [m3], from the groups
    surfaces: Surfaces  # one of every yarn, for contact
    ends: Grips  # nodes that are held and driven
    # Nodes (k, a) and weights (k, a) whose sum a material point is, from places (k, 3) [m] in or near yarns (k,)
    locate: Callable[[Floats, Ints], tuple[Ints, Floats]]
    rings: Rings  # where the edges of the surfaces' cells across lie along the yarns
    size: float  # length h of an element [m]
    # (M, N) nodes of `mesh` as weighted sums of nodes; None where they are the nodes
    sampling: sp.csr_matrix | Sampling | None = None
    # (N, N) nodes as weighted sums of nodes that depend on no others; the identity if None
    dependence: sp.csr_matrix | None = None
    # (E, a) nodes of hexahedra, in the order of `mesh`, where the elements are hexahedra
    connectivity: NDArray[np.integer[Any]] | None = None
    contact: ContactOfSolids | None = None  # None where all crossings are tied
    # Compliance (k, 2) [m/N] of the mean and of the linear moments of a patch that the nodes cannot show, one
    # yarn's alone: from yarns (k,), arc lengths (k,) [m] and the patch's radius [m]. None where refinement
    # shows it all
    missing_compliance: Callable[[Ints, Floats, float], Floats] | None = None
    space: Space | None = None  # of polynomials and splines

    @property
    def splines(self) -> Space:
        """Space of polynomials and splines, of yarns that have one."""
        assert self.space is not None
        return self.space

    def sampled(self, values: Floats) -> Floats:
        """Return values at the nodes of `mesh` (M, ...) from values of the nodes (N, ...)."""
        return values if self.sampling is None else self.sampling @ values

    def nodes_of(self, yarn: int) -> Ints:
        """Return the nodes of a yarn, ascending."""
        return np.flatnonzero(self.yarn == yarn)


COARSE = 3.0  # length of cells away from crossings, over that near them


def contact_surfaces(
    space: Space,
    specimen: Fabric,
    cell: float,  # length of cells near crossings, over the yarn's radius
    window: float,  # distance from a crossing up to which they have it, over the yarn's radius; 0 if nothing touches
) -> tuple[Cylinders, Rings]:
    """Return the surfaces of yarns for contact, and where their rings lie; coarse where nothing touches.

    Raises ConfigurationError if crossings of a yarn are nearer to each other than the law of contact allows.
    """
    radius, crossings = specimen.radius, specimen.crossings
    cell, window = cell * radius, window * radius
    along = []
    for number, yarn in enumerate(space.yarns):
        stations = np.sort(crossings.arc_length[crossings.yarn == number])
        # The areas of contact of crossings must be alone.
        nearest = np.diff(stations).min(initial=np.inf)
        if nearest < window:
            raise ConfigurationError(
                f"two crossings of a yarn are {nearest / radius:.2f} yarn radii apart, less than contact.window, "
                f"{window / radius:.2f}: their indentations would count twice; use a smaller contact.window"
            )
        along.append(_edges(yarn, stations, window, cell))
    surfaces = Cylinders(space, radius, along, int(np.ceil(2 * np.pi * radius / cell)))
    parameters = tuple(surfaces.edges(number)[0] for number in range(len(along)))
    return surfaces, Rings(parameters, tuple(along))


def _edges(yarn: YarnSpace, stations: Floats, window: float, cell: float) -> Floats:
    """Return the arc lengths (m + 1,) of edges of cells on a yarn and the images that continue it [m]."""
    length = yarn.spline.spans[yarn.own][-1, 1]
    periods = length * np.arange(-1, 2)[:, None]
    if yarn.beyond:
        stations = (stations + periods).ravel()
        stations = stations[(stations > -window) & (stations < length + window)]
    bounds = np.stack([stations - window, stations + window], axis=1).clip(0.0, length)
    # Windows that meet are one.
    first = np.ones(len(bounds), dtype=bool)
    first[1:] = bounds[1:, 0] > np.maximum.accumulate(bounds[:-1, 1]) + cell
    low = bounds[first, 0]
    high = np.maximum.reduceat(bounds[:, 1], np.flatnonzero(first)) if len(bounds) else low
    stops = np.unique(np.concatenate([[0.0, length], low, high]))
    middle = 0.5 * (stops[1:] + stops[:-1])
    fine = np.any((middle[:, None] > low) & (middle[:, None] < high), axis=1)
    parts = np.ceil(np.diff(stops) / np.where(fine, cell, COARSE * cell) - 1e-9).astype(int)
    edges = evenly(stops, parts)
    every = np.append((edges[:-1] + periods).ravel(), 2 * length)
    low, high = yarn.spline.spans[[0, -1], [0, 1]]
    return every[(every >= low) & (every <= high)]


PLACES = 8  # places a span at which the shape of a yarn is fitted


def fitted_places(own: YarnSpace) -> Floats:
    """Return the arc lengths (k,) at which the shape of a yarn is fitted, its end included [m]."""
    low, high = own.spline.spans[own.own].T
    return evenly(np.append(low, high[-1]), np.full(len(low), PLACES))
