"""A network of beams that stands for a fabric: grips, load and history of all models of beams."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.gates import require_sound
from knitstudy.loading.history import Motion, Stations, load_path
from knitstudy.loading.solve import Check, Problem, Reported, settings_of
from knitstudy.mechanics.beam import LinearSprings, Section, SectionLaw
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.curved_rod import CurvedSection
from knitstudy.mechanics.increment import Increment, PrescribedDisplacement
from knitstudy.mesh.mesher import Grips
from knitstudy.models.joints import Joints
from knitstudy.study.problem_sections import Yarn
from knitstudy.study.scene import Scene

SPINS = range(3, 6)  # components of the rotation among the unknowns of a node


@dataclass(frozen=True)
class Network:
    """Yarns as chains of straight beam elements, joined where they touch."""

    nodes: np.ndarray  # (N, 3) nodes that carry unknowns [m]
    ends: np.ndarray  # (E, 2) node at either end of every element
    offsets: np.ndarray  # (E, 2, 3) from that node to the end of the element [m]
    arms_turn: bool  # whether offsets are rigid arms; see `BeamModel`
    yarns_side_by_side: np.ndarray  # (E,) yarns that an element stands for
    stations: Stations  # the points of all yarns, one yarn after the other, in order of arc length
    station_node: np.ndarray  # (S,) node that carries a station
    station_offset: np.ndarray  # (S, 3) from that node to the station [m]
    # Nodes of the beams before joints are eliminated; the paper counts degrees of freedom as 6 times this
    beam_nodes: int
    springs: LinearSprings = field(default_factory=LinearSprings.none)  # springs between yarns
    joints: Joints | None = None  # of the crossings; None where crossings are nodes of the network
    # (E, 3) mean curvature vector t x dt/ds of the undeformed yarn over every element [1/m]; None where
    # elements do not follow a yarn
    curvature: np.ndarray | None = None
    # Of its rows, which strains along the wales refer to; None where it is that of the knit [m]
    height: float | None = None

    def section(self, yarn: Yarn, law: str) -> SectionLaw:
        """Return the section of the elements; law "straight", or "curved" where elements follow a yarn."""
        if law == "curved" and self.curvature is not None:
            return CurvedSection(yarn.radius, yarn.youngs_modulus, yarn.poisson_ratio, self.curvature)
        return Section.circular(
            yarn.diameter, yarn.youngs_modulus, yarn.poisson_ratio, self.yarns_side_by_side
        )

    def model(self, yarn: Yarn, law: str) -> BeamModel:
        """Return the network as beams of circular yarn, with the law of `section`."""
        section = self.section(yarn, law)
        return BeamModel(
            self.nodes, self.ends, section, yarn.radius, self.offsets, self.arms_turn, self.springs
        )

    def station_displacement(self, model: BeamModel, state: BeamState) -> np.ndarray:
        """Return the displacement (S, 3) of the stations [m]."""
        return model.carried(state, self.station_node, self.station_offset) - self.stations.position


def grips(network: Network, fabric: Fabric, direction: str) -> Grips:
    """Return the nodes of all stations that are gripped under a direction of the load."""
    stations = network.stations
    parts = (grip.holds(stations.yarn, stations.arc_length) for grip in fabric.grips[direction])
    return Grips(*(np.unique(network.station_node[part]) for part in parts))


def tension(grips: Grips, motion: Motion, lateral: str) -> PrescribedDisplacement:
    """Return the boundary conditions of a pull.

    The held side stays where it is. The driven side moves along the load as `motion` says and, with `lateral` "fixed",
    in no other way. Where all points of a side move along the load alike it cannot tilt either: with `lateral`
    "free" it may move across the load and spin about its direction, and no more.
    """
    axis = motion.axis
    given = [axis, *(i for i in range(3) if i != axis), *SPINS]
    if lateral == "free":
        given = [axis, *(spin for spin in SPINS if spin != 3 + axis)]
    driven = 6 * grips.driven[:, None] + given
    clamped = (6 * grips.held[:, None] + np.arange(6)).ravel()
    value = np.zeros((len(motion.displacement), len(clamped) + driven.size))
    value[:, len(clamped) :: len(given)] = motion.displacement[:, [axis]]
    fixed = np.concatenate([clamped, driven.ravel()])
    return PrescribedDisplacement(fixed, value, motion.corners, motion.stops)


def require_named(scene: Scene, key: str, what: str, given: xr.Dataset | None) -> None:
    """Refuse results of another simulation unless a key of the scene names it, and the other way round."""
    wanted = scene.value(key)
    if (wanted is None) != (given is None):
        raise ConfigurationError(
            f"{key} of scene {scene.name} is {wanted or 'empty'}, and {what} are {'not ' if given is None else ''}"
            "given: they must be given where it names one, and only there"
        )


def problem(scene: Scene, fabric: Fabric, network: Network) -> Problem:
    """Return joined beams with the load of a scene."""
    model = network.model(scene.yarn, scene.value("mesh.section_law") or "straight")
    joints = network.joints
    return loaded(
        scene,
        fabric,
        network,
        model=model,
        observer=NetworkObserver(network, model),
        settings=settings_of(scene, touches=False),
        constants={"joint_stiffness": joints.stiffness} if joints else {},
        attributes={"open_crossings": int(joints.open.sum())} if joints else {},
    )


def loaded(
    scene: Scene,
    fabric: Fabric,
    network: Network,
    attributes: dict[str, Any],
    checks: tuple[Check, ...] = (),
    first: int = 0,
    stations: Stations | None = None,
    **given: Any,
) -> Problem:
    """Return a network with the load of a scene; `first` is the first of its unknowns among those of the model."""
    motion = _motion(network, scene, fabric)
    ends = grips(network, fabric, scene.load.direction)
    prescribed = tension(ends, motion, scene.load.lateral)
    return Problem(
        scene=scene,
        prescribed=replace(prescribed, fixed=first + prescribed.fixed),
        motion=motion,
        driven=first + 6 * ends.driven[:, None] + np.arange(3),
        stations=stations or network.stations,
        checks=(*checks, partial(require_sound, scene, None)),
        attributes={"dof": 6 * network.beam_nodes, "elements": len(network.ends)} | attributes,
        **given,
    )


def _motion(network: Network, scene: Scene, fabric: Fabric) -> Motion:
    """Return how the grips move: strains refer to the height of the network, where it is not that of the fabric."""
    motion = load_path(scene, fabric)
    if scene.load.direction == "course" or network.height is None:
        return motion
    scale = network.height / fabric.height
    return replace(motion, displacement=scale * motion.displacement, length=scale * motion.length)


@dataclass(frozen=True, eq=False)
class NetworkObserver:
    """Reports the motion of the stations, and the couples that joints leave without balance.

    Their magnitudes are summed as well: on a symmetric knit couples cancel.
    """

    network: Network
    model: BeamModel

    def record(self, increment: Increment) -> Reported:
        """Return columns of the history."""
        couples = self.model.couples(increment.state)
        columns = {
            "centreline_displacement": self.network.station_displacement(self.model, increment.state),
            "joint_couple": couples.sum(axis=0),
            "joint_couple_magnitude": np.linalg.norm(couples, axis=1).sum(),
        }
        return columns, {}
