"""Beams in contact with each other as a model that a solver can drive."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.beam_contact.contact import (
    BeamContact,
    BeamContactHistory,
    BeamContactPoints,
    Places,
)
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.model import Response
from knitstudy.mechanics.rotation import hat


@dataclass(frozen=True, eq=False)
class TouchingState:
    """Configuration of beams, and what their contact remembers."""

    beams: BeamState
    history: BeamContactHistory


class TouchingBeams:
    """Beams, and the contact of the stations along them.

    Parameters
    ----------
    beams : BeamModel
        With arms that turn, if it has any.
    node : ndarray of int, shape (S,)
        Node that carries a station.
    offset : ndarray, shape (S, 3)
        From that node to the station, in the reference [m].
    contact : BeamContact
    """

    def __init__(self, beams: BeamModel, node: np.ndarray, offset: np.ndarray, contact: BeamContact) -> None:
        self.beams, self.node, self.offset, self.contact = beams, node, offset, contact
        self.block, self.size, self.scale, self.length = beams.block, beams.size, beams.scale, beams.length

    def start(self) -> TouchingState:
        """Return the reference state."""
        beams = self.beams.start()
        return TouchingState(beams, self.contact.start(self.places(beams)))

    def advance(self, state: TouchingState, step: np.ndarray) -> TouchingState:
        """Return the state a step (size,) further: translations [m] and spins [rad] from the left."""
        return replace(state, beams=self.beams.advance(state.beams, step))

    def begin(self, state: TouchingState, load: float, change: float) -> TouchingState:
        """Return the state in which an increment starts."""
        return state

    def settle(self, state: TouchingState) -> None:
        """Return None: a balanced state is a converged one."""
        return None

    def commit(self, state: TouchingState) -> TouchingState:
        """Return the state that a converged increment leaves."""
        return replace(state, history=self.contact.commit(self.places(state.beams), state.history))

    def places(self, beams: BeamState) -> Places:
        """Return where the stations are."""
        return Places(self.beams.carried(beams, self.node, self.offset), beams.rotation[self.node])

    def points(self, state: TouchingState) -> BeamContactPoints:
        """Return all pairs that may touch."""
        return self.contact.points(self.places(state.beams), state.history)

    def respond(self, state: TouchingState, stiffness: bool) -> Response:
        """Return force, energies and, if asked, tangent of a state."""
        response = self.beams.respond(state.beams, stiffness)
        places = self.places(state.beams)
        touch = self.contact.respond(places, state.history, stiffness)
        arm = places.position - state.beams.position[self.node]
        force = response.force.reshape(-1, 6).copy()
        at_node = touch.station_force.copy()
        at_node[:, 3:] += np.cross(arm, touch.station_force[:, :3])
        np.add.at(force, self.node, at_node)
        response = replace(
            response,
            force=force.ravel(),
            energy=response.energy | touch.energy,
            status=touch.points.status,
        )
        if not stiffness:
            return response
        full = self._at_nodes(touch.stations, touch.stiffness, touch.station_force, arm)
        return replace(response, stiffness=sp.bsr_matrix(response.stiffness + full, blocksize=(6, 6)))

    def _at_nodes(
        self, stations: np.ndarray, stiffness: np.ndarray, station_force: np.ndarray, arm: np.ndarray
    ) -> sp.bsr_matrix:
        """Return the stiffness of stations (a, 16), (a, 96, 96) over all nodes, their arms eliminated."""
        motion = np.tile(np.eye(6), (len(self.node), 1, 1))  # of a station by that of its node
        motion[:, :3, 3:] = -hat(arm)
        carried = motion[stations]  # (a, 16, 6, 6)
        blocks = stiffness.reshape(-1, 16, 6, 16, 6).transpose(0, 1, 3, 2, 4)
        blocks = np.swapaxes(carried, 2, 3)[:, :, None] @ blocks @ carried[:, None]
        # An arm turns under the force at its end: d(r x F) = F^ r^ w.
        turning = np.zeros((len(self.node), 6, 6))
        turning[:, 3:, 3:] = hat(station_force[:, :3]) @ hat(arm)
        held = np.flatnonzero(np.any(turning != 0, axis=(1, 2)))
        node = self.node[stations]
        row = np.concatenate([np.repeat(node, 16, axis=1).ravel(), self.node[held]])
        column = np.concatenate([np.tile(node, (1, 16)).ravel(), self.node[held]])
        return _summed(row, column, np.concatenate([blocks.reshape(-1, 6, 6), turning[held]]), self.size // 6)


def _summed(row: np.ndarray, column: np.ndarray, blocks: np.ndarray, count: int) -> sp.bsr_matrix:
    """Sum blocks (b, 6, 6) at rows and columns (b,) into a matrix over `count` nodes."""
    shape = (6 * count, 6 * count)
    if not len(row):
        return sp.bsr_matrix(shape, blocksize=(6, 6))
    key = row.astype(np.int64) * count + column
    order = np.argsort(key, kind="stable")
    start = np.flatnonzero(np.diff(key[order], prepend=-1))
    unique = key[order[start]]
    indptr = np.searchsorted(unique, count * np.arange(count + 1, dtype=np.int64)).astype(np.int32)
    data = np.add.reduceat(blocks[order], start, axis=0)
    return sp.bsr_matrix((data, (unique % count).astype(np.int32), indptr), shape=shape)
