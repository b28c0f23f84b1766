"""The crossings of a specimen on the surfaces of its mesh: facets that face each other, and what touches near them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.geometry.pattern import Crossings
from knitstudy.mesh.sweep import SweptMesh

REACH = 2.0
"""Distance along the yarn from a crossing, in radii, up to which contact is counted to it."""


@dataclass(frozen=True, eq=False)
class CrossingFacets:
    """Facets at the closest points of all crossings.

    Attributes
    ----------
    crossings : Crossings
    mesh : SweptMesh
    nodes : ndarray of int, shape (K, 2, 4)
        Corners of the facet on each of the two yarns.
    """

    crossings: Crossings
    mesh: SweptMesh
    nodes: np.ndarray

    @classmethod
    def of(cls, crossings: Crossings, mesh: SweptMesh) -> CrossingFacets:
        """Find the facets: the layer that the closest point lies in, and what faces the other yarn there."""
        nodes = np.empty((len(crossings.row), 2, 4), dtype=np.int64)
        across = crossings.point[:, ::-1] - crossings.point
        for side in range(2):
            for yarn in np.unique(crossings.yarn[:, side]):
                here = np.flatnonzero(crossings.yarn[:, side] == yarn)
                first, last = mesh.first_slice[yarn : yarn + 2]
                stations = mesh.arc_length[first:last]
                layer = np.searchsorted(stations, crossings.arc_length[here, side], side="right") - 1
                layer = np.clip(layer, 0, len(stations) - 2)
                directors = mesh.frames[first + layer] + mesh.frames[first + layer + 1]
                x, y = np.einsum("kdi,ki->dk", directors[:, :2], across[here, side])
                facet, _ = mesh.facet_at(first + layer, np.arctan2(y, x))
                nodes[here, side] = mesh.surface_quads(yarn)[layer * mesh.section.ring.size + facet]
        return cls(crossings, mesh, nodes)

    def displacement(self, displacement: np.ndarray) -> np.ndarray:
        """Return the mean displacement (K, 2, 3) of the facets [m] from that of all nodes (N, 3)."""
        return displacement[self.nodes].mean(axis=2)

    def nearest(
        self, yarn: np.ndarray, other: np.ndarray, arc_length: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return crossing and side (k,) of places where two yarns touch; crossing -1 away from all of them.

        Parameters
        ----------
        yarn, other : ndarray of int, shape (k,)
            Yarn that the place lies on, and the one it touches.
        arc_length : ndarray, shape (k,)
            Where: on the first one [m].
        """
        side = np.where(yarn < other, 0, 1)
        crossings = self.crossings
        crossing = np.full(len(yarn), -1)
        for mine, theirs in np.unique(np.stack([yarn, other], axis=1), axis=0):
            here = np.flatnonzero((yarn == mine) & (other == theirs))
            end = 0 if mine < theirs else 1
            candidates = np.flatnonzero(
                (crossings.yarn[:, end] == mine) & (crossings.yarn[:, 1 - end] == theirs)
            )
            if not len(candidates):
                continue
            apart = np.abs(arc_length[here, None] - crossings.arc_length[candidates, end])
            nearest = np.argmin(apart, axis=1)
            close = apart[np.arange(len(here)), nearest] <= REACH * self.mesh.radius
            crossing[here[close]] = candidates[nearest[close]]
        return crossing, side
