"""The spatial network of beams."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from knitstudy.errors import ConfigurationError, GeometryError
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.history import Stations
from knitstudy.loading.load_path import Motion
from knitstudy.mechanics.beam import LinearSprings, Section, SectionLaw
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.curved_rod import CurvedSection
from knitstudy.mechanics.increment import PrescribedDisplacement
from knitstudy.mesh.mesher import Grips
from knitstudy.mesh.quality import require_memory
from knitstudy.models.joints import JointPoints, Joints
from knitstudy.study.problem_sections import Yarn

# ---- A network of beams that stands for a knit: what both reduced models give to the solver and the history


@dataclass(frozen=True)
class Network:
    """Yarns as chains of straight beam elements, joined where they touch.

    Attributes
    ----------
    nodes : ndarray, shape (N, 3)
        Nodes that carry unknowns [m].
    ends : ndarray of int, shape (E, 2)
        Node at either end of every element.
    offsets : ndarray, shape (E, 2, 3)
        From that node to the end of the element [m].
    arms_turn : bool
        Whether offsets are rigid arms; see `BeamModel`.
    yarns_side_by_side : ndarray, shape (E,)
        Yarns that an element stands for.
    stations : Stations
        The points of all yarns, one yarn after the other, in order of arc length.
    station_node : ndarray of int, shape (S,)
        Node that carries a station.
    station_offset : ndarray, shape (S, 3)
        From that node to the station [m].
    beam_nodes : int
        Nodes of the beams before joints are eliminated; the paper counts degrees of freedom as 6 times this.
    springs : LinearSprings
        Springs between yarns.
    joints : Joints or None
        What joins the yarns at each crossing; None where crossings are nodes of the network.
    curvature : ndarray, shape (E, 3), or None
        Mean curvature vector t x dt/ds of the undeformed yarn over every element [1/m]; None where elements do not
        follow a yarn.
    height : float or None
        Of its rows, which strains along the wales refer to; None where it is that of the knit [m].
    """

    nodes: np.ndarray
    ends: np.ndarray
    offsets: np.ndarray
    arms_turn: bool
    yarns_side_by_side: np.ndarray
    stations: Stations
    station_node: np.ndarray
    station_offset: np.ndarray
    beam_nodes: int
    springs: LinearSprings = field(default_factory=LinearSprings.none)
    joints: Joints | None = None
    curvature: np.ndarray | None = None
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

    def end_nodes(self, side: str) -> np.ndarray:
        """Return the nodes (Y,) at the "left" or "right" ends of the yarns."""
        yarn = self.stations.yarn
        last = np.flatnonzero(np.append(np.diff(yarn) != 0, True))
        return self.station_node[{"left": np.append(0, last[:-1] + 1), "right": last}[side]]

    def station_displacement(self, model: BeamModel, state: BeamState) -> np.ndarray:
        """Return the displacement (S, 3) of the stations [m]."""
        return model.carried(state, self.station_node, self.station_offset) - self.stations.position


# ---- Where a reduced model is held and driven, and how (section 2.3 of the paper)


SPINS = range(3, 6)


def grips(network: Network, knit: Fabric, direction: str) -> Grips:
    """Return the nodes of all stations that are gripped under a direction of the load."""
    stations = network.stations
    parts = (grip.holds(stations.yarn, stations.arc_length) for grip in knit.grips[direction])
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


# ---- Three-dimensional reduced model, Figs. 5 and 6: beams along the centrelines, joined at the points C
# The two points C of a tied crossing move as one. With joint "rigid" both hang on a node at the contact's centroid P
# by rigid arms. With joint "printed" their displacements and rotations are equal, u_T = 0 and u_R = 0 (Table 2): the
# forces that they exchange across their distance then leave a couple that no part of the model takes up; see
# `BeamModel.couples`.
#
# Where yarns touch without a tie they are two nodes with a spring between, and may turn against each other. With joint
# "rigid" it acts at P, at the ends of arms from both points C; with "printed" between the points C, and leaves a couple
# as well. Pinned joints are the same with stiff springs for ties (`Joints.pinned`).


JOINTS = ("rigid", "printed")

BYTES_A_NODE = 8_200
"""Of a simulation of beams; measured were 7.9 to 8.2 kB, from 0.5 to 0.02 mm."""


def spatial_network(
    knit: Fabric,
    contacts: JointPoints,
    size: float,
    joint: str = "rigid",
    joints: Joints | None = None,
    stops: Mapping[int, np.ndarray] | None = None,
) -> Network:
    """Return the network of a knit.

    Parameters
    ----------
    knit : Fabric
        Centrelines of the yarns.
    contacts : JointPoints
        Points C and P.
    size : float
        Wanted length of an element [m]; every piece between points C has the whole number of elements that
        comes nearest to it.
    joint : {"rigid", "printed"}
        See the module.
    joints : Joints, optional
        What joins the yarns at each crossing; all are tied if left out.
    stops : mapping of int to ndarray, optional
        Arc lengths [m] by yarn at which there has to be a node as well.

    Raises
    ------
    ConfigurationError
        If the joint is unknown or the size is not positive.
    MeshError
        If the network does not fit into memory.
    GeometryError
        If two contacts of a yarn share a point C, or one lies at a stop.
    """
    if joint not in JOINTS:
        raise ConfigurationError(f"rom.joint is {joint!r}: allowed are {', '.join(JOINTS)}")
    if not size > 0:
        raise ConfigurationError(f"mesh.beam_size is {size}: allowed is a positive length in m")
    nodes = sum(centreline.length for centreline in knit.centrelines) / size
    require_memory(nodes * BYTES_A_NODE, "mesh.beam_size", size, f"a network of {nodes:.2g} nodes", power=1)
    joints = joints or Joints.all_tied(len(contacts.yarn))
    stops = stops or {}
    pieces = [
        _divide(
            np.append(contacts.arc_length[contacts.yarn == number], stops.get(number, ())),
            centreline.length,
            size,
            number,
        )
        for number, centreline in enumerate(knit.centrelines)
    ]
    count = np.array([len(s) for s in pieces])
    yarn, arc_length = np.repeat(np.arange(len(count)), count), np.concatenate(pieces)
    position = np.concatenate([c.position(s) for c, s in zip(knit.centrelines, pieces, strict=True)])
    station = _stations_of(contacts, yarn, arc_length)
    node, nodes = _tie(position, station[joints.tied], contacts.centroid[joints.tied])
    offset = position - nodes[node]
    first = np.flatnonzero(yarn[1:] == yarn[:-1])
    elements = np.column_stack([first, first + 1])  # by station
    sprung = joints.sprung
    arms = (contacts.centroid[:, None] - contacts.point)[sprung] * (joint == "rigid")
    return Network(
        nodes=nodes,
        ends=node[elements],
        offsets=offset[elements],
        arms_turn=joint == "rigid",
        yarns_side_by_side=np.ones(len(elements)),
        stations=Stations(yarn, arc_length, position),
        station_node=node,
        station_offset=offset,
        beam_nodes=len(position),
        springs=LinearSprings(node[station[sprung]], arms, joints.stiffness[sprung]),
        joints=joints,
        curvature=_curvature(knit, pieces, first),
    )


def _curvature(knit: Fabric, pieces: list[np.ndarray], first: np.ndarray) -> np.ndarray:
    """Mean curvature vectors (E, 3) [1/m] of the centrelines from the stations `first` (E,) to the next ones."""
    tangent = np.concatenate([c.tangent(s) for c, s in zip(knit.centrelines, pieces, strict=True)])
    arc_length = np.concatenate(pieces)
    before, after = tangent[first], tangent[first + 1]
    sine = np.cross(before, after)
    size = np.linalg.norm(sine, axis=1)
    angle = np.arctan2(size, np.einsum("ei,ei->e", before, after))
    per_sine = np.divide(angle, size, out=np.ones_like(angle), where=size > 0)
    return (per_sine / (arc_length[first + 1] - arc_length[first]))[:, None] * sine


def _divide(inner: np.ndarray, length: float, size: float, yarn: int) -> np.ndarray:
    """Arc lengths of the beam nodes of one yarn: its ends, stops inside, and even steps between."""
    stops = np.concatenate([[0.0], np.sort(inner), [length]])
    gaps = np.diff(stops)
    if not np.all(gaps > 1e-9 * length):
        place = stops[int(np.argmin(gaps))]
        raise GeometryError(
            f"yarn {yarn} has two joints, or a joint and the end of yarn or grip, at arc length {place:.6g} m; "
            "they must be apart"
        )
    counts = np.maximum(np.rint(gaps / size), 1).astype(int)
    piece = np.repeat(np.arange(len(gaps)), counts)
    step = np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.append(stops[piece] + step * (gaps / counts)[piece], length)


def _stations_of(contacts: JointPoints, yarn: np.ndarray, arc_length: np.ndarray) -> np.ndarray:
    """Stations (K, 2) at the points C."""
    station = np.empty(contacts.yarn.shape, dtype=int)
    for number in range(yarn[-1] + 1):
        on_yarn = contacts.yarn == number
        start = int(np.searchsorted(yarn, number))
        along = arc_length[yarn == number]
        # Points C are stops of the division, so the nearest station is the point itself.
        middles = 0.5 * (along[1:] + along[:-1])
        station[on_yarn] = start + np.searchsorted(middles, contacts.arc_length[on_yarn])
    return station


def _tie(position: np.ndarray, pairs: np.ndarray, centroid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Node of every station, and the positions of the nodes: tied pairs (t, 2) share one at their centroid (t, 3)."""
    master = np.arange(len(position))
    master[pairs[:, 1]] = pairs[:, 0]
    kept, node = np.unique(master, return_inverse=True)
    at = position.copy()
    at[pairs[:, 0]] = centroid
    return node, at[kept]
