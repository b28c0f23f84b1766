"""Endless beams between two rigid plates without friction.

A plate is a mirror: a yarn that it presses touches its own image as it touches another yarn, and half of the energy of
both is its own. So contact of yarns (`beams.line_contact`) is that with plates as well, for all laws, bends and angles:
of points and of their images x_m = (x, y, 2 h - z) by plates at heights h. The force on a plate is that between both.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.beams.beam import LineHistory
from knitstudy.mechanics.beams.contact_points import Spread
from knitstudy.mechanics.beams.laws import Mixed
from knitstudy.mechanics.beams.line_contact import LineContact
from knitstudy.mechanics.beams.pair_search import PairSearch, PointPairs
from knitstudy.mechanics.cells.beams import EndlessBeams, EndlessState
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.core.model import Memoryless, Response, summed


class MirrorSearch(PairSearch):
    """Pairs of a point and of an image, by either of two plates, of a point of the same piece of yarn.

    A piece is as long as a yarn does not touch itself. The image of another piece is farther away than that piece.
    """

    def __init__(self, search: PairSearch, period: Floats) -> None:
        yarn = search.yarn
        s = search.arc_length
        n = len(search.yarn)
        begin, end = (np.searchsorted(yarn, yarn, side=side)[:, None] for side in ("left", "right"))
        spacing = np.diff(s)
        beside = np.broadcast_to(search.beside, n)[:, None]
        reach = int(np.ceil(beside.max() / spacing[spacing > 0].min()))
        along = np.arange(n)[:, None] - begin + np.arange(-reach, reach + 1)
        around, place = np.divmod(along, end - begin)  # periods, and points of the yarn
        apart = s[begin + place] + around * period[yarn][:, None] - s[:, None]
        near = np.abs(apart) <= beside
        i = np.nonzero(near)[0]
        j = (begin + place)[near]
        image = around[near][:, None] * [1, 0]
        both = (np.tile(i, 2), np.append(n + j, 2 * n + j), np.tile(image, (2, 1)))
        key = np.arange(2 * len(i))
        self._every = PointPairs(*both, np.zeros((len(key), 3)), key)

    def within(self, reach: float, far: float, position: Floats, vectors: Floats) -> PointPairs:
        """Return the pairs within a reach [m] of points and images (3 n, 3) and lattice vectors (2, 3) [m]."""
        pairs = self._every
        way = position[pairs.j] + pairs.image @ vectors - position[pairs.i]
        return replace(pairs, way=way)[np.flatnonzero(np.einsum("ki,ki->k", way, way) < reach**2)]


@dataclass(frozen=True, eq=False)
class PressedState:
    """Configuration of a cell and of the plates."""

    cell: EndlessState
    closed: float = 0.0  # by how much the plates have come nearer to each other [m]
    began: float = 0.0  # the same where the increment began [m]


class PressedBeams(Memoryless):
    """Endless beams between plates that touch them at first; the last unknown is by how much these have closed [m].

    Its force is that of either plate. The cell may move along z between them.
    """

    block = 1

    def __init__(self, cell: EndlessBeams, force: float = 0.0) -> None:
        """`force` closes the plates [N]; during relaxation it grows with the diameter of the yarns."""
        self.cell = cell
        self.force = force
        self.length = cell.length
        self.size = cell.size + 1
        self.scale = np.append(cell.scale, 1.0)
        self.drag = np.append(cell.drag, cell.drag[-1])
        start = cell.start()
        line = cell.contact
        period = cell.contact.search.period
        assert period is not None, "the yarns of a cell repeat themselves"
        height = cell.at_points(start).position[:, 2]
        radius = 0.5 * line.of_diameter(cell.diameter(start)).repulsion.own_diameter
        # of both plates at first [m]
        self.heights = np.array([np.min(height - radius), np.max(height + radius)])
        self.thickness = float(np.ptp(self.heights))
        n = len(line.yarn)
        yarn = np.concatenate([line.yarn + k * len(period) for k in range(3)])
        of_points = yarn, np.tile(line.arc_length, 3), np.tile(line.weight, 3)
        law = line.repulsion
        law = replace(law, kind=np.tile(law.kind, 3)) if isinstance(law, Mixed) else law
        self.contact = LineContact(*of_points, law, period=np.tile(period, 3))
        self.contact.search = MirrorSearch(line.search, period)
        self.contact.weight[n:] *= 0.5  # a pair of a point and an image has half of the energy
        points = sp.csr_matrix(cell.points.spread(cell.moves).matrix)
        images = sp.kron(sp.identity(n), sp.diags([1.0, 1.0, -1.0, 0.0, 0.0, 0.0])) @ points[:-6]
        up = np.tile([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], n)[:, None]  # twice what the lower plate moves
        rows = [[points[:-6], None], [images, up], [images, -up], [points[-6:], None]]
        self._spread = Spread(sp.bmat(rows, format="csr"))

    def name_of(self, unknown: int) -> str:
        """Return what an unknown is, in words."""
        return self.cell.name_of(unknown) if unknown < self.cell.size else "the plates"

    def sticking(self) -> PressedBeams:
        """Return the model whose yarns stick wherever they touch."""
        model = copy(self)
        model.cell = self.cell.sticking()
        return model

    def cell_state(self, state: PressedState) -> EndlessState:
        """Return the state of the cell between the plates."""
        return state.cell

    def start(self) -> PressedState:
        """Return the state in which the load begins."""
        return PressedState(self.cell.start())

    def advance(self, state: PressedState, step: Floats) -> PressedState:
        """Return the state a step (size,) further."""
        return replace(state, cell=self.cell.advance(state.cell, step[:-1]), closed=state.closed + step[-1])

    def begin(self, state: PressedState, load: float, change: float) -> PressedState:
        """Return the state in which an increment to a load factor starts."""
        return PressedState(self.cell.begin(state.cell, load, change), state.closed, state.closed)

    def commit(self, state: PressedState) -> PressedState:
        """Return the state that a converged increment leaves."""
        return PressedState(self.cell.commit(state.cell), state.closed, state.closed)

    def respond(self, state: PressedState, stiffness: bool) -> Response:
        """Return forces, energies and, if asked, the tangent."""
        answer = self.cell.respond(state.cell, stiffness)
        drag = self.drag[-1]
        points = self.cell.at_points(state.cell)
        position, rotation = np.tile(points.position, (3, 1, 1)), np.tile(points.rotation, (3, 1, 1))
        position[1:] *= [1.0, 1.0, -1.0]
        position[1:, :, 2] += (2 * self.heights + [state.closed, -state.closed])[:, None]
        images = replace(points, position=position.reshape(-1, 3), rotation=rotation)
        on_points, energy, tangent = self.contact.of_diameter(self.cell.diameter(state.cell)).respond(
            images, self.cell.vectors(state.cell), LineHistory.none(), stiffness, spread=self._spread
        )
        closing = drag * (state.closed - state.began) - self.force * state.cell.beams.released
        total = None
        if stiffness:
            total = sp.csr_matrix(sp.block_diag([answer.stiffness, [[drag]]]) + tangent)
            total.sort_indices()
        force = np.append(answer.force, closing) + self._spread.forces(on_points)
        return replace(answer, force=force, energy=summed(answer.energy, energy), stiffness=total)
