"""Endless beams between two rigid plates without friction.

The mirror image of a yarn behind a plate keeps its distance from the plate: a yarn that is pressed to a plate touches
its own image as it touches another yarn, and half of the energy of both is its own. Contact of yarns
(`beams.line_contact`) therefore is the contact with plates as well, for all laws, bends and angles: of points and of
their mirror images, which follow them and the plate. With the height h of a plate an image is at

    x_m = (x, y, 2 h - z),   and the force on the plate is that of the two yarns on each other.

Images by the lattice lie in the plane of the plates, so that images of images need no rule of their own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.arrays import Floats
from knitstudy.mechanics.beams.beam import BeamState, LineHistory
from knitstudy.mechanics.beams.contact_points import Spread
from knitstudy.mechanics.beams.line_contact import LineContact
from knitstudy.mechanics.beams.pair_search import PairSearch, PointPairs
from knitstudy.mechanics.model import Memoryless, Response, summed
from knitstudy.mechanics.periodic import EndlessBeams, EndlessState


class MirrorSearch(PairSearch):
    """Pairs of a point and of the mirror image of a point of the same piece of yarn.

    The piece is as long as a yarn does not touch itself. The image of another piece is farther away than the piece.
    """

    def __init__(self, search: PairSearch, spacing: float) -> None:
        assert search.period is not None, "the yarns of a cell repeat themselves"
        self.yarn, n = search.yarn, len(search.yarn)
        reach = int(np.ceil(search.beside / spacing))
        begin, end = (np.searchsorted(self.yarn, self.yarn, side=side) for side in ("left", "right"))
        count, along = (end - begin)[:, None], np.arange(-reach, reach + 1)
        around, place = np.divmod((np.arange(n) - begin)[:, None] + along, count)
        apart = search.arc_length[begin[:, None] + place] + around * search.period[self.yarn][:, None]
        near = np.abs(apart - search.arc_length[:, None]) <= search.beside
        i, j, image = np.nonzero(near)[0], n + (begin[:, None] + place)[near], around[near]
        image = np.column_stack([image, np.zeros_like(image)])
        self._every = PointPairs(i, j, image, np.zeros((len(i), 3)), np.arange(len(i)))

    def within(self, reach: float, far: float, position: Floats, vectors: Floats) -> PointPairs:
        """Return the pairs within a reach [m] of points and their images (2 n, 3) and lattice vectors (2, 3) [m]."""
        pairs = self._every
        way = position[pairs.j] + pairs.image @ vectors - position[pairs.i]
        return replace(pairs, way=way)[np.flatnonzero(np.einsum("ki,ki->k", way, way) < reach**2)]


def mirrored_contact(contact: LineContact) -> LineContact:
    """Return the contact of n points of yarns that repeat themselves with their n mirror images."""
    period = contact.search.period
    assert period is not None, "the yarns of a cell repeat themselves"
    yarn = np.concatenate([contact.yarn, contact.yarn + len(period)])
    arc_length, weight = (np.tile(each, 2) for each in (contact.arc_length, contact.weight))
    both = LineContact(yarn, arc_length, weight, contact.repulsion, period=np.tile(period, 2))
    # Half of the energy; a pair has one point and one image.
    both.weight = np.append(contact.weight, 0.5 * contact.weight)
    both.search = MirrorSearch(contact.search, float(contact.weight.min()))
    return both


@dataclass(frozen=True, eq=False)
class PressedState:
    """Configuration of a cell and of the plates."""

    cell: EndlessState
    closed: float = 0.0  # by how much the plates have come nearer to each other [m]
    began: float = 0.0  # the same where the increment began [m]


class PressedBeams(Memoryless):
    """Endless beams between two plates that touch them at first; the last unknown is by how much they have closed [m].

    Its force is that of either plate, which closes them where it is positive. The cell may move along z between them.
    """

    block = 1

    def __init__(
        self,
        cell: EndlessBeams,
        force: float = 0.0,  # that closes the plates; grows with the diameter on a way to rest [N]
    ) -> None:
        self.cell, self.force = cell, force
        self.size = cell.size + 1
        self.scale, self.length = np.append(cell.scale, 1.0), cell.length
        self._drag = cell.drag_of_lattice
        self.contact = mirrored_contact(cell.contact)
        start = cell.start()
        height, radius = cell.at_points(start).position[:, 2], 0.5 * cell.diameter(start)
        self.heights = height.min() - radius, height.max() + radius  # of both plates at first [m]
        self._spread = [self._images_follow(moves) for moves in (1.0, -1.0)]

    @property
    def thickness(self) -> float:
        """Distance of the plates at first [m]."""
        return float(self.heights[1] - self.heights[0])

    def _images_follow(self, moves: float) -> Spread:
        """Return how points and images follow the unknowns; a plate moves by half of this times what they close."""
        points = sp.csr_matrix(self.cell.points.spread(self.cell.moves).matrix)
        own, lattice = points[:-6], points[-6:]
        n = own.shape[0] // 6
        across = np.tile([0.0, 0.0, moves, 0.0, 0.0, 0.0], n)[:, None]
        turned = sp.kron(sp.identity(n), sp.diags([1.0, 1.0, -1.0, 0.0, 0.0, 0.0])) @ own
        return Spread(sp.bmat([[own, None], [turned, across], [lattice, None]], format="csr"))

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
        answer, vectors = self.cell.respond(state.cell, stiffness), self.cell.vectors(state.cell)
        contact = self.contact.of_diameter(self.cell.diameter(state.cell))
        closing = self._drag * (state.closed - state.began) - self.force * state.cell.beams.released
        force, energy = np.append(answer.force, closing), answer.energy
        tangents = [sp.block_diag([answer.stiffness, [[self._drag]]], format="csr")] if stiffness else []
        for height, moves, spread in zip(self.heights, (1.0, -1.0), self._spread, strict=True):
            points = self._with_images(state, height + 0.5 * moves * state.closed)
            on_points, stored, tangent = contact.respond(
                points, vectors, LineHistory.none(), stiffness, spread=spread
            )
            force = force + spread.forces(on_points)
            energy = summed(energy, {"penalty": stored["penalty"]})
            tangents += [] if tangent is None else [sp.csr_matrix(tangent)]
        total = reduce(add, tangents) if stiffness else None
        if total is not None:
            total.sort_indices()
        return replace(answer, force=force, energy=energy, stiffness=total)

    def _with_images(self, state: PressedState, height: float) -> BeamState:
        """Return the points and their images (2 n,) by a plate at a height [m]."""
        points = self.cell.at_points(state.cell)
        images = points.position * [1.0, 1.0, -1.0] + [0.0, 0.0, 2 * height]
        position, rotation = np.concatenate([points.position, images]), np.tile(points.rotation, (2, 1, 1))
        return replace(points, position=position, rotation=rotation)
