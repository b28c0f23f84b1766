"""Contact with friction between beams of circular section, at one pair of closest points a crossing.

The gap is |r| - 2R, and more where a tie carries part of the overlap. Points at the bound of their piece stay in
contact, so that no force is lost at once where they slide into the next piece. The force is that of yarns that cross at
a right angle, times a factor by the shape of both surfaces (`hertz.Patch.force`). Within an increment the factor is
what it will be at the end if the last one goes on.

Friction (`beam_friction`) follows two material points of the surfaces that faced each other when the increment began. A
material point is carried by its yarn's sections, so that friction knows their spin: a yarn that rolls on another does
not slip, one that spins in its place does. Friction acts on both yarns half way between the centrelines, with the
couple that it exerts there on their sections, so that forces and moments balance exactly. Friction that acted on the
centrelines alone would leave a couple of 2R times its force.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.batches import Chosen
from knitstudy.mechanics.beam_approach import (
    SOFTEST,
    A,
    Approach,
    B,
    Change,
    Curves,
    Pairs,
    Stencil,
    approach,
    bends,
    needed_hold,
)
from knitstudy.mechanics.beam_friction import Frame, Rubbing, stored_energy
from knitstudy.mechanics.contact.friction import OPEN
from knitstudy.mechanics.hertz import Patch
from knitstudy.mechanics.model import Response
from knitstudy.mechanics.rotation import hat

if TYPE_CHECKING:
    from knitstudy.mechanics.beam_model import BeamState

SIGNS = np.array([[1.0], [-1.0]])  # of sides A and B

# Largest factor: straight yarns have it at 13 degrees. Yarns that conform to each other touch along an arc
MOST = 3.0
# Most that an increment may go on as the last one: along the yarns over R, and of factors over themselves
AHEAD = 0.25
# Smallest eigenvalue of H (`beam_approach`) below which nothing goes on
SINGULAR = 0.1


@dataclass(frozen=True)
class Power:
    """Force coefficient (-gap)^exponent [N] where yarns overlap."""

    coefficient: float  # of force over approach to the exponent
    exponent: float = 1.0  # 1: a penalty
    share: float = 1.0  # stiffness against elastic slip over that against approach

    def force(self, gap: np.ndarray) -> np.ndarray:
        """Return the forces (k,) at gaps (k,) [m]; zero where open."""
        return self.coefficient * np.maximum(0.0, -gap) ** self.exponent

    def depth(self, force: np.ndarray) -> np.ndarray:
        """Return the overlaps (k,) [m] at which forces (k,) act."""
        return (force / self.coefficient) ** (1 / self.exponent)

    def stiffness(self, gap: np.ndarray) -> np.ndarray:
        """Return how fast (k,) the force grows with the approach."""
        return np.where(
            gap < 0, self.exponent * self.coefficient * np.maximum(0.0, -gap) ** (self.exponent - 1.0), 0.0
        )

    def stiffening(self, gap: np.ndarray) -> np.ndarray:
        """Return the derivative (k,) of the stiffness by the gap; zero where open."""
        n, depth = self.exponent, np.where(gap < 0, -gap, 1.0)
        return np.where(gap < 0, -n * (n - 1.0) * self.coefficient * depth ** (n - 2.0), 0.0)

    def energy(self, gap: np.ndarray) -> np.ndarray:
        """Return the stored energies (k,) [J]."""
        return self.coefficient / (self.exponent + 1.0) * np.maximum(0.0, -gap) ** (self.exponent + 1.0)


def hertz(
    youngs_modulus: float,  # [Pa]
    poisson_ratio: float,
    radius: float,  # of both [m]
) -> Power:
    """Return the approach of two equal cylinders that cross at a right angle (Johnson 1985, sections 4.1 and 7.2).

    F = 4/3 E* sqrt(R) delta^1.5 with E* = E / 2 (1 - nu^2), as of a sphere of radius R on a plane. Against elastic slip
    the same patch is 2 (1 - nu) / (2 - nu) as stiff (Mindlin 1949): hardly at all where yarns just touch, so that
    friction and rough contact begin and end without a jump.
    """
    contact_modulus = youngs_modulus / (2 * (1 - poisson_ratio**2))
    mindlin = 2 * (1 - poisson_ratio) / (2 - poisson_ratio)
    return Power(4 / 3 * contact_modulus * np.sqrt(radius), 1.5, mindlin)


@dataclass(frozen=True, eq=False)
class BeamContactHistory(Chosen):
    """What pairs remember of the last converged increment."""

    pairs: Pairs  # what may touch; they start where the closest points were last within their pieces
    carried: np.ndarray  # (k,), overlap up to which a tie, or contact around, keeps the yarns apart [m]
    s: np.ndarray  # (k, 2), closest points; also where the material points belong [m]
    arm: np.ndarray  # (k, 2, 3), from the centreline to the material points, in the reference [m]
    normal: np.ndarray  # (k, 3), from side A to side B
    gap: np.ndarray  # (k,) [m]; inf where the closest point was an end
    force: np.ndarray  # (k,), normal force [N]; where it is positive the material points count as joined
    factor: np.ndarray  # (k,), by the shape of the surfaces
    sense: np.ndarray  # (k,), of the `Frame`
    shear: np.ndarray  # (k, 2, 2), shear stiffness of the patch over dF/d(delta), in the frame
    spring: np.ndarray  # (k,), dF/d(delta) [N/m]
    traction: np.ndarray  # (k, 2), on side B, in the frame [N]
    slip: np.ndarray  # (k,), length slipped since first contact [m]
    hold: np.ndarray  # (k,), springs of closest points, see `beam_approach`
    on_a: np.ndarray  # (k, 3), force of contact on side A, before springs are held anew [N]
    rate: np.ndarray  # (k, 3), change of s and the factor in the last increment, over that of the load
    change: float = 0.0  # of the load in this one
    rubbed: float = 0.0  # work of friction so far [J]

    @property
    def stored(self) -> np.ndarray:
        """Energies (k,) of elastic slip [J]."""
        return stored_energy(self.traction, self.spring, self.shear)


@dataclass(frozen=True, eq=False)
class BeamContactPoints(Chosen):
    """Pairs in one configuration."""

    approach: Approach
    anchor: Stencil  # (k, 2), of the centrelines where the material points belong
    # (k, 2, 4, 3), from the centreline to the material points, turned as each of its stations is [m]
    arm: np.ndarray
    gap: np.ndarray  # (k,) [m]; inf where the closest point is an end
    force: np.ndarray  # (k,), normal force [N]
    factor: np.ndarray  # (k,), of it by the shape of the surfaces
    rubs: Rubbing

    @property
    def status(self) -> np.ndarray:
        """Status (k,) OPEN, STICK or SLIP."""
        return self.rubs.status

    @property
    def on_a(self) -> np.ndarray:
        """Force (k, 3) of contact on side A [N]."""
        on_a = -(self.rubs.traction + self.force[:, None] * self.approach.normal)
        return np.where((self.status != OPEN)[:, None], on_a, 0.0)


class BeamContact:
    """Contact of yarns of one radius at crossings."""

    def __init__(
        self,
        curves: Curves,  # through the stations
        pairs: Pairs,  # what may touch
        node: np.ndarray,  # int (S,), node that carries a station
        offset: np.ndarray,  # (S, 3), rigid arm from that node to the station, in the reference [m]
        radius: float,  # [m]
        law: Power,  # normal force over gap, and stiffness against elastic slip
        friction: float,  # mu; inf for rough contact, 0 for none
        crossings: int | None = None,  # of the pairs, the first ones, whose contact must not end
        carried: np.ndarray | float = 0.0,  # (k,), overlap up to which ties keep the yarns apart [m]
        # Returns these pairs in new windows and further ones, from positions (S, 3), pairs and their points (k, 2)
        search: Callable[[np.ndarray, Pairs, np.ndarray], Pairs] | None = None,
        patch: Patch | None = None,  # by which the shape of the surfaces counts; None: it does not
    ) -> None:
        self.crossings = len(pairs.start) if crossings is None else crossings
        self.carried, self.search = np.zeros(len(pairs.start)) + carried, search
        self.curves, self.pairs, self.node, self.offset = curves, pairs, node, offset
        self.radius, self.law, self.friction, self.patch = radius, law, friction, patch

    def places(self, state: BeamState) -> BeamState:
        """Return position (S, 3) and rotation (S, 3, 3) of the stations, from those of the nodes."""
        rotation = state.rotation[self.node]
        arm = np.einsum("sij,sj->si", rotation, self.offset)
        return replace(state, position=state.position[self.node] + arm, rotation=rotation)

    def start(self, state: BeamState) -> BeamContactHistory:
        """Return the history of yarns that have not moved yet."""
        return self._begun(self.places(state), self.pairs, self.carried)

    def begin(self, state: BeamState, change: float = 0.0) -> BeamContactHistory:
        """Return the history with which an increment of the load begins: its pairs are those that the search finds.

        Pairs that the search has added go once they are open. Where yarns overlap already when a pair is added, contact
        near it has carried them so far: the new pair carries what is more.
        """
        past = replace(state.contact, change=change)
        if self.search is None:
            return past
        first = np.arange(len(past.s)) < len(self.pairs.start)
        past, places = past[first | (past.force > 0)], self.places(state)
        # An open pair that stands at a bound follows no minimum: no place on its yarn is near.
        follows = (past.force > 0) | (past.pairs.start == past.s).all(axis=1)
        s = np.where(follows[:, None], past.s, -self.curves.length.max())
        pairs = self.search(places.position, past.pairs, s)
        known = np.arange(len(pairs.start)) < len(past.s)
        return replace(past, pairs=pairs[known]).joined(self._begun(places, pairs[~known]))

    def _begun(
        self, places: BeamState, pairs: Pairs, carried: np.ndarray | None = None
    ) -> BeamContactHistory:
        """Return the history of pairs that begin, with no force if nothing else is said to be carried."""
        here, none = approach(self.curves, places.position, pairs), np.zeros(len(pairs.start))
        if carried is None:
            carried = np.maximum(2 * self.radius - here.distance, 0.0)
        return BeamContactHistory(
            pairs=replace(pairs, start=here.s),
            carried=carried,
            s=here.s,
            arm=self._arms(here, places.rotation),
            normal=here.normal,
            gap=self._gap(here, pairs, carried),
            force=none,
            **self._shape(here),
            spring=none,
            traction=np.zeros((len(none), 2)),
            slip=none,
            hold=needed_hold(here),
            on_a=np.zeros((len(none), 3)),
            rate=np.zeros((len(none), 3)),
        )

    def _shape(self, here: Approach) -> dict[str, np.ndarray]:
        """Return factor, sense and shear of the history."""
        shape = bends(here, self.radius)
        sense = np.where(shape[:, 2] < 0, -1.0, 1.0)
        factor, shear = np.ones(len(sense)), self.law.share * np.tile(np.eye(2), (len(sense), 1, 1))
        if self.patch is not None:
            frame = Frame.of(here, sense)
            factor = np.minimum(self.patch.force(shape).value, MOST)
            shear = self.patch.shear(frame.tangent, shape, here.normal)
            shear = frame.axes.swapaxes(1, 2) @ shear @ frame.axes
        return {"factor": factor, "sense": sense, "shear": shear}

    def points(self, state: BeamState) -> BeamContactPoints:
        """Evaluate all pairs."""
        places, history = self.places(state), state.contact
        most = AHEAD * np.stack([self.radius + 0 * history.factor] * 2 + [history.factor], axis=1)
        ahead = np.clip(history.change * history.rate, -most, most)
        ahead[history.hold > SOFTEST - SINGULAR] = 0.0
        pairs = replace(history.pairs, start=history.s + ahead[:, :2])
        here = approach(self.curves, places.position, pairs, history.hold)
        # Near yarns whose normal has turned round have passed through each other: r counts backwards.
        through = (np.einsum("ki,ki->k", here.normal, history.normal) < 0) & (history.gap < self.radius)
        sign = np.where(through, -1.0, 1.0)
        here = replace(here, distance=sign * here.distance, normal=sign[:, None] * here.normal)
        anchor = self.curves.stencil(history.pairs.yarn, history.s)
        arm = np.einsum("kapij,kaj->kapi", places.rotation[anchor.stations], history.arm)
        material = anchor.of(anchor.value, places.position) + np.einsum("kap,kapi->kai", anchor.value, arm)
        gap = self._gap(here, history.pairs, history.carried)
        apart, factor, law = material[:, A] - material[:, B], history.factor + ahead[:, 2], self.law
        force, *rates, past = (
            factor * each
            for each in (law.force(gap), law.stiffness(gap), law.stiffening(gap), law.force(history.gap))
        )
        rubs = Rubbing.of(history, here, apart, gap, (force, *rates, past), self.friction)
        return BeamContactPoints(here, anchor, arm, gap, force, factor, rubs)

    def added(self, response: Response, state: BeamState) -> Response:
        """Return the response of beams and of their contact, with a tangent if that of the beams has one."""
        places, points = self.places(state), self.points(state)
        touching = points[points.status != OPEN]
        here, traction = touching.approach, touching.rubs.traction
        couple = 0.5 * here.distance[:, None] * np.cross(here.normal, traction)
        both = np.stack([-touching.on_a, couple], axis=1)[:, None] * np.stack([SIGNS, SIGNS**2], axis=1)
        at_stations = np.zeros((len(self.node), 6))
        np.add.at(
            at_stations, here.stencil.stations, here.stencil.value[..., None] * both.reshape(-1, 2, 1, 6)
        )
        arm = places.position - state.position[self.node]
        at_stations[:, 3:] += np.cross(arm, at_stations[:, :3])  # about the nodes
        force = response.force.reshape(-1, 6).copy()
        np.add.at(force, self.node, at_stations)
        stored = float(np.sum(touching.factor * self.law.energy(touching.gap) + touching.rubs.stored))
        energy = {"penalty": stored, "friction": state.contact.rubbed + float(points.rubs.lost.sum())}
        # The patch of Hertz and Mindlin is real.
        energy["numerical"] = stored if self.law.exponent == 1 else 0.0
        stiffness = response.stiffness
        if stiffness is not None:
            own = self._stiffness(touching, hat(arm), hat(at_stations[:, :3]), len(force))
            stiffness = sp.bsr_matrix(stiffness + own, blocksize=(6, 6))
        return replace(
            response,
            force=force.ravel(),
            energy=response.energy | energy,
            status=points.status,
            stiffness=stiffness,
        )

    def commit(self, state: BeamState) -> BeamContactHistory:
        """Return the history that a converged increment leaves.

        Raises ConvergenceError if a pair that touched has slid to the end of a yarn.
        """
        points, history = self.points(state), state.contact
        lost = ((history.force > 0) & ~np.isfinite(points.gap))[: self.crossings]
        if lost.any():
            one, other = self.pairs.yarn[int(np.argmax(lost))]
            raise ConvergenceError(
                f"the contact of yarns {one} and {other} has slid to the end of a yarn, which is pulled out of its "
                "loop; use a smaller load"
            )
        here, pairs, rubs = points.approach, history.pairs, points.rubs
        within, shape = here.free.all(axis=1)[:, None], self._shape(here)
        # The patch turns, and what it stores must not grow.
        traction = Frame.of(here, shape["sense"]).within(rubs.traction)
        turned = stored_energy(traction, rubs.spring, shape["shear"])
        less = np.divide(rubs.stored, turned, out=np.ones_like(turned), where=turned > rubs.stored)
        rubbed = history.rubbed + float(np.sum(rubs.lost + rubs.stored - less * turned))
        moved = np.column_stack([np.where(within, here.s - history.s, 0.0), shape["factor"] - history.factor])
        return BeamContactHistory(
            pairs=replace(pairs, start=np.where(within, here.s, pairs.start)),
            carried=history.carried,
            s=here.s,
            arm=self._arms(here, self.places(state).rotation),
            normal=here.normal,
            gap=points.gap,
            force=points.force,
            **shape,
            spring=rubs.spring,
            traction=np.sqrt(less)[:, None] * traction,
            slip=np.where(points.force > 0, history.slip + rubs.slipped, 0.0),
            hold=needed_hold(here),
            on_a=points.on_a,
            rate=moved / (history.change or np.inf),
            rubbed=rubbed,
        )

    def _gap(self, here: Approach, pairs: Pairs, carried: np.ndarray) -> np.ndarray:
        ends = (here.s <= 0) | (here.s >= self.curves.length[pairs.yarn])
        return np.where(ends.any(axis=1), np.inf, here.distance - 2 * self.radius + carried)

    def _arms(self, here: Approach, rotation: np.ndarray) -> np.ndarray:
        """Reference arms (k, 2, 3) of material points half way between the yarns."""
        way = SIGNS * (0.5 * here.distance[:, None] * here.normal)[:, None]
        return np.linalg.solve(here.stencil.of(here.stencil.value, rotation), way[..., None])[..., 0]

    def _stiffness(
        self, points: BeamContactPoints, lever: np.ndarray, pull: np.ndarray, count: int
    ) -> sp.bsr_matrix:
        """Return the stiffness over all nodes of pairs that touch: `lever` and `pull` (S, 3, 3) are skew matrices."""
        closest, anchor = points.approach.stencil, points.anchor
        stations = np.concatenate([closest.stations, anchor.stations], axis=1)  # (a, 4, 4)
        motion = np.zeros((len(stations), 5, 3, 4, 4, 6))  # z by the motion of the stations
        reaction = np.zeros((len(stations), 8, 3, 4, 4, 6))  # generalised forces of the two sides, likewise
        i = np.arange(3)
        for side, sign in ((A, 1.0), (B, -1.0)):
            for order, weights in enumerate((closest.value[:, side], closest.first[:, side])):
                motion[:, 2 * side + order, i, side, :, i] = weights
                reaction[:, 4 * side + order, i, side, :, i] = weights
                reaction[:, 4 * side + 2 + order, i, side, :, 3 + i] = weights
            value = sign * anchor.value[:, side]
            motion[:, 4, i, 2 + side, :, i] = value
            turning = -value[..., None, None] * hat(points.arm[:, side])  # (a, 4, 3, 3)
            motion[:, 4, :, 2 + side, :, 3:] = np.swapaxes(turning, 1, 2)
        for each in (motion, reaction):  # by the motion of the nodes
            each[..., 3:] -= np.einsum("auxgpi,agpij->auxgpj", each[..., :3], lever[stations])
        motion, reaction = motion.reshape(-1, 15, 96), reaction.reshape(-1, 24, 96)
        blocks = np.swapaxes(reaction, 1, 2) @ (self._point_tangent(points) @ motion)
        blocks = blocks.reshape(-1, 16, 6, 16, 6).swapaxes(2, 3)
        # An arm turns under the force at its end: d(r x F) = F^ r^ w.
        turning = np.zeros((len(self.node), 6, 6))
        turning[:, 3:, 3:] = pull @ lever
        node = self.node[stations].reshape(-1, 16)
        row = np.concatenate([np.repeat(node, 16, axis=1).ravel(), self.node]).astype(np.int64)
        column = np.concatenate([np.tile(node, 16).ravel(), self.node])
        key, place = np.unique(row * count + column, return_inverse=True)
        total = sp.csr_matrix((np.ones(len(row)), (place, np.arange(len(row)))))
        data = total @ np.concatenate([blocks.reshape(-1, 36), turning.reshape(-1, 36)])
        indptr = np.searchsorted(key, count * np.arange(count + 1)).astype(np.int32)
        pattern = (key % count).astype(np.int32), indptr
        return sp.bsr_matrix((data.reshape(-1, 6, 6), *pattern), shape=(6 * count, 6 * count))

    def _point_tangent(self, points: BeamContactPoints) -> np.ndarray:
        """Return the derivative (a, 24, 15) of generalised forces with respect to z.

        Rows are, for side A and then B, what works on X and X,_s (force) and on the spin and its derivative (couple).
        """
        here, change = points.approach, Change.of(points.approach)
        normal, traction, force, stiffness = (
            here.normal,
            points.rubs.traction,
            points.force,
            points.rubs.spring,
        )
        d_traction = points.rubs.tangent(here, change, self.friction)
        d_force = d_traction + force[:, None, None] * change.normal
        d_force -= stiffness[:, None, None] * normal[:, :, None] * change.gap[:, None]
        r = here.distance[:, None] * normal
        couple = 0.5 * np.cross(r, traction)
        d_couple = 0.5 * (hat(r) @ d_traction - hat(traction) @ change.apart)
        total = traction + force[:, None] * normal
        rows = []
        for side, sign in ((A, 1.0), (B, -1.0)):
            along = change.s[:, side, None]
            rows += [sign * d_force, sign * total[:, :, None] * along, d_couple, couple[:, :, None] * along]
        return np.concatenate(rows, axis=1)
