"""Where a reduced model is held and driven, and how (section 2.3 of the paper)."""

from __future__ import annotations

import numpy as np

from knitstudy.geometry.arcs import gripped_arcs, inside
from knitstudy.geometry.pattern import Knit
from knitstudy.loading.load_path import Motion
from knitstudy.mechanics.increment import PrescribedDisplacement
from knitstudy.mesh.grips import Grips
from knitstudy.networks.rom.network import Network

SPINS = range(3, 6)


def grips(network: Network, knit: Knit, direction: str) -> Grips:
    """Return the grips of a load direction.

    In course tension these are the ends of all yarns; in wale tension the stations on the sinker arcs of the bottom
    yarn and on the head arcs of the top yarn.
    """
    if direction == "course":
        return Grips(network.end_nodes("left"), network.end_nodes("right"))
    stations = network.stations
    arcs = gripped_arcs(knit, direction)
    parts = [(stations.yarn == yarn) & inside(stations.arc_length, arcs[yarn]) for yarn in sorted(arcs)]
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
