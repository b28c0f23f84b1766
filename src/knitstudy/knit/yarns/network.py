"""Networks of beams that stand for a fabric: grips, load and history of all of them, and the 3D network.

The 3D network follows the centrelines, joined at the points C (section 2.5 of the paper, Figs. 5 and 6). The two points
C of a tied crossing move as one. With joint "rigid" both hang on a node at the contact's centroid P by rigid arms. With
joint "printed" their displacements and rotations are equal, u_T = 0 and u_R = 0 (Table 2): the forces that they
exchange across their distance then leave a couple without balance; see `BeamModel.couples`.

Where yarns touch without a tie, a spring joins their two nodes, which may turn against each other. With joint "rigid"
it acts at P, at the ends of arms from both points C; with "printed" between the points C, and leaves a couple as well.
Pinned joints are the same with stiff springs for ties, joints "patch" with springs as compliant as tied patches.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from knitstudy.errors import ConfigurationError, DataFileError, GeometryError
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.spline import evenly
from knitstudy.knit.loading.gates import require_fine_beams, require_sound
from knitstudy.knit.loading.history import Motion, Stations, load_path
from knitstudy.knit.loading.solve import Check, Problem, Reported, settings_of
from knitstudy.knit.mesh.mesher import Grips
from knitstudy.knit.mesh.quality import require_memory
from knitstudy.knit.scene.sections import BeamYarn, Yarn
from knitstudy.knit.scene.shared_sections import Tie
from knitstudy.knit.scene.specimens import Knit
from knitstudy.knit.yarns.joints import CrossingJoints, JointPoints, contacts_of_crossings
from knitstudy.mechanics.beams.beam import BeamSection, BeamState, LinearSprings, SectionLaw
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.curved_rod import CurvedSection
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.increment import Increment, PrescribedDisplacement
from knitstudy.mechanics.core.rotation import turns

if TYPE_CHECKING:  # networks without contact import none of it
    from knitstudy.mechanics.beams.beam_contact import BeamContact

SPINS = range(3, 6)  # components of the rotation among the unknowns of a node


@dataclass(frozen=True)
class Network:
    """Yarns as chains of straight beam elements, joined where they touch."""

    nodes: Floats  # (N, 3) nodes that carry unknowns [m]
    ends: Ints  # (E, 2) node at either end of every element
    offsets: Floats  # (E, 2, 3) from that node to the end of the element [m]
    arms_turn: bool  # whether offsets are rigid arms; see `BeamModel`
    yarns_side_by_side: Floats | Ints  # (E,) yarns that an element stands for
    stations: Stations  # the points of all yarns, one yarn after the other, in order of arc length
    station_node: Ints  # (S,) node that carries a station
    station_offset: Floats  # (S, 3) from that node to the station [m]
    # Nodes of the beams before joints are eliminated; the paper counts degrees of freedom as 6 times this
    beam_nodes: int
    springs: LinearSprings = field(default_factory=LinearSprings.none)  # springs between yarns
    joints: CrossingJoints | None = None  # of the crossings; None where crossings are nodes of the network
    # (E, 3) mean curvature vector t x dt/ds of the undeformed yarn over every element [1/m]; None where
    # elements do not follow a yarn
    curvature: Floats | None = None
    # Of its rows, which strains along the wales refer to; None where it is that of the knit [m]
    height: float | None = None
    # (E,), share of normal forces in what loads the elements on their surface
    pressed: float | Floats = 0.0
    polygon: float = 0.0  # by how much its straight beams are too stiff as they are bent; see `_polygon`

    def section(self, yarn: Yarn, law: str) -> SectionLaw:
        """Return the section of the elements; law "straight", or "curved" where elements follow a yarn."""
        return section_of(yarn, law, self.curvature, self.yarns_side_by_side, self.pressed)

    def model(self, yarn: Yarn, law: str, contact: BeamContact | None = None) -> BeamModel:
        """Return the network as beams of circular yarn, with the law of `section`."""
        where = self.nodes, self.ends, self.section(yarn, law), yarn.radius, self.offsets
        return BeamModel(*where, self.arms_turn, self.springs, contact)

    def station_displacement(self, model: BeamModel, state: BeamState) -> Floats:
        """Return the displacement (S, 3) of the stations [m]."""
        return model.carried(state, self.station_node, self.station_offset) - self.stations.position


def section_of(
    yarn: Yarn,
    law: str,
    curvature: Floats | None,
    count: float | Floats | Ints = 1.0,
    pressed: float | Floats = 0.0,
) -> SectionLaw:
    """Return the section of beams that stand for `count` yarns each, bent as `curvature` (E, 3) [1/m] as drawn.

    The law "curved" knows the share of normal forces in what loads beams on their surface, `pressed` (E,).

    Stiffnesses of the yarn's own replace the stiffnesses of a solid circle, whose law alone "curved" is.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> section = section_of(load_scene("rom3d-tie-course").yarn, law="straight", curvature=None)
    >>> round(float(section.EA / section.EI) * 1e-6, 3)  # 16 / d^2 of a solid circle [1/mm2]
    4.938
    """
    if law == "curved" and curvature is not None:
        return CurvedSection(yarn.radius, yarn.youngs_modulus, yarn.poisson_ratio, curvature, pressed=pressed)
    circle = BeamSection.circular(yarn.diameter, yarn.youngs_modulus, yarn.poisson_ratio, count)
    if not isinstance(yarn, BeamYarn):
        return circle
    given = {"EA": yarn.stretching, "EI": yarn.bending, "GJ": yarn.twisting}
    own: dict[str, Any] = {
        name: value * np.asarray(count) for name, value in given.items() if value is not None
    }
    if "EA" in own:
        own["kGA"] = circle.kGA / circle.EA * own["EA"]
    return replace(circle, **own)


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


def require_named(key: str, named: str | None, what: str, given: xr.Dataset | None) -> None:
    """Refuse results of another simulation unless a key names it, and the other way round; ConfigurationError."""
    if (named is None) != (given is None):
        raise ConfigurationError(
            f"{key} is {named or 'empty'}, and {what} are {'not ' if given is None else ''}"
            "given: they must be given where it names one, and only there"
        )


def problem(
    scene: Knit, fabric: Fabric, network: Network, constants: Mapping[str, Floats] | None = None
) -> Problem:
    """Return joined beams with the load of a scene, and constants for its history."""
    model = network.model(scene.yarn, scene.value("mesh.section_law") or "straight")
    joints = network.joints
    return loaded(
        scene,
        fabric,
        network,
        model=model,
        observer=NetworkObserver(network, model),
        settings=settings_of(scene.solver, touches=False),
        constants={"joint_stiffness": joints.stiffness, **(constants or {})} if joints else {},
        attributes={"open_crossings": int(joints.open.sum())} if joints else {},
    )


def loaded(
    scene: Knit,
    fabric: Fabric,
    network: Network,
    attributes: dict[str, Any],
    checks: tuple[Check, ...] = (),
    **given: Any,
) -> Problem:
    """Return a network with the load of a scene.

    Raises MeshError if its beams are too long for the bends of the yarns.
    """
    require_fine_beams(scene.value("gates.polygon"), scene.value("mesh.beam_size"), network.polygon)
    motion = load_path(scene, fabric)
    if network.height is not None and scene.load.direction == "wale":
        # Strains refer to the height of the network.
        scale = network.height / fabric.height
        motion = replace(motion, displacement=scale * motion.displacement, length=scale * motion.length)
    ends = grips(network, fabric, scene.load.direction)
    return Problem(
        scene=scene,
        prescribed=tension(ends, motion, scene.load.lateral),
        motion=motion,
        driven=6 * ends.driven[:, None] + np.arange(3),
        stations=network.stations,
        checks=(*checks, partial(require_sound, gates=scene.gates, yarn=scene.yarn)),
        attributes={"dof": 6 * network.beam_nodes, "elements": len(network.ends)} | attributes,
        **given,
    )


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


BYTES_A_NODE = 8_200  # of a simulation of beams; measured were 7.9 to 8.2 kB, from 0.5 to 0.02 mm


def contacts_of(fabric: Fabric, contacts: xr.Dataset | None, tie: Tie | None = None) -> xr.Dataset:
    """Return the contacts that are given, or else predicted by the geometry with areas of ties, or of usual ones.

    Raises DataFileError if they do not describe every crossing of the fabric.
    """
    if contacts is None:
        return contacts_of_crossings(fabric, (tie or Tie()).radius)
    crossings = fabric.crossings
    count = contacts.sizes["crossing"]
    same = count == len(crossings.row) and all(
        np.array_equal(contacts[name], getattr(crossings, name)) for name in ("row", "column", "zone", "yarn")
    )
    if not same:
        raise DataFileError(
            f"the contacts describe {count} crossings that are not the {len(crossings.row)} of a "
            f"{fabric.cells[0]} x {fabric.cells[1]} knit: contacts and knit must be of the same scene"
        )
    whole = np.isfinite([contacts[name].to_numpy() for name in ("centroid", "normal")]).all(axis=(0, 2))
    if not whole.all():
        k = int(np.argmin(whole))
        raise DataFileError(
            f"the contact at row {crossings.row[k]}, column {crossings.column[k]}, zone {crossings.zone[k]} "
            "has no centroid or no normal: a joint needs both"
        )
    return contacts


def spatial_network(
    fabric: Fabric,
    contacts: JointPoints,
    # wanted length of an element in yarn radii; pieces between points C have the nearest whole number of them
    size: float,
    joint: str = "rigid",  # of ties: "rigid" or "printed", see the module
    joints: CrossingJoints | None = None,  # by default all crossings are tied
    stops: Mapping[int, Floats] | None = None,  # arc lengths [m] by yarn that have a node as well
) -> Network:
    """Return the network of a fabric.

    Raises MeshError if the network does not fit into memory; GeometryError if two contacts of a yarn share a point C,
    or one lies at a stop.
    """
    number = sum(centreline.length for centreline in fabric.centrelines) / (size * fabric.radius)
    require_memory(number * BYTES_A_NODE, "mesh.beam_size", size, f"a network of {number:.2g} nodes", power=1)
    joints = joints or CrossingJoints.all_tied(len(contacts.yarn))
    stops = stops or {}
    pieces = []
    for yarn_number, line in enumerate(fabric.centrelines):
        inner = np.append(contacts.arc_length[contacts.yarn == yarn_number], stops.get(yarn_number, ()))
        pieces.append(_divide(inner, line.length, size * fabric.radius, yarn_number))
    count = np.array([len(s) for s in pieces])
    yarn = np.repeat(np.arange(len(count)), count)
    arc_length = np.concatenate(pieces)
    position = np.concatenate([c.position(s) for c, s in zip(fabric.centrelines, pieces, strict=True)])
    stations = Stations(yarn, arc_length, position)
    station = stations.nearest(contacts.yarn, contacts.arc_length)  # points C are stops of the division
    node, nodes = _tie(position, station[joints.tied], contacts.centroid[joints.tied])
    offset = position - nodes[node]
    first = np.flatnonzero(yarn[1:] == yarn[:-1])
    elements = np.column_stack([first, first + 1])  # by station
    tangent = np.concatenate([c.tangent(s) for c, s in zip(fabric.centrelines, pieces, strict=True)])
    sprung = joints.sprung
    arms = (contacts.centroid[:, None] - contacts.point)[sprung] * (joint == "rigid")
    return Network(
        nodes=nodes,
        ends=node[elements],
        offsets=offset[elements],
        arms_turn=joint == "rigid",
        yarns_side_by_side=np.ones(len(elements)),
        stations=stations,
        station_node=node,
        station_offset=offset,
        beam_nodes=len(position),
        springs=LinearSprings(node[station[sprung]], arms, joints.stiffness[sprung]),
        joints=joints,
        curvature=turns(tangent[first], tangent[first + 1]) / np.diff(arc_length)[first, None],
        polygon=_polygon(fabric, pieces),
    )


# A ring of elements that turn by phi each, pulled across, is stiffer by this share of phi^2: 5/24 as chords are nearer
# to its middle and shorter, (1 - EA / 4 kGA) / (12 (1 - 8 / pi^2)) as one point shows no change of the moment; nu = 0.3
RING = 0.33


def _polygon(fabric: Fabric, pieces: list[Floats]) -> float:
    """Return by how much elements between arc lengths of every yarn are too stiff, estimated: the mean of rings."""
    place, weight = np.polynomial.legendre.leggauss(8)
    turned, length = 0.0, 0.0
    for line, s in zip(fabric.centrelines, pieces, strict=True):
        size = np.diff(s)
        inside = s[:-1, None] + size[:, None] * 0.5 * (1 + place)
        angle = size * (line.curvature(inside.ravel()).reshape(inside.shape) @ (0.5 * weight))
        turned = turned + float(size @ angle**2)
        length = length + float(size.sum())
    return RING * turned / length


def _divide(inner: Floats, length: float, size: float, yarn: int) -> Floats:
    """Return the arc lengths of the beam nodes of one yarn: its ends, stops inside, and even steps between."""
    stops = np.concatenate([[0.0], np.sort(inner), [length]])
    gaps = np.diff(stops)
    if not np.all(gaps > 1e-9 * length):
        place = stops[int(np.argmin(gaps))]
        raise GeometryError(
            f"yarn {yarn} has two joints, or a joint and the end of yarn or grip, at arc length {place:.6g} m; "
            "they must be apart"
        )
    counts = np.maximum(np.rint(gaps / size), 1).astype(int)
    return evenly(stops, counts)


def _tie(position: Floats, pairs: Ints, centroid: Floats) -> tuple[Ints, Floats]:
    """Node of every station, and the positions of the nodes: tied pairs (t, 2) share one at their centroid (t, 3)."""
    master = np.arange(len(position))
    master[pairs[:, 1]] = pairs[:, 0]
    kept, node = np.unique(master, return_inverse=True)
    at = position.copy()
    at[pairs[:, 0]] = centroid
    return node, at[kept]
