"""Three-dimensional reduced model, Figs. 5 and 6: beams along the centrelines, joined at the points C.

The two points C of a tied crossing move as one. With joint "rigid" both hang on a node at the contact's centroid P
by rigid arms. With joint "printed" their displacements and rotations are equal, u_T = 0 and u_R = 0 (Table 2): the
forces that they exchange across their distance then leave a couple that no part of the model takes up; see
`BeamModel.couples`.

Where yarns touch without a tie they are two nodes with a spring between, and may turn against each other. With joint
"rigid" it acts at P, at the ends of arms from both points C; with "printed" between the points C, and leaves a couple
as well. Pinned joints are the same with stiff springs for ties (`Joints.pinned`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from knitstudy.errors import ConfigurationError, GeometryError
from knitstudy.gates.memory import require_memory
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.history import Stations
from knitstudy.mechanics.spring import LinearSprings
from knitstudy.networks.rom.joints import Joints
from knitstudy.networks.rom.network import Network
from knitstudy.networks.rom.points import JointPoints

JOINTS = ("rigid", "printed")

BYTES_A_NODE = 8_200
"""Of a simulation of beams; measured were 7.9 to 8.2 kB, from 0.5 to 0.02 mm."""


def spatial_network(
    knit: Knit,
    contacts: JointPoints,
    size: float,
    joint: str = "rigid",
    joints: Joints | None = None,
    stops: Mapping[int, np.ndarray] | None = None,
) -> Network:
    """Return the network of a knit.

    Parameters
    ----------
    knit : Knit
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


def _curvature(knit: Knit, pieces: list[np.ndarray], first: np.ndarray) -> np.ndarray:
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
