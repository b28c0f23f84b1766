"""Yarns of polynomials over the section times splines along the yarn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.geometry.fabric import Fabric, Grip
from knitstudy.geometry.spline import Centreline
from knitstudy.mechanics.elements import ElementGroup
from knitstudy.mechanics.materials import material_of
from knitstudy.mechanics.patch_compliance import missing
from knitstudy.mechanics.spline_yarn.space import Sampling, Space, YarnSpace, locate, yarn_space
from knitstudy.mechanics.spline_yarn.span import span_groups
from knitstudy.mesh.mesher import ACROSS, Grips, load_of
from knitstudy.mesh.quality import require_memory
from knitstudy.mesh.spacing import Spacing, place_slices
from knitstudy.mesh.sweep import SweptMesh, rotation_minimising
from knitstudy.models.discretisation import Discretisation, contact_surfaces
from knitstudy.study.scene import Scene

# ---- Where the spans of solid yarns end, and which degree they have: near crossings, on legs, where they are gripped


CROSSING_REACH = 1.0
"""Distance from a crossing up to which spans are short and of the degree of crossings, over the yarn's radius."""

RAMP = 1.0
"""Distance over which spans grow beyond the reach of a crossing, over the yarn's radius."""

NONE = np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class YarnSpans:
    """The spans of one yarn.

    Attributes
    ----------
    breaks : ndarray, shape (E + 1,)
        Their ends [m].
    degrees : ndarray of int, shape (E,)
        p of each.
    sharp : ndarray of int
        Breaks at which a grip begins or ends.
    arcs : ndarray, shape (a, 2)
        Arc lengths between which it is gripped [m].
    """

    breaks: np.ndarray
    degrees: np.ndarray
    sharp: np.ndarray
    arcs: np.ndarray

    def gripped(self) -> np.ndarray:
        """Return which spans (E,) lie in the arcs."""
        middle = 0.5 * (self.breaks[1:] + self.breaks[:-1])[:, None]
        return np.any((middle > self.arcs[:, 0]) & (middle < self.arcs[:, 1]), axis=1)


def yarn_spans(scene: Scene, specimen: Fabric) -> list[YarnSpans]:
    """Return the spans of every yarn: of all loops the same, but for the ends of arcs that are gripped."""
    radius, keys = specimen.radius, scene.mesh
    load, repeats = load_of(scene), specimen.repeats
    arcs, ends = specimen.gripped_arcs(load), specimen.grip_ends(load)
    plain = {}
    for one in np.unique(specimen.copy_of).tolist():
        spacing = Spacing(
            keys.crossing_span * radius,
            keys.span / keys.crossing_span,
            tuple(specimen.places_of_a_repeat(one).tolist()),
            specimen.centrelines[one].length / repeats,
            reach=CROSSING_REACH * radius,
            ramp=RAMP * radius,
        )
        plain[one] = spacing, _spans(repeats, NONE, NONE.ravel(), spacing, scene)
    found = []
    for yarn, one in enumerate(specimen.copy_of.tolist()):
        spacing, spans = plain[one]
        found.append(_spans(repeats, arcs[yarn], ends[yarn], spacing, scene) if yarn in arcs else spans)
    return found


def _spans(loops: int, arcs: np.ndarray, ends: np.ndarray, spacing: Spacing, scene: Scene) -> YarnSpans:
    """Return the spans of a yarn of loops, gripped along arcs (a, 2) that end inside it at ends (k,) [m]."""
    breaks = place_slices(loops * spacing.period, spacing, loops, ends=ends)
    around = (np.array(spacing.stations) + spacing.period * np.arange(-1, loops + 2)[:, None]).ravel()
    apart = np.maximum(np.maximum(breaks[:-1, None] - around, around - breaks[1:, None]), 0.0).min(axis=1)
    degrees = np.where(apart < spacing.reach, scene.mesh.crossing_degree, scene.mesh.degree)
    return YarnSpans(breaks, degrees, np.searchsorted(breaks, ends), arcs)


# ---- Solid yarns as polynomials over the section times splines along the yarn (`mechanics.polynomial_yarn`)


PLACES = 8
"""Places a span at which the shape of a yarn is fitted."""

BYTES_A_PAIR = 48
"""Of a simulation, for each pair of nodes of a span: tangent, factors of single yarns, places of what is summed."""


def discretise(scene: Scene, mesh: SweptMesh, specimen: Fabric) -> Discretisation:
    """Return the yarns of a scene as polynomials times splines.

    The length of an element, which stiffnesses of contact and tolerances refer to, is that of hexahedra in the sections
    that are drawn.

    Raises
    ------
    ConfigurationError
        If a pair is held at the backs of its yarns.
    MeshError
        If there are too many unknowns for the memory.
    """
    if scene.value("pair.support") == "back":
        raise ConfigurationError(
            "pair.support is 'back' but must be ends where fidelity is spline_yarns: half of a surface is no set of "
            "unknowns there"
        )
    spans = yarn_spans(scene, specimen)
    space = space_on(scene, spans)
    _require_memory(scene, space)
    return described(
        scene, space, undeformed(space, specimen), mesh, specimen, _grips(scene, specimen, space, spans)
    )


def described(
    scene: Scene,
    space: Space,
    nodes: np.ndarray,
    mesh: SweptMesh,
    specimen: Fabric,
    ends: Grips,
) -> Discretisation:
    """Return what all that works with solid yarns asks of them, of undeformed nodes (N, 3) [m] of a space.

    Parameters
    ----------
    scene : Scene
    space : Space
    nodes : ndarray, shape (N, 3)
    mesh : SweptMesh
        Sections at which yarns are seen.
    specimen : Fabric
        Or a part of one: what says where yarns cross.
    ends : Grips
        Nodes that are held and driven.
    """
    surfaces, rings = contact_surfaces(scene, space, specimen)
    material = material_of(scene.yarn)
    return Discretisation(
        mesh=mesh,
        nodes=nodes,
        unity=space.unity,
        yarn=space.yarn,
        station=space.station,
        bandwidth=max(own.bandwidth for own in space.yarns),
        groups=partial(span_groups, space, material=material),
        volume=partial(_volume, space.size),
        surfaces=surfaces,
        rings=rings,
        ends=ends,
        locate=partial(_locate, space, nodes),
        size=2 * mesh.radius / ACROSS,
        missing=partial(missing, space, mesh.radius, *material.across),
        sampling=Sampling(space, mesh.yarn_of_slice, mesh.arc_length, mesh.section.points),
    )


def space_on(scene: Scene, spans: list[YarnSpans]) -> Space:
    """Return the space of a scene's yarns on their spans; yarns with the same spans share theirs."""
    degree = scene.mesh.spline_degree
    kinds = {kind: yarn_space(kind.breaks, kind.degrees, degree, kind.sharp) for kind in set(spans)}
    return Space(tuple(kinds[each] for each in spans))


def undeformed(space: Space, specimen: Fabric) -> np.ndarray:
    """Return the undeformed nodes (N, 3) of a specimen's yarns [m]; all yarns of a knit are one, moved."""
    curves, radius = specimen.centrelines, specimen.radius
    kinds = list(zip(space.yarns, specimen.copy_of.tolist(), strict=True))
    shapes = {kind: shape(kind[0], curves[kind[1]], radius) for kind in set(kinds)}
    nodes = np.concatenate([shapes[kind] for kind in kinds])
    return nodes + space.unity[:, None] * specimen.shift[space.yarn]


def _require_memory(scene: Scene, space: Space) -> None:
    """Refuse more unknowns than the memory has room for: tangent, factors of single yarns and what is summed up."""
    pairs = sum(float((own.span_sizes.astype(float) ** 2).sum()) for own in space.yarns)
    what = f"a simulation of {3 * space.size:.2g} unknowns"
    require_memory(BYTES_A_PAIR * pairs, "mesh.span", scene.mesh.span, what, power=1, unit="yarn radii")


def shape(own: YarnSpace, curve: Centreline, radius: float) -> np.ndarray:
    """Return the coefficients (N, 3) of a round yarn along a centreline, with frames that do not twist [m]."""
    low, high = own.spline.spans.T
    share = np.arange(PLACES) / PLACES
    s = np.append((low[:, None] + (high - low)[:, None] * share).ravel(), high[-1])
    centre = curve.position(s)
    frames = rotation_minimising(centre, curve.tangent(s))
    fitted = own.spline.fit(s, np.concatenate([centre, frames[:, 0], frames[:, 1]], axis=1))
    return own.coefficients(fitted[:, :3], fitted[:, 3:6], fitted[:, 6:], radius)


def _volume(count: int, groups: tuple[ElementGroup, ...]) -> np.ndarray:
    """Return what stands for the volume (N,) of every node [m3]: positive, and of the constant function all of it."""
    total = np.zeros(count)
    for group in groups:
        total += np.bincount(group.connectivity.ravel(), group.elements.node_volume().ravel(), count)
    return total


def _locate(
    space: Space, nodes: np.ndarray, points: np.ndarray, yarn: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    return space.weights(yarn, *locate(space, nodes, points, yarn))


def _grips(scene: Scene, specimen: Fabric, space: Space, spans: list[YarnSpans]) -> Grips:
    """Return the nodes that are held and driven where `mesh.mesher.grips` does: all functions over those sections."""
    return Grips(*(_gripped(grip, specimen, space, spans) for grip in specimen.grips[load_of(scene)]))


def _gripped(grip: Grip, specimen: Fabric, space: Space, spans: list[YarnSpans]) -> np.ndarray:
    """Return the nodes of a grip: those of the ends that it holds, and those along its arcs."""
    nodes = []
    for yarn in np.unique(grip.yarn).tolist():
        arcs, length = grip.of(yarn), specimen.centrelines[yarn].length
        ends = arcs[arcs[:, 0] == arcs[:, 1], 0]
        nodes += [_end(space, yarn, -1 if s > 0.5 * length else 0) for s in ends]
        if len(ends) < len(arcs):
            nodes.append(_along(space, yarn, spans[yarn]))
    return np.concatenate(nodes)


def _end(space: Space, yarn: int, last: int) -> np.ndarray:
    """Return the nodes of the first (0) or last (-1) spline of a yarn, which alone do not vanish at its end."""
    own = space.yarns[yarn]
    first = own.first_node[:-1][last], own.first_node[1:][last]
    return space.first_node[yarn] + np.arange(*first)


def _along(space: Space, yarn: int, spans: YarnSpans) -> np.ndarray:
    """Return the nodes of all splines that do not vanish somewhere in the gripped arcs; their ends are sharp breaks."""
    own = space.yarns[yarn]
    spline = np.unique(own.spline.first[spans.gripped()][:, None] + np.arange(own.spline.degree + 1))
    every = np.repeat(np.arange(own.spline.size), np.diff(own.first_node))
    return space.first_node[yarn] + np.flatnonzero(np.isin(every, spline))
