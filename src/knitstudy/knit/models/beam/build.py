"""Beams in contact: yarns as chains of beams, tied where the scene ties them and in contact wherever they meet.

Ties are rigid: two sections that are joined by arms move and turn as one, as in the tied 3D network. Pinned ties hold
the same two points together and leave the rotation free; ties "patch" are as compliant as a small tied patch of two
solid yarns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import xarray as xr

from knitstudy.errors import GeometryError
from knitstudy.knit.geometry.crossings import Crossings, tied_crossings
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.loading.history import Recorder
from knitstudy.knit.loading.solve import Problem, Reported, settings_of
from knitstudy.knit.models.beam import Beams, CellOfBeams
from knitstudy.knit.models.beam import cell as endless_beams
from knitstudy.knit.models.beam.contact import (
    STRIDE,
    YarnContact,
    contact_of,
    nearest_crossing,
    require_verified_contact,
)
from knitstudy.knit.scene.alternatives import RELAXED
from knitstudy.knit.yarns.joints import CrossingJoints, JointPoints, contacts_of_crossings, patch_stiffness
from knitstudy.knit.yarns.network import Network, loaded, spatial_network
from knitstudy.mechanics.beams.beam import BeamState
from knitstudy.mechanics.beams.beam_contact import NO_LATTICE, BeamContact
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.laws import RIGID
from knitstudy.mechanics.core.arrays import Bools, Floats
from knitstudy.mechanics.core.increment import Increment, PrescribedDisplacement

# Stiffness of springs that hold the even stretch, over that of a typical unknown: that of bending waves of some hundred
# elements, a few loops
HOLD = 1e-6


@dataclass(eq=False)
class BeamKnit:
    """A knit of beams in contact, which reports stations and crossings."""

    network: Network
    model: BeamModel
    contact: BeamContact
    law: YarnContact
    tied: Bools  # (K,) crossings that are joined
    # Yarns without ties: the internal force at a tied station equals the force of the tie and of contact there
    apart: BeamModel
    crossings: Crossings

    def __post_init__(self) -> None:
        stations = self.network.stations
        crossings = self.crossings
        lower = crossings[self.tied]
        self._lower = stations.nearest(lower.yarn[:, 0], lower.arc_length[:, 0])
        at = stations.nearest(crossings.yarn, crossings.arc_length)  # (K, 2)
        self._station, self._rest = at, crossings.point.mean(axis=1)[:, None]
        self._arm = self._rest - stations.position[at]

    def record(self, increment: Increment) -> Reported:
        """Return columns of the history."""
        state = increment.state
        nearest = float(np.nanmin(state.contact.gap, initial=np.inf))
        columns = {
            "centreline_displacement": self.network.station_displacement(self.model, state),
            "smallest_gap": nearest if np.isfinite(nearest) else np.nan,
            **self.at_crossings(state),
        }
        return columns, {}

    def at_crossings(self, state: BeamState) -> dict[str, Floats]:
        """Return forces, displacements, gaps and slip at crossings, as columns of the history.

        All that is of contact has been committed with the state.
        """
        contact, tied, past = self.contact, self.tied, state.contact
        assert past is not None  # of a model in contact
        places = contact.places(state)
        force = past.force.copy()
        station_force = self.apart.respond(places, stiffness=False).force.reshape(-1, 6)[:, :3]
        force[tied] += (station_force + past.on_stations)[self._lower]
        # Of the points of both sections that met at rest
        moved = places.position[self._station]
        moved = moved + np.einsum("kaij,kaj->kai", places.rotation[self._station], self._arm)
        return {
            "crossing_force": force,
            "crossing_displacement": moved - self._rest,
            "crossing_gap": past.gap[:-1],
            "crossing_slip": np.where(tied, np.nan, past.slip),
        }

    def require_verified_contact(self, limit: float, increment: Increment, recorder: Recorder) -> None:
        """Refuse a state beyond the verified law of contact; raises as `require_verified_law`."""
        contact = self.contact
        internal = increment.response.energy["internal"]
        points = contact.at_points(increment.state)
        require_verified_contact(limit, increment, contact.line, points, NO_LATTICE, internal)


def beam_knit(scene: Beams, fabric: Fabric) -> BeamKnit:
    """Return the beams of a scene; errors as of `build`."""
    crossings = fabric.crossings
    yarn = scene.yarn
    beam = scene.beam
    law = scene.mesh.section_law
    contact = contact_of(scene)
    tied = tied_crossings(crossings, True, scene.contact.tied_edges, scene.load.direction)
    points = JointPoints.at_crossings(crossings, tied)
    joints = CrossingJoints.all_tied(len(points.yarn))
    if beam.tie == "pinned":
        # As stiff as contact that sticks, and never open.
        joints = joints.pinned(RIGID * yarn.youngs_modulus * yarn.radius)
    elif beam.tie == "patch" and tied.any():
        discs = contacts_of_crossings(fabric, scene.tie.radius).isel(crossing=tied)
        joints = joints.pinned(patch_stiffness(fabric, points, discs, yarn))
    stops = fabric.grip_ends(scene.load.direction)
    beams = spatial_network(fabric, points, scene.mesh.beam_size, joints=joints, stops=stops)
    stations = beams.stations
    first = np.flatnonzero(stations.yarn[1:] == stations.yarn[:-1])
    # Contact loads the beams from half the way to a tie on.
    middle = 0.5 * (stations.arc_length[first] + stations.arc_length[first + 1])
    nearest, _ = nearest_crossing(stations.yarn[first], middle, crossings)
    beams = replace(beams, pressed=~np.append(tied, False)[nearest] * contact.pressed)
    reach = 2 * scene.tie.radius * yarn.radius
    line = contact.along(stations.yarn, stations.arc_length, tied=crossings[tied], reach=reach)
    carriers = beams.station_node, beams.station_offset
    touching = BeamContact(*line, *carriers, crossings.yarn, crossings.arc_length)
    elements = np.column_stack([first, first + 1])
    apart = BeamModel(stations.position, elements, beams.section(yarn, law), yarn.radius)
    return BeamKnit(beams, beams.model(yarn, law, touching), touching, contact, tied, apart, crossings)


def even_stretch(
    prescribed: PrescribedDisplacement, model: BeamModel, load: float, target: float
) -> Floats | None:
    """Return the first guess (size,) of the first increment, which ends at a load factor `target`; None for later ones.

    The knit as a whole is stretched evenly. Loops hang loose before they touch: the tangent at rest would take them
    through each other.
    """
    return prescribed.affine(model.nodes, model.block, target) if load == 0 else None


def build(scene: Beams | CellOfBeams, fabric: Fabric, rest: xr.Dataset | None = None) -> Problem:
    """Return a scene with beams in contact as a problem; a cell of an endless fabric may begin with a shape at rest.

    Raises DataFileError if ties yield and no compliance is known for their size; GeometryError if two ties of a yarn
    coincide, or a yarn has too few nodes for a smooth centreline.
    """
    if isinstance(scene, CellOfBeams):
        try:
            return endless_beams.build(scene, fabric, rest)
        except GeometryError as error:
            if scene.mesh.section_law != "curved":
                raise
            relaxed = f"{RELAXED} true takes them, and loops that find their shape at rest"
            raise GeometryError(
                f"scene {scene.name!r}: {error} (mesh.section_law straight): {relaxed}"
            ) from None
    beams = beam_knit(scene, fabric)
    line = beams.contact.line
    problem = loaded(
        scene,
        fabric,
        beams.network,
        model=beams.model,
        observer=beams,
        settings=replace(
            settings_of(scene.solver, touches=True, stride=STRIDE * scene.yarn.diameter), hold=HOLD
        ),
        checks=(partial(beams.require_verified_contact, scene.gates.point),),
        constants={"crossing_tied": beams.tied.astype(np.int8)},
        attributes={
            "beam_section": scene.beam.section,
            "beam_ties": scene.beam.tie,
            "contact_stick_share": beams.law.law.share,
            "contact_points": len(line.yarn),
            **beams.law.attributes(line.repulsion.onset),
        },
    )
    return replace(problem, guide=lambda report: partial(even_stretch, problem.prescribed, beams.model))
