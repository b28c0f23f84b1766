"""What happens at every crossing of beams in contact, increment by increment."""

from __future__ import annotations

import numpy as np

from knitstudy.geometry.pattern import Crossings
from knitstudy.mechanics.beam_contact.contact import Places
from knitstudy.mechanics.beam_contact.model import TouchingState
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.networks.beams.beam_knit import BeamKnit
from knitstudy.study.scene import Scene


class CrossingRecord:
    """Forces, displacements, gaps and slip at crossings.

    Parameters
    ----------
    beams : BeamKnit
    crossings : Crossings
    scene : Scene
    """

    def __init__(self, beams: BeamKnit, crossings: Crossings, scene: Scene) -> None:
        self._model, self._tied, self._radius = beams.model, beams.tied, scene.yarn.radius
        self._count = len(crossings.row)
        network, yarn = beams.network, scene.yarn
        stations = network.stations
        first = np.flatnonzero(stations.yarn[1:] == stations.yarn[:-1])
        # Yarns without their ties: what they resist at a tied station is what the tie supplies.
        self._apart = BeamModel(
            stations.position,
            np.column_stack([first, first + 1]),
            network.section(yarn, scene.mesh.section_law),
            yarn.radius,
        )
        curves = self._model.contact.curves
        self._lower = self._nearest(stations.yarn, stations.arc_length, crossings)
        self._stencil = [curves.stencil(crossings.yarn[:, i], crossings.arc_length[:, i]) for i in (0, 1)]
        middle = crossings.point.mean(axis=1)
        self._arm = middle[:, None] - np.stack(
            [each.of(each.value, stations.position) for each in self._stencil], axis=1
        )
        self._rest = middle

    def _nearest(self, yarn: np.ndarray, arc_length: np.ndarray, crossings: Crossings) -> np.ndarray:
        """Stations (K,) of the lower row's yarn at its tied crossings."""
        station = np.zeros(self._count, dtype=int)
        for k in np.flatnonzero(self._tied):
            distance = np.where(
                yarn == crossings.yarn[k, 0], np.abs(arc_length - crossings.arc_length[k, 0]), np.inf
            )
            station[k] = int(np.argmin(distance))
        return station

    def columns(self, state: TouchingState) -> dict[str, np.ndarray]:
        """Return the columns of a converged state for the history.

        Slip has been committed with the state; forces and gaps are those of its positions.
        """
        contact, places = self._model.contact, self._model.places(state.beams)
        points = self._model.points(state)
        slip = np.full(self._count, np.nan)
        slip[~self._tied] = state.history.slip[np.flatnonzero(~self._tied)]
        force = contact.crossing_force(points, self._count)
        apart = BeamState(places.position, places.rotation)
        station_force = self._apart.respond(apart, stiffness=False).force.reshape(-1, 6)[:, :3]
        force[self._tied] = station_force[self._lower[self._tied]]
        gap = contact.crossing_gap(points, self._count)
        gap[self._tied] = self._gap_of_points(places)[self._tied]
        return {
            "crossing_force": force,
            "crossing_displacement": self._displacement(places),
            "crossing_gap": gap,
            "crossing_slip": slip,
        }

    def _gap_of_points(self, places: Places) -> np.ndarray:
        """Gap (K,) of the yarns at the points of their centrelines that were closest at rest [m]: what a tie leaves."""
        one, other = (each.of(each.value, places.position) for each in self._stencil)
        return np.linalg.norm(other - one, axis=1) - 2 * self._radius

    def _displacement(self, places: Places) -> np.ndarray:
        """Displacement (K, 2, 3) of the points of both surfaces that faced each other at rest [m]."""
        sides = [
            each.of(each.value, places.position)
            + np.einsum("kp,kpij,kj->ki", each.value, places.rotation[each.stations], self._arm[:, side])
            for side, each in enumerate(self._stencil)
        ]
        return np.stack(sides, axis=1) - self._rest[:, None]
