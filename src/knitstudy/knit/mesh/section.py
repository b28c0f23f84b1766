"""Cross-section of a yarn, how it is drawn towards crossings, and where along the yarn sections stand.

A section is an O-grid of quadrilaterals on the unit disc: a square core, rounded so that no element is badly shaped, is
surrounded by rings that carry its boundary out to the circle (the "butterfly" of block-structured meshing).

Near crossings its nodes are drawn towards the other yarn. The section keeps its topology along the yarn, so a layer
that is finer on one side has to be coarser on the other. A Moebius map of the disc onto itself,

    f(z) = (z + a) / (1 + conj(a) z) ,   |a| = (m - 1) / (m + 1) ,

does that without shearing anything: it is conformal, so elements keep their angles, and takes the circle to the circle.
Elements are m times as small at a / |a|, angles and rings alike, and m times as large on the other side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from knitstudy.errors import MeshError
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints

FEWEST_CORE = 3  # elements along a side of the core: 12 angles keep 91% of a circle's bending stiffness
ROUNDING = (
    0.28  # how far the core's sides bulge: 0 a square, 1/2 the elliptic map of the square onto the disc
)


@dataclass(frozen=True, eq=False)
class SectionMesh:
    """A cross-section mesh on the unit disc, to be swept along a yarn.

    The polygon of surface nodes has the area of the unit circle, so its nodes lie slightly outside of it: a
    swept yarn keeps its cross-sectional area, and nearly its bending stiffness.
    """

    points: Floats  # (q, 2) node positions over the radius of the yarn
    quads: Ints  # (e, 4) corner nodes, counter-clockwise
    ring: Ints  # (a,) surface nodes, counter-clockwise

    @classmethod
    def butterfly(cls, core: int, rings: int) -> SectionMesh:
        """Section with a core of ``core`` by ``core`` elements and ``rings`` rings of ``4 core`` elements."""
        # From a search over cores of 3 to 8 and one or two rings: corner sines above 0.8, areas within 1.6.
        scale = 0.27 + 0.6 * core / (core + 2 * rings)
        core_points, core_quads, boundary = _core(core, scale)
        layers = _layers(core_points[boundary], rings)
        angles = 4 * core
        nodes = np.vstack([boundary, core_points.shape[0] + np.arange(rings * angles).reshape(rings, angles)])
        inner = nodes[:-1]
        outer = nodes[1:]
        ring_quads = np.stack([inner, outer, np.roll(outer, -1, axis=1), np.roll(inner, -1, axis=1)], axis=-1)
        points = np.vstack([core_points, layers.reshape(-1, 2)])
        quads = np.vstack([core_quads, ring_quads.reshape(-1, 4)])
        return cls(*_narrow(points, quads, nodes[-1]))

    @classmethod
    def for_size(cls, diameter: float, size: float) -> SectionMesh:
        """Section whose elements are about ``size`` wide on a yarn of ``diameter`` (both m).

        ``round(diameter / size)`` elements lie across, a third of them in rings. However coarse the size, the
        section has at least 12 angles, that is, five elements across.
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
    """Return how many nodes `SectionMesh.for_size` has, without making it.

    Examples
    --------
    >>> nodes_for_size(diameter=1.8e-3, size=0.3e-3)
    41
    """
    core, rings = _divisions(diameter, size)
    return (core + 1) ** 2 + rings * 4 * core


def _divisions(diameter: float, size: float) -> tuple[int, int]:
    """Return the elements along a side of the core and the rings of elements about ``size`` wide."""
    # Rounded first: the same section in whatever unit of length, halves included.
    across = round(round(diameter / size, 6))
    rings = max(1, round(across / 6))
    return max(FEWEST_CORE, across - 2 * rings), rings


def _core(core: int, scale: float) -> tuple[Floats, Ints, Ints]:
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


def _narrow(points: Floats, quads: Ints, ring: Ints) -> tuple[Floats, Ints, Ints]:
    """Renumber the nodes for a small bandwidth: the best of reverse Cuthill-McKee and straight sweeps."""
    size = points.shape[0]
    pairs = (np.repeat(quads, 4, axis=1).ravel(), np.tile(quads, (1, 4)).ravel())
    graph = csr_array((np.ones(pairs[0].size), pairs), shape=(size, size))
    directions = np.pi * np.arange(32) / 32 + 1e-3  # off the axes of symmetry, where nodes tie
    sweeps = [np.argsort(points @ [np.cos(a), np.sin(a)], kind="stable") for a in directions]
    orders = [np.asarray(reverse_cuthill_mckee(graph.tocsr(), symmetric_mode=True), dtype=np.int64), *sweeps]
    order: Ints = min(orders, key=lambda order: np.ptp(np.argsort(order)[quads], axis=1).max())
    number = np.argsort(order)
    return points[order], number[quads], number[ring]


def smooth_step(t: Floats) -> Floats:
    """Return the cubic that grows from 0 at t = 0 to 1 at t = 1 with slopes of 0; constant beyond.

    Examples
    --------
    >>> smooth_step(np.array([0.0, 0.5, 1.0])).tolist()
    [0.0, 0.5, 1.0]
    """
    t = np.clip(t, 0.0, 1.0)
    return t**2 * (3 - 2 * t)


@dataclass(frozen=True)
class Grading:
    """How much finer a mesh is near crossings."""

    refinement: float = 1.0  # element size over the size at crossings, at least 1
    reach: float = 0.0  # distance along the yarn from a crossing up to which refinement is full. [m]
    ramp: float = 1.0  # distance over which it is then gone. [m]

    def share(self, distance: Floats) -> Floats:
        """Share of the refinement that is left at distances (k,) in m from a crossing: 1 at it, 0 far away."""
        return 1 - smooth_step((distance - self.reach) / self.ramp)

    def pull(self, s: Floats, crossings: Floats, bearing: Floats) -> Floats:
        """Return a (k, 2) of sections at arc lengths ``s`` (k,) [m]: how far, and where to, they are drawn.

        At crossings (c,), increasing arc lengths, the other yarn lies at a bearing (c,) from d1 towards d2, rad.
        Raises MeshError if a section would be drawn to two crossings at once.
        """
        if self.refinement == 1 or not crossings.size:
            return np.zeros((s.size, 2))
        room = np.diff(crossings).min(initial=np.inf)
        if room < 2 * (self.reach + self.ramp):
            raise MeshError(
                f"mesh.refinement: crossings {room:.4g} m apart along a yarn are too near for {self.refinement:g}, "
                f"which takes {self.reach + self.ramp:.4g} m on both sides of each; use 1"
            )
        distance = np.abs(s[:, None] - crossings)
        nearest = distance.argmin(axis=1)
        finer = self.refinement ** self.share(distance[np.arange(s.size), nearest])
        towards = bearing[nearest]
        return ((finer - 1) / (finer + 1))[:, None] * np.stack([np.cos(towards), np.sin(towards)], axis=-1)


UNIFORM = Grading()  # no refinement anywhere


def drawn(points: Floats, pull: Floats) -> Floats:
    """Return points (k, q, 2) of sections: points (q, 2) in the circle of the outermost ones, drawn by pull (k, 2).

    Examples
    --------
    >>> section = np.array([[0.0, 0.0], [1.0, 0.0]])
    >>> drawn(section, np.array([[0.5, 0.0]])).tolist()  # the middle moves, the edge stays
    [[[0.5, 0.0], [1.0, 0.0]]]
    """
    radius = np.linalg.norm(points, axis=-1).max()
    z = (points @ [1, 1j])[None] / radius
    a = (pull @ [1, 1j])[:, None]
    image = radius * (z + a) / (1 + a.conj() * z)
    still = np.broadcast_to(points, (*image.shape, 2))
    return np.where((a == 0)[..., None], still, np.stack([image.real, image.imag], axis=-1))


def shrinkage(points: Floats, pull: Floats) -> Floats:
    """Return |f'| (k, q) at points (q, 2) of sections drawn by pull (k, 2): lengths there, over those not drawn."""
    z = points @ [1, 1j] / np.linalg.norm(points, axis=-1).max()
    a = (pull @ [1, 1j])[:, None]
    return (1 - np.abs(a) ** 2) / np.abs(1 + a.conj() * z) ** 2


def drawn_angles(angles: Floats, pull: Floats) -> Floats:
    """Return angles (k, a) on the circle, in rad and increasing: angles (a,) of the section, drawn by pull (k, 2).

    Examples
    --------
    >>> quarter = np.array([0.0, 0.5 * np.pi, np.pi])
    >>> drawn_angles(quarter, np.array([[0.5, 0.0]])).round(3).tolist()
    [[0.0, 0.644, 3.142]]
    """
    z = np.exp(1j * angles)
    a = (pull @ [1, 1j])[:, None]
    return angles - 2 * np.angle(1 + a.conj() * z)  # |z| = 1: z + a = z conj(1 + conj(a) z)


# ---- Where slices stand

GROWTH = 1.2
"""Spacing of slices of hexahedra away from crossings over that near them: near the count of nodes of Table 5.

From 1 to 1.5 the force of a tied knit changes by 0.1 % at most.
"""

SAMPLES_PER_ELEMENT = 32
SAME = 1e-9  # share of a yarn's length within which two arc lengths are one
COUNT_DIGITS = 6  # digits behind the point to which numbers of elements are known, rounding errors apart


@dataclass(frozen=True)
class Spacing:
    """Wanted distance of slices: ``size`` near crossings, growing to ``growth * size``; less where it is refined."""

    size: float  # within ``reach`` of a crossing. [m]
    growth: float = 1.0  # spacing beyond ``reach + ramp`` over ``size``, at least 1
    stations: tuple[float, ...] = ()  # arc lengths of the crossings. [m]
    period: float = np.inf  # arc length after which the stations repeat (one loop). [m]
    reach: float = 0.0  # [m]
    ramp: float = 1.0  # [m]
    grading: Grading = UNIFORM  # how much finer it is at the crossings

    def __call__(self, s: Floats) -> Floats:
        """Spacing in m at arc lengths ``s`` (k,) in m."""
        s = np.asarray(s, dtype=float)
        if not self.stations:
            return np.full(s.shape, self.size * self.growth)
        offset = s[:, None] - np.asarray(self.stations)
        if np.isfinite(self.period):
            offset -= self.period * np.round(offset / self.period)
        distance = np.abs(offset).min(axis=1)
        far = smooth_step((distance - self.reach) / self.ramp)
        # Refinement grows geometrically over its ramp, so that neighbours differ by the same ratio.
        finer = self.grading.refinement ** -self.grading.share(distance)
        return self.size * (1 + (self.growth - 1) * far) * finer


def place_slices(
    length: float,  # of the yarn [m]
    spacing: Spacing,
    periods: int = 1,  # equally long parts of the yarn (its loops) at whose ends slices stand
    # Rising arc lengths (crossings) in the middle of a layer of elements, whose length is the spacing there [m]
    centred: ArrayLike = (),
    ends: ArrayLike = (),  # arc lengths (of grips' ends) at which slices stand besides [m]
) -> Floats:
    """Arc lengths of the slices of one yarn, equidistributed with respect to ``spacing``.

    The ends of the periods, the ends of grips, and the layers of elements that have one of the ``centred`` arc lengths
    in their middle, divide the yarn into parts. Within a part the integral of ds / spacing(s) between neighbours is
    the same everywhere, and as near to 1 as a whole number of elements allows.
    Raises MeshError if two centred arc lengths, or one and the end of a period or grip, leave less than half an element
    between their layers.
    """
    centred = np.asarray(centred, dtype=float)
    ends = np.sort(np.concatenate([np.linspace(0.0, length, periods + 1), ends]))
    ends = ends[np.diff(ends, prepend=-length) > SAME * length]
    ends[[0, -1]] = 0.0, length
    bounds, is_layer = _parts(spacing, ends, centred)
    s, count = _element_count(length, spacing, bounds)
    at_bounds = np.interp(bounds, s, count)
    # Rounded first: the same numbers in whatever unit of length, halves included.
    number = np.round(np.round(np.diff(at_bounds), COUNT_DIGITS))
    if centred.size:
        _check_room(bounds, number)
    number = np.where(is_layer, 1, np.maximum(number, 1)).astype(int)
    first = np.concatenate([[0], np.cumsum(number)])
    slices = np.interp(np.interp(np.arange(first[-1] + 1), first, at_bounds), count, s)
    slices[first] = bounds
    return slices


def _parts(spacing: Spacing, ends: Floats, centred: Floats) -> tuple[Floats, Bools]:
    """Bounds (p + 1,) of the parts of a yarn in m, and which parts (p,) are layers about ``centred``."""
    half = 0.5 * spacing(centred)
    layers = np.stack([centred - half, centred + half], axis=-1)  # (c, 2)
    place = 2 * np.searchsorted(centred, ends)
    begins_layer = np.tile([True, False], centred.size)
    return np.insert(layers.ravel(), place, ends), np.insert(begins_layer, place, False)[:-1]


def _element_count(length: float, spacing: Spacing, bounds: Floats) -> tuple[Floats, Floats]:
    """Arc lengths (k,) in m, bounds among them, and the integral (k,) of ds / spacing from 0 to them."""
    smallest = spacing(np.linspace(0.0, length, 4097)).min()
    samples = SAMPLES_PER_ELEMENT * int(np.ceil(round(length / smallest, COUNT_DIGITS)))
    s = np.union1d(np.linspace(0.0, length, 1 + samples), np.clip(bounds, 0.0, length))
    density = 1.0 / spacing(s)
    return s, np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(s))])


def _check_room(bounds: Floats, number: Floats) -> None:
    """Refuse parts (p,) of a yarn with a ``number`` of elements that is not positive."""
    tight = (number < 1) | (np.diff(bounds) <= 0)
    if tight.any():
        part = np.flatnonzero(tight)[0]
        room = bounds[part + 1] - bounds[part]
        raise MeshError(
            f"mesh size: {room:.4g} m between s = {bounds[part]:.6g} m and s = {bounds[part + 1]:.6g} m, "
            "beside layers of elements with a crossing in their middle, are not allowed; there must be room for "
            "half an element: use a smaller mesh.size"
        )
