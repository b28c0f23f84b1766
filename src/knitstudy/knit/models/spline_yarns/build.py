"""Solid yarns of polynomials over the section times splines along the yarn (`mechanics.spline_yarn`), of any fabric.

Spans are short and of a high degree near crossings, long and of a low degree between them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.knit.geometry.fabric import NO_ARCS, Fabric, Grip
from knitstudy.knit.geometry.spline import Centreline
from knitstudy.knit.loading.solve import Problem
from knitstudy.knit.mesh.mesher import ACROSS, Grips, check_shape, load_of, sampled_sections
from knitstudy.knit.mesh.quality import require_memory
from knitstudy.knit.mesh.section import Section, Spacing, place_slices
from knitstudy.knit.mesh.sweep import SweptMesh, rotation_minimising, sweep
from knitstudy.knit.models.spline_yarns import cell as endless
from knitstudy.knit.models.spline_yarns.beam_guide import guide_of
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.yarns import solids
from knitstudy.knit.yarns.discretisation import Discretisation, contact_surfaces, fitted_places
from knitstudy.mechanics.contact.compliance import missing_tie_compliance
from knitstudy.mechanics.elements import ElementGroup
from knitstudy.mechanics.materials import material_of
from knitstudy.mechanics.spline_yarn.space import Sampling, Space, YarnSpace, locate, yarn_space
from knitstudy.mechanics.spline_yarn.span import span_groups

# Distance from a crossing up to which spans are short and of the degree of crossings, over the yarn's radius
CROSSING_REACH = 1.0

RAMP = 1.0  # distance over which spans grow beyond the reach of a crossing, over the yarn's radius

# Of a simulation, for each pair of nodes of a span: tangent, factors of single yarns and indices of sums
BYTES_A_PAIR = 48


@dataclass(frozen=True, eq=False)
class YarnSpans:
    """The spans of one yarn."""

    breaks: np.ndarray  # (E + 1,) their ends [m]
    degrees: np.ndarray  # (E,) p of each
    sharp: np.ndarray  # breaks at which a grip begins or ends
    arcs: np.ndarray  # (a, 2) arc lengths between which it is gripped [m]

    def gripped(self) -> np.ndarray:
        """Return which spans (E,) lie in the arcs."""
        middle = 0.5 * (self.breaks[1:] + self.breaks[:-1])[:, None]
        return np.any((middle > self.arcs[:, 0]) & (middle < self.arcs[:, 1]), axis=1)


def yarn_spans(scene: Scene, fabric: Fabric) -> list[YarnSpans]:
    """Return the spans of every yarn; copies of a yarn have the same, but for arcs that are gripped."""
    load = load_of(scene)
    arcs, ends = fabric.gripped_arcs(load), fabric.grip_ends(load)
    plain = {
        one: _spans(scene, fabric, one, NO_ARCS, NO_ARCS.ravel()) for one in set(fabric.copy_of.tolist())
    }
    return [
        _spans(scene, fabric, one, arcs[yarn], ends[yarn]) if yarn in arcs else plain[one]
        for yarn, one in enumerate(fabric.copy_of.tolist())
    ]


def _spans(scene: Scene, fabric: Fabric, yarn: int, arcs: np.ndarray, ends: np.ndarray) -> YarnSpans:
    """Return the spans of a yarn that is gripped along arcs (a, 2), which end inside it at ends (k,) [m]."""
    radius, keys = fabric.radius, scene.mesh
    length, repeats = fabric.centrelines[yarn].length, fabric.repeats
    stations, period = fabric.places_of_a_repeat(yarn), length / repeats
    # A whole yarn would go on beyond its ends as within them, an arc of a yarn ends there.
    images = period * np.arange(-1, repeats + 2) if fabric.arcs is None else np.zeros(1)
    reach = CROSSING_REACH * radius
    spacing = Spacing(
        keys.crossing_span * radius,
        keys.span / keys.crossing_span,
        tuple(stations.tolist()),
        period if fabric.arcs is None else np.inf,
        reach=reach,
        ramp=RAMP * radius,
    )
    breaks = place_slices(length, spacing, repeats, ends=ends)
    around = (stations + images[:, None]).ravel()
    apart = np.maximum(np.maximum(breaks[:-1, None] - around, around - breaks[1:, None]), 0.0).min(axis=1)
    degrees = np.where(apart < reach, keys.crossing_degree, keys.degree)
    return YarnSpans(breaks, degrees, np.searchsorted(breaks, ends), arcs)


def build(scene: Scene, fabric: Fabric, mesh: SweptMesh | None = None) -> Problem:
    """Return a scene with yarns of polynomials and splines as a problem, observed at the sections of a mesh.

    Raises ConfigurationError if a pair is held at the backs of its yarns; MeshError if a yarn bends tighter than its
    radius, crossings cannot be tied, yarns overlap, or the simulation does not fit into memory.
    """
    parts = discretise(scene, fabric, mesh)
    if len(fabric.periods):
        return endless.problem(scene, fabric, parts)
    yarns = solids.assemble(scene, fabric, parts)
    guide = partial(guide_of, scene, fabric, parts.space, yarns.retained)
    return replace(solids.problem(scene, fabric, yarns), guide=guide)


def discretise(scene: Scene, fabric: Fabric, mesh: SweptMesh | None = None) -> Discretisation:
    """Return the yarns of a scene as polynomials times splines.

    The length of an element, which stiffnesses of contact and tolerances refer to, is that of hexahedra in the sections
    at which the yarns are observed. Arguments and errors as of `build`.
    """
    if scene.value("pair.support") == "back":
        raise ConfigurationError(
            "pair.support is 'back' but must be ends where fidelity is spline_yarns: half of a surface is no set of "
            "unknowns there"
        )
    spans = yarn_spans(scene, fabric)
    space, nodes = undeformed_yarns(scene, fabric, spans)
    # Tangent, factors of single yarns and sums
    pairs = sum(float((own.span_sizes.astype(float) ** 2).sum()) for own in space.yarns)
    what = f"a simulation of {3 * space.size:.2g} unknowns"
    require_memory(BYTES_A_PAIR * pairs, "mesh.span", scene.mesh.span, what, power=1)
    surfaces, rings = contact_surfaces(scene, space, fabric)
    mesh, material = mesh or _sections(fabric), material_of(scene.yarn)
    parts = Discretisation(
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
        ends=_grips(scene, fabric, space, spans),
        locate=lambda points, yarn: space.weights(yarn, *locate(space, nodes, points, yarn)),
        size=2 * mesh.radius / ACROSS,
        missing_compliance=partial(missing_tie_compliance, space, mesh.radius, *material.across),
        sampling=Sampling(space, mesh.yarn_of_slice, mesh.arc_length, mesh.section.points),
        space=space,
    )
    return endless.without_images(parts, fabric, material) if len(fabric.periods) else parts


def _sections(fabric: Fabric) -> SweptMesh:
    """Return the sections at which yarns without a mesh are observed."""
    if fabric.arcs is None:
        return sampled_sections(fabric)
    check_shape(fabric)
    size = 2 * fabric.radius / ACROSS
    return sweep(fabric.centrelines, Section.for_size(2 * fabric.radius, size), fabric.radius, Spacing(size))


def undeformed_yarns(scene: Scene, fabric: Fabric, spans: list[YarnSpans]) -> tuple[Space, np.ndarray]:
    """Return the space of a fabric's yarns on their spans and its undeformed nodes (N, 3) [m].

    Of an endless fabric there are images as well; where yarns touch, one loop of their images continues them.
    """
    if not len(fabric.periods):
        space = space_on(scene, spans)
        return space, undeformed(space, fabric)
    touches = scene.kind.interaction.touches
    rows = [spans[row] for row in endless.rows_and_images(fabric, touches)]
    space = space_on(scene, rows, fabric.repeats if touches else None)
    return space, endless.wrapped_nodes(space, fabric)


def space_on(scene: Scene, spans: list[YarnSpans], loops: int | None = None) -> Space:
    """Return the space of a scene's yarns on their spans; yarns with the same spans share theirs.

    Yarns of so many `loops` that repeat themselves are continued by one of them at both ends.
    """
    degree = scene.mesh.spline_degree
    kinds = {
        kind: yarn_space(
            kind.breaks, kind.degrees, degree, kind.sharp, len(kind.degrees) // loops if loops else 0
        )
        for kind in set(spans)
    }
    return Space(tuple(kinds[span] for span in spans))


def undeformed(space: Space, fabric: Fabric) -> np.ndarray:
    """Return the undeformed nodes (N, 3) of a fabric's yarns [m]; copies of a yarn are one, moved."""
    curves, radius = fabric.centrelines, fabric.radius
    kinds = list(zip(space.yarns, fabric.copy_of.tolist(), strict=True))
    shapes = {kind: shape(kind[0], curves[kind[1]], radius) for kind in set(kinds)}
    nodes = np.concatenate([shapes[kind] for kind in kinds])
    return nodes + space.unity[:, None] * fabric.shift[space.yarn]


def shape(own: YarnSpace, curve: Centreline, radius: float) -> np.ndarray:
    """Return the coefficients (N, 3) of a round yarn along a centreline, with frames that do not twist [m]."""
    s = fitted_places(own)
    centre = curve.position(s)
    frames = rotation_minimising(centre, curve.tangent(s))
    return own.fitted(s, centre, frames[:, :2], radius)


def _volume(count: int, groups: tuple[ElementGroup, ...]) -> np.ndarray:
    """Return a positive volume (N,) of every node [m3]; volumes of the constant function add up to the whole."""
    total = np.zeros(count)
    for group in groups:
        total += np.bincount(group.connectivity.ravel(), group.elements.node_volume().ravel(), count)
    return total


def _grips(scene: Scene, fabric: Fabric, space: Space, spans: list[YarnSpans]) -> Grips:
    """Return the nodes that are held and driven, of all functions over gripped sections; none without grips."""
    nothing = np.empty(0, dtype=np.int64)
    grips = fabric.grips.get(load_of(scene) or "")
    if grips is None:
        return Grips(nothing, nothing)
    return Grips(*(_gripped(grip, fabric, space, spans) for grip in grips))


def _gripped(grip: Grip, fabric: Fabric, space: Space, spans: list[YarnSpans]) -> np.ndarray:
    """Return the nodes of a grip, of all splines that do not vanish in it."""
    nodes = [np.empty(0, dtype=np.int64)]
    for yarn in np.unique(grip.yarn).tolist():
        own, arcs = space.yarns[yarn], grip.of(yarn)
        # At an end the first or the last spline alone does not vanish; the ends of arcs are sharp breaks.
        ends = arcs[arcs[:, 0] == arcs[:, 1], 0]
        splines = np.where(ends > 0.5 * fabric.centrelines[yarn].length, own.spline.size - 1, 0)
        if len(ends) < len(arcs):
            first = own.spline.first[spans[yarn].gripped()]
            splines = np.append(splines, first[:, None] + np.arange(own.spline.degree + 1))
        every = np.repeat(np.arange(own.spline.size), np.diff(own.first_node))
        nodes.append(space.first_node[yarn] + np.flatnonzero(np.isin(every, splines)))
    return np.concatenate(nodes)
