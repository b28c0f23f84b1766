"""Elastic rods in contact: from curves to a model, what is done to their ends, equilibria along a path, stability.

Nodes are the points of the curves. A path has legs: over a leg, `End` says for every node that something acts on what
moves, what turns, and which dead force and moment it carries at last. `Rods.path` follows a leg in shares of it,
`Rods.arc_path` by arc length, beyond limit points as well. Any consistent units do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse.linalg as spla

from knitstudy.errors import ConfigurationError, ConvergenceError
from knitstudy.mechanics.beams.beam import BeamState, SectionLaw
from knitstudy.mechanics.beams.beam_contact import BeamContact
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.laws import Power, Repulsion
from knitstudy.mechanics.beams.line_contact import SPACINGS, LineContact
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.energy_balance import balanced
from knitstudy.mechanics.core.increment import Increment, PrescribedDisplacement, Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.model import Response
from knitstudy.mechanics.core.rotation import turns
from knitstudy.mechanics.core.stability import lowest_mode

Vector = Sequence[float] | Floats
STILL = (0.0, 0.0, 0.0)
FREE = (np.nan, np.nan, np.nan)
ITERATIONS, HALVINGS = 12, 10  # most of one step by arc length
BALANCE = 0.02  # largest share of the work that no energy may account for, by default


@dataclass(frozen=True)
class End:
    """What is done to a node during a leg; nan in `move` or `turn` leaves a component free."""

    move: Vector = STILL  # (3,), change of its place
    turn: Vector = STILL  # (3,), spin about fixed axes [rad]
    force: Vector = STILL  # (3,), dead force at the end of the leg, on free components
    moment: Vector = STILL  # (3,), dead moment about fixed axes at the end of the leg


CLAMPED = End()
PINNED = End(turn=FREE)
Ends = Mapping[int, End]  # by node


@dataclass(frozen=True, eq=False)
class RodState(BeamState):
    """Configuration of rods under dead loads."""

    dead: Floats | float = 0.0  # (size,), forces and moments


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A state of rods in balance, at a share of a leg."""

    rods: Rods
    load: float
    state: RodState
    # Forces and energies by form in balance: friction as it was then, not as the next increment begins
    response: Response
    # Work that ends and dead loads have done on the leg, and the part of it that no energy accounts for; nan unknown
    work: float = np.nan
    gap: float = np.nan

    def curve(self, rod: int = 0) -> Floats:
        """Return the places (n, 3) of the nodes of a rod."""
        return self.state.position[self.rods.numbers[rod]]

    @cached_property
    def support(self) -> Floats:
        """Forces and moments (N, 6) that hold or drive nodes, zero where nothing does."""
        support = self.response.force.copy()
        support[self.rods.free] = 0.0
        return support.reshape(-1, 6)

    @property
    def lowest_stiffness(self) -> float:
        """Lowest eigenvalue of the tangent per length of rod: below zero the state is unstable [N/m2].

        It is that of the symmetric part over the mean length of elements, for turns over its third power.
        """
        rods = self.rods
        free = np.zeros(rods.size, dtype=bool)
        free[rods.free] = True
        tangent = rods.respond(self.state, True).tangent
        return lowest_mode(tangent, np.sqrt(rods.length) * rods.scale, free).stiffness


class Rods(BeamModel):
    """Rods of one circular section through curves, in contact with each other and with themselves."""

    def __init__(
        self,
        curves: Sequence[Floats],  # one (n, 3) a rod: its nodes as drawn
        radius: float,
        section: SectionLaw,  # stiffness, such as `BeamSection.circular`
        contact: Power | None = None,  # such as `CrossedCylinders.elastic`; None: rods pass each other
        friction: float = 0.0,  # mu
        # (E, 3), curvature free of stress, 0 for straight rods; None: as drawn
        natural: Floats | float | None = None,
        per_node: int = 2,  # points of contact a node: a radius needs ten for 2 % of the force of a crossing
    ) -> None:
        nodes = np.concatenate(list(curves))
        count = [len(each) for each in curves]
        rod = np.repeat(np.arange(len(count)), count)
        # Nodes of every rod
        self.numbers: list[Ints] = np.split(np.arange(len(nodes)), np.cumsum(count)[:-1])
        ends = np.concatenate([np.column_stack([own[:-1], own[1:]]) for own in self.numbers])
        drawn = np.concatenate([drawn_curvature(each) for each in curves])
        touch = None
        if contact is not None:
            length = [np.linalg.norm(np.diff(each, axis=0), axis=1) for each in curves]
            s = np.concatenate([np.append(0.0, np.cumsum(each)) for each in length])
            points = ContactPoints.of(rod, s, per_node)
            # Rods touch where nodes lie densest: there the law is exact from this approach on.
            repulsion = Repulsion(contact, 2 * radius, SPACINGS**2 * points.weight.min() ** 2 / (16 * radius))
            line = LineContact(points.yarn, points.arc_length, points.weight, repulsion, friction)
            none = np.zeros((0, 2), dtype=np.int64)
            touch = BeamContact(line, points, np.arange(len(nodes)), 0 * nodes, none, np.zeros((0, 2)))
        lever = float(np.linalg.norm(nodes[ends[:, 1]] - nodes[ends[:, 0]], axis=1).mean())
        bend = 0.0 if natural is None else natural - drawn
        super().__init__(nodes, ends, section, lever, contact=touch, natural=bend)
        # Of a leg: free unknowns, moves of all, dead loads where it begins and ends, natural curvature at first
        self.free = np.arange(self.size)
        self.value = np.zeros(self.size)
        self.released = 0.0
        self.dead = np.zeros((2, self.size))

    def start(self) -> RodState:
        """Return the drawn state; nothing of the curvature free of stress acts yet."""
        state = super().start()
        return RodState(state.position, state.rotation, state.contact, released=0.0)

    def begin(self, state: RodState, load: float, change: float) -> RodState:
        """Return the state with the dead loads and the natural curvature of a share of the leg."""
        before, after = self.dead
        released = self.released + load * (1 - self.released)
        return replace(state, dead=before + load * (after - before), released=released)

    def respond(self, state: BeamState, stiffness: bool) -> Response:
        """Return force, energy and, if asked, tangent of a state under its dead loads."""
        response = super().respond(state, stiffness)
        return replace(response, force=response.force - getattr(state, "dead", 0.0), pulled=True)

    def motion_of_neighbours(self, state: BeamState, step: Floats) -> float:
        """Return the largest motion of a node: loose rods must not pass each other within one correction."""
        return float(np.abs(step.reshape(-1, 6)[:, :3]).max())

    def on_leg(self, ends: Ends, start: Equilibrium | None = None) -> Rods:
        """Return the same rods with what is done to nodes over a leg."""
        number = np.fromiter(ends, dtype=np.int64)
        if np.any((number < 0) | (number >= len(self.nodes))):
            raise ConfigurationError(f"rods have nodes 0 to {len(self.nodes) - 1}, not {number.tolist()}")
        motion = np.array([[*end.move, *end.turn] for end in ends.values()], dtype=float)
        unknowns = 6 * number[:, None] + np.arange(6)
        held = ~np.isnan(motion)
        rods = copy(self)
        dead, rods.value = np.zeros((2, self.size))
        dead[unknowns] = np.where(held, 0.0, [[*end.force, *end.moment] for end in ends.values()])
        rods.value[unknowns] = np.where(held, motion, 0.0)
        rods.free = np.setdiff1d(np.arange(self.size), unknowns[held])
        before = np.zeros(self.size)
        if start is not None:  # what holds an unknown takes over the dead load on it
            before[rods.free] = np.broadcast_to(start.state.dead, self.size)[rods.free]
            rods.released = start.state.released
        rods.dead = np.stack([before, dead])
        return rods

    def path(
        self,
        ends: Ends,
        steps: int = 10,
        start: Equilibrium | None = None,
        stops: tuple[float, ...] = (),
        balance: float = BALANCE,
        **limits: Any,
    ) -> Iterator[Equilibrium]:
        """Yield equilibria along a leg that begins where rods are drawn, or where another leg ended.

        There are `steps` increments, or more where Newton's method or the energy balance needs shorter ones. Energies
        differ from the work by at most the share `balance`, unless rods snap; a warning in the log says so. `limits`
        are those of `Settings`. The natural curvature grows on the first leg and acts in full afterwards; its work on
        this leg is not counted, and the energy balance is not checked there. Raises ConvergenceError as `trace` does.
        """
        rods = self.on_leg(ends, start)
        state = self.start() if start is None else start.state
        if self.contact is not None:
            limits = {"stride": 0.5 * self.contact.line.repulsion.diameter} | limits
        first = Increment(0, 0.0, state, rods._begun(start, state), 1.0 / steps)
        fixed = np.setdiff1d(np.arange(self.size), rods.free)
        drive = PrescribedDisplacement(fixed, rods.value[fixed], stops=stops)
        increments = trace(rods, drive, Settings(increments=steps, **limits), LU(), resume=first)
        if rods.released < 1 and np.any(self.elements.natural):
            for each in increments:
                yield Equilibrium(rods, each.load, each.state, each.response)
            return
        for each, work, gap in balanced(first, increments, rods._from_outside, balance):
            yield Equilibrium(rods, each.load, each.state, each.response, work, gap)

    def _begun(self, start: Equilibrium | None, state: RodState) -> Response:
        """Return the response with which a leg begins: that in balance where the leg before ended."""
        if start is None:
            return self.respond(state, False)
        response = start.response
        return replace(response, force=response.force + start.state.dead - self.dead[0])

    def _from_outside(self, increment: Increment) -> Floats:
        """Return the forces and moments (size,) of supports, and the dead ones."""
        support = increment.response.force.copy()
        support[self.free] = 0.0
        before, after = self.dead
        return support + before + increment.load * (after - before)

    def arc_path(
        self, ends: Ends, size: float, start: Equilibrium | None = None, tolerance: float = 1e-8
    ) -> Iterator[Equilibrium]:
        """Yield equilibria along a leg and beyond, each the length `size` of all moves of nodes after the last.

        Loads may rise and fall (Riks 1979): a step goes along the tangent of the path, its corrections at right
        angles to it. Steps that fail are halved; raises ConvergenceError if `HALVINGS` of them do not help.
        """
        rods = self.on_leg(ends, start)
        state = rods.start() if start is None else start.state
        load = 0.0
        last = np.zeros(self.size)
        while True:
            steps = (
                rods._arc_step(state, load, last, 0.5**halving * size, tolerance)
                for halving in range(HALVINGS)
            )
            found = next((step for step in steps if step is not None), None)
            if found is None:
                raise ConvergenceError(
                    f"no step by arc length beyond load factor {load:.6g} converges; take shorter ones"
                )
            state, load, last, response = found
            yield Equilibrium(rods, load, state, response)

    def _arc_step(
        self, state: Any, load: float, last: Floats, size: float, tolerance: float
    ) -> tuple[Any, float, Floats, Response] | None:
        """Return the state one step further, its load factor, motion (size,) and response; None if iterations fail."""
        free = self.free
        along = self.value
        moved = np.zeros(self.size)
        way = None
        pull = (self.dead[1] - self.dead[0])[free]
        for _ in range(ITERATIONS):
            state = self.begin(state, load, 0.0)
            response = self.respond(state, True)
            error = np.max(np.abs(response.force / self.scale)[free]) / response.mean_force
            if not np.isfinite(error):
                return None
            if way is not None and error <= tolerance:
                return self.commit(state), load, moved, response
            K = response.tangent.tocsr()[free]
            steps = np.zeros((2, self.size))
            loads = np.column_stack([-response.force[free], pull - K @ along])
            try:
                steps[:, free] = spla.splu(K[:, free].tocsc()).solve(loads).T
            except RuntimeError:  # the tangent is singular
                return None
            balance = steps[0]
            tangent = steps[1] + along
            if way is None:
                way = np.where(np.arange(self.size) % 6 < 3, tangent, 0.0)
                way *= np.copysign(1 / np.linalg.norm(way), way @ last if last.any() else 1.0)
                change = size / (way @ tangent)
            else:
                change = -(way @ balance) / (way @ tangent)
            step = balance + change * tangent
            state = self.advance(state, step)
            load = load + change
            moved = moved + step
        return None


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
    turned = turns(t[:-1], t[1:])
    turned = np.concatenate([turned[:1], turned, turned[-1:]])
    return 0.5 * (turned[:-1] + turned[1:]) / length[:, None]
