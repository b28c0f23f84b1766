"""Unknowns of square knits and which of them are coupled, for the memory of a direct solver (Tables 3 and 5).

The paper's solver estimates before a run the least memory that it needs, about its largest front (Table 5), and the
memory with which it writes nothing to a disk, about all of the factor (Table 3). Both follow from the graph of the
unknowns (`measures.factor`).

A vertex of hexahedra is a cross-section of nodes, which elimination couples with each other in any case. Nodes that are
coupled with another yarn are a vertex of their own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from knitstudy.knit.geometry.crossings import tied_crossings
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.mesh.mesher import crossing_spacing
from knitstudy.knit.mesh.section import GROWTH, SectionMesh
from knitstudy.knit.mesh.sweep import SweptMesh, Targets, sweep
from knitstudy.knit.yarns.network import Network
from knitstudy.measures.factor import UnknownGraph
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints

BEAM_UNKNOWNS = 6  # of a node of beams
SOLID_UNKNOWNS = 3  # of a node of hexahedra; as many multipliers has a node in contact
TIED = 1.0  # distance of nodes from the middle of a crossing up to which a tie couples them, in elements
NEAR = 2.0  # distance of surface nodes of two yarns up to which contact couples them, in elements
# Copies of a yarn: they are crossed at the same places, and so many points besides are the same, in yarn radii
SAMPLES, SAME = 20, 1e-6


def graph_of_network(network: Network) -> UnknownGraph:
    """Return the graph of a network of beams; nodes that are tied are one vertex."""
    nodes = len(network.nodes)
    pairs = np.concatenate([network.ends, network.springs.ends])
    return UnknownGraph(network.nodes, np.full(nodes, BEAM_UNKNOWNS), pairs[pairs[:, 0] != pairs[:, 1]])


def graphs_of_solids(fabric: Fabric, sections: Sections, size: float, contact: bool) -> list[UnknownGraph]:
    """Return graphs of hexahedra of a size in yarn radii in a knit in course tension.

    Yarns are tied at all crossings, which is one graph, or in contact and tied in the outer rows alone, which are two:
    by penalties, and with `SOLID_UNKNOWNS` multipliers at every surface node of the lower yarn of each pair in contact.
    """
    element = size * fabric.radius
    crossings = fabric.crossings
    tied = tied_crossings(crossings, contact, "outer", "course")
    middles = crossings.point.mean(axis=1)
    coupled = [sections.around(crossings.yarn[k], middles[k], TIED * element) for k in np.flatnonzero(tied)]
    if not contact:
        return [sections.graph(np.concatenate(coupled))]
    touching = np.unique(crossings.yarn[~tied], axis=0)
    coupled += [sections.between(lower, upper, NEAR * element) for lower, upper in touching.tolist()]
    return [sections.graph(np.concatenate(coupled), multiplied) for multiplied in ((), touching[:, 0])]


@dataclass(frozen=True, eq=False)
class Sections:
    """Cross-sections of all yarns, one yarn after the other; surface nodes are numbered section by section."""

    centres: Floats  # (S, 3) [m]
    surface: Floats  # (S, a, 3) nodes on the surface [m]
    yarn: Ints  # (S,)
    nodes: int  # of a section

    @classmethod
    def of(cls, fabric: Fabric, size: float) -> Sections:
        """Return the sections of a mesh of elements of a size in yarn radii; copies of a yarn are meshed once."""
        meshes = list(_yarns(fabric, size))
        centres = [mesh.centres + shift for mesh, shift in meshes]
        surface = [mesh.nodes[mesh.surface_nodes(0)] + shift for mesh, shift in meshes]
        yarn = np.repeat(np.arange(len(meshes)), [len(each) for each in centres])
        return cls(np.concatenate(centres), np.concatenate(surface), yarn, meshes[0][0].section.size)

    @cached_property
    def _trees(self) -> list[cKDTree]:
        """Search trees of the surface nodes of every yarn."""
        return [cKDTree(self.surface[self.yarn == yarn].reshape(-1, 3)) for yarn in range(self.yarn[-1] + 1)]

    @cached_property
    def _first(self) -> Ints:
        """Number of the first surface node of every yarn."""
        return self.surface.shape[1] * np.searchsorted(self.yarn, np.arange(self.yarn[-1] + 1))

    def around(self, yarns: Ints, middle: Floats, reach: float) -> Ints:
        """Return all pairs (p, 2) of the surface nodes of some yarns around a place (3,) [m]."""
        near = [self._trees[yarn].query_ball_point(middle, reach, return_sorted=True) for yarn in yarns]
        nodes = np.concatenate([self._first[yarn] + each for yarn, each in zip(yarns, near, strict=True)])
        return nodes[np.column_stack(np.triu_indices(len(nodes), 1))].astype(np.int64)

    def between(self, yarn: int, other: int, reach: float) -> Ints:
        """Return the pairs (p, 2) of surface nodes of two yarns that are near each other [m]."""
        near = self._trees[yarn].sparse_distance_matrix(self._trees[other], reach, output_type="ndarray")
        return np.column_stack([self._first[yarn] + near["i"], self._first[other] + near["j"]])

    def graph(self, coupled: Ints, multiplied: ArrayLike = ()) -> UnknownGraph:
        """Return the graph with pairs (p, 2) of coupled surface nodes, and multipliers on the surface of yarns (k,)."""
        around = self.surface.shape[1]
        joined = np.zeros(self.surface.shape[:2], dtype=bool)
        joined.ravel()[coupled] = True
        apart: Bools = np.any(joined, axis=1)
        # Every section has a vertex, and one more of its nodes that are coupled with another yarn
        number = np.cumsum(1 + apart) - 1 - apart  # of the first
        vertex = number[:, None] + joined  # of every surface node
        of_joined = joined.sum(axis=1)
        more = SOLID_UNKNOWNS * np.isin(self.yarn, multiplied)
        unknowns = np.empty(len(apart) + apart.sum(), dtype=np.int64)
        unknowns[number] = SOLID_UNKNOWNS * (self.nodes - of_joined) + more * (around - of_joined)
        unknowns[number[apart] + 1] = ((SOLID_UNKNOWNS + more) * of_joined)[apart]
        pairs = [
            vertex.ravel()[coupled],
            np.column_stack([number, number + 1])[apart],
            *self._along(number, apart),
        ]
        found = np.unique(np.sort(np.concatenate(pairs), axis=1) @ [len(unknowns), 1])
        both = np.column_stack(np.divmod(found, len(unknowns)))
        places = np.repeat(self.centres, 1 + apart, axis=0)
        return UnknownGraph(places, unknowns, both[both[:, 0] != both[:, 1]])

    def _along(self, number: Ints, apart: Bools) -> Iterator[Ints]:
        """Yield the pairs of vertices of neighbouring sections of a yarn."""
        lower = np.flatnonzero(self.yarn[1:] == self.yarn[:-1])
        for here in (0, 1):
            for there in (0, 1):
                both = lower[(apart[lower] >= here) & (apart[lower + 1] >= there)]
                yield np.column_stack([number[both] + here, number[both + 1] + there])


def _yarns(fabric: Fabric, size: float) -> Iterator[tuple[SweptMesh, Floats]]:
    """Yield the mesh of every yarn, or of an earlier one of the same shape, and the vector to the yarn (3,) [m]."""
    element = size * fabric.radius
    section = SectionMesh.for_size(2 * fabric.radius, element)
    known: dict[tuple[int, ...], tuple[SweptMesh, Floats]] = {}
    for yarn, line in enumerate(fabric.centrelines):
        where, point = fabric.places(yarn)
        along = line.position(np.append(np.linspace(0.0, line.length, SAMPLES), where))
        start = along[0]
        shape = np.concatenate([[line.length], where, (along - start).ravel()])
        key = tuple(np.rint(shape / (SAME * fabric.radius)).astype(int).tolist())
        if key not in known:
            spacing = crossing_spacing(fabric, yarn, element, GROWTH)
            targets = [Targets(where, point)]
            known[key] = sweep([line], section, fabric.radius, spacing, fabric.repeats, targets), start
        mesh, first = known[key]
        yield mesh, start - first
