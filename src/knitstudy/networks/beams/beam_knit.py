"""Yarns as chains of beams, tied where the scene ties them and in contact at all other crossings.

Ties are rigid: two sections that are joined by arms move and turn as one, as in the tied reduced model. Pinned ones
hold the same two points together and leave the turning free, as a tie of a small patch of two solid yarns nearly does;
with ties "patch" they yield as well, by as much as such a patch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.crossings.tied_crossings import tied_crossings
from knitstudy.geometry.arcs import grip_ends
from knitstudy.geometry.pattern import Knit
from knitstudy.mechanics.beam_contact.contact import BeamContact
from knitstudy.mechanics.beam_contact.curves import Curves
from knitstudy.mechanics.beam_contact.law import Power, hertz
from knitstudy.mechanics.beam_contact.model import TouchingBeams
from knitstudy.networks.beams.neighbours import Neighbours
from knitstudy.networks.beams.pairs import line_pairs, point_pairs
from knitstudy.networks.rom import rom3d
from knitstudy.networks.rom.crossing_contacts import contacts_of_crossings
from knitstudy.networks.rom.joints import Joints
from knitstudy.networks.rom.network import Network
from knitstudy.networks.rom.patch_joint import patch_stiffness
from knitstudy.networks.rom.points import JointPoints
from knitstudy.study.scene import Scene


@dataclass(frozen=True, eq=False)
class BeamKnit:
    """A knit of beams in contact.

    Attributes
    ----------
    network : Network
    model : TouchingBeams
    tied : ndarray of bool, shape (K,)
        Crossings that are joined at their closest points.
    neighbours : Neighbours
    """

    network: Network
    model: TouchingBeams
    tied: np.ndarray
    neighbours: Neighbours


def beam_knit(scene: Scene, knit: Knit) -> BeamKnit:
    """Return the beams of a scene.

    Raises
    ------
    ConfigurationError
        If ``mesh.beam_size`` is not positive.
    DataFileError
        If ties yield and are of a size that is not known (`networks.rom.patch_joint`).
    GeometryError
        If two ties of a yarn coincide, or a yarn has too few nodes for a smooth centreline.
    """
    crossings = knit.crossings
    tied = tied_crossings(scene, crossings)
    points = JointPoints(
        crossings.yarn[tied],
        crossings.arc_length[tied],
        crossings.point[tied],
        crossings.point[tied].mean(axis=1),
    )
    joints = Joints.all_tied(len(points.yarn))
    if scene.beam.tie == "pinned":
        # As stiff as contact that sticks, and never open.
        joints = joints.pinned(_penalty(scene, "point"))
    elif scene.beam.tie == "patch" and tied.any():
        discs = contacts_of_crossings(knit, scene.tie.radius).isel(crossing=tied)
        joints = joints.pinned(patch_stiffness(knit, points, discs, scene.yarn))
    stops = grip_ends(knit, scene.load.direction)
    network = rom3d.spatial_network(knit, points, scene.mesh.beam_size, joints=joints, stops=stops)
    beams = network.model(scene.yarn, scene.mesh.section_law)
    stations = network.stations
    curves = Curves(stations.yarn, stations.arc_length)
    model = TouchingBeams(
        beams, network.station_node, network.station_offset, beam_contact(scene, knit, curves, ~tied)
    )
    return BeamKnit(network, model, tied, Neighbours(curves, stations.yarn, crossings, scene.yarn.radius))


def beam_contact(scene: Scene, knit: Knit, curves: Curves, touching: np.ndarray) -> BeamContact:
    """Return the contact of a scene at the crossings that `touching` (K,) says.

    The stiffness against elastic slip is ``beam.stiffness`` whatever the sections do: Hertz's approach is normal.
    """
    yarn, mode = scene.yarn, scene.beam.contact
    chosen = np.flatnonzero(touching)
    if mode == "point":
        pairs = point_pairs(knit.crossings, chosen, curves.length)
    else:
        pairs = line_pairs(knit.crossings, chosen, curves.length, yarn.radius)
    penalty = _penalty(scene, mode)
    law = Power(penalty)
    if scene.beam.section == "hertz":
        law = hertz(yarn.youngs_modulus, yarn.poisson_ratio, yarn.radius, mode)
    return BeamContact(curves, pairs, yarn.radius, law, penalty, scene.kind.interaction.friction(scene))


def _penalty(scene: Scene, mode: str) -> float:
    """Return ``beam.stiffness`` in N/m at a point, in N/m2 along a line."""
    stiffness = scene.beam.stiffness * scene.yarn.youngs_modulus
    return stiffness * scene.yarn.radius if mode == "point" else stiffness
