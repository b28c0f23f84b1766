"""The 3D network: beams along the centrelines, joined at the points C (section 2.5 of the paper, Figs. 5 and 6).

The two points C of a tied crossing move as one. With joint "rigid" both hang on a node at the contact's centroid P by
rigid arms. With joint "printed" their displacements and rotations are equal, u_T = 0 and u_R = 0 (Table 2): the forces
that they exchange across their distance then leave a couple without balance; see `BeamModel.couples`.

Where yarns touch without a tie, a spring joins their two nodes, which may turn against each other. With joint "rigid"
it acts at P, at the ends of arms from both points C; with "printed" between the points C, and leaves a couple as well.
Pinned joints are the same with stiff springs for ties, joints "patch" with springs as compliant as tied patches.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from knitstudy.errors import DataFileError, GeometryError
from knitstudy.geometry.fabric import Fabric
from knitstudy.loading.history import Stations
from knitstudy.loading.solve import Problem
from knitstudy.mechanics.beam import LinearSprings
from knitstudy.mesh.quality import require_memory
from knitstudy.models import network
from knitstudy.models.joints import (
    JointPoints,
    Joints,
    contacts_of_crossings,
    joint_points,
    patch_stiffness,
    spring_joints,
)
from knitstudy.models.network import Network
from knitstudy.study.scene import Scene

PIN = 10.0  # stiffness of pins over E R: a newton moves the pinned points by a tenth of a micrometre

BYTES_A_NODE = 8_200  # of a simulation of beams; measured were 7.9 to 8.2 kB, from 0.5 to 0.02 mm


def build(
    scene: Scene,
    fabric: Fabric,
    contacts: xr.Dataset | None = None,  # as `rom.contacts_from` says; by default predicted by the geometry
    springs: xr.Dataset | None = None,  # contacts of the simulation that `rom.springs_from` names
) -> Problem:
    """Return a scene with the 3D network as a problem.

    Raises ConfigurationError if the scene asks for springs that the contacts do not give; DataFileError if the contacts
    are those of another fabric, or not all crossings have one; GeometryError if no joints can be made of the contacts.
    """
    contacts = contacts_of(scene, fabric, contacts)
    points, rom = joint_points(fabric, contacts), scene.rom
    if scene.interaction == "tie":
        joints = Joints.all_tied(len(points.yarn))
    else:
        network.require_named(scene, "rom.springs_from", "springs", springs)
        each = rom.springs == "zones"
        joints = spring_joints(contacts, rom.displacement, rom.axes, each, springs, rom.stiffness)
    if rom.joint == "pinned":
        joints = joints.pinned(PIN * scene.yarn.youngs_modulus * scene.yarn.radius)
    elif rom.joint == "patch":
        joints = joints.pinned(patch_stiffness(fabric, points, contacts, scene.yarn))
    stops = fabric.grip_ends(scene.load.direction)
    arms = "printed" if rom.joint == "printed" else "rigid"
    beams = spatial_network(fabric, points, scene.mesh.beam_size, arms, joints, stops)
    return network.problem(scene, fabric, beams)


def contacts_of(scene: Scene, fabric: Fabric, contacts: xr.Dataset | None) -> xr.Dataset:
    """Return the contacts that are given, or those that the geometry predicts.

    Raises DataFileError if they do not describe every crossing of the fabric.
    """
    if contacts is None:
        return contacts_of_crossings(fabric, scene.value("tie.radius") or 0.0)
    crossings, count = fabric.crossings, contacts.sizes["crossing"]
    same = count == len(crossings.row) and all(
        np.array_equal(contacts[name], getattr(crossings, name)) for name in ("row", "column", "zone", "yarn")
    )
    if not same:
        raise DataFileError(
            f"the contacts describe {count} crossings that are not the {len(crossings.row)} of a "
            f"{fabric.cells[0]} x {fabric.cells[1]} knit: contacts and knit must be of the same scene"
        )
    whole = np.isfinite(contacts["centroid"]).all("xyz") & np.isfinite(contacts["normal"]).all("xyz")
    if not whole.all():
        k = int(np.argmin(whole.to_numpy()))
        raise DataFileError(
            f"the contact at row {crossings.row[k]}, column {crossings.column[k]}, zone {crossings.zone[k]} "
            "has no centroid or no normal: a joint needs both"
        )
    return contacts


def spatial_network(
    fabric: Fabric,
    contacts: JointPoints,
    size: float,  # wanted length of an element [m]; pieces between points C have the nearest whole number of them
    joint: str = "rigid",  # of ties: "rigid" or "printed", see the module
    joints: Joints | None = None,  # by default all crossings are tied
    stops: Mapping[int, np.ndarray] | None = None,  # arc lengths [m] by yarn that have a node as well
) -> Network:
    """Return the network of a fabric.

    Raises MeshError if the network does not fit into memory; GeometryError if two contacts of a yarn share a point C,
    or one lies at a stop.
    """
    nodes = sum(centreline.length for centreline in fabric.centrelines) / size
    require_memory(nodes * BYTES_A_NODE, "mesh.beam_size", size, f"a network of {nodes:.2g} nodes", power=1)
    joints, stops = joints or Joints.all_tied(len(contacts.yarn)), stops or {}
    pieces = []
    for number, line in enumerate(fabric.centrelines):
        inner = np.append(contacts.arc_length[contacts.yarn == number], stops.get(number, ()))
        pieces.append(_divide(inner, line.length, size, number))
    count = np.array([len(s) for s in pieces])
    yarn, arc_length = np.repeat(np.arange(len(count)), count), np.concatenate(pieces)
    position = np.concatenate([c.position(s) for c, s in zip(fabric.centrelines, pieces, strict=True)])
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
        curvature=_curvature(fabric, pieces, first),
    )


def _curvature(fabric: Fabric, pieces: list[np.ndarray], first: np.ndarray) -> np.ndarray:
    """Return mean curvature vectors (E, 3) [1/m] of centrelines from the stations `first` (E,) to the next ones."""
    tangent = np.concatenate([c.tangent(s) for c, s in zip(fabric.centrelines, pieces, strict=True)])
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
