"""Two-dimensional reduced model, Fig. 4: straight beams in the plane from contact zone to contact zone.

A node in a contact zone is shared by both yarns. Between the lower and the upper zone of one side of an
interlock both yarns run along the same segment, which has the section of one yarn (or of both, as a
variant).

The feet of the bottom yarn and the heads of the top yarn meet no other yarn. Their corners stand where the
contact zones of the next row would be: the zones of the outermost row of interlocks, one course away. The
yarn's ends lie in the cut through the sinker's centres, on the line through the zones that the sinker would
link.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.history import Stations
from knitstudy.networks.rom.network import Network
from knitstudy.networks.rom.principal_honeycomb import heights_by_stress, moved


def planar_network(
    knit: Knit,
    contacts: xr.Dataset,
    elements: int = 1,
    doubled: bool = False,
    stresses: xr.Dataset | None = None,
) -> Network:
    """Return the network of a knit.

    Parameters
    ----------
    knit : Knit
        Size of the pattern and lengths of the yarns.
    contacts : Dataset
        Contacts in the format of docs/architecture.md.
    elements : int
        Elements a segment.
    doubled : bool
        Whether a segment that two yarns share has the section of both.
    stresses : Dataset, optional
        Of the directions that segments take instead of joining the contacts (`principal_honeycomb`).

    Raises
    ------
    ConfigurationError
        If `elements` is not a positive whole number.
    GeometryError
        If the stresses make no honeycomb.
    """
    if elements < 1 or elements != int(elements):
        raise ConfigurationError(
            f"elements a segment: {elements} is not allowed, only whole numbers from 1 on"
        )
    course = knit.loop.course_spacing
    if stresses is not None:
        rows = heights_by_stress(knit, contacts, stresses)
        contacts, course = moved(knit, contacts, rows), rows.course
    corners = _end_in_cut(knit, _corners(knit, contacts, course))
    first = np.flatnonzero(corners.begins)
    legs = np.column_stack([corners.number[first], corners.number[first + 1]])
    segments, which, yarns = np.unique(np.sort(legs, axis=1), axis=0, return_inverse=True, return_counts=True)
    nodes, chains = _divide(corners.point, segments, elements)
    forwards = legs[:, :1] == segments[which, :1]
    stations, station_node = _stations(corners, np.where(forwards, chains[which], chains[which, ::-1]), nodes)
    ends = np.stack([chains[:, :-1], chains[:, 1:]], axis=-1).reshape(-1, 2)
    return Network(
        nodes=nodes,
        ends=ends,
        offsets=np.zeros((len(ends), 2, 3)),
        arms_turn=True,
        yarns_side_by_side=np.repeat(yarns if doubled else np.ones(len(yarns)), elements),
        stations=stations,
        station_node=station_node,
        station_offset=np.zeros((len(station_node), 3)),
        beam_nodes=len(nodes),
        height=knit.rows * course,
    )


@dataclass(frozen=True)
class _Corners:
    """The corners that the yarns pass, yarn by yarn and in order of arc length.

    ``yarn``, ``arc_length`` and ``number`` have one entry a passage; ``point`` (C, 3) one a corner.
    """

    yarn: np.ndarray
    arc_length: np.ndarray
    number: np.ndarray
    point: np.ndarray

    @property
    def begins(self) -> np.ndarray:
        """Passages (bool) from which the yarn goes on along a segment; the others are right ends."""
        return np.append(self.yarn[1:] == self.yarn[:-1], False)

    @classmethod
    def sorted(
        cls, yarn: np.ndarray, arc_length: np.ndarray, number: np.ndarray, point: np.ndarray
    ) -> _Corners:
        order = np.lexsort((arc_length, yarn))
        return cls(yarn[order], arc_length[order], number[order], point)


def _corners(knit: Knit, contacts: xr.Dataset, spacing: float) -> _Corners:
    """Corners in contact zones, and where the zones of the rows beyond the edges would be."""
    zone = contacts["centroid"].to_numpy() * [1.0, 1.0, 0.0]
    row = contacts["row"].to_numpy()
    yarn, arc_length = contacts["yarn"].to_numpy().astype(int), contacts["arc_length"].to_numpy()
    course = np.array([0.0, spacing, 0.0])
    feet, heads = np.flatnonzero(row == 0), np.flatnonzero(row == knit.rows - 1)
    number = np.arange(len(zone))
    # All yarns have one shape: the bottom yarn's feet are where yarn 1 has them, the top yarn's heads where
    # the yarn below it has them.
    return _Corners.sorted(
        np.concatenate([yarn[:, 0], yarn[:, 1], yarn[feet, 0], yarn[heads, 1]]),
        np.concatenate([arc_length[:, 0], arc_length[:, 1], arc_length[feet, 1], arc_length[heads, 0]]),
        np.concatenate([number, number, len(zone) + np.arange(len(feet) + len(heads))]),
        np.concatenate([zone, zone[feet] - course, zone[heads] + course]),
    )


def _end_in_cut(knit: Knit, corners: _Corners) -> _Corners:
    """Add the ends of the yarns."""
    start = np.flatnonzero(np.append(True, np.diff(corners.yarn) != 0))
    stop = np.append(start[1:], len(corners.yarn)) - 1
    length = np.array([centreline.length for centreline in knit.centrelines])
    arc_length = np.concatenate([np.zeros(len(length)), length])
    tips = np.stack([c.position(np.array([0.0, c.length])) for c in knit.centrelines], axis=1)  # (2, Y, 3)
    end = corners.point[corners.number[np.append(start, stop)]]
    end[:, 0] = tips[..., 0].ravel()
    return _Corners.sorted(
        np.concatenate([corners.yarn, corners.yarn[start], corners.yarn[stop]]),
        np.concatenate([corners.arc_length, arc_length]),
        np.concatenate([corners.number, len(corners.point) + np.arange(len(end))]),
        np.concatenate([corners.point, end]),
    )


def _divide(corners: np.ndarray, segments: np.ndarray, elements: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (N, 3) of divided segments (G, 2), corners first, and the chain (G, elements + 1) of each."""
    share = (np.arange(1, elements) / elements)[:, None]
    start, stop = corners[segments[:, 0], None], corners[segments[:, 1], None]
    inner = len(corners) + np.arange(len(segments) * (elements - 1)).reshape(len(segments), -1)
    nodes = np.concatenate([corners, ((1 - share) * start + share * stop).reshape(-1, 3)])
    return nodes, np.column_stack([segments[:, 0], inner, segments[:, 1]])


def _stations(corners: _Corners, chains: np.ndarray, nodes: np.ndarray) -> tuple[Stations, np.ndarray]:
    """Stations along all yarns and their nodes, from the chains (legs, elements + 1) that the yarns follow.

    Arc length is that of the yarn, shared evenly by the nodes of a segment.
    """
    elements = chains.shape[1] - 1
    follow = np.repeat(corners.begins[:, None], elements, axis=1)
    follow[:, 0] = True  # a right end is a station without a segment
    node = np.repeat(corners.number[:, None], elements, axis=1)
    node[corners.begins] = chains[:, :-1]
    rise = np.diff(corners.arc_length, append=0.0)[:, None]
    arc_length = corners.arc_length[:, None] + rise * np.arange(elements) / elements
    yarn = np.repeat(corners.yarn[:, None], elements, axis=1)
    station_node = node[follow]
    return Stations(yarn[follow], arc_length[follow], nodes[station_node]), station_node
