"""Beams in contact: yarns as chains of beams, tied where the scene ties them and in contact at all other crossings.

Ties are rigid: two sections that are joined by arms move and turn as one, as in the tied 3D network. Pinned ties hold
the same two points together and leave the rotation free; ties "patch" are as compliant as a small tied patch of two
solid yarns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.contacts.facets import tied_crossings
from knitstudy.errors import ConvergenceError
from knitstudy.geometry.crossings import Crossings
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.gates import require_sound
from knitstudy.loading.history import Meter, Recorder, load_path
from knitstudy.loading.solve import Problem
from knitstudy.mechanics.beam_approach import A, B, Curves, Pairs, approach
from knitstudy.mechanics.beam_contact import (
    BeamContact,
    CrossingPairs,
    Places,
    Power,
    TouchingBeams,
    TouchingState,
    hertz,
)
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.increment import Increment, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.models.joints import JointPoints, Joints, contacts_of_crossings, patch_stiffness
from knitstudy.models.network import Network, grips, tension
from knitstudy.models.network_3d import spatial_network
from knitstudy.study.scene import Scene


def piece_bounds(crossings: Crossings, length: np.ndarray) -> np.ndarray:
    """Return the piece (K, 2, 2) of either yarn that belongs to a crossing: half way to the next along the yarn [m]."""
    yarn, s = crossings.yarn.ravel(), crossings.arc_length.ravel()
    order = np.lexsort((s, yarn))
    middle = 0.5 * (s[order][1:] + s[order][:-1])
    same = yarn[order][1:] == yarn[order][:-1]
    low = np.concatenate([[0.0], np.where(same, middle, 0.0)])
    high = np.concatenate([np.where(same, middle, length[yarn[order][:-1]]), [length[yarn[order][-1]]]])
    bounds = np.empty((len(s), 2))
    bounds[order] = np.stack([low, high], axis=1)
    return bounds.reshape(-1, 2, 2)


def point_pairs(crossings: Crossings, chosen: np.ndarray, length: np.ndarray) -> CrossingPairs:
    """Return one pair of closest points for each of the crossings `chosen` (k,); yarns are `length` (Y,) long [m]."""
    pairs = Pairs(crossings.yarn[chosen], piece_bounds(crossings, length)[chosen])
    return CrossingPairs(pairs, crossings.arc_length[chosen], chosen)


MARGIN = 0.3
"""Gap up to which pieces count as near, over the radius."""


@dataclass(frozen=True, eq=False)
class Gaps:
    """Smallest gaps of yarns in one configuration."""

    crossing: np.ndarray  # (K,) of the two pieces that belong to a crossing [m]; inf where they are not near
    elsewhere: float  # of all other pieces [m]; inf if none are near
    yarn: tuple[int, int]  # the yarns of that gap
    arc_length: tuple[float, float]  # where it is on them [m]

    @property
    def smallest(self) -> float:
        """Smallest of all [m]."""
        return min(self.elsewhere, float(self.crossing.min(initial=np.inf)))


class Neighbours:
    """Search for pieces of yarn that are near each other, a yarn with itself included.

    Parameters
    ----------
    curves : Curves
    yarn : ndarray of int, shape (S,)
        Of the stations.
    crossings : Crossings
    radius : float
        [m]
    """

    def __init__(self, curves: Curves, yarn: np.ndarray, crossings: Crossings, radius: float) -> None:
        self.curves, self.yarn, self.radius = curves, np.asarray(yarn), radius
        self.count = len(crossings.row)
        bounds = piece_bounds(crossings, curves.length)
        self._starts = [
            _Starts.of(bounds[here, side, 0], here)
            for number in range(len(curves.length))
            for here, side in [np.nonzero(crossings.yarn == number)]
        ]
        self._step = float(np.diff(curves.arc_length).max())

    def gaps(self, position: np.ndarray) -> Gaps:
        """Return the gaps where the stations are at positions (S, 3) [m]."""
        reach = (2 + MARGIN) * self.radius + self._step
        one, other = cKDTree(position).query_pairs(reach, output_type="ndarray").T
        s = self.curves.arc_length
        near = np.stack([one, other], axis=1)
        near = near[self._may_meet(self.yarn[near], s[near]) & self._nearest(near, position)]
        crossing = np.full(self.count, np.inf)
        if not len(near):
            return Gaps(crossing, np.inf, (-1, -1), (np.nan, np.nan))
        start = s[near]
        low = np.maximum(start - self._step, 0.0)
        high = np.minimum(start + self._step, self.curves.length[self.yarn[near]])
        pairs = Pairs(self.yarn[near], np.stack([low, high], axis=-1))
        here = approach(self.curves, position, pairs, start)
        gap = np.where(self._may_meet(pairs.yarn, here.s), here.distance - 2 * self.radius, np.inf)
        known = self._crossing_of(pairs.yarn, here.s)
        np.minimum.at(crossing, known[known >= 0], gap[known >= 0])
        beyond = np.where(known < 0, gap, np.inf)
        k = int(np.argmin(beyond))
        return Gaps(crossing, float(beyond[k]), tuple(map(int, pairs.yarn[k])), tuple(map(float, here.s[k])))

    def _nearest(self, near: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Return which pairs of stations (k, 2) are no farther apart than those beside them along their yarns."""
        distance = np.linalg.norm(position[near[:, A]] - position[near[:, B]], axis=1)
        nearest = np.ones(len(near), dtype=bool)
        low, high = self.curves.first[self.yarn[near]], self.curves.first[self.yarn[near] + 1] - 1
        for step in product((-1, 0, 1), repeat=2):
            beside = np.clip(near + np.array(step), low, high)
            nearest &= distance <= np.linalg.norm(position[beside[:, A]] - position[beside[:, B]], axis=1)
        return nearest

    def _may_meet(self, yarn: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return whether points (k, 2) may touch: only a yarn bent to less than its radius could beside itself."""
        return (yarn[:, A] != yarn[:, B]) | (np.abs(s[:, A] - s[:, B]) > np.pi * self.radius)

    def _crossing_of(self, yarn: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return the crossing (k,) that both points belong to, or -1."""
        crossing = np.full(yarn.shape, -1)
        for number, starts in enumerate(self._starts):
            crossing[yarn == number] = starts.crossing_at(s[yarn == number])
        return np.where(crossing[:, A] == crossing[:, B], crossing[:, A], -1)


@dataclass(frozen=True, eq=False)
class _Starts:
    """Where the pieces of one yarn begin, ascending, and the crossings that they belong to."""

    arc_length: np.ndarray
    crossing: np.ndarray

    @classmethod
    def of(cls, arc_length: np.ndarray, crossing: np.ndarray) -> _Starts:
        order = np.argsort(arc_length)
        # A yarn without crossings has no pieces.
        return cls(np.append(-np.inf, arc_length[order]), np.append(-1, crossing[order]))

    def crossing_at(self, s: np.ndarray) -> np.ndarray:
        return self.crossing[np.searchsorted(self.arc_length, s, side="right") - 1]


@dataclass(frozen=True, eq=False)
class BeamKnit:
    """A knit of beams in contact."""

    network: Network
    model: TouchingBeams
    tied: np.ndarray  # (K,) crossings that are joined at their closest points
    neighbours: Neighbours


def beam_knit(scene: Scene, fabric: Fabric) -> BeamKnit:
    """Return the beams of a scene.

    Raises ConfigurationError if ``mesh.beam_size`` is not positive; DataFileError if ties are compliant and no
    compliance is known for their size; GeometryError if two ties of a yarn coincide, or a yarn has too few nodes for a
    smooth centreline.
    """
    crossings = fabric.crossings
    tied = tied_crossings(scene, crossings)
    points = JointPoints.at_crossings(crossings, tied)
    joints = Joints.all_tied(len(points.yarn))
    if scene.beam.tie == "pinned":
        # As stiff as contact that sticks, and never open.
        joints = joints.pinned(_penalty(scene))
    elif scene.beam.tie == "patch" and tied.any():
        discs = contacts_of_crossings(fabric, scene.tie.radius).isel(crossing=tied)
        joints = joints.pinned(patch_stiffness(fabric, points, discs, scene.yarn))
    stops = fabric.grip_ends(scene.load.direction)
    network = spatial_network(fabric, points, scene.mesh.beam_size, joints=joints, stops=stops)
    beams = network.model(scene.yarn, scene.mesh.section_law)
    stations = network.stations
    curves = Curves(stations.yarn, stations.arc_length)
    model = TouchingBeams(
        beams, network.station_node, network.station_offset, beam_contact(scene, fabric, curves, ~tied)
    )
    return BeamKnit(network, model, tied, Neighbours(curves, stations.yarn, crossings, scene.yarn.radius))


def beam_contact(scene: Scene, fabric: Fabric, curves: Curves, touching: np.ndarray) -> BeamContact:
    """Return the contact of a scene at the crossings that `touching` (K,) says.

    The stiffness against elastic slip is ``beam.stiffness`` for both laws: Hertz's approach is normal.
    """
    yarn = scene.yarn
    pairs = point_pairs(fabric.crossings, np.flatnonzero(touching), curves.length)
    penalty = _penalty(scene)
    law = Power(penalty)
    if scene.beam.section == "hertz":
        law = hertz(yarn.youngs_modulus, yarn.poisson_ratio, yarn.radius)
    return BeamContact(curves, pairs, yarn.radius, law, penalty, scene.kind.interaction.friction(scene))


def _penalty(scene: Scene) -> float:
    """Return ``beam.stiffness`` in N/m."""
    return scene.beam.stiffness * scene.yarn.youngs_modulus * scene.yarn.radius


class CrossingRecord:
    """Forces, displacements, gaps and slip at crossings.

    Parameters
    ----------
    beams : BeamKnit
    crossings : Crossings
    scene : Scene
    """

    def __init__(self, beams: BeamKnit, crossings: Crossings, scene: Scene) -> None:
        self._model, self._tied, self._radius = beams.model, beams.tied, scene.yarn.radius
        self._count = len(crossings.row)
        network, yarn = beams.network, scene.yarn
        stations = network.stations
        first = np.flatnonzero(stations.yarn[1:] == stations.yarn[:-1])
        # Yarns without ties: the internal force at a tied station equals the force of the tie.
        self._apart = BeamModel(
            stations.position,
            np.column_stack([first, first + 1]),
            network.section(yarn, scene.mesh.section_law),
            yarn.radius,
        )
        curves = self._model.contact.curves
        self._lower = self._nearest(stations.yarn, stations.arc_length, crossings)
        self._stencil = [curves.stencil(crossings.yarn[:, i], crossings.arc_length[:, i]) for i in (0, 1)]
        middle = crossings.point.mean(axis=1)
        self._arm = middle[:, None] - np.stack(
            [each.of(each.value, stations.position) for each in self._stencil], axis=1
        )
        self._rest = middle

    def _nearest(self, yarn: np.ndarray, arc_length: np.ndarray, crossings: Crossings) -> np.ndarray:
        """Stations (K,) of the lower row's yarn at its tied crossings."""
        station = np.zeros(self._count, dtype=int)
        for k in np.flatnonzero(self._tied):
            distance = np.where(
                yarn == crossings.yarn[k, 0], np.abs(arc_length - crossings.arc_length[k, 0]), np.inf
            )
            station[k] = int(np.argmin(distance))
        return station

    def columns(self, state: TouchingState) -> dict[str, np.ndarray]:
        """Return the columns of a converged state for the history.

        Slip has been committed with the state; forces and gaps are those of its positions.
        """
        contact, places = self._model.contact, self._model.places(state.beams)
        points = self._model.points(state)
        slip = np.full(self._count, np.nan)
        slip[~self._tied] = state.history.slip
        force = contact.crossing_force(points, self._count)
        apart = BeamState(places.position, places.rotation)
        station_force = self._apart.respond(apart, stiffness=False).force.reshape(-1, 6)[:, :3]
        force[self._tied] = station_force[self._lower[self._tied]]
        gap = contact.crossing_gap(points, self._count)
        gap[self._tied] = self._gap_of_points(places)[self._tied]
        return {
            "crossing_force": force,
            "crossing_displacement": self._displacement(places),
            "crossing_gap": gap,
            "crossing_slip": slip,
        }

    def _gap_of_points(self, places: Places) -> np.ndarray:
        """Gap (K,) of the yarns at the points of their centrelines that were closest at rest [m]."""
        one, other = (each.of(each.value, places.position) for each in self._stencil)
        return np.linalg.norm(other - one, axis=1) - 2 * self._radius

    def _displacement(self, places: Places) -> np.ndarray:
        """Displacement (K, 2, 3) of the points of both surfaces that faced each other at rest [m]."""
        sides = [
            each.of(each.value, places.position)
            + np.einsum("kp,kpij,kj->ki", each.value, places.rotation[each.stations], self._arm[:, side])
            for side, each in enumerate(self._stencil)
        ]
        return np.stack(sides, axis=1) - self._rest[:, None]


UNSEEN = 0.02
"""Penetration over the radius, of yarns between which no contact acts, beyond which a state is refused.

Beside pins in wale tension it reaches 1 %. Solid yarns under the force of such a crossing, 10 to 30 N, approach each
other by 5 to 10 % (Hertz): a second contact would carry little.
"""


def build(scene: Scene, fabric: Fabric) -> Problem:
    """Return a scene with beams in contact as a problem.

    Raises
    ------
    ConfigurationError
        If ``mesh.beam_size`` is not positive.
    DataFileError
        If ties yield and no compliance is known for their size.
    GeometryError
        If no beams can be made of the yarns.
    """
    meter = Meter()
    beams = beam_knit(scene, fabric)
    network, model = beams.network, beams.model
    motion = load_path(scene, fabric)
    ends = grips(network, fabric, scene.load.direction)
    observer = BeamObserver(beams, fabric, scene)
    law = model.contact
    return Problem(
        scene=scene,
        model=model,
        prescribed=tension(ends, motion, scene.load.lateral),
        solver=LU(),
        # Where contact begins, a parabola through earlier increments overshoots far into the other yarn.
        settings=replace(Settings.of(scene.solver), predictor=1),
        motion=motion,
        driven=6 * ends.driven[:, None] + np.arange(3),
        stations=network.stations,
        observers=(observer,),
        checks=(observer.require_seen, partial(require_sound, scene, None)),
        constants={"crossing_tied": beams.tied.astype(np.int8)},
        attributes={
            "dof": model.block * network.beam_nodes,
            "elements": len(network.ends),
            "beam_section": scene.beam.section,
            "beam_ties": scene.beam.tie,
            "contact_coefficient": law.law.coefficient,
            "contact_exponent": law.law.exponent,
            "stick_stiffness": law.friction.tangential,
            "friction": law.friction.friction,
            "contact_points": len(law.crossing.start),
        },
        meter=meter,
    )


class BeamObserver:
    """Reports the motion of the stations, crossings, and gaps of yarns that are near each other."""

    def __init__(self, beams: BeamKnit, fabric: Fabric, scene: Scene) -> None:
        self._beams, self._radius = beams, scene.yarn.radius
        self._crossings = CrossingRecord(beams, fabric.crossings, scene)
        self._gaps: Gaps | None = None

    def record(self, increment: Increment) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return columns of the history."""
        state, model, network = increment.state, self._beams.model, self._beams.network
        self._gaps = self._beams.neighbours.gaps(model.places(state.beams).position)
        smallest = self._gaps.smallest
        columns = {
            "centreline_displacement": network.station_displacement(model.beams, state.beams),
            "smallest_gap": smallest if np.isfinite(smallest) else np.nan,
            **self._crossings.columns(state),
        }
        return columns, {}

    def require_seen(self, increment: Increment, recorder: Recorder) -> None:
        """Refuse the increment that was recorded last if yarns penetrate each other where no contact acts.

        Raises ConvergenceError as the function `require_seen`.
        """
        contact_gap = recorder.columns["crossing_gap"][-1]
        require_seen(self._beams, self._gaps, contact_gap, increment, self._radius)


def require_seen(
    beams: BeamKnit, gaps: Gaps, contact_gap: np.ndarray, increment: Increment, radius: float
) -> None:
    """Refuse a state in which yarns penetrate each other where no contact acts.

    Raises
    ------
    ConvergenceError
        If pieces of yarn away from crossings, or deeper than the contact or the tie at a crossing knows, overlap by
        more than `UNSEEN` radii. A tie that yields lets yarns approach each other as much as their patches are
        indented.
    """
    known = np.minimum(np.where(np.isfinite(contact_gap), contact_gap, 0.0), 0.0)  # (K,)
    unseen = gaps.crossing - known
    if gaps.elsewhere < -UNSEEN * radius:
        (one, other), (s, t) = gaps.yarn, gaps.arc_length
        where = f"yarns {one} and {other} at arc lengths {s:.4g} and {t:.4g} m, which is no crossing,"
        depth = -gaps.elsewhere
    elif unseen.min(initial=np.inf) < -UNSEEN * radius:
        k = int(np.argmin(unseen))
        kind = "tied" if beams.tied[k] else "touching"
        where, depth = f"the yarns of crossing {k}, beside the {kind} points,", -unseen[k]
    else:
        return
    raise ConvergenceError(
        f"increment {increment.index}: {where} penetrate each other by {depth:.3g} m, unseen by the beams' contact; "
        f"allowed is {UNSEEN * radius:.3g} m. Use a smaller load.strain"
    )
