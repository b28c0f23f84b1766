"""Hexahedra of yarns: cross-sections swept along centrelines in frames that do not twist."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from knitstudy.errors import DataFileError
from knitstudy.knit.geometry.columns import MESH
from knitstudy.knit.geometry.spline import Centreline
from knitstudy.knit.mesh.section import (
    SAME,
    UNIFORM,
    Grading,
    SectionMesh,
    Spacing,
    drawn,
    drawn_angles,
    place_slices,
    shrinkage,
    smooth_step,
)
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import Chosen


def rotation_minimising(position: Floats, tangent: Floats) -> Floats:
    """Frames (S, 3, 3) that do not spin about a curve: rows d1, d2 and the tangent.

    The first d1 is nearest to z, or to y where the tangent is almost parallel to that.

    Every frame is the one before it, mirrored first at the plane that halves the chord and then at the plane
    that brings the tangent into place: fourth order in the distance of the points (Wang, Juettler, Zheng and
    Liu 2008, "Computation of rotation minimizing frames", ACM Transactions on Graphics 27(1), algorithm 1).

    Examples
    --------
    >>> x = np.array([1.0, 0.0, 0.0])
    >>> rotation_minimising(np.outer([0.0, 1.0], x), np.array([x, x]))[1].tolist()
    [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]
    """
    chord = np.diff(position, axis=0)
    first = _reflection(chord)
    mirrored = np.einsum("sij,sj->si", first, tangent[:-1])
    step = _reflection(tangent[1:] - mirrored) @ first  # (S - 1, 3, 3)
    _, y, z = np.eye(3)
    start = y if np.linalg.norm(np.cross(tangent[0], z)) < 0.1 else z
    start = start - (start @ tangent[0]) * tangent[0]
    start /= np.linalg.norm(start)
    d1 = np.array(list(accumulate(step, lambda d, turn: turn @ d, initial=start)))
    # Rounding accumulates along the yarn: keep d1 a unit normal.
    d1 -= np.einsum("si,si->s", d1, tangent)[:, None] * tangent
    d1 /= np.linalg.norm(d1, axis=1, keepdims=True)
    return np.stack([d1, np.cross(tangent, d1), tangent], axis=1)


def _reflection(normal: Floats) -> Floats:
    """Householder reflections (S, 3, 3) at the planes normal to ``normal`` (S, 3); the identity for 0."""
    square = np.einsum("si,si->s", normal, normal)
    factor = np.divide(2.0, square, out=np.zeros_like(square), where=square > 0)
    return np.eye(3) - factor[:, None, None] * normal[:, :, None] * normal[:, None, :]


# ---- Roll of frames about the tangent: facets turn towards the contacts at crossings

TIE_DIGITS = 6  # of a facet step, to which two ways round are equally far: rounding does not choose


@dataclass(frozen=True, eq=False)
class Targets(Chosen):
    """Points that the middles of facets of one yarn shall face."""

    arc_length: Floats  # (T,) increasing; where the yarn is nearest to the points. [m]
    point: Floats  # (T, 3) off the centreline. [m]

    def without(self, arc_length: Floats) -> Targets:
        """Return all but those at arc lengths (k,) [m]."""
        near = np.abs(self.arc_length[:, None] - arc_length) <= SAME * self.arc_length.max(initial=0.0)
        return self[~near.any(axis=1)]


NO_TARGETS = Targets(np.empty(0), np.empty((0, 3)))


def roll_towards(
    targets: Targets, arc_length: Floats, centres: Floats, frames: Floats, angles: Floats
) -> Floats:
    """Roll (S,) from d1 towards d2 after which every target lies over the middle line of a facet, rad.

    Slices have arc lengths (S,), centres (S, 3), frames (S, 3, 3) before the roll, and surface nodes at angles (a,).

    At the first target the roll is the smallest possible, at every other one the nearest to that before it:
    at most half a facet step more or less, which keeps the twist of the elements between them small. It is
    constant over the layer that a target lies in the middle of, and beyond the outermost ones; in between it
    follows the cubic smooth step. A symmetric yarn gets a symmetric roll.
    """
    if not targets.arc_length.size:
        return np.zeros_like(arc_length)
    layer = _layers(targets, arc_length)
    bearing = bearings(targets, arc_length, centres, frames)
    step = 2 * np.pi / angles.size
    excess = (bearing - angles[0]) / step - 0.5  # facet steps beyond the middle of the first facet
    whole = np.round(np.round(np.diff(excess, prepend=0.0), TIE_DIGITS))
    roll = step * (excess - np.cumsum(whole))
    knots = np.stack([arc_length[layer], arc_length[layer + 1]], axis=-1).ravel()
    roll = np.repeat(roll, 2)
    part = np.clip(np.searchsorted(knots, arc_length, side="right") - 1, 0, knots.size - 2)
    share = smooth_step((arc_length - knots[part]) / (knots[part + 1] - knots[part]))
    return roll[part] + (roll[part + 1] - roll[part]) * share


def rolled(frames: Floats, roll: Floats) -> Floats:
    """Frames (S, 3, 3), rows d1, d2, tangent, turned about the tangent by ``roll`` (S,) in rad.

    Examples
    --------
    >>> rolled(np.eye(3)[None], np.array([0.5 * np.pi])).round(12)[0, 0].tolist()
    [0.0, 1.0, 0.0]
    """
    d1, d2, tangent = np.moveaxis(frames, 1, 0)
    cosine, sine = np.cos(roll)[:, None], np.sin(roll)[:, None]
    return np.stack([cosine * d1 + sine * d2, cosine * d2 - sine * d1, tangent], axis=1)


def _layers(targets: Targets, arc_length: Floats) -> Ints:
    """Lower slices (T,) of the layers that the targets lie in the middle of."""
    return np.searchsorted(arc_length, targets.arc_length) - 1


def bearings(targets: Targets, arc_length: Floats, centres: Floats, frames: Floats) -> Floats:
    """Angles (T,) at which targets are seen from the middles of layers, where facets have their middles."""
    layer = _layers(targets, arc_length)
    seen = targets.point - 0.5 * (centres[layer] + centres[layer + 1])
    directors = 0.5 * (frames[layer] + frames[layer + 1])[:, :2]  # (T, 2, 3)
    # Where the yarn bends the mean directors are not quite orthonormal: components by their Gram matrix.
    gram = directors @ directors.transpose(0, 2, 1)
    x, y = np.linalg.solve(gram, directors @ seen[..., None])[..., 0].T
    return np.arctan2(y, x)


# ---- Sections swept along centrelines

VARIABLES = ("nodes", "hexahedra", "centres", "frames", "arc_length", "first_slice", "radius")
"""Variables of a file of a mesh that are attributes of the mesh."""


@dataclass(frozen=True, eq=False)
class SweptMesh:
    """Hexahedra of all yarns, numbered yarn by yarn, slice by slice, section node by section node."""

    nodes: Floats  # (S q, 3) coordinates. [m]
    section: SectionMesh
    radius: float  # of the yarns. [m]
    centres: Floats  # (S, 3) centres of the slices. [m]
    frames: Floats  # (S, 3, 3) rows d1, d2 and the tangent
    arc_length: Floats  # (S,) from the left end of a yarn. [m]
    first_slice: Ints  # (Y + 1,) first slice of every yarn, then S
    pull: Floats  # (S, 2) how far, and where to in the plane of d1 and d2, slices are drawn

    @property
    def yarns(self) -> int:
        """Number of yarns Y."""
        return self.first_slice.size - 1

    @property
    def slices(self) -> int:
        """Number of slices S of all yarns."""
        return self.arc_length.size

    @cached_property
    def yarn_of_slice(self) -> Ints:
        """Yarn of every slice (S,)."""
        return np.repeat(np.arange(self.yarns), np.diff(self.first_slice))

    @cached_property
    def lower_slices(self) -> Ints:
        """Slices (L,) that a layer of elements begins with: all but the last one of every yarn."""
        return np.setdiff1d(np.arange(self.slices), self.first_slice[1:] - 1)

    @cached_property
    def hexahedra(self) -> NDArray[np.int32]:
        """Corner nodes (E, 8) in VTK order; within a yarn layer by layer, in a layer as ``section.quads``."""
        lower = self.lower_slices[:, None, None] * self.section.size + self.section.quads  # (L, e, 4)
        return np.concatenate([lower, lower + self.section.size], axis=-1).reshape(-1, 8).astype(np.int32)

    def slice_below(self, yarn: Ints, arc_length: Floats) -> Ints:
        """Return the slices (...) that layers begin with in which arc lengths (...) [m] on yarns (...) lie."""
        slices = np.empty(yarn.shape, dtype=np.int64)
        for number, stations in enumerate(self.stations):
            here = yarn == number
            layer = np.searchsorted(stations, arc_length[here], side="right") - 1
            slices[here] = self.first_slice[number] + np.clip(layer, 0, len(stations) - 2)
        return slices

    @property
    def stations(self) -> tuple[Floats, ...]:
        """Arc lengths of the slices of every yarn, m."""
        return self.by_yarn(self.arc_length)

    def by_yarn(self, values: Floats) -> tuple[Floats, ...]:
        """Return values of slices (S, ...) for every yarn."""
        return tuple(np.split(values, self.first_slice[1:-1]))

    @cached_property
    def angles(self) -> Floats:
        """Polar angles (S, a) of the surface nodes of every slice, from d1 towards d2, rad, increasing."""
        return drawn_angles(self.section.angles, self.pull)

    @cached_property
    def shrinkage(self) -> Floats:
        """Lengths in the section around every node (S, q), over the lengths in a section that is not drawn."""
        return shrinkage(self.section.points, self.pull)

    def ring_means(self, values: Floats) -> Floats:
        """Means (S, ...) around all slices of nodal values (N, ...); a node counts by its part of the circle."""
        ring = self.section.ring
        weight = self.shrinkage[:, ring]
        on_ring = values[self.slice_nodes(np.arange(self.slices))[:, ring]]
        return np.einsum("sa,sa...->s...", weight / weight.sum(axis=1, keepdims=True), on_ring)

    def facet_at(self, slices: Ints, angle: Floats) -> Ints:
        """Facets (k,) at angles (k,) in rad, counted midway from slices (k,) to the next ones."""
        begin = 0.5 * self.angles[slices] + 0.5 * self.angles[slices + 1]
        turned = begin[:, 0] + np.mod(angle - begin[:, 0], 2 * np.pi)
        return (begin <= turned[:, None]).sum(axis=1) - 1

    @cached_property
    def slice_of_element(self) -> Ints:
        """Lower slice of every hexahedron (E,)."""
        return np.repeat(self.lower_slices, self.section.quads.shape[0])

    def slice_nodes(self, slices: Ints | int) -> Ints:
        """Node numbers (..., q) of the given slices (...)."""
        return np.asarray(slices)[..., None] * self.section.size + np.arange(self.section.size)

    def surface_nodes(self, yarn: int) -> Ints:
        """Grid (slices, angles) of the surface nodes of one yarn."""
        slices = np.arange(*self.first_slice[yarn : yarn + 2])
        return self.slice_nodes(slices)[:, self.section.ring]

    def facet_nodes(self, slices: Ints, facet: Ints) -> Ints:
        """Corners (..., 4) of facets (...) between slices (...) and the next ones."""
        corner = np.stack([facet, facet + 1, facet + 1, facet], axis=-1) % self.section.ring.size
        return (slices[..., None] + [0, 0, 1, 1]) * self.section.size + self.section.ring[corner]

    def surface_quads(self, yarn: int) -> Ints:
        """Facets ((slices - 1) angles, 4) of one yarn's lateral surface, layer by layer, normals outward."""
        facets = np.indices((int(np.diff(self.first_slice)[yarn]) - 1, self.section.ring.size))
        return self.facet_nodes(self.first_slice[yarn] + facets[0], facets[1]).reshape(-1, 4)

    def to_dataset(self) -> xr.Dataset:
        """Dataset of everything the mesh consists of (SI units)."""
        section = {f"section_{name}": getattr(self.section, name) for name in ("points", "quads", "ring")}
        pull = {"pull": self.pull} if self.pull.any() else {}
        return xr.Dataset(MESH.variables({name: getattr(self, name) for name in VARIABLES} | section | pull))

    @classmethod
    def from_dataset(cls, dataset: xr.Dataset) -> SweptMesh:
        """Mesh from what ``to_dataset`` wrote; DataFileError if a variable is missing."""
        source = dataset.encoding.get("source", "dataset")
        names = (*VARIABLES, "section_points", "section_quads", "section_ring")
        missing = [name for name in names if name not in dataset]
        if missing:
            raise DataFileError(
                f"{source}: not a mesh; missing {', '.join(missing)}; needed are {', '.join(names)}"
            )
        data: dict[str, Any] = {name: dataset[name].to_numpy() for name in names if name != "hexahedra"}
        section = SectionMesh(*(data.pop(f"section_{name}") for name in ("points", "quads", "ring")))
        data["radius"] = float(data["radius"])
        still = np.zeros((len(data["arc_length"]), 2))
        return cls(section=section, pull=dataset["pull"].to_numpy() if "pull" in dataset else still, **data)


def sweep(
    centrelines: Sequence[Centreline],
    section: SectionMesh,
    radius: float,  # of the yarns [m]
    spacing: Spacing | Sequence[Spacing],  # one a yarn, or one for all
    periods: int = 1,
    # One a yarn: places in the middle of a layer of elements, and points that the middle of a facet faces there
    targets: Sequence[Targets] | None = None,
    ends: Mapping[int, Floats] | None = None,
    grading: Grading = UNIFORM,  # how far sections are drawn towards the targets; along the yarn `spacing` counts
) -> SweptMesh:
    """Sweep a section along every centreline.

    Frames do not spin about the centreline, but for the roll that turns facets to the targets. `periods` and the `ends`
    of every yarn are those of `place_slices`.
    Raises MeshError if targets are too close together for the spacing or the grading.
    """
    targets = [NO_TARGETS] * len(centrelines) if targets is None else targets
    spacings = [spacing] * len(centrelines) if isinstance(spacing, Spacing) else spacing
    yarns = []
    for yarn, (curve, own, aim) in enumerate(zip(centrelines, spacings, targets, strict=True)):
        s = place_slices(curve.length, own, periods, aim.arc_length, (ends or {}).get(yarn, ()))
        centres = curve.position(s)
        frames = rotation_minimising(centres, curve.tangent(s))
        frames = rolled(frames, roll_towards(aim, s, centres, frames, section.angles))
        pull = grading.pull(s, aim.arc_length, bearings(aim, s, centres, frames))
        yarns.append((s, centres, frames, pull))
    arc_length, centres, frames, pull = (np.concatenate(parts) for parts in zip(*yarns, strict=True))
    return SweptMesh(
        nodes=tube(centres, frames, radius * drawn(section.points, pull)).reshape(-1, 3),
        section=section,
        radius=float(radius),
        centres=centres,
        frames=frames,
        arc_length=arc_length,
        first_slice=np.cumsum([0, *(len(s) for s, *_ in yarns)]),
        pull=pull,
    )


def tube(centres: Floats, frames: Floats, places: Floats) -> Floats:
    """Return points (S, k, 3) at places (S, k, 2) [m] of cross-sections.

    Examples
    --------
    >>> tube(np.array([[5.0, 0.0, 0.0]]), np.eye(3)[None], np.array([[[1.0, 2.0]]])).tolist()
    [[[6.0, 2.0, 0.0]]]
    """
    return centres[:, None] + np.einsum("skd,sdi->ski", places, frames[:, :2])
