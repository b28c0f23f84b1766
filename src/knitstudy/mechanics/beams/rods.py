"""Elastic rods in contact: rods from curves, what is done to their ends, equilibria along a path, and their stability.

Nodes are the points of the curves. A path has legs: over a leg, `End` says for every node that something acts on what
moves, what turns, and which dead force and moment it carries at last. `Rods.path` follows the leg in increments of it,
`Rods.arc_path` by arc length, beyond limit points as well. Any consistent units do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse.linalg as spla

from knitstudy.errors import ConfigurationError, ConvergenceError
from knitstudy.mechanics.arrays import Floats, Ints
from knitstudy.mechanics.beams.beam import BeamState, SectionLaw
from knitstudy.mechanics.beams.beam_contact import BeamContact
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.laws import Power, Repulsion
from knitstudy.mechanics.beams.line_contact import SPACINGS, LineContact
from knitstudy.mechanics.increment import Increment, PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.load_path import trace
from knitstudy.mechanics.model import Response

Vector = Sequence[float] | Floats

STILL, FREE = (0.0, 0.0, 0.0), (np.nan, np.nan, np.nan)
ITERATIONS, HALVINGS = 12, 10  # most of one step by arc length


@dataclass(frozen=True)
class End:
    """What is done to a node during a leg; nan in `move` or `turn` leaves a component free."""

    move: Vector = STILL  # (3,), change of its place
    turn: Vector = STILL  # (3,), spin about fixed axes [rad]
    force: Vector = STILL  # (3,), dead force on free components at the end of the leg
    moment: Vector = STILL  # (3,), dead moment about fixed axes at the end of the leg


CLAMPED, PINNED, LOOSE = End(), End(turn=FREE), End(move=FREE, turn=FREE)

Ends = Mapping[int, End]
"""What is done to nodes, by their numbers."""


@dataclass(frozen=True, eq=False)
class RodState(BeamState):
    """Configuration of rods, with the dead loads on them."""

    dead: Floats | float = 0.0  # (size,), dead forces and moments


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A state of rods in balance on a leg of a path."""

    rods: Rods
    ends: Ends
    load: float  # share of the leg, 0 to 1
    state: RodState
    support: Floats  # (N, 6), forces and moments that hold or drive nodes; zero where nothing does
    energy: dict[str, float]  # by form

    def curve(self, rod: int = 0) -> Floats:
        """Return the places (n, 3) of the nodes of a rod."""
        return self.state.position[self.rods.numbers[rod]]

    def stiffness_eigenvalues(self, count: int = 1) -> Floats:
        """Return the lowest eigenvalues (count,) of the tangent over a length, ascending: below zero it is unstable.

        The tangent is that against free motions, its symmetric part, over the mean length of elements for places and
        over its third power for turns.
        """
        rods, fixed = self.rods, self.rods.driven(self.ends)[0]
        free = np.setdiff1d(np.arange(rods.size), fixed)
        K = rods.respond(self.state, True).tangent.tocsr()[free][:, free].toarray()
        weight = np.sqrt(rods.length) * rods.scale[free]
        K = 0.5 * (K + K.T) / np.outer(weight, weight)
        values: Floats = scipy.linalg.eigh(K, eigvals_only=True, subset_by_index=[0, count - 1])
        return values


class Rods(BeamModel):
    """Rods of one circular section through curves, in contact with each other and with themselves."""

    def __init__(
        self,
        curves: Sequence[Floats],  # one (n, 3) a rod: its nodes as drawn
        radius: float,
        section: SectionLaw,  # stiffness, such as `BeamSection.circular`
        contact: Power | None = None,  # its law, such as `CrossedCylinders.elastic`; None: rods pass each other
        friction: float = 0.0,  # mu
        natural: Floats | float | None = None,  # (E, 3), curvature free of stress; 0: straight; None: as drawn
        per_node: int = 2,  # points of contact a node: a radius has ten for 2 % of the force of a crossing
    ) -> None:
        count = np.array([len(curve) for curve in curves])
        nodes, yarn = np.concatenate(list(curves)), np.repeat(np.arange(len(curves)), count)
        self.numbers: list[Ints] = np.split(np.arange(len(nodes)), np.cumsum(count)[:-1])  # nodes of every rod
        ends = np.concatenate([np.column_stack([own[:-1], own[1:]]) for own in self.numbers])
        drawn = np.concatenate([drawn_curvature(curve) for curve in curves])
        touch = None if contact is None else _contact(nodes, yarn, radius, contact, friction, per_node)
        length = float(np.linalg.norm(nodes[ends[:, 1]] - nodes[ends[:, 0]], axis=1).mean())
        own = 0.0 if natural is None else natural - drawn
        super().__init__(nodes, ends, section, length, contact=touch, natural=own)
        self._leg: tuple[tuple[Any, float], tuple[Any, float]] = ((0.0, 0.0), (0.0, 1.0))

    def start(self) -> RodState:
        """Return the drawn state; nothing of the curvature free of stress acts yet."""
        state = super().start()
        return RodState(state.position, state.rotation, state.contact, released=0.0)

    def begin(self, state: RodState, load: float, change: float) -> RodState:
        """Return the state with the dead loads, and the share of the natural curvature, of a share of the leg."""
        (dead, released), (later, all_of_it) = self._leg
        dead = dead + load * (later - dead)
        return replace(state, dead=dead, released=released + load * (all_of_it - released))

    def respond(self, state: BeamState, stiffness: bool) -> Response:
        """Return force, energy and, if asked, tangent of a state under its dead loads."""
        response = super().respond(state, stiffness)
        return replace(response, force=response.force - getattr(state, "dead", 0.0), pulled=True)

    def motion_of_neighbours(self, state: BeamState, step: Floats) -> float:
        """Return the largest motion of a node: loose rods must not pass each other within one correction."""
        return float(np.abs(step.reshape(-1, 6)[:, :3]).max())

    def driven(self, ends: Ends) -> tuple[Ints, Floats, Floats]:
        """Return held unknowns (k,), their changes (k,) during a leg, and dead loads (size,) at its end."""
        number = np.fromiter(ends, dtype=np.int64)
        if np.any((number < 0) | (number >= len(self.nodes))):
            raise ConfigurationError(f"rods have nodes 0 to {len(self.nodes) - 1}, not {number.tolist()}")
        motion = np.array([[*end.move, *end.turn] for end in ends.values()], dtype=float)
        unknowns, dead = 6 * number[:, None] + np.arange(6), np.zeros(self.size)
        held = ~np.isnan(motion)
        dead[unknowns] = [[*end.force, *end.moment] for end in ends.values()]
        dead[unknowns[held]] = 0.0  # supports carry what acts there
        return unknowns[held], motion[held], dead

    def path(
        self, ends: Ends, steps: int = 10, start: Equilibrium | None = None, stops: tuple[float, ...] = (), **limits: Any
    ) -> Iterator[Equilibrium]:
        """Yield equilibria along a leg that begins where rods are drawn or where another leg ended.

        Increments are `steps` or, where Newton's method fails, shorter; `limits` are those of `Settings`. The
        natural curvature acts in full from the end of the first leg. Raises ConvergenceError as `trace` does.
        """
        leg, (fixed, value, _) = self._on_leg(ends, start), self.driven(ends)
        state = self.start() if start is None else start.state
        limits = {"stride": np.inf if self.contact is None else 0.5 * self.contact.line.repulsion.diameter} | limits
        first = Increment(0, 0.0, state, leg.respond(state, False), 1.0 / steps)
        drive = PrescribedDisplacement(fixed, value, stops=stops)
        for each in trace(leg, drive, Settings(increments=steps, **limits), LU(), resume=first):
            yield leg._equilibrium(ends, each.load, each.state)

    def arc_path(
        self, ends: Ends, size: float, start: Equilibrium | None = None, tolerance: float = 1e-8
    ) -> Iterator[Equilibrium]:
        """Yield equilibria along a leg and beyond, each the length `size` of all moves of nodes after the last.

        Loads may rise and fall (Riks 1979): a step goes along the tangent of the path, its corrections at right
        angles to it. Steps that fail are halved; raises ConvergenceError if `HALVINGS` of them do not help.
        """
        leg = self._on_leg(ends, start)
        state, load, last = leg.start() if start is None else start.state, 0.0, np.zeros(self.size)
        while True:
            for halving in range(HALVINGS):
                found = leg._arc_step(ends, state, load, last, 0.5**halving * size, tolerance)
                if found is not None:
                    break
            else:
                raise ConvergenceError(f"no step by arc length from load factor {load:.6g} converges; begin with a shorter one")
            state, load, last = found
            yield leg._equilibrium(ends, load, state)

    def _arc_step(
        self, ends: Ends, state: RodState, load: float, last: Floats, size: float, tolerance: float
    ) -> tuple[RodState, float, Floats] | None:
        """Return the state one step further, its load factor and the motion (size,), or None if iterations fail."""
        fixed, value, _ = self.driven(ends)
        free, along, moved = np.setdiff1d(np.arange(self.size), fixed), np.zeros(self.size), np.zeros(self.size)
        along[fixed], way = value, None
        pull = np.broadcast_to(self._leg[1][0] - self._leg[0][0], self.size)[free]
        for _ in range(ITERATIONS):
            state = self.begin(state, load, 0.0)
            response = self.respond(state, True)
            error = np.max(np.abs(response.force / self.scale)[free]) / response.mean_force
            if way is not None and error <= tolerance:
                return self.commit(state), load, moved
            K = response.tangent.tocsr()[free]
            steps = np.zeros((2, self.size))
            loads = np.column_stack([-response.force[free], pull - K @ along])
            steps[:, free] = spla.splu(K[:, free].tocsc()).solve(loads).T
            balance, tangent = steps[0], steps[1] + along
            if way is None:
                way = np.where(np.arange(self.size) % 6 < 3, tangent, 0.0)
                way *= np.copysign(1 / np.linalg.norm(way), way @ last if last.any() else 1.0)
                change = size / (way @ tangent)
            else:
                change = -(way @ balance) / (way @ tangent)
            step = balance + change * tangent
            if not np.all(np.isfinite(step)):
                return None
            state, load, moved = self.advance(state, step), load + change, moved + step
        return None

    def _on_leg(self, ends: Ends, start: Equilibrium | None) -> Rods:
        """Return the same rods with the loads of a leg."""
        leg = copy(self)
        before = (0.0, 0.0) if start is None else (start.state.dead, start.state.released)
        leg._leg = before, (self.driven(ends)[2], 1.0)
        return leg

    def _equilibrium(self, ends: Ends, load: float, state: RodState) -> Equilibrium:
        response, support = self.respond(state, False), np.zeros(self.size)
        fixed = self.driven(ends)[0]
        support[fixed] = response.force[fixed]
        return Equilibrium(self, ends, load, state, support.reshape(-1, 6), response.energy)


def drawn_curvature(curve: Floats) -> Floats:
    """Return the curvature vectors (n - 1, 3) of the pieces of a curve (n, 3), along the binormal.

    Half the angle between a piece and the next one belongs to either.

    Examples
    --------
    >>> turn = np.linspace(0.0, 1.0, 101)
    >>> drawn_curvature(2 * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]))[50].round(4).tolist()
    [0.0, 0.0, 0.5]
    """
    chord = np.diff(curve, axis=0)
    length = np.linalg.norm(chord, axis=1)
    t = chord / length[:, None]
    across = np.cross(t[:-1], t[1:])
    size = np.linalg.norm(across, axis=1, keepdims=True)
    angle = np.arctan2(size, np.einsum("ni,ni->n", t[:-1], t[1:])[:, None])
    turned = across * np.divide(angle, size, out=np.ones_like(size), where=size > 0)
    turned = np.concatenate([turned[:1], turned, turned[-1:]])
    return 0.5 * (turned[:-1] + turned[1:]) / length[:, None]


def _contact(
    nodes: Floats, rod: Ints, radius: float, law: Power, friction: float, per_node: int
) -> BeamContact:
    """Return the contact of rods of a radius whose nodes (N, 3) are of `rod` (N,)."""
    step = np.linalg.norm(np.diff(nodes, axis=0), axis=1) * (rod[1:] == rod[:-1])
    along = np.append(0.0, np.cumsum(step))
    along -= along[np.searchsorted(rod, rod)]
    points = ContactPoints.of(rod, along, per_node)
    # Where nodes lie densest rods touch: the law is exact from that approach on.
    onset = SPACINGS**2 * points.weight.min() ** 2 / (16 * radius)
    line = LineContact(
        points.yarn, points.arc_length, points.weight, Repulsion(law, 2 * radius, onset), friction
    )
    nowhere = np.zeros((0, 2), dtype=np.int64)
    return BeamContact(line, points, np.arange(len(nodes)), 0 * nodes, nowhere, 1.0 * nowhere)
