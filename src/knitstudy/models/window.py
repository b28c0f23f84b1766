"""A window: solid yarns (`spline_yarns`) in some cells of a fabric whose other cells are a network of beams.

Solid yarns are arcs of the fabric's yarns; at their ends, the seams, nodes of beams carry whole sections.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from knitstudy.geometry.fabric import Fabric, pieces_of
from knitstudy.loading.gates import require_no_jump, require_sound
from knitstudy.loading.history import Meter, Stations, load_path
from knitstudy.loading.solve import Problem
from knitstudy.mechanics.beam_model import BeamModel
from knitstudy.mechanics.increment import Increment, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.solids_and_beams import MixedState, Seams, SolidsAndBeams
from knitstudy.mechanics.spline_yarn.space import Space
from knitstudy.mesh.mesher import Grips
from knitstudy.models import solids, spline_yarns
from knitstudy.models.discretisation import Discretisation
from knitstudy.models.network import Network, grips, tension
from knitstudy.models.solids import SolidYarns
from knitstudy.models.window_network import Window, cut_nodes, surroundings, touching_beams, window_of
from knitstudy.study.scene import Scene


def _solid_pieces(scene: Scene, pieces: Fabric) -> SolidYarns:
    """Return the solid yarns of a window: all crossings are tied, or all in contact."""
    tied = np.full(len(pieces.crossings.row), not scene.kind.interaction.touches)
    parts = spline_yarns.discretise(scene, pieces)
    ends = Grips(*(_carried(parts.space, last) for last in (0, -1)))
    return solids.assemble(scene, pieces, replace(parts, ends=ends), tied)


def end_sections(parts: Discretisation) -> np.ndarray:
    """Return the nodes (P, 2, 3) that the mean and the linear moments of both end sections of all pieces are."""
    ends = np.stack([parts.ends.held, parts.ends.driven]).reshape(2, -1, 3)
    return ends.swapaxes(0, 1)


def _carried(space: Space, last: int) -> np.ndarray:
    """Return the three nodes of the first (0) or last (-1) section of every piece that a beam's node carries."""
    first = [own.first_node[:-1][last] for own in space.yarns]
    return ((space.first_node[:-1] + first)[:, None] + np.arange(3)).ravel()


@dataclass(frozen=True, eq=False)
class MixedKnit:
    """A knit of beams with solid yarns in a window."""

    window: Window
    yarns: SolidYarns  # of the pieces: each solid arc of the window counts as a yarn
    network: Network
    beams: BeamModel  # of the network, without contact
    model: SolidsAndBeams
    # (S,) stations of the network, then sections of the pieces, in the order of yarns and arc lengths
    order: np.ndarray
    stations: Stations  # of all yarns, solid or not, in that order

    def station_displacement(self, state: MixedState, sections: np.ndarray) -> np.ndarray:
        """Return the displacement (S, 3) of all stations from that of the pieces' sections (k, 3) [m]."""
        beams = self.network.station_displacement(self.beams, state.frame)
        return np.concatenate([beams, sections])[self.order]


def mixed_knit(scene: Scene, fabric: Fabric, contacts: xr.Dataset | None = None) -> MixedKnit:
    """Return the knit of a scene with its window.

    Raises ConfigurationError as `window_of` and `surroundings`; MeshError as `_solid_pieces`; GeometryError if two
    joints of a yarn coincide.
    """
    window = window_of(scene, fabric)
    yarns = _solid_pieces(scene, pieces_of(fabric, window))
    network = surroundings(scene, fabric, window, contacts)
    beams = network.model(scene.yarn, scene.mesh.section_law)
    section = end_sections(yarns.parts).reshape(-1, 3)
    arms = yarns.parts.nodes[section[:, 1:]]
    seams = Seams(section, cut_nodes(network, window).ravel(), arms)
    order, stations = _stations(network, yarns, window)
    outer = touching_beams(scene, fabric, window, network, beams) if contacts is None else None
    model = SolidsAndBeams(yarns.model, outer or beams, seams)
    return MixedKnit(window, yarns, network, beams, model, order, stations)


def _stations(network: Network, yarns: SolidYarns, window: Window) -> tuple[np.ndarray, Stations]:
    """Return the order of all stations along the yarns, and the stations in it; seams are those of the network."""
    outer, inner = network.stations, solids.stations_of(yarns.parts.mesh, window)
    yarn, arc_length, position = (
        np.concatenate([getattr(each, name) for each in (outer, inner)])
        for name in ("yarn", "arc_length", "position")
    )
    order = np.lexsort((arc_length, yarn))
    return order, Stations(yarn[order], arc_length[order], position[order])


OF_CROSSINGS = ("crossing_force", "crossing_displacement", "section_gradient", "section_displacement")
"""Columns of the history with a value for every crossing."""


class WindowObserver:
    """Reports crossings by their numbers in the whole fabric, with nan for those outside of the window.

    Parameters
    ----------
    mixed : MixedKnit
    crossings : int
        K, of the whole fabric.
    """

    def __init__(self, mixed: MixedKnit, crossings: int) -> None:
        self.mixed, self.crossings = mixed, crossings

    def record(self, increment: Increment) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Return columns of the history, and of the points in contact."""
        mixed, state = self.mixed, increment.state
        columns, points = mixed.yarns.record(state.solids)
        for name in OF_CROSSINGS:
            columns[name] = self.of_all(columns[name])
        stations = columns["centreline_displacement"]
        columns["centreline_displacement"] = mixed.station_displacement(state, stations)
        return columns | self._seams(state), self._named(points)

    def _seams(self, state: Any) -> dict[str, np.ndarray | float]:
        """Return forces and moments of the beams on the solids at the seams, and the largest difference at a seam."""
        force, moment = self.mixed.model.seam_forces(state)
        return {
            "seam_force": -force[:, 1],
            "seam_moment": -moment[:, 1],
            "seam_jump": float(np.linalg.norm(force.sum(axis=1), axis=1).max()),
        }

    def of_all(self, values: np.ndarray) -> np.ndarray:
        """Return values (K, ...) of all crossings from those of the window (V, ...)."""
        every = np.full((self.crossings, *values.shape[1:]), np.nan)
        every[self.mixed.window.crossing] = values
        return every

    def _named(self, points: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the points in contact by crossings and yarns of the whole knit."""
        if not points:
            return {}
        window, here = self.mixed.window, points["crossing"]
        crossing = np.where(here < 0, -1, window.crossing[here])
        yarns = {name: window.yarn[points[name]] for name in ("yarn", "target")}
        return points | {"crossing": crossing} | yarns


def build(scene: Scene, fabric: Fabric, springs: xr.Dataset | None = None) -> Problem:
    """Return a scene with a window as a problem.

    Parameters
    ----------
    springs : Dataset, optional
        Contacts of the simulation that ``window.springs_from`` names.

    Raises
    ------
    ConfigurationError, GeometryError, MeshError
        As `mixed_knit`.
    """
    meter = Meter()
    mixed = mixed_knit(scene, fabric, springs)
    model, yarns, window = mixed.model, mixed.yarns, mixed.window
    motion = load_path(scene, fabric)
    ends = grips(mixed.network, fabric, scene.load.direction)
    prescribed = tension(ends, motion, scene.load.lateral)
    settings = Settings.of(scene.solver)
    if yarns.contact is not None:
        # Where contact begins, a parabola through earlier increments overshoots far into the other yarn.
        settings = replace(settings, predictor=1)
    count = len(fabric.crossings.row)
    observer = WindowObserver(mixed, count)
    shown = np.zeros(count, dtype=np.int8)
    shown[window.shown] = 1
    tied = np.zeros(count, dtype=np.int8)
    tied[window.crossing] = np.isfinite(yarns.ties.area)
    return Problem(
        scene=scene,
        model=model,
        prescribed=replace(prescribed, fixed=model.first_beam + prescribed.fixed),
        solver=LU(),
        settings=settings,
        motion=motion,
        driven=model.first_beam + 6 * ends.driven[:, None] + np.arange(3),
        stations=mixed.stations,
        observers=(observer,),
        checks=(partial(require_sound, scene, None), partial(require_no_jump, scene)),
        constants={
            "window_crossing": shown,
            "crossing_tied": tied,
            "tied_area": observer.of_all(yarns.ties.area),
            "tied_centroid": observer.of_all(yarns.ties.centroid),
            "seam_yarn": np.repeat(window.yarn, 2),
            "seam_arc_length": window.arc.ravel(),
        },
        attributes={
            "dof": model.size,
            "solid_unknowns": yarns.model.size,
            "elements": yarns.elements + len(mixed.network.ends),
            **yarns.attributes(),
        },
        meter=meter,
    )
