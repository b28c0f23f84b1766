"""A network of beams that stands for a knit: what both reduced models give to the solver and the history."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from knitstudy.loading.history import Stations
from knitstudy.mechanics.beam import Section, SectionLaw
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.curved_section import CurvedSection
from knitstudy.mechanics.spring import LinearSprings
from knitstudy.networks.rom.joints import Joints
from knitstudy.study.sections.yarn import Yarn


@dataclass(frozen=True)
class Network:
    """Yarns as chains of straight beam elements, joined where they touch.

    Attributes
    ----------
    nodes : ndarray, shape (N, 3)
        Nodes that carry unknowns [m].
    ends : ndarray of int, shape (E, 2)
        Node at either end of every element.
    offsets : ndarray, shape (E, 2, 3)
        From that node to the end of the element [m].
    arms_turn : bool
        Whether offsets are rigid arms; see `BeamModel`.
    yarns_side_by_side : ndarray, shape (E,)
        Yarns that an element stands for.
    stations : Stations
        The points of all yarns, one yarn after the other, in order of arc length.
    station_node : ndarray of int, shape (S,)
        Node that carries a station.
    station_offset : ndarray, shape (S, 3)
        From that node to the station [m].
    beam_nodes : int
        Nodes of the beams before joints are eliminated; the paper counts degrees of freedom as 6 times this.
    springs : LinearSprings
        Springs between yarns.
    joints : Joints or None
        What joins the yarns at each crossing; None where crossings are nodes of the network.
    curvature : ndarray, shape (E, 3), or None
        Mean curvature vector t x dt/ds of the undeformed yarn over every element [1/m]; None where elements do not
        follow a yarn.
    height : float or None
        Of its rows, which strains along the wales refer to; None where it is that of the knit [m].
    """

    nodes: np.ndarray
    ends: np.ndarray
    offsets: np.ndarray
    arms_turn: bool
    yarns_side_by_side: np.ndarray
    stations: Stations
    station_node: np.ndarray
    station_offset: np.ndarray
    beam_nodes: int
    springs: LinearSprings = field(default_factory=LinearSprings.none)
    joints: Joints | None = None
    curvature: np.ndarray | None = None
    height: float | None = None

    def section(self, yarn: Yarn, law: str) -> SectionLaw:
        """Return the section of the elements; law "straight", or "curved" where elements follow a yarn."""
        if law == "curved" and self.curvature is not None:
            return CurvedSection(yarn.radius, yarn.youngs_modulus, yarn.poisson_ratio, self.curvature)
        return Section.circular(
            yarn.diameter, yarn.youngs_modulus, yarn.poisson_ratio, self.yarns_side_by_side
        )

    def model(self, yarn: Yarn, law: str) -> BeamModel:
        """Return the network as beams of circular yarn, with the law of `section`."""
        section = self.section(yarn, law)
        return BeamModel(
            self.nodes, self.ends, section, yarn.radius, self.offsets, self.arms_turn, self.springs
        )

    def end_nodes(self, side: str) -> np.ndarray:
        """Return the nodes (Y,) at the "left" or "right" ends of the yarns."""
        yarn = self.stations.yarn
        last = np.flatnonzero(np.append(np.diff(yarn) != 0, True))
        return self.station_node[{"left": np.append(0, last[:-1] + 1), "right": last}[side]]

    def station_displacement(self, model: BeamModel, state: BeamState) -> np.ndarray:
        """Return the displacement (S, 3) of the stations [m]."""
        return model.carried(state, self.station_node, self.station_offset) - self.stations.position
