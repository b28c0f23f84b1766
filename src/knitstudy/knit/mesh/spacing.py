"""Grading of cross-sections: near crossings their nodes are drawn towards the other yarn.

The section keeps its topology along the yarn, so a layer that is finer on one side has to be coarser on the other. A
Moebius map of the disc onto itself,

    f(z) = (z + a) / (1 + conj(a) z) ,   |a| = (m - 1) / (m + 1) ,

does that without shearing anything: it is conformal, so elements keep their angles, and takes the circle to the circle.
Elements are m times as small at a / |a|, angles and rings alike, and m times as large on the other side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from knitstudy.errors import MeshError
from knitstudy.mechanics.arrays import Floats, Ints


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

    def __post_init__(self) -> None:
        if not self.refinement >= 1:
            raise MeshError(f"mesh.refinement: {self.refinement} is not allowed; it must be at least 1")

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
    z, a = (points @ [1, 1j])[None] / radius, (pull @ [1, 1j])[:, None]
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
    z, a = np.exp(1j * angles), (pull @ [1, 1j])[:, None]
    return angles - 2 * np.angle(1 + a.conj() * z)  # |z| = 1: z + a = z conj(1 + conj(a) z)


# ---- Where slices stand

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

    def __post_init__(self) -> None:
        for name, value, fits, allowed in (
            ("size", f"{self.size} m", 0 < self.size < np.inf, "positive"),
            ("growth", f"{self.growth}", 1 <= self.growth < np.inf, "at least 1"),
            ("ramp", f"{self.ramp} m", self.ramp > 0, "positive"),
        ):
            if not fits:
                raise MeshError(f"mesh {name}: {value} is not allowed; it must be {allowed}")

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
    length: float,
    spacing: Spacing,
    periods: int = 1,
    centred: Sequence[float] = (),
    ends: Sequence[float] = (),
) -> Floats:
    """Arc lengths of the slices of one yarn, equidistributed with respect to ``spacing``.

    The ends of the periods, the ends of grips, and the layers of elements that have one of the ``centred`` arc lengths
    in their middle, divide the yarn into parts. Within a part the integral of ds / spacing(s) between neighbours is
    the same everywhere, and as near to 1 as a whole number of elements allows.

    Parameters
    ----------
    length : float
        Arc length of the yarn, m.
    periods : int
        Number of equally long parts of the yarn (its loops) at whose ends slices stand.
    centred : sequence of float
        Increasing arc lengths (the crossings) that shall lie in the middle of a layer of elements, whose
        length is the spacing there, m.
    ends : sequence of float
        Arc lengths (of grips' ends) at which slices stand besides, m.

    Raises
    ------
    MeshError
        If the length is not positive and finite, or two centred arc lengths, or one and the end of a period or grip,
        leave less than half an element between their layers.
    """
    if not (np.isfinite(length) and length > 0):
        raise MeshError(f"yarn length: {length} m is not allowed; it must be positive")
    ends = np.sort(np.concatenate([np.linspace(0.0, length, periods + 1), ends]))
    ends = ends[np.diff(ends, prepend=-length) > SAME * length]
    ends[[0, -1]] = 0.0, length
    bounds, is_layer = _parts(length, spacing, ends, np.asarray(centred, dtype=float))
    s, count = _element_count(length, spacing, bounds)
    at_bounds = np.interp(bounds, s, count)
    # Rounded first: the same numbers in whatever unit of length, halves included.
    number = np.round(np.round(np.diff(at_bounds), COUNT_DIGITS))
    if len(centred):
        _check_room(bounds, number)
    number = np.where(is_layer, 1, np.maximum(number, 1)).astype(int)
    first = np.concatenate([[0], np.cumsum(number)])
    slices = np.interp(np.interp(np.arange(first[-1] + 1), first, at_bounds), count, s)
    slices[first] = bounds
    return slices


def _parts(length: float, spacing: Spacing, ends: Floats, centred: Floats) -> tuple[Floats, Floats]:
    """Bounds (p + 1,) of the parts of a yarn in m, and which parts (p,) are layers about ``centred``."""
    if centred.size and not (0 < centred[0] and centred[-1] < length and (np.diff(centred) > 0).all()):
        raise MeshError(
            f"mesh spacing: centred arc lengths {centred.tolist()} m are not allowed; they must increase and "
            f"lie between 0 and {length:.6g} m"
        )
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


def _check_room(bounds: Floats, number: Ints) -> None:
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
