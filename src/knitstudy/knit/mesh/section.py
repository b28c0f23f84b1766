"""Cross-section of a yarn: an O-grid of quadrilaterals on the unit disc.

A square core, rounded so that no element is badly shaped, is surrounded by rings that carry its boundary out
to the circle (the "butterfly" of block-structured meshing).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from knitstudy.errors import MeshError
from knitstudy.mechanics.arrays import Floats, Ints

FEWEST_CORE = 3  # elements along a side of the core: 12 angles keep 91% of a circle's bending stiffness
ROUNDING = (
    0.28  # how far the core's sides bulge: 0 a square, 1/2 the elliptic map of the square onto the disc
)


@dataclass(frozen=True, eq=False)
class Section:
    """A cross-section mesh on the unit disc, to be swept along a yarn.

    The polygon of surface nodes has the area of the unit circle, so its nodes lie slightly outside of it: a
    swept yarn keeps its cross-sectional area, and nearly its bending stiffness.
    """

    points: Floats  # (q, 2) node positions over the radius of the yarn
    quads: Ints  # (e, 4) corner nodes, counter-clockwise
    ring: Ints  # (a,) surface nodes, counter-clockwise

    @classmethod
    def butterfly(cls, core: int, rings: int) -> Section:
        """Section with a core of ``core`` by ``core`` elements and ``rings`` rings of ``4 core`` elements.

        Raises MeshError if the core has fewer than three elements a side (12 angles), or there is no ring.
        """
        if core < FEWEST_CORE:
            raise MeshError(
                f"section core: {core} elements a side give {4 * core} angles; at least {FEWEST_CORE} a side "
                f"({4 * FEWEST_CORE} angles) are allowed"
            )
        if rings < 1:
            raise MeshError(f"section rings: {rings} is not allowed; at least 1")
        # From a search over cores of 3 to 8 and one or two rings: corner sines above 0.8, areas within 1.6.
        scale = 0.27 + 0.6 * core / (core + 2 * rings)
        core_points, core_quads, boundary = _core(core, scale)
        layers = _layers(core_points[boundary], rings)
        angles = 4 * core
        nodes = np.vstack([boundary, core_points.shape[0] + np.arange(rings * angles).reshape(rings, angles)])
        inner, outer = nodes[:-1], nodes[1:]
        ring_quads = np.stack([inner, outer, np.roll(outer, -1, axis=1), np.roll(inner, -1, axis=1)], axis=-1)
        points = np.vstack([core_points, layers.reshape(-1, 2)])
        quads = np.vstack([core_quads, ring_quads.reshape(-1, 4)])
        return cls(*_narrow(points, quads, nodes[-1]))

    @classmethod
    def for_size(cls, diameter: float, size: float) -> Section:
        """Section whose elements are about ``size`` wide on a yarn of ``diameter`` (both m).

        ``round(diameter / size)`` elements lie across, a third of them in rings. However coarse the size, the
        section has at least 12 angles, that is, five elements across.
        Raises MeshError if the diameter or the size is not positive.
        """
        return cls.butterfly(*_divisions(diameter, size))

    @property
    def size(self) -> int:
        """Number of nodes of the section."""
        return self.points.shape[0]

    @cached_property
    def angles(self) -> Floats:
        """Polar angles of the surface nodes in rad, increasing, as ``ring`` (a,)."""
        x, y = self.points[self.ring].T
        return np.unwrap(np.arctan2(y, x))

    @cached_property
    def bandwidth(self) -> int:
        """Largest difference of node numbers in one element; a swept yarn's is ``size`` more."""
        return int(np.ptp(self.quads, axis=1).max())


def nodes_for_size(diameter: float, size: float) -> int:
    """Return how many nodes `Section.for_size` has, without making it.

    Examples
    --------
    >>> nodes_for_size(diameter=1.8e-3, size=0.3e-3)
    41
    """
    core, rings = _divisions(diameter, size)
    return (core + 1) ** 2 + rings * 4 * core


def _divisions(diameter: float, size: float) -> tuple[int, int]:
    """Return the elements along a side of the core and the rings of elements about ``size`` wide."""
    for name, value in (("diameter", diameter), ("size", size)):
        if not value > 0:
            raise MeshError(f"section {name}: {value} m is not allowed; it must be positive")
    # Rounded first: the same section in whatever unit of length, halves included.
    across = round(round(diameter / size, 6))
    rings = max(1, round(across / 6))
    return max(FEWEST_CORE, across - 2 * rings), rings


def _core(core: int, scale: float) -> tuple[Floats, Floats, Floats]:
    """Rounded square grid: points ((core + 1)^2, 2), quads (core^2, 4), boundary nodes (4 core,)."""
    # Halfway between equal steps and equal angles as seen from the centre; rounding closes the rest.
    t = np.linspace(-1.0, 1.0, core + 1)
    t = 0.5 * (t + np.tan(0.25 * np.pi * t))
    y, x = np.meshgrid(t, t, indexing="ij")
    points = scale * np.stack([x * np.sqrt(1 - ROUNDING * y**2), y * np.sqrt(1 - ROUNDING * x**2)], axis=-1)
    grid = np.arange((core + 1) ** 2).reshape(core + 1, core + 1)
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1)
    boundary = np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0]])
    return points.reshape(-1, 2), quads.reshape(-1, 4), boundary


def _layers(boundary: Floats, rings: int) -> Floats:
    """Ring nodes (rings, a, 2) on straight lines from the core's boundary (a, 2) to the inflated circle."""
    count = boundary.shape[0]
    # The core's first corner lies at -135 degrees.
    angle = 2 * np.pi * np.arange(count) / count - 0.75 * np.pi
    # A regular polygon of `count` corners on this radius has the area of the unit circle.
    radius = np.sqrt(2 * np.pi / (count * np.sin(2 * np.pi / count)))
    circle = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    share = (np.arange(1, rings + 1) / rings)[:, None, None]
    return (1 - share) * boundary + share * circle


def _narrow(points: Floats, quads: Ints, ring: Ints) -> tuple[Floats, ...]:
    """Renumber the nodes for a small bandwidth: the best of reverse Cuthill-McKee and straight sweeps."""
    size = points.shape[0]
    pairs = (np.repeat(quads, 4, axis=1).ravel(), np.tile(quads, (1, 4)).ravel())
    graph = csr_array((np.ones(pairs[0].size), pairs), shape=(size, size))
    directions = np.pi * np.arange(32) / 32 + 1e-3  # off the axes of symmetry, where nodes tie
    sweeps = [np.argsort(points @ [np.cos(a), np.sin(a)], kind="stable") for a in directions]
    orders = [reverse_cuthill_mckee(graph.tocsr(), symmetric_mode=True), *sweeps]
    order = min(orders, key=lambda order: np.ptp(np.argsort(order)[quads], axis=1).max())
    number = np.argsort(order)
    return points[order], number[quads], number[ring]
