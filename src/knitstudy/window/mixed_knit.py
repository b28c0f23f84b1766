"""A knit with a window, put together: solid pieces, beams around them, and the seams between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.geometry.pattern import Knit
from knitstudy.geometry.pieces import Pieces
from knitstudy.loading.history import Stations
from knitstudy.mechanics.beam_model import BeamModel
from knitstudy.mechanics.seams import Seams
from knitstudy.mechanics.solids_and_beams import MixedState, SolidsAndBeams
from knitstudy.networks.rom.network import Network
from knitstudy.solids.solid_yarns import SolidYarns
from knitstudy.study.scene import Scene
from knitstudy.window.cells import Window, window_of
from knitstudy.window.solid_pieces import end_sections, solid_pieces
from knitstudy.window.surroundings import cut_nodes, surroundings
from knitstudy.window.touching_surroundings import touching_beams


@dataclass(frozen=True, eq=False)
class MixedKnit:
    """A knit of beams with solid yarns in a window.

    Attributes
    ----------
    window : Window
    yarns : SolidYarns
        The pieces; what it calls yarns are solid arcs of the window.
    network : Network
    beams : BeamModel
        Of the network, without contact.
    model : SolidsAndBeams
    order : ndarray of int, shape (S,)
        Stations of the network, then sections of the pieces, in the order of yarns and arc lengths.
    stations : Stations
        Of all yarns, solid or not, in that order.
    """

    window: Window
    yarns: SolidYarns
    network: Network
    beams: BeamModel
    model: SolidsAndBeams
    order: np.ndarray
    stations: Stations

    def station_displacement(self, state: MixedState, sections: np.ndarray) -> np.ndarray:
        """Return the displacement (S, 3) of all stations from that of the pieces' sections (k, 3) [m]."""
        beams = self.network.station_displacement(self.beams, state.frame)
        return np.concatenate([beams, sections])[self.order]


def mixed_knit(scene: Scene, knit: Knit, contacts: xr.Dataset | None = None) -> MixedKnit:
    """Return the knit of a scene with its window.

    Raises
    ------
    ConfigurationError
        As `window_of` and `surroundings`.
    MeshError
        As `solid_pieces`.
    GeometryError
        If two joints of a yarn coincide.
    """
    window = window_of(scene, knit)
    yarns = solid_pieces(scene, Pieces(knit, window))
    network = surroundings(scene, knit, window, contacts)
    beams = network.model(scene.yarn, scene.mesh.section_law)
    section = end_sections(yarns.parts).reshape(-1, 3)
    arms = yarns.parts.nodes[section[:, 1:]]
    seams = Seams(section, cut_nodes(network, window).ravel(), arms)
    order, stations = _stations(network, yarns, window)
    outer = touching_beams(scene, knit, window, network, beams) if contacts is None else None
    model = SolidsAndBeams(yarns.model, outer or beams, seams)
    return MixedKnit(window, yarns, network, beams, model, order, stations)


def _stations(network: Network, yarns: SolidYarns, window: Window) -> tuple[np.ndarray, Stations]:
    """Return the order of all stations along the yarns, and the stations in it; seams are those of the network."""
    mesh, outer = yarns.parts.mesh, network.stations
    piece = mesh.yarn_of_slice
    yarn = np.concatenate([outer.yarn, window.yarn[piece]])
    arc_length = np.concatenate([outer.arc_length, window.arc[piece, 0] + mesh.arc_length])
    position = np.concatenate([outer.position, mesh.centres])
    order = np.lexsort((arc_length, yarn))
    return order, Stations(yarn[order], arc_length[order], position[order])
