"""Beams of yarns that repeat themselves in two directions, and touch each other and their images."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.beams.beam import BeamState, LineHistory
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.line_contact import ROUGH, SOFT, LineContact
from knitstudy.mechanics.beams.line_friction import ActivePairs
from knitstudy.mechanics.cells.lattice import STRAINS, Lattice
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.model import Memoryless, Response, summed

# Where yarns do not touch yet nothing holds their rows or a free lattice: a faint drag within each increment does, this
# times EI / L^3 of the yarn of one period. Loops resist by a hundred EI / L^3 and more
DRAG = 0.01

# Load factor at which a relaxation has ended. Friction after an increment is out of balance by as much as the
# increment has moved yarns: the last increments move none.
RELEASED = 0.9


@dataclass(frozen=True, eq=False)
class EndlessState:
    """Configuration of the n nodes of one period."""

    beams: BeamState
    lattice: Floats  # (3,), strains in the plane times `Lattice.lengths` [m]
    contact: LineHistory
    moved: Floats  # (6 n + 3,), change of the unknowns since the increment began
    dragged: float = 0.0  # work of the drag before [J]


class EndlessBeams(Memoryless):
    """A model whose unknowns are six of every node of one period, and the three of the lattice.

    `inner` has the elements between them. Its further nodes are images: they move with their nodes and with the
    lattice, and turn as their nodes do.
    """

    block = 3

    def __init__(
        self,
        inner: BeamModel,  # of N nodes
        owner: Ints,  # (N,), node of the period; the first n are themselves
        image: Ints,  # (N, 2), how many periods away
        lattice: Lattice,
        contact: LineContact,  # of points
        points: ContactPoints,
        ramps: bool = False,  # whether natural curvature and diameter grow with the load
        thinner: float = 0.0,  # by how much the diameter is smaller at first then [m]
        # (nodes,), length of the straight yarn that a node is of, 0 of others: nothing but contact holds it [m]
        straight: Floats | float = 0.0,
    ) -> None:
        self.inner, self.owner, self.image = inner, owner, image
        self.lattice, self.contact, self.points = lattice, contact, points
        self.ramps, self.thinner = ramps, thinner
        self.nodes = int(owner.max()) + 1
        self.size = 6 * self.nodes + 3
        self.scale = np.append(inner.scale[: 6 * self.nodes], np.ones(3))
        self.length = inner.length
        zero = np.zeros((1, 3))
        self.moves = np.stack(
            [lattice.jumps(k, zero, np.ones(1))[0, :, :3] / lattice.lengths for k in range(2)]
        )
        start = inner.start()
        drawn = BeamState(
            start.position[: self.nodes], start.rotation[: self.nodes], released=0.0 if ramps else 1.0
        )
        self._begins = EndlessState(drawn, np.zeros(3), LineHistory.none(), np.zeros(self.size))
        # (size,), stiffness of the drag against the unknowns
        self.drag = np.append(np.tile([1 / self.nodes] * 3 + [0] * 3, self.nodes), np.ones(3))
        bending = np.trace(inner.elements.law[:, 3:, 3:], axis1=1, axis2=2).mean() / 3
        period = inner.elements.length.sum() / (len(owner) - self.nodes)
        self.drag *= DRAG * bending / period**3
        if np.any(straight):  # by their own length; they turn about themselves for nothing as well
            free = np.flatnonzero(straight)
            own = np.asarray(straight)[free, None]
            step = inner.elements.length[free, None]
            each = np.repeat(np.hstack([own**-4, own**-2]), 3, axis=1)
            self.drag[:-3].reshape(-1, 6)[free] = DRAG * bending * step * each
        self._stored: dict[str, float] = {}  # energies there
        own = sp.csr_matrix((np.ones(len(owner)), (np.arange(len(owner)), owner)))
        shift = np.zeros((len(owner), 6, 3))
        shift[:, :3] = np.einsum("ka,aij->kij", image, self.moves)
        self.spread = sp.hstack([sp.kron(own, sp.identity(6)), shift.reshape(-1, 3)], format="csr")
        self._collect = sp.csr_matrix(self.spread.T)
        self._points_follow = points.spread(self.moves)
        self._placed = lru_cache(maxsize=1)(self._place)  # the tangent needs what forces have needed

    def starting_at(self, state: EndlessState) -> EndlessBeams:
        """Return the model with another state in which the load begins; energies count from there on."""
        model = copy(self)
        model._stored = {}
        model._begins, model._stored = state, model.respond(state, stiffness=False).energy
        return model

    def sticking(self) -> EndlessBeams:
        """Return the model whose yarns stick wherever they touch: friction at its limit holds as below it."""
        if not self.contact.mu:
            return self
        model = copy(self)
        model.contact = copy(self.contact)
        model.contact.mu = ROUGH
        model._placed = lru_cache(maxsize=1)(model._place)
        return model

    def cell_state(self, state: EndlessState) -> EndlessState:
        """Return the state of the cell: this model is that of the cell alone."""
        return state

    @property
    def lattice_unknowns(self) -> Ints:
        """Unknowns (3,) of the lattice."""
        return self.size + np.arange(-3, 0)

    def start(self) -> EndlessState:
        """Return the state in which the load begins; yarns that touch there stick from the first increment on.

        Those whose diameter and curvature grow during relaxation begin apart.
        """
        state = self._begins
        if self.contact.mu and not self.ramps and state.contact.points is None:
            points, vectors = self.at_points(state), self.vectors(state)
            state = replace(state, contact=self._contact(state).commit(points, vectors, state.contact))
        return state

    def name_of(self, unknown: int) -> str:
        """Return what an unknown is, in words."""
        if unknown < 6 * self.nodes:
            return self.inner.name_of(unknown)
        return f"the cell as a whole, its strain {STRAINS[(unknown - 6 * self.nodes) % 3]}"

    def diameter(self, state: EndlessState) -> float:
        """Return the diameter to which the yarns have grown [m]."""
        return self.contact.repulsion.diameter - (1 - state.beams.released) * self.thinner

    def vectors(self, state: EndlessState) -> Floats:
        """Return the lattice vectors (2, 3) in a state [m]."""
        return self.lattice.vectors + self.moves @ state.lattice

    def advance(self, state: EndlessState, step: Floats) -> EndlessState:
        """Return the state a step (size,) further."""
        nodes, lattice = np.split(np.asarray(step), [6 * self.nodes])
        beams = self.inner.advance(state.beams, nodes)
        return replace(state, beams=beams, lattice=state.lattice + lattice, moved=state.moved + step)

    def begin(self, state: EndlessState, load: float, change: float) -> EndlessState:
        """Return the state in which an increment to a load factor starts."""
        released = min(load / RELEASED, 1.0)
        beams = replace(state.beams, released=released) if self.ramps else state.beams
        return replace(state, beams=beams, moved=np.zeros(self.size))

    def commit(self, state: EndlessState) -> EndlessState:
        """Return the state that a converged increment leaves."""
        contact = state.contact
        if self.contact.mu:
            contact = self._contact(state).commit(self.at_points(state), self.vectors(state), contact)
        return replace(state, contact=contact, dragged=self._dragged(state), moved=np.zeros(self.size))

    def _dragged(self, state: EndlessState) -> float:
        """Return the work of the drag so far [J]."""
        return state.dragged + 0.5 * float(self.drag @ state.moved**2)

    def respond(self, state: EndlessState, stiffness: bool) -> Response:
        """Return forces, energies and, if asked, the tangent."""
        beams, contact, points, active = self._placed(state)
        inner = self.inner.respond(beams, stiffness)
        force, energy, tangent = contact.respond(
            points, self.vectors(state), state.contact, stiffness, active, self._points_follow
        )
        if stiffness:
            own = self._collect @ sp.csr_matrix(inner.stiffness) @ self.spread
            tangent = sp.csr_matrix(own + tangent + sp.diags(self.drag))
            tangent.sort_indices()
        return replace(
            inner,
            force=self._collect @ inner.force + self._points_follow.forces(force) + self.drag * state.moved,
            energy=summed(
                inner.energy | energy | {"stabilisation": self._dragged(state)},
                {form: -stored for form, stored in self._stored.items()},
            ),
            stiffness=tangent,
            status=SOFT,
        )

    def sliding(self, state: EndlessState) -> Floats:
        """Return the motions (size, Y) of yarns along their own curves."""
        here, there = self.inner.ends.T
        chord = np.diff(self._all(state).position[self.inner.ends], axis=1)[:, 0]
        along = chord / np.linalg.norm(chord, axis=1)[:, None]
        before = np.empty_like(here)
        before[self.owner[there]] = here
        motion = np.zeros((self.nodes, 6, self.points.yarn.max() + 1))
        yarn = np.empty(self.nodes, dtype=np.int64)
        yarn[self.points.station] = self.points.yarn
        # The direction turns by the angle between both beams at a node, over the length that it stands for
        length = 0.5 * (self.inner.elements.length + self.inner.elements.length[before])[:, None]
        motion[here, :3, yarn] = 0.5 * (chord + chord[before]) / length
        motion[here, 3:, yarn] = np.cross(along[before], along) / length
        return np.concatenate([motion.reshape(6 * self.nodes, -1), np.zeros((3, motion.shape[2]))])

    def internal_energy(self, response: Response) -> float:
        """Return the energy of the yarns in a response, that in which the load begins included [J]."""
        return response.energy["internal"] + self._stored.get("internal", 0.0)

    def at_points(self, state: EndlessState) -> BeamState:
        """Return position and rotation of the points of contact."""
        return self.points.at(state.beams, self.vectors(state))

    def _place(self, state: EndlessState) -> tuple[BeamState, LineContact, BeamState, ActivePairs]:
        """Return the state of all nodes, the contact, the state of its points, and what touches."""
        contact, points = self._contact(state), self.at_points(state)
        active = contact.active_pairs(points, self.vectors(state), state.contact)
        return self._all(state), contact, points, active

    def _contact(self, state: EndlessState) -> LineContact:
        """Return the contact of yarns as thick as they have grown."""
        return self.contact.of_diameter(self.diameter(state)) if self.ramps else self.contact

    def _all(self, state: EndlessState) -> BeamState:
        """Return the state of all nodes, images included."""
        beams = state.beams
        position = beams.position[self.owner] + self.image @ self.vectors(state)
        return replace(beams, position=position, rotation=beams.rotation[self.owner])
