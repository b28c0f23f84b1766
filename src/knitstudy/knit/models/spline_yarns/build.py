"""Solid yarns of polynomials over the section times splines along the yarn (`solids.spline_yarn`), of any fabric.

Spans are short and of a high degree near crossings, long and of a low degree between them.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from knitstudy.errors import ConfigurationError, KnitstudyError
from knitstudy.knit.geometry.fabric import NO_ARCS, Fabric, Grip
from knitstudy.knit.geometry.spline import Centreline
from knitstudy.knit.loading.history import Stations
from knitstudy.knit.loading.run import ReportProgress, silent
from knitstudy.knit.loading.solve import Problem
from knitstudy.knit.mesh.mesher import ACROSS, Grips, check_shape, load_of, sampled_sections
from knitstudy.knit.mesh.quality import require_memory
from knitstudy.knit.mesh.section import SectionMesh, Spacing, place_slices
from knitstudy.knit.mesh.sweep import SweptMesh, rotation_minimising, sweep
from knitstudy.knit.models.spline_yarns import (
    CellOfSplineYarns,
    PairOfSplineYarns,
    PolynomialMesh,
    SplineScene,
    SplineYarns,
    TiedCellOfSplineYarns,
)
from knitstudy.knit.models.spline_yarns import cell as endless
from knitstudy.knit.scene.kinds import MODELS
from knitstudy.knit.yarns import solids
from knitstudy.knit.yarns.discretisation import (
    WINDOW,
    ContactOfSolids,
    Discretisation,
    contact_surfaces,
    fitted_places,
)
from knitstudy.mechanics.contact.compliance import missing_tie_compliance
from knitstudy.mechanics.contact.indentation import Indentation, indentation
from knitstudy.mechanics.contact.solid import Penetration
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.rotation import exp, log
from knitstudy.mechanics.materials import Material, material_of
from knitstudy.mechanics.solids.elements import ElementGroup
from knitstudy.mechanics.solids.spline_yarn.space import Sampling, Space, YarnSpace, locate, yarn_space
from knitstudy.mechanics.solids.spline_yarn.span import span_groups

SPLINE_DEGREE = 3  # of the splines along the yarn; quadratic ones need 1.5 times as many spans

# Distance from a crossing up to which spans are short and of the degree of crossings, over the yarn's radius
CROSSING_REACH = 1.0

RAMP = 1.0  # distance over which spans grow beyond the reach of a crossing, over the yarn's radius

# Depth up to which the parabola beyond the tables of the law of contact serves, over theirs: jerseys at 30 % wale
# strain carry the same within 0.01 % with tables of degree 3, at 1.8 times their depth, and of degree 4, at 2.5 times
FURTHER = 2.5
LESS = "the law of indentation is not verified beyond: use a smaller load, a smaller mesh.crossing_degree, or hexahedra"

# Of a simulation, for each pair of nodes of a span: tangent, factors of single yarns and indices of sums
BYTES_A_PAIR = 48

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class YarnSpans:
    """The spans of one yarn."""

    breaks: Floats  # (E + 1,) their ends [m]
    degrees: Ints  # (E,) p of each
    sharp: Ints  # breaks at which a grip begins or ends
    arcs: Floats  # (a, 2) arc lengths between which it is gripped [m]

    def gripped(self) -> Bools:
        """Return which spans (E,) lie in the arcs."""
        middle = 0.5 * (self.breaks[1:] + self.breaks[:-1])[:, None]
        return np.any((middle > self.arcs[:, 0]) & (middle < self.arcs[:, 1]), axis=1)


def yarn_spans(keys: PolynomialMesh, fabric: Fabric, load: str | None) -> list[YarnSpans]:
    """Return the spans of every yarn; copies of a yarn have the same, but for arcs that are gripped under a load."""
    arcs, ends = fabric.gripped_arcs(load), fabric.grip_ends(load)
    plain = {one: _spans(keys, fabric, one, NO_ARCS, NO_ARCS.ravel()) for one in set(fabric.copy_of.tolist())}
    return [
        _spans(keys, fabric, one, arcs[yarn], ends[yarn]) if yarn in arcs else plain[one]
        for yarn, one in enumerate(fabric.copy_of.tolist())
    ]


def _spans(keys: PolynomialMesh, fabric: Fabric, yarn: int, arcs: Floats, ends: Floats) -> YarnSpans:
    """Return the spans of a yarn that is gripped along arcs (a, 2), which end inside it at ends (k,) [m]."""
    radius = fabric.radius
    length = fabric.centrelines[yarn].length
    repeats = fabric.repeats
    stations = fabric.places_of_a_repeat(yarn)
    period = length / repeats
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


def build(scene: SplineScene, fabric: Fabric, mesh: SweptMesh | None = None) -> Problem:
    """Return a scene with yarns of polynomials and splines as a problem, observed at the sections of a mesh.

    Raises ConfigurationError if a pair is held at the backs of its yarns; MeshError if a yarn bends tighter than its
    radius, crossings cannot be tied, yarns overlap, or the simulation does not fit into memory.
    """
    parts = discretise(scene, fabric, mesh)
    if isinstance(scene, TiedCellOfSplineYarns | CellOfSplineYarns):
        return endless.problem(scene, fabric, parts)
    yarns = solids.assemble(scene, scene.tie, fabric, parts)
    guide = partial(guide_of, scene, fabric, parts.splines, yarns.retained)
    return replace(solids.problem(scene, fabric, yarns), guide=guide)


def discretise(scene: SplineScene, fabric: Fabric, mesh: SweptMesh | None = None) -> Discretisation:
    """Return the yarns of a scene as polynomials times splines.

    Stiffnesses of contact and tolerances refer to the length of an element: the length of a hexahedron in the sections
    at which the yarns are observed. Arguments and errors as of `build`.
    """
    if scene.value("pair.support") == "back":
        raise ConfigurationError(
            "pair.support is 'back' but must be ends where fidelity is spline_yarns: spline yarns cannot fix half of "
            "their surface"
        )
    space, nodes, spans = undeformed_yarns(scene, fabric)
    # Tangent, factors of single yarns and sums
    pairs = sum(float((own.span_sizes.astype(float) ** 2).sum()) for own in space.yarns)
    what = f"a simulation of {3 * space.size:.2g} unknowns"
    require_memory(BYTES_A_PAIR * pairs, "mesh.span", scene.mesh.span, what, power=1)
    mesh = mesh or _sections(fabric)
    material = material_of(scene.yarn)
    size = 2 * mesh.radius / ACROSS
    cells = (1.0, 0.0)
    contact = None
    if isinstance(scene, SplineYarns | PairOfSplineYarns | CellOfSplineYarns):
        keys = scene.contact
        cells = keys.cell, WINDOW
        law = law_of(scene.mesh, material, mesh.radius, scene.friction)
        contact = ContactOfSolids(law, keys.penetration * size, Penetration(FURTHER * law.end, remedy=LESS))
    surfaces, rings = contact_surfaces(space, fabric, *cells)
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
        contact=contact,
        ends=_grips(fabric, load_of(scene), space, spans),
        locate=lambda points, yarn: space.weights(yarn, *locate(space, nodes, points, yarn)),
        size=size,
        missing_compliance=partial(missing_tie_compliance, space, mesh.radius, *material.across),
        sampling=Sampling(space, mesh.yarn_of_slice, mesh.arc_length, mesh.section.points),
        space=space,
    )
    return endless.without_images(parts, fabric, material) if len(fabric.periods) else parts


def law_of(keys: PolynomialMesh, material: Material, radius: float, friction: float) -> Indentation:
    """Return the law of contact: the local indentation that the polynomials near crossings do not resolve."""
    modulus, poisson = material.across
    settings = keys.crossing_degree, keys.crossing_span, SPLINE_DEGREE
    return indentation(*settings, modulus=modulus, poisson=poisson, radius=radius, friction=friction)


def _sections(fabric: Fabric) -> SweptMesh:
    """Return the sections at which yarns without a mesh are observed."""
    if fabric.arcs is None:
        return sampled_sections(fabric)
    check_shape(fabric)
    size = 2 * fabric.radius / ACROSS
    return sweep(
        fabric.centrelines, SectionMesh.for_size(2 * fabric.radius, size), fabric.radius, Spacing(size)
    )


def undeformed_yarns(scene: SplineScene, fabric: Fabric) -> tuple[Space, Floats, list[YarnSpans]]:
    """Return the space of a fabric's yarns, its undeformed nodes (N, 3) [m], and the spans of every yarn.

    Of an endless fabric there are images as well; where yarns touch, one loop of their images continues them.
    """
    spans = yarn_spans(scene.mesh, fabric, load_of(scene))
    if not len(fabric.periods):
        space = _space(spans)
        return space, undeformed(space, fabric), spans
    touches = scene.kind.interaction.touches
    rows = [spans[row] for row in endless.rows_and_images(fabric, touches)]
    space = _space(rows, fabric.repeats if touches else None)
    return space, endless.wrapped_nodes(space, fabric), spans


def _space(spans: list[YarnSpans], loops: int | None = None) -> Space:
    """Return the space of yarns on their spans; yarns with the same spans share theirs.

    Periodic yarns of a number of `loops` are continued by one loop at both ends.
    """
    kinds = {
        kind: yarn_space(
            kind.breaks, kind.degrees, SPLINE_DEGREE, kind.sharp, len(kind.degrees) // loops if loops else 0
        )
        for kind in set(spans)
    }
    return Space(tuple(kinds[span] for span in spans))


def undeformed(space: Space, fabric: Fabric) -> Floats:
    """Return the undeformed nodes (N, 3) of a fabric's yarns [m]; copies of a yarn are one, moved."""
    curves, radius = fabric.centrelines, fabric.radius
    kinds = list(zip(space.yarns, fabric.copy_of.tolist(), strict=True))
    shapes = {kind: shape(kind[0], curves[kind[1]], radius) for kind in set(kinds)}
    nodes = np.concatenate([shapes[kind] for kind in kinds])
    return nodes + space.unity[:, None] * fabric.shift[space.yarn]


def shape(own: YarnSpace, curve: Centreline, radius: float) -> Floats:
    """Return the coefficients (N, 3) of a round yarn along a centreline, with frames that do not twist [m]."""
    s = fitted_places(own)
    centre = curve.position(s)
    frames = rotation_minimising(centre, curve.tangent(s))
    return own.fitted(s, centre, frames[:, :2], radius)


def _volume(count: int, groups: tuple[ElementGroup, ...]) -> Floats:
    """Return a positive volume (N,) of every node [m3]; volumes of the constant function add up to the whole."""
    total = np.zeros(count)
    for group in groups:
        elements: Any = group.elements
        total += np.bincount(group.connectivity.ravel(), elements.node_volume().ravel(), count)
    return total


def _grips(fabric: Fabric, load: str | None, space: Space, spans: list[YarnSpans]) -> Grips:
    """Return the nodes that are held and driven, of all functions over gripped sections; none without grips."""
    nothing = np.empty(0, dtype=np.int64)
    grips = fabric.grips.get(load or "")
    if grips is None:
        return Grips(nothing, nothing)
    return Grips(*(_gripped(grip, fabric, space, spans) for grip in grips))


def _gripped(grip: Grip, fabric: Fabric, space: Space, spans: list[YarnSpans]) -> Ints:
    """Return the nodes of a grip, of all splines that do not vanish in it."""
    nodes = [np.empty(0, dtype=np.int64)]
    for yarn in np.unique(grip.yarn).tolist():
        own = space.yarns[yarn]
        arcs = grip.of(yarn)
        # At an end the first or the last spline alone does not vanish; the ends of arcs are sharp breaks.
        ends = arcs[arcs[:, 0] == arcs[:, 1], 0]
        splines = np.where(ends > 0.5 * fabric.centrelines[yarn].length, own.spline.size - 1, 0)
        if len(ends) < len(arcs):
            first = own.spline.first[spans[yarn].gripped()]
            splines = np.append(splines, first[:, None] + np.arange(own.spline.degree + 1))
        every = np.repeat(np.arange(own.spline.size), np.diff(own.first_node))
        nodes.append(space.first_node[yarn] + np.flatnonzero(np.isin(every, splines)))
    return np.concatenate(nodes)


# First guesses for large knits in contact: the displacements of beams in contact under the same load.
#
# The loops of a large knit are slack and close one after the other, at loads that neither the tangent nor the path so
# far predicts. Beams predict the closed loops for a tenth of the price. Newton's method of the spline yarns then
# corrects sections and contacts, whatever the size of the knit. No result depends on a guess.

# Cells from which beams save more than they cost: a fifth of the time at 10 x 10, a third at 16 x 16, nothing at 6 x 6
LARGE = 64

# The beams: the settings that come nearest to solid yarns; a guess need not be balanced to the last digit
BEAMS = {
    "fidelity": "beam",
    "mesh.beam_size": 5 / 9,
    "mesh.section_law": "curved",
    "beam.section": "hertz",
    "beam.tie": "patch",
    "solver.residual_tolerance": 1e-3,
    "solver.correction_tolerance": 1e-3,
}


class BeamGuide:
    """The change of the displacements of spline yarns between two load factors, predicted by beams.

    The first call simulates all increments of the beams, and keeps the motion of their stations.
    """

    def __init__(
        self,
        beams: Callable[[], Any],  # the same problem of beams
        fabric: Fabric,
        space: Space,
        retained: Ints,  # int (n,), nodes that are unknowns
        report: ReportProgress = silent,
    ) -> None:
        self._beams, self._fabric, self._space, self._retained = beams, fabric, space, retained
        self._report = report
        self._loads: list[float] = []

    def __call__(self, load: float, target: float) -> Floats | None:
        """Return the change (size,) [m] from one load factor to another; None where the beams ended before."""
        if not self._loads:
            self._simulate(load)
        if target > self._loads[-1]:
            return None
        return self._displacement(target) - self._displacement(load)

    def _simulate(self, begun: float) -> None:
        """Follow the load path with beams, as far as possible; spline yarns have reached the load factor `begun`."""
        self._loads = [0.0]
        loads = []
        ways = []
        try:
            problem = self._beams()
            for increment in problem.increments(self._report):
                places = problem.model.contact.places(increment.state)
                moved = places.position - problem.stations.position
                self._report(begun, f"beams predict: load factor {increment.load:.3g}")
                loads.append(increment.load)
                ways.append(np.concatenate([moved, log(places.rotation)], axis=1))
        except KnitstudyError as error:
            # Beyond the range in which beams converge or are verified, spline yarns go on without them.
            logger.info(
                "beams give no guesses beyond load factor %.4g: %s", loads[-1] if loads else 0.0, error
            )
        if loads:
            self.follow(problem.stations, loads, ways)
        logger.info("beams give first guesses up to load factor %.4g", self._loads[-1])

    def follow(self, stations: Stations, loads: list[float], ways: list[Floats]) -> None:
        """Take the ways (S, 6) of stations, displacements [m] and rotation vectors, at rising load factors."""
        self._of_yarn = [np.flatnonzero(stations.yarn == yarn) for yarn in range(len(self._space.yarns))]
        self._arc_length = stations.arc_length
        self._loads = loads
        self._ways = ways
        # An increment asks for those of the one before again.
        self._displacement = lru_cache(maxsize=3)(self._fitted)

    def _fitted(self, load: float) -> Floats:
        """Return the displacements (size,) [m] of all unknowns at a load factor."""
        way = self._way(load)
        moved = [self._moved(yarn, way[here]) for yarn, here in enumerate(self._of_yarn)]
        return np.concatenate(moved)[self._retained].ravel()

    def _way(self, load: float) -> Floats:
        """Return displacements and rotations (S, 6) at a load factor between two increments of the beams."""
        after = int(np.clip(np.searchsorted(self._loads, load), 1, len(self._loads) - 1))
        low, high = self._loads[after - 1 : after + 1]
        share = (load - low) / (high - low)
        return (1 - share) * self._ways[after - 1] + share * self._ways[after]

    def _moved(self, yarn: int, way: Floats) -> Floats:
        """Return the displacements (m, 3) [m] of the nodes of one yarn, whose sections move by `way` (k, 6)."""
        own, curve = self._space.yarns[yarn], self._fabric.centrelines[yarn]
        s = fitted_places(own)
        shift, turn = np.split(CubicSpline(self._arc_length[self._of_yarn[yarn]], way)(s), 2, axis=1)
        directors = rotation_minimising(curve.position(s), curve.tangent(s))[:, :2]
        turned = directors @ exp(turn).swapaxes(1, 2) - directors
        return own.fitted(s, shift, turned, self._fabric.radius)


def guide_of(
    scene: SplineScene, fabric: Fabric, space: Space, retained: Ints, report: ReportProgress = silent
) -> BeamGuide | None:
    """Return the guide of a scene; None where beams save no time, or cannot model its yarn or interaction."""
    if not isinstance(scene, SplineYarns) or scene.pattern.loops * scene.pattern.rows < LARGE:
        return None
    try:
        beams = partial(MODELS.find("beam").build, scene.vary(BEAMS), fabric)
        return BeamGuide(beams, fabric, space, retained, report)
    except ConfigurationError as error:
        logger.info("no first guesses by beams: %s", error)
        return None
