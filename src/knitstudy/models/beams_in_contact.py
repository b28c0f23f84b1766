"""Beams in contact: yarns as chains of beams, tied where the scene ties them and in contact at all other crossings.

Ties are rigid: two sections that are joined by arms move and turn as one, as in the tied 3D network. Pinned ties hold
the same two points together and leave the rotation free, as a small tied patch of two solid yarns nearly does; ties
"patch" are compliant as well, as much as such a patch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from knitstudy.contacts.facets import tied_crossings
from knitstudy.errors import ConvergenceError
from knitstudy.geometry.crossings import Crossings
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.gates import require_sound
from knitstudy.loading.history import Meter, Recorder
from knitstudy.loading.load_path import load_path
from knitstudy.loading.solve import Problem
from knitstudy.mechanics.beam_contact.approach import Curves
from knitstudy.mechanics.beam_contact.contact import (
    BeamContact,
    Places,
    Power,
    TouchingBeams,
    TouchingState,
    hertz,
)
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.increment import Increment, Settings
from knitstudy.mechanics.linear.direct import LU
from knitstudy.models.beam_pairs import Gaps, Neighbours, point_pairs
from knitstudy.models.joints import JointPoints, Joints, contacts_of_crossings, patch_stiffness
from knitstudy.models.network import Network, grips, tension
from knitstudy.models.network_3d import spatial_network
from knitstudy.study.scene import Scene


@dataclass(frozen=True, eq=False)
class BeamKnit:
    """A knit of beams in contact.

    Attributes
    ----------
    network : Network
    model : TouchingBeams
    tied : ndarray of bool, shape (K,)
        Crossings that are joined at their closest points.
    neighbours : Neighbours
    """

    network: Network
    model: TouchingBeams
    tied: np.ndarray
    neighbours: Neighbours


def beam_knit(scene: Scene, fabric: Fabric) -> BeamKnit:
    """Return the beams of a scene.

    Raises
    ------
    ConfigurationError
        If ``mesh.beam_size`` is not positive.
    DataFileError
        If ties are compliant and no compliance is known for their size.
    GeometryError
        If two ties of a yarn coincide, or a yarn has too few nodes for a smooth centreline.
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

        Raises
        ------
        ConvergenceError
            As the function `require_seen`.
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
