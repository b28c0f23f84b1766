"""Round yarns as curved cells: hexahedra of 27 nodes, the surface ones on the true circle.

A section is an O-grid with the middles of its edges and faces, repeated at the ends and in the middle of every span.
With 12 angles a quadratic arc of 30 degrees leaves the circle by 2e-4 of the radius at most: what is drawn is smooth,
and not a mesh that anything was computed on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mesh.quadratic import FACE_CENTRE, QuadraticSection
from knitstudy.mesh.section import Section

CORE, RINGS = 3, 1
"""Of the section; see `knitstudy.mesh.section.Section.butterfly`."""

CELL = "hexahedron27"
"""What meshio calls it; VTK_TRIQUADRATIC_HEXAHEDRON."""

NODES = 27


@dataclass(frozen=True, eq=False)
class CurvedCells:
    """Cells of yarns, and the material points that their nodes are; numbered yarn by yarn, section by section.

    Attributes
    ----------
    x : ndarray, shape (q, 2)
        Points of every section, over the radius.
    cells : ndarray of int32, shape (C, 27)
        In the order of VTK.
    first : ndarray of int, shape (Y + 1,)
        First section of every yarn, then their number.
    stations : ndarray, shape (T,)
        Arc lengths of the sections [m].
    rim : ndarray of int, shape (2 a,)
        Points of a section that lie on its circle, counter-clockwise from angle[0].
    angle : ndarray, shape (2 a,)
        Their angles, increasing [rad].
    """

    x: np.ndarray
    cells: np.ndarray
    first: np.ndarray
    stations: np.ndarray
    rim: np.ndarray
    angle: np.ndarray

    @property
    def yarn(self) -> np.ndarray:
        """Yarn (P,) of every point."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first) * len(self.x))

    @property
    def arc_length(self) -> np.ndarray:
        """Arc length (P,) of every point's section [m]."""
        return np.repeat(self.stations, len(self.x))

    @property
    def cell_yarn(self) -> np.ndarray:
        """Yarn (C,) of every cell."""
        return self.yarn[self.cells[:, 0]]

    def of_yarn(self, yarn: int) -> slice:
        """Return the sections of a yarn."""
        return slice(*self.first[yarn : yarn + 2].tolist())

    def surface(self, yarn: int) -> np.ndarray:
        """Return the points (t, 2 a) on the surface of a yarn, section by section."""
        return np.arange(len(self.stations))[self.of_yarn(yarn), None] * len(self.x) + self.rim


def curved_cells(breaks: list[np.ndarray]) -> CurvedCells:
    """Return the cells of yarns of whose spans the ends are breaks (b,) [m], one array a yarn."""
    shape = QuadraticSection.of(Section.butterfly(CORE, RINGS))
    x, quads = _nine_nodes(shape)
    stations = [np.insert(b, np.arange(1, b.size), 0.5 * (b[1:] + b[:-1])) for b in breaks]
    first = np.concatenate([[0], np.cumsum([s.size for s in stations])])
    lower = np.concatenate(
        [low + 2 * np.arange(b.size - 1) for low, b in zip(first[:-1], breaks, strict=True)]
    )
    bottom, middle, top = ((lower + up)[:, None, None] * len(x) + quads for up in range(3))  # (spans, e, 9)
    # Corners below and above; middles of edges below, above and between; faces x, x, y, y, below, above; the centre.
    sides = middle[..., [7, 5, 4, 6]]
    parts = [bottom[..., :4], top[..., :4], bottom[..., 4:8], top[..., 4:8], middle[..., :4], sides]
    cells = np.concatenate([*parts, bottom[..., 8:], top[..., 8:], middle[..., 8:]], axis=-1)
    rim = np.stack([shape.section.ring, shape.section.size + shape.ring_edges], axis=-1).ravel()
    return CurvedCells(
        x=x,
        cells=cells.reshape(-1, NODES).astype(np.int32),
        first=first,
        stations=np.concatenate(stations),
        rim=rim,
        angle=np.unwrap(np.arctan2(*x[rim].T[::-1])),
    )


def _nine_nodes(shape: QuadraticSection) -> tuple[np.ndarray, np.ndarray]:
    """Points (q + m + e, 2) of a section, and its quads (e, 9): corners, middles of edges, centre."""
    section = shape.section
    q, m = section.size, len(shape.middles)
    eight = np.concatenate([section.quads, q + shape.quad_edges], axis=1)
    points = np.vstack([section.points, shape.middles])
    centres = np.einsum("n,eni->ei", FACE_CENTRE, points[eight])
    number = q + m + np.arange(len(eight))
    return np.vstack([points, centres]), np.concatenate([eight, number[:, None]], axis=1)
