"""Three-dimensional reduced model, Figs. 5 and 6: beams along the centrelines, joined at the points C.

The two points C of a contact move as one. With joint "rigid" both hang on a node at the contact's centroid
P by rigid arms. With joint "coincident" their displacements and rotations are equal, u_T = 0 and u_R = 0
(Table 2): the forces that they exchange across their distance then leave a couple that no part of the model
takes up; see `BeamModel.couples`.
"""

from __future__ import annotations

import numpy as np

from knitstudy.errors import ConfigurationError, GeometryError
from knitstudy.geometry.pattern import Knit
from knitstudy.history import Stations
from knitstudy.rom.network import Network
from knitstudy.rom.points import ContactPoints

JOINTS = ("rigid", "coincident")


def build(knit: Knit, contacts: ContactPoints, size: float, joint: str = "rigid") -> Network:
    """Return the network of a knit.

    Parameters
    ----------
    knit : Knit
        Centrelines of the yarns.
    contacts : ContactPoints
        Points C and P.
    size : float
        Wanted length of an element [m]; every piece between points C has the whole number of elements that
        comes nearest to it.
    joint : {"rigid", "coincident"}
        See the module.

    Raises
    ------
    ConfigurationError
        If the joint is unknown or the size is not positive.
    GeometryError
        If two contacts of a yarn share a point C.
    """
    if joint not in JOINTS:
        raise ConfigurationError(f"rom.joint is {joint!r}: allowed are {', '.join(JOINTS)}")
    if not size > 0:
        raise ConfigurationError(f"mesh.beam_size is {size}: allowed is a positive length in m")
    pieces = [
        _divide(contacts.arc_length[contacts.yarn == number], centreline.length, size, number)
        for number, centreline in enumerate(knit.centrelines)
    ]
    count = np.array([len(s) for s in pieces])
    yarn, arc_length = np.repeat(np.arange(len(count)), count), np.concatenate(pieces)
    position = np.concatenate([c.position(s) for c, s in zip(knit.centrelines, pieces, strict=True)])
    node, nodes = _join(yarn, arc_length, position, contacts)
    offset = position - nodes[node]
    first = np.flatnonzero(yarn[1:] == yarn[:-1])
    elements = np.column_stack([first, first + 1])  # by station
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
    )


def _divide(joints: np.ndarray, length: float, size: float, yarn: int) -> np.ndarray:
    """Arc lengths of the beam nodes of one yarn: its ends, its joints, and even steps between."""
    stops = np.concatenate([[0.0], np.sort(joints), [length]])
    gaps = np.diff(stops)
    if not np.all(gaps > 1e-9 * length):
        place = stops[int(np.argmin(gaps))]
        raise GeometryError(
            f"yarn {yarn} has two joints, or a joint and its end, at arc length {place:.6g} m; points of "
            "different contacts must be apart"
        )
    counts = np.maximum(np.rint(gaps / size), 1).astype(int)
    piece = np.repeat(np.arange(len(gaps)), counts)
    step = np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.append(stops[piece] + step * (gaps / counts)[piece], length)


def _join(
    yarn: np.ndarray, arc_length: np.ndarray, position: np.ndarray, contacts: ContactPoints
) -> tuple[np.ndarray, np.ndarray]:
    """Node of every station, and the positions of the nodes: a joint's stations share one at its centroid."""
    station = np.empty(contacts.yarn.shape, dtype=int)
    for number in range(yarn[-1] + 1):
        on_yarn = contacts.yarn == number
        start = int(np.searchsorted(yarn, number))
        along = arc_length[yarn == number]
        # Joints are stops of the division, so the nearest station is the joint itself.
        middles = 0.5 * (along[1:] + along[:-1])
        station[on_yarn] = start + np.searchsorted(middles, contacts.arc_length[on_yarn])
    master = np.arange(len(yarn))
    master[station[:, 1]] = station[:, 0]
    kept, node = np.unique(master, return_inverse=True)
    at = position.copy()
    at[station[:, 0]] = contacts.centroid
    return node, at[kept]
