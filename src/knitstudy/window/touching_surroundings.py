"""Beams around a window in contact with each other, each with friction at the closest points of every crossing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from knitstudy.crossings.tied_crossings import tied_crossings
from knitstudy.geometry.pattern import Crossings, Knit
from knitstudy.loading.history import Stations
from knitstudy.mechanics.beam_contact.contact import BeamContact
from knitstudy.mechanics.beam_contact.curves import Curves
from knitstudy.mechanics.beam_contact.law import hertz
from knitstudy.mechanics.beam_contact.model import TouchingBeams
from knitstudy.mechanics.beam_model import BeamModel
from knitstudy.networks.beams.pairs import point_pairs
from knitstudy.networks.rom.network import Network
from knitstudy.study.scene import Scene
from knitstudy.window.cells import Window

STICK = 10.0
"""Stiffness against elastic slip over E R, as of beams in contact (`beam.stiffness`)."""


def touching_beams(
    scene: Scene, knit: Knit, window: Window, network: Network, beams: BeamModel
) -> TouchingBeams | None:
    """Return beams with contact at all crossings outside of the window that are not tied; None if there are none.

    Raises
    ------
    GeometryError
        If a piece of yarn has too few nodes for a smooth centreline.
    """
    if not scene.kind.interaction.touches:
        return None
    open_ones = ~tied_crossings(scene, knit.crossings)
    open_ones[window.crossing] = False
    if not open_ones.any():
        return None
    chain = chains(network)
    curves = Curves(chain, network.stations.arc_length)
    outside = np.setdiff1d(np.arange(len(open_ones)), window.crossing)
    pairs = point_pairs(
        _on_chains(knit.crossings, outside, network.stations, chain),
        np.flatnonzero(open_ones[outside]),
        curves.length,
    )
    yarn = scene.yarn
    law = hertz(yarn.youngs_modulus, yarn.poisson_ratio, yarn.radius, "point")
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
    part = Crossings(**{name: getattr(crossings, name)[chosen] for name in Crossings.__dataclass_fields__})
    # Places of all stations on one axis, yarn after yarn, as the network has them.
    longest = 2 * stations.arc_length.max()
    places = longest * stations.yarn + stations.arc_length
    nearest = np.searchsorted(places, longest * part.yarn + part.arc_length)
    return replace(part, yarn=chain[nearest])
