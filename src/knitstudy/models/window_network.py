"""The cells of a window, whose yarns are solid, and the network of beams around them.

Yarns are cut where they become solid. At all other crossings they are joined, or in contact at the closest points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import xarray as xr

from knitstudy.contacts.facets import tied_crossings
from knitstudy.errors import ConfigurationError
from knitstudy.geometry.crossings import Crossings
from knitstudy.geometry.fabric import Arcs, Fabric
from knitstudy.loading.history import Stations
from knitstudy.mechanics.beam_approach import Curves
from knitstudy.mechanics.beam_contact import BeamContact, TouchingBeams, hertz
from knitstudy.mechanics.beam_model import BeamModel
from knitstudy.models.beams_in_contact import point_pairs
from knitstudy.models.joints import (
    LARGEST,
    SMALLEST,
    JointPoints,
    Joints,
    contacts_of_crossings,
    patch_stiffness,
    springs,
)
from knitstudy.models.network import Network
from knitstudy.models.network_3d import spatial_network
from knitstudy.study.scene import Scene


@dataclass(frozen=True, eq=False)
class Window(Arcs):
    """Crossings of which both yarns are solid, and the arcs that they lie on."""

    shown: np.ndarray  # (W,) crossings of the cells that are asked for; the others are of the margin

    @cached_property
    def cuts(self) -> dict[int, np.ndarray]:
        """Arc lengths by yarn at which solid and beam meet, ascending [m]."""
        return {int(yarn): self.arc[self.yarn == yarn].ravel() for yarn in np.unique(self.yarn)}


def window_of(scene: Scene, fabric: Fabric) -> Window:
    """Return the window of a scene.

    Raises ConfigurationError if it does not lie within the knit, or reaches a grip or, where yarns touch, tied
    crossings.
    """
    crossings, cells = fabric.crossings, scene.window.cells // 2
    middle = _middle(scene, fabric)
    shown = _around(crossings, middle, cells)
    crossing = _around(crossings, middle, cells + scene.window.margin)
    if scene.kind.interaction.touches:
        _require_untied(scene, crossings, crossing)
    yarn, arc = _arcs(fabric, crossing)
    _require_ungripped(scene, fabric, yarn, arc)
    return Window(crossing, yarn, arc, shown)


def _around(crossings: Crossings, middle: tuple[int, int], reach: int) -> np.ndarray:
    """Return the crossings of all cells that are not farther from the one at a row and a column than `reach`."""
    rows, columns = np.abs(crossings.row - middle[0]), np.abs(crossings.column - middle[1])
    return np.flatnonzero((rows <= reach) & (columns <= reach))


def _middle(scene: Scene, fabric: Fabric) -> tuple[int, int]:
    """Return row and column of the middle cell; refuse a window that is not wholly in the knit."""
    keys = scene.window
    reach, found = keys.cells // 2 + keys.margin, []
    for name, given, count in (("row", keys.row, fabric.cells[1]), ("column", keys.column, fabric.cells[0])):
        middle = count // 2 if given is None else given
        lowest, highest = reach, count - 1 - reach
        if lowest > highest:
            raise ConfigurationError(
                f"scene {scene.name!r}: window.cells is {keys.cells} and window.margin {keys.margin}, but the knit has "
                f"{count} {name}s: use smaller ones, for together they must be at most that many"
            )
        if not lowest <= middle <= highest:
            why = "does not exist" if middle >= count else "is too near to the edge of the knit"
            raise ConfigurationError(
                f"scene {scene.name!r}: window.{name} is {middle}, which {why} for window.cells {keys.cells} and "
                f"window.margin {keys.margin}: use one from {lowest} to {highest}"
            )
        found.append(middle)
    return found[0], found[1]


def _require_untied(scene: Scene, crossings: Crossings, chosen: np.ndarray) -> None:
    """Refuse a window in which some crossings are tied and others are not."""
    tied = chosen[tied_crossings(scene, crossings)[chosen]]
    if len(tied):
        k = tied[0]
        raise ConfigurationError(
            f"scene {scene.name!r}: the window takes in row {crossings.row[k]}, column {crossings.column[k]}, which "
            "contact.tied_edges 'outer' ties: move window.row or window.column inwards, or use a smaller window.cells "
            "or window.margin"
        )


def _require_ungripped(scene: Scene, fabric: Fabric, yarn: np.ndarray, arc: np.ndarray) -> None:
    """Refuse a window whose arcs reach into a grip."""
    gripped = fabric.gripped_arcs(scene.load.direction)
    for one, (low, high) in zip(yarn, arc, strict=True):
        ends = gripped.get(int(one), np.empty((0, 2)))
        if np.any((ends[:, 0] < high) & (ends[:, 1] > low)):
            raise ConfigurationError(
                f"scene {scene.name!r}: the window takes in a part of yarn {one} that is gripped in "
                f"{scene.load.direction} tension: move window.row inwards, or use a smaller window.cells or "
                "window.margin"
            )


def _arcs(fabric: Fabric, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return arcs of yarns (P,) that hold chosen crossings: (P, 2) [m], half the way to those next to them."""
    crossings = fabric.crossings
    is_chosen = np.zeros(len(crossings.row), dtype=bool)
    is_chosen[chosen] = True
    yarns, arcs = [], []
    for number, line in enumerate(fabric.centrelines):
        here, side = np.nonzero(crossings.yarn == number)
        order = np.argsort(crossings.arc_length[here, side])
        stations = crossings.arc_length[here, side][order]
        solid = is_chosen[here][order]
        middles = np.concatenate([[0.0], 0.5 * (stations[1:] + stations[:-1]), [line.length]])
        middles[[0, -1]] = 0.5 * stations[0], 0.5 * (stations[-1] + line.length)
        begins = np.flatnonzero(solid & ~np.append(False, solid[:-1]))
        ends = np.flatnonzero(solid & ~np.append(solid[1:], False))
        arcs.append(np.column_stack([middles[begins], middles[ends + 1]]))
        yarns.append(np.full(len(begins), number))
    return np.concatenate(yarns), np.concatenate(arcs)


def surroundings(scene: Scene, fabric: Fabric, window: Window, contacts: xr.Dataset | None) -> Network:
    """Return the network around a window; it has a node at every cut, and no elements in the solid arcs.

    Raises ConfigurationError if ties have no size that pins are known for, or springs are not positive.

    Parameters
    ----------
    contacts : Dataset, optional
        Contacts of the simulation that ``window.springs_from`` names. Without it nothing joins yarns that touch.
    """
    crossings = fabric.crossings
    outside = np.setdiff1d(np.arange(len(crossings.row)), window.crossing)
    points = JointPoints.at_crossings(crossings, outside)
    stops = fabric.grip_ends(scene.load.direction)
    for yarn, cuts in window.cuts.items():
        stops = stops | {yarn: np.concatenate([stops.get(yarn, np.empty(0)), cuts])}
    joints = _joints(scene, fabric, points, outside, contacts)
    whole = spatial_network(fabric, points, scene.mesh.beam_size, joints=joints, stops=stops)
    return _without_arcs(whole, window)


def cut_nodes(network: Network, window: Window) -> np.ndarray:
    """Return the nodes (P, 2) of the network at both ends of every solid arc."""
    stations = network.stations
    found = np.empty(window.arc.shape, dtype=int)
    for piece, yarn in enumerate(window.yarn):
        own = np.flatnonzero(stations.yarn == yarn)
        for side in range(2):
            nearest = own[np.argmin(np.abs(stations.arc_length[own] - window.arc[piece, side]))]
            found[piece, side] = network.station_node[nearest]
    return found


def _joints(
    scene: Scene, fabric: Fabric, points: JointPoints, outside: np.ndarray, contacts: xr.Dataset | None
) -> Joints:
    """Return the joints of the beams: pins as compliant as tied patches, and springs or nothing where yarns touch."""
    joints = Joints.all_tied(len(outside))
    tied = tied_crossings(scene, fabric.crossings)[outside]
    every = contacts_of_crossings(fabric, scene.tie.radius).isel(crossing=outside)
    if not tied.all():
        if contacts is None:
            joints = replace(joints, open=~tied)
        else:
            measured = _measured(scene, contacts, every["normal"].to_numpy())
            joints = replace(joints, stiffness=np.where(tied[:, None, None], joints.stiffness, measured))
    return joints.pinned(_pins(scene, fabric, points, every)) if tied.any() else joints


def _pins(scene: Scene, fabric: Fabric, points: JointPoints, contacts: xr.Dataset) -> np.ndarray:
    """Return the stiffness (K, 3, 3) [N/m] of tied patches of the scene's size."""
    radius = scene.tie.radius
    if not SMALLEST <= radius <= LARGEST:
        raise ConfigurationError(
            f"scene {scene.name!r}: tie.radius is {radius:g} but must be from {SMALLEST:g} to {LARGEST:g} where "
            "fidelity is window: beyond, no pins are known that yield as the ties around it do"
        )
    return patch_stiffness(fabric, points, contacts, scene.yarn)


def _measured(scene: Scene, contacts: xr.Dataset, normal: np.ndarray) -> np.ndarray:
    """Return springs (K, 3, 3) [N/m] along normals (K, 3) and across: those that contacts of a smaller knit measure."""
    along, across = springs(contacts, "interface", "contact").averaged
    if not (along > 0 and across > 0):
        raise ConfigurationError(
            f"scene {scene.name!r}: window.springs_from is {scene.window.springs_from!r}, whose averaged springs are "
            f"{along:.4g} and {across:.4g} N/m along and across the contact but must be positive: name another scene"
        )
    outer = normal[:, :, None] * normal[:, None, :]
    return along * outer + across * (np.eye(3) - outer)


def _without_arcs(network: Network, window: Window) -> Network:
    """Return a network without the elements and nodes inside of the solid arcs."""
    stations = network.stations
    first = np.flatnonzero(stations.yarn[1:] == stations.yarn[:-1])
    middle = 0.5 * (stations.arc_length[first] + stations.arc_length[first + 1])
    elements = window.piece(stations.yarn[first], middle) < 0
    kept = np.zeros(len(stations.yarn), dtype=bool)
    kept[first[elements]] = kept[first[elements] + 1] = True
    nodes, place = np.unique(network.station_node[kept], return_inverse=True)
    renumbered = np.full(len(network.nodes), -1)
    renumbered[nodes] = np.arange(len(nodes))
    joints = network.springs
    return replace(
        network,
        nodes=network.nodes[nodes],
        ends=renumbered[network.ends[elements]],
        offsets=network.offsets[elements],
        yarns_side_by_side=network.yarns_side_by_side[elements],
        stations=Stations(stations.yarn[kept], stations.arc_length[kept], stations.position[kept]),
        station_node=place,
        station_offset=network.station_offset[kept],
        beam_nodes=int(kept.sum()),
        springs=replace(joints, ends=renumbered[joints.ends]),
        curvature=network.curvature[elements],
    )


STICK = 10.0
"""Stiffness against elastic slip over E R, as of beams in contact (`beam.stiffness`)."""


def touching_beams(
    scene: Scene, fabric: Fabric, window: Window, network: Network, beams: BeamModel
) -> TouchingBeams | None:
    """Return beams with contact at all crossings outside of the window that are not tied; None if there are none.

    Raises GeometryError if a piece of yarn has too few nodes for a smooth centreline.
    """
    if not scene.kind.interaction.touches:
        return None
    open_ones = ~tied_crossings(scene, fabric.crossings)
    open_ones[window.crossing] = False
    if not open_ones.any():
        return None
    chain = chains(network)
    curves = Curves(chain, network.stations.arc_length)
    outside = np.setdiff1d(np.arange(len(open_ones)), window.crossing)
    pairs = point_pairs(
        _on_chains(fabric.crossings, outside, network.stations, chain),
        np.flatnonzero(open_ones[outside]),
        curves.length,
    )
    yarn = scene.yarn
    law = hertz(yarn.youngs_modulus, yarn.poisson_ratio, yarn.radius)
    stick = STICK * yarn.youngs_modulus * yarn.radius
    contact = BeamContact(curves, pairs, yarn.radius, law, stick, scene.kind.interaction.friction(scene))
    return TouchingBeams(beams, network.station_node, network.station_offset, contact)


def chains(network: Network) -> np.ndarray:
    """Return the number (S,) of the chain of beams that every station belongs to; a cut yarn is several."""
    yarn, node, count = network.stations.yarn, network.station_node, len(network.nodes)
    joined = np.zeros(len(yarn), dtype=bool)
    elements = network.ends[:, 0] * count + network.ends[:, 1]
    joined[1:] = (yarn[1:] == yarn[:-1]) & np.isin(node[:-1] * count + node[1:], elements)
    return np.cumsum(~joined) - 1


def _on_chains(crossings: Crossings, chosen: np.ndarray, stations: Stations, chain: np.ndarray) -> Crossings:
    """Return chosen crossings (k,) with chains instead of yarns; arc lengths stay those of the yarns."""
    part = crossings.chosen(chosen)
    # Places of all stations on one axis, yarn after yarn, as the network has them.
    longest = 2 * stations.arc_length.max()
    places = longest * stations.yarn + stations.arc_length
    nearest = np.searchsorted(places, longest * part.yarn + part.arc_length)
    return replace(part, yarn=chain[nearest])
