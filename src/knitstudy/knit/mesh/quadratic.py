"""Mesh of quadratic hexahedra: the elements of a swept mesh with nodes in the middles of their edges, on the true tube.

Stations alternate along a yarn. A slice has the corners of the section and the middles of its edges; a middle slice, at
the arc length halfway between two slices, the corners of the section alone. All of them lie on the true centreline and
all surface nodes on the true radius: a curved section has no need to be inflated.

The middles of the surface's faces carry no unknowns. They are weighted sums of the eight nodes around them, as the
element has it, and complete a regular grid of surface nodes at half the spacing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from knitstudy.knit.geometry.spline import Centreline
from knitstudy.knit.mesh.quality import refuse_folded
from knitstudy.knit.mesh.section import SectionMesh, drawn, drawn_angles
from knitstudy.knit.mesh.sweep import SweptMesh, rolled, rotation_minimising, tube
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import determinant
from knitstudy.mechanics.solids.elements.hexahedron import QUADRATIC_GRADIENTS

# Weights (8,) of a face's corners and of the middles of its edges at its centre.
FACE_CENTRE = np.array([-0.25] * 4 + [0.5] * 4)


@dataclass(frozen=True, eq=False)
class QuadraticSection:
    """A section with the middles of its edges, on the unit disc."""

    section: SectionMesh  # corners and quads, the ring on the unit circle
    edges: Ints  # (m, 2) corners of every edge
    middles: Floats  # (m, 2) places of their middles over the radius, on the ring on the circle
    quad_edges: Ints  # (e, 4) edges of every quad, the first one from its first corner to its second
    ring_edges: Ints  # (a,) edges from every surface node to the next one

    @classmethod
    def of(cls, section: SectionMesh) -> QuadraticSection:
        """Return a section, its ring moved to the unit circle, with the middles of its edges."""
        points = section.points.copy()
        ring = section.ring
        points[ring] /= np.linalg.norm(points[ring], axis=1, keepdims=True)
        pairs = np.sort(np.stack([section.quads, np.roll(section.quads, -1, axis=1)], axis=-1), axis=-1)
        edges, number = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
        around = np.sort(np.stack([ring, np.roll(ring, -1)], axis=-1), axis=-1)
        key = edges[:, 0] * section.size + edges[:, 1]
        ring_edges = np.searchsorted(key, around[:, 0] * section.size + around[:, 1])
        middles = points[edges].mean(axis=1)
        middles[ring_edges] /= np.linalg.norm(middles[ring_edges], axis=1, keepdims=True)
        return cls(
            replace(section, points=points), edges, middles, number.reshape(section.quads.shape), ring_edges
        )

    @cached_property
    def place(self) -> Ints:
        """Place (q + m,) of every corner and then every middle in a slice: a middle between its corners."""
        key = np.concatenate([np.arange(self.section.size), self.edges.mean(axis=1)])
        return np.argsort(np.argsort(key, kind="stable"))


@dataclass(frozen=True, eq=False)
class QuadraticMesh:
    """Quadratic hexahedra of all yarns, numbered yarn by yarn, station by station."""

    corners: SweptMesh  # of the corners alone, on the true radius
    nodes: Floats  # (N, 3) coordinates. [m]
    elements: NDArray[np.int32]  # (E, 20) in the order of `knitstudy.mechanics.solids.elements.hexahedron`
    yarn: Ints  # (N,)
    station: Ints  # (N,) numbered through all yarns
    corner_nodes: Ints  # number of every node of ``corners``
    face_centres: Ints  # (F,) nodes in the middles of surface faces, which belong to no element
    faces: Ints  # (F, 8) corners of these faces, and middles of their edges, by `FACE_CENTRE`
    grids: tuple[Ints, ...]  # surface nodes (2 s - 1, 2 a) of every yarn, station by station, by angle
    arc_lengths: tuple[Floats, ...]  # (2 s - 1,) of the stations of every yarn. [m]

    @cached_property
    def angles(self) -> tuple[Floats, ...]:
        """Angles (2 s - 1, 2 a) of the nodes of every grid, from d1 towards d2, rad."""
        ring = self.corners.section.angles
        around = np.stack([ring, ring + np.pi / ring.size], axis=-1).ravel()
        pulls = self.corners.by_yarn(self.corners.pull)
        return tuple(drawn_angles(around, _with_middles(pull)) for pull in pulls)

    @cached_property
    def bandwidth(self) -> int:
        """Largest difference of numbers in one element, once the face centres are eliminated."""
        kept = np.ones(len(self.nodes), dtype=np.int64)
        kept[self.face_centres] = 0
        return int(np.ptp(np.cumsum(kept)[self.elements], axis=1).max())


def quadratic_mesh(mesh: SweptMesh, curves: Sequence[Centreline]) -> QuadraticMesh:
    """Return the mesh of quadratic hexahedra with the elements of a swept mesh, from the curves that were swept.

    Raises MeshError if an element is folded at one of its Gauss points.
    """
    section = QuadraticSection.of(mesh.section)
    disc = np.vstack([section.section.points, section.middles])
    q, a = section.section.size, section.ring_edges.size
    whole = len(disc)
    ring = section.section.ring
    ring_edges = q + section.ring_edges
    slices = np.arange(mesh.slices)
    lower = mesh.lower_slices
    # Stations: a middle slice stands behind every slice but the last of a yarn.
    of_slice = 2 * slices - mesh.yarn_of_slice
    # Numbers (stations, q + m): a slice has all nodes, a middle slice corners, and face centres on the rim.
    start = slices * (whole + q + a) - mesh.yarn_of_slice * (q + a)
    number = np.full((of_slice[-1] + 1, whole), -1)
    number[of_slice] = start[:, None] + section.place
    number[of_slice[lower, None] + 1, np.append(np.arange(q), ring_edges)] = (
        start[lower, None] + whole + np.arange(q + a)
    )
    below, middle, above = (number[of_slice[lower] + step] for step in range(3))

    nodes = np.empty((start[-1] + whole, 3))
    nodes[number[of_slice]] = tube(mesh.centres, mesh.frames, mesh.radius * drawn(disc, mesh.pull))
    arc_lengths = tuple(_with_middles(s) for s in mesh.stations)
    centres, frames = _middle_slices(mesh, curves, arc_lengths)
    pull = 0.5 * (mesh.pull[lower] + mesh.pull[lower + 1])
    nodes[middle[:, :q]] = tube(centres, frames, mesh.radius * drawn(disc[:q], pull))
    ahead = np.roll(ring, -1)
    around = [below[:, ring], below[:, ahead], above[:, ahead], above[:, ring]]
    around += [below[:, ring_edges], middle[:, ahead], above[:, ring_edges], middle[:, ring]]
    faces = np.stack(around, axis=-1)  # (L, a, 8)
    nodes[middle[:, ring_edges]] = np.einsum("f,lafi->lai", FACE_CENTRE, nodes[faces])

    station = np.empty(len(nodes), dtype=np.int64)
    station[number[number >= 0]] = np.nonzero(number >= 0)[0]
    grid = number[:, np.stack([ring, ring_edges], axis=-1).ravel()]
    quads = section.section.quads
    edges = q + section.quad_edges
    parts = [below[:, quads], above[:, quads], below[:, edges], above[:, edges], middle[:, quads]]
    elements = np.concatenate(parts, axis=-1).reshape(-1, 20).astype(np.int32)
    corner_nodes = number[of_slice, :q].ravel()
    corners = replace(mesh, section=section.section, nodes=nodes[corner_nodes])
    places = np.swapaxes(nodes[elements], 1, 2)
    smallest = np.min([determinant(places @ gradient) for gradient in QUADRATIC_GRADIENTS], axis=0)
    refuse_folded(corners, smallest, "quadratic hexahedron", "its Jacobian at a Gauss point")
    return QuadraticMesh(
        corners=corners,
        nodes=nodes,
        elements=elements,
        yarn=np.repeat(np.arange(mesh.yarns), np.diff(np.append(start[mesh.first_slice[:-1]], len(nodes)))),
        station=station,
        corner_nodes=corner_nodes,
        face_centres=middle[:, ring_edges].ravel(),
        faces=faces.reshape(-1, 8),
        grids=tuple(np.split(grid, of_slice[mesh.first_slice[1:-1]])),
        arc_lengths=arc_lengths,
    )


def _with_middles(s: Floats) -> Floats:
    """Values (s, ...) at the slices of a yarn, such as arc lengths, with the means between them (2 s - 1, ...)."""
    return np.insert(s, np.arange(1, len(s)), 0.5 * (s[1:] + s[:-1]), axis=0)


def _middle_slices(
    mesh: SweptMesh, curves: Sequence[Centreline], arc_lengths: Sequence[Floats]
) -> tuple[Floats, Floats]:
    """Centres (L, 3) and frames (L, 3, 3) halfway between all slices of every yarn."""
    centres, frames = [], []
    for curve, s, d1 in zip(curves, arc_lengths, mesh.by_yarn(mesh.frames[:, 0]), strict=True):
        place = curve.position(s)
        free = rotation_minimising(place, curve.tangent(s))
        # The roll of the slices against frames without spin, and its mean between them.
        x, y = (np.einsum("si,si->s", free[::2, axis], d1) for axis in (0, 1))
        roll = np.unwrap(np.arctan2(y, x))
        centres.append(place[1::2])
        frames.append(rolled(free[1::2], 0.5 * (roll[1:] + roll[:-1])))
    return np.concatenate(centres), np.concatenate(frames)
