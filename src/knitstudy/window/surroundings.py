"""The knit around a window as a network of beams: yarns cut where they become solid, joined at all other crossings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr

from knitstudy.crossings.tied_crossings import tied_crossings
from knitstudy.errors import ConfigurationError
from knitstudy.geometry.arcs import grip_ends
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.history import Stations
from knitstudy.networks.rom import rom3d
from knitstudy.networks.rom.crossing_contacts import contacts_of_crossings
from knitstudy.networks.rom.joints import Joints
from knitstudy.networks.rom.network import Network
from knitstudy.networks.rom.patch_joint import LARGEST, SMALLEST, patch_stiffness
from knitstudy.networks.rom.points import JointPoints
from knitstudy.networks.rom.springs import springs
from knitstudy.study.scene import Scene
from knitstudy.window.cells import Window


def surroundings(scene: Scene, knit: Knit, window: Window, contacts: xr.Dataset | None) -> Network:
    """Return the network around a window; it has a node at every cut, and no elements in the solid arcs.

    Parameters
    ----------
    scene : Scene
    knit : Knit
    window : Window
    contacts : Dataset, optional
        Contacts of the simulation that ``window.springs_from`` names. Without it nothing joins yarns that touch.

    Raises
    ------
    ConfigurationError
        If ties have no size that pins are known for, or springs are not positive.
    """
    crossings = knit.crossings
    outside = np.setdiff1d(np.arange(len(crossings.row)), window.crossing)
    points = JointPoints(
        crossings.yarn[outside],
        crossings.arc_length[outside],
        crossings.point[outside],
        crossings.point[outside].mean(axis=1),
    )
    stops = grip_ends(knit, scene.load.direction)
    for yarn, cuts in window.cuts.items():
        stops = stops | {yarn: np.concatenate([stops.get(yarn, np.empty(0)), cuts])}
    joints = _joints(scene, knit, points, outside, contacts)
    whole = rom3d.spatial_network(knit, points, scene.mesh.beam_size, joints=joints, stops=stops)
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
    scene: Scene, knit: Knit, points: JointPoints, outside: np.ndarray, contacts: xr.Dataset | None
) -> Joints:
    """Return what joins the beams: pins that yield as tied patches do, and springs or nothing where yarns touch."""
    joints = Joints.all_tied(len(outside))
    tied = tied_crossings(scene, knit.crossings)[outside]
    every = contacts_of_crossings(knit, scene.tie.radius).isel(crossing=outside)
    if not tied.all():
        if contacts is None:
            joints = replace(joints, open=~tied)
        else:
            measured = _measured(scene, contacts, every["normal"].to_numpy())
            joints = replace(joints, stiffness=np.where(tied[:, None, None], joints.stiffness, measured))
    return joints.pinned(_pins(scene, knit, points, every)) if tied.any() else joints


def _pins(scene: Scene, knit: Knit, points: JointPoints, contacts: xr.Dataset) -> np.ndarray:
    """Return the stiffness (K, 3, 3) [N/m] of tied patches of the scene's size."""
    radius = scene.tie.radius
    if not SMALLEST <= radius <= LARGEST:
        raise ConfigurationError(
            f"scene {scene.name!r}: tie.radius is {radius:g} but must be from {SMALLEST:g} to {LARGEST:g} where "
            "fidelity is window: beyond, no pins are known that yield as the ties around it do"
        )
    return patch_stiffness(knit, points, contacts, scene.yarn)


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
    """Return a network without what lies inside of the solid arcs."""
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
