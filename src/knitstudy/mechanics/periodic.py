"""Endless structures: unknowns that repeat, strains of the whole, yarns that wrap around."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import MeshError
from knitstudy.mechanics.arrays import Floats, Ints
from knitstudy.mechanics.beams.beam import BeamState, LineHistory
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.line_contact import ROUGH, SOFT, LineContact
from knitstudy.mechanics.beams.line_friction import ActivePairs
from knitstudy.mechanics.linear import factorise
from knitstudy.mechanics.model import Memoryless, Response, summed
from knitstudy.mechanics.solid import SolidModel
from knitstudy.mechanics.spline_yarn import basis as disc
from knitstudy.mechanics.spline_yarn.basis import Spline
from knitstudy.mechanics.spline_yarn.space import YarnSpace

# A sheet repeats itself by two lattice vectors t in its plane. From a point X to its image X + t the macroscopic field
# (docs/theory/theory.md, section 11) jumps by
#
#     E t + z K t   in the plane,    - X . K t - t . K t / 2   out of it:
#
# a translation and a rotation, linear in X, so that nodes that are coefficients take it as well. Strains in the plane
# may be finite; a curved sheet is one to first order.

STRAINS = ("x", "y", "xy")  # components in the plane; of curvatures and moments as well


@dataclass(frozen=True, eq=False)
class Lattice:
    """How a sheet repeats itself."""

    vectors: Floats  # (2, 3), from a point to its images, in the plane of x and y [m]
    reference: float = 0.0  # height of the plane of reference [m]

    @property
    def area(self) -> float:
        """Of a cell [m2]."""
        return float(abs(np.cross(*self.vectors)[2]))

    @property
    def lengths(self) -> Floats:
        """Edges of the cell (3,) by which strains in the plane are multiplied for a displacement [m]."""
        return np.linalg.norm(self.vectors, axis=1)[[0, 1, 1]]

    def jumps(
        self,
        number: int,  # of the vector
        nodes: Floats,  # (N, 3), undeformed places, or coefficients of them [m]
        unity: Floats,  # (N,), coefficients of the constant 1
    ) -> Floats:
        """Return the jumps (N, 3, 6) of nodes to their images by one of the vectors, for each generalised strain."""
        t = self.vectors[number, :2]
        way = np.array([[t[0], 0, 0.5 * t[1]], [0, t[1], 0.5 * t[0]]])  # E t, and K t, by components of E, K
        height = nodes[:, 2] - self.reference * unity
        jump = np.zeros((len(nodes), 3, 6))
        jump[:, :2, :3] = unity[:, None, None] * way
        jump[:, :2, 3:] = height[:, None, None] * way
        jump[:, 2, 3:] = -(nodes[:, :2] + 0.5 * np.multiply.outer(unity, t)) @ way
        return jump


class PeriodicModel:
    """A model whose unknowns are weighted sums of fewer ones, u = T v.

    The last three of v are the lattice: the strains in the plane times `Lattice.lengths` [m]. Forces on the edges of
    the cell are conjugate to them.
    """

    block = 3

    def __init__(
        self,
        model: SolidModel,  # of all nodes, images included; every element, tie and contact once
        spread: sp.csr_matrix,  # (model.size, size), T, of full rank
    ) -> None:
        self.model, self.spread = model, spread
        self._collect = sp.csr_matrix(spread.T)
        self.size = spread.shape[1]
        self.scale = np.ones(self.size)
        self.length = model.length
        # Its states are the states of the model.
        self.start, self.begin = model.start, model.begin
        self.settle, self.commit = model.settle, model.commit
        last = sp.eye(self.size, 3, k=3 - self.size).toarray()
        self._measure = (spread @ factorise(self._collect @ spread).solve(last)).T

    @property
    def lattice(self) -> Ints:
        """Unknowns (3,) of the lattice."""
        return self.size + np.arange(-3, 0)

    def stretched(self, displacement: Floats) -> Floats:
        """Return the unknowns (3,) of the lattice in a displacement (model.size,) of the model [m]."""
        return self._measure @ displacement

    def advance(self, state: Any, step: Floats) -> Any:
        """Return the state displaced by `step` (size,) [m]."""
        return self.model.advance(state, self.spread @ step)

    def motion_of_neighbours(self, state: Any, step: Floats) -> float:
        """Return the largest motion against each other of what is near each other, images included [m]."""
        return self.model.motion_of_neighbours(state, self.spread @ step)

    def respond(self, state: Any, stiffness: bool) -> Response:
        """Return T^T of the model's forces and, if asked, T^T K T: as a whole, for a direct solver."""
        answer = self.model.respond(state, stiffness)
        return replace(
            answer,
            force=self._collect @ answer.force,
            stiffness=self.collected(answer.stiffness) if stiffness else None,
            unsymmetric=None,
            moved=None,
            touching=np.empty(0, dtype=np.int64),
        )

    def collected(self, stiffness: sp.spmatrix) -> sp.csr_matrix:
        """Return T^T K T (size, size)."""
        total = sp.csr_matrix(self._collect @ sp.csr_matrix(stiffness) @ self.spread)
        total.sort_indices()
        return total


def condensed(
    stiffness: sp.spmatrix,  # (size, size), symmetric
    fields: Floats,  # (size, m)
    spread: sp.csr_matrix,  # (size, n), S
    held: Ints,  # (k,), of the n: they stay 0, so that nothing can move for nothing
) -> Floats:
    """Return the symmetric stiffness (m, m) against the amounts of fields, u = S q + fields a, with q in balance.

    Raises ConvergenceError if something else moves without any stiffness.

    Examples
    --------
    >>> springs = sp.csr_matrix([[1.0, -1.0, 0.0], [-1.0, 3.0, -2.0], [0.0, -2.0, 2.0]])  # 1 and 2 N/m in a row
    >>> ends, middle = np.array([[0.0], [0.0], [1.0]]), sp.csr_matrix([[0.0], [1.0], [0.0]])
    >>> condensed(springs, ends, middle, np.array([], dtype=int)).round(9).tolist()
    [[0.666666667]]
    """
    free = np.ones(spread.shape[1], dtype=bool)
    free[held] = False
    kept = sp.csr_matrix(spread[:, free])
    pull = sp.csr_matrix(stiffness) @ fields
    across = kept.T @ pull
    answer = factorise(kept.T @ stiffness @ kept).solve(across)
    condensed_stiffness = fields.T @ pull - across.T @ answer
    return 0.5 * (condensed_stiffness + condensed_stiffness.T)


# The seam of a yarn that goes on as its own image: B-splines that wrap around, out of B-splines with two ends
# With E spans of degree d there are E functions that wrap around, and E + d on the open knot vector of the same spans.
# Number the wrapped ones on beyond the end: function i + E is the image of function i, and of a yarn it carries the
# coefficient of i plus the jump from a yarn to its image. The open functions span all of them,
#
#     U_open = R U,    U_i+E = U_i + jump_i,    i = 0 .. d - 1,
#
# so that the yarn is as smooth over the seam as it is within: d - 1 derivatives, not only the value, go on. A yarn with
# spans of its images before and after its own (`YarnSpace.beyond`) has functions of several periods:
#
#     U_i+mE = U_i + m jump_i.

ROUNDING = 1e-12  # entries of R below are none


@dataclass(frozen=True, eq=False)
class Seam:
    """Coefficients of one yarn out of coefficients that wrap around, X_open = W X + S jump."""

    wrapped: sp.csr_matrix  # (n, p) W: nodes of the yarn with two ends from nodes that wrap around
    beyond: sp.csr_matrix  # (n, p) S: how much of the jump of each its nodes carry
    order: Ints  # (p,), function over the section of every node that wraps around

    @property
    def unity(self) -> Floats:
        """Coefficients (p,) of the constant 1."""
        return (self.order == 0).astype(float)

    def nodes(self, wrapped: Floats, period: Floats) -> Floats:
        """Return the undeformed nodes (n, 3) from nodes that wrap around (p, 3), the image `period` (3,) away [m]."""
        return self.wrapped @ wrapped + self.beyond @ np.multiply.outer(self.unity, period)


def seam(yarn: YarnSpace) -> Seam:
    """Return the seam of a yarn's space.

    Over the section, a wrapped spline has only the functions that all its open splines have.

    Raises MeshError if there are fewer spans than the degree of the splines.
    """
    spline, beyond = yarn.spline, yarn.beyond
    spans = spline.size - spline.degree - 2 * beyond
    number = np.arange(spline.size)
    periods, wrapped_number = np.divmod(number - beyond, spans)
    around = sp.csr_matrix((np.ones(spline.size), (number, wrapped_number)))  # (E + d, E)
    open_from_wrapped = conversion(spline, beyond)
    has = disc.size(yarn.degrees)
    made_of = abs(open_from_wrapped) @ around
    # At the ends of images splines reach over fewer spans.
    whole = slice(beyond, spline.size - beyond)
    counts = np.where(made_of[whole].toarray() > 0, has[whole, None], yarn.stride).min(axis=0)
    k = np.arange(yarn.stride)
    wrapped = k < counts[:, None]

    def of_functions(splines: sp.csr_matrix) -> sp.csr_matrix:
        """The same of all functions over the section: (n, p) of (J, E)."""
        every = sp.kron(splines, sp.identity(yarn.stride), format="csr")
        return every[(k < has[:, None]).ravel()][:, wrapped.ravel()]

    jumps = open_from_wrapped @ sp.diags(periods.astype(float)) @ around
    return Seam(of_functions(open_from_wrapped @ around), of_functions(jumps), np.nonzero(wrapped)[1])


def conversion(spline: Spline, beyond: int = 0) -> sp.csr_matrix:
    """Return R (J, E + d): open splines' coefficients from coefficients of splines that go on beyond both ends.

    Both are bases of the same functions on the yarn: R is found from their values at J places. So many spans `beyond`
    at either end are of images of the yarn.

    Raises MeshError if there are fewer spans than the degree.

    Examples
    --------
    >>> from knitstudy.mechanics.spline_yarn.space import yarn_space
    >>> matrix = conversion(yarn_space(np.linspace(0, 1, 5), 2).spline)
    >>> matrix.shape, matrix.sum(axis=1).round(12).tolist() == 7 * [[1.0]]  # both represent the constant 1
    ((7, 7), True)
    """
    d, low, high = spline.degree, *spline.spans.T
    if len(low) < d:
        raise MeshError(
            f"{len(low)} spans of a yarn cannot wrap around with splines of degree {d}; use more spans"
        )
    spans = len(low) - 2 * beyond
    period = low[beyond + spans - 1] + (high - low)[beyond + spans - 1] - low[beyond]
    breaks = np.append(low, high[-1])
    along = Spline.on(np.concatenate([breaks[:spans] - period, breaks, breaks[-spans:] + period]), d)
    # Number of splines of `along` that begin before the yarn.
    first = np.searchsorted(along.spans[:, 0], low[0] - 1e-9 * period)
    share = 0.5 - 0.5 * np.cos(np.pi * (np.arange(d + 1) + 0.5) / (d + 1))
    s = (low[:, None] + (high - low)[:, None] * share).ravel()
    goal = along.matrix(s)[:, first : first + spline.size].toarray()
    solution = np.linalg.lstsq(spline.matrix(s).toarray(), goal, rcond=None)[0]
    solution[np.abs(solution) < ROUNDING] = 0.0
    return sp.csr_matrix(solution)


# Beams of yarns that repeat themselves in two directions, and touch each other and their images

# Where yarns do not touch yet nothing holds their rows or a free lattice: a faint drag within each increment does, this
# times EI / L^3 of the yarn of one period. Loops resist by a hundred EI / L^3 and more
DRAG = 0.01

# Load factor at which a way to rest has ended. Friction after an increment is out of balance by as much as the
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

        Those whose diameter and curvature grow on the way to rest begin apart.
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
