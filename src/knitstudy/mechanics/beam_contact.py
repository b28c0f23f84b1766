"""Contact with friction between beams of circular section, at one pair of closest points a crossing.

The gap is |r| - 2R, and more where a tie carries part of the overlap. Points at the bound of their piece stay in
contact, so that no force is lost at once where they slide into the next piece. The tangential traction is a stiffness
times the elastic slip of two material points of the surfaces, one on either yarn, that faced each other when the last
increment had converged, up to mu times the normal force. A material point is carried by its yarn's sections, so that
friction knows their spin: a yarn that rolls on another does not slip, one that spins in its place does. Friction acts
on both yarns half way between the centrelines, with the couple that it exerts there on their sections, so that forces
and moments balance exactly. Friction that acted on the centrelines alone would leave a couple of 2R times its force.
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
    A,
    Approach,
    B,
    Change,
    Curves,
    Pairs,
    Stencil,
    approach,
    needed_hold,
)
from knitstudy.mechanics.contact.friction import OPEN, Coulomb
from knitstudy.mechanics.model import Response
from knitstudy.mechanics.rotation import hat

if TYPE_CHECKING:
    from knitstudy.mechanics.beam_model import BeamState

SIGNS = np.array([[1.0], [-1.0]])  # of sides A and B


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
    slip: np.ndarray  # (k,), length slipped since first contact [m]
    hold: np.ndarray  # (k,), springs of closest points, see `beam_approach`
    on_a: np.ndarray  # (k, 3), force of contact on side A, before springs are held anew [N]
    rubbed: np.ndarray  # (k,), work of friction so far [J]


@dataclass(frozen=True, eq=False)
class BeamContactPoints(Chosen):
    """Pairs in one configuration."""

    approach: Approach
    anchor: Stencil  # (k, 2), of the centrelines where the material points belong
    # (k, 2, 4, 3), from the centreline to the material points, turned as each of its stations is [m]
    arm: np.ndarray
    gap: np.ndarray  # (k,) [m]; inf where the closest point is an end
    apart: np.ndarray  # (k, 3), from the material point of side B to that of side A [m]
    # (k,), part of the increment in contact: 1, or less for pairs that have closed within it
    share: np.ndarray
    share_rate: np.ndarray  # (k,), its derivative with respect to the gap [1/m]
    sticking: np.ndarray  # (k,), stiffness against elastic slip [N/m]; zero where open
    trial: np.ndarray  # (k, 3), tangential force on side B by side A's motion, before Coulomb's limit [N]
    traction: np.ndarray  # (k, 3), the same after it [N]
    force: np.ndarray  # (k,), normal force [N]
    status: np.ndarray  # int (k,) OPEN, STICK or SLIP
    slipped: np.ndarray  # (k,), length within the increment [m]

    @property
    def on_a(self) -> np.ndarray:
        """Force (k, 3) of contact on side A [N]."""
        on_a = -(self.traction + self.force[:, None] * self.approach.normal)
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
    ) -> None:
        self.crossings = len(pairs.start) if crossings is None else crossings
        self.carried, self.search = np.zeros(len(pairs.start)) + carried, search
        self.curves, self.pairs, self.node, self.offset = curves, pairs, node, offset
        self.radius, self.law = radius, law
        # Coulomb's law meets forces here: with stiffnesses of one, changes of forces are those of gaps and slips.
        self.friction = Coulomb(normal=1.0, tangential=1.0, friction=friction)

    def places(self, state: BeamState) -> BeamState:
        """Return position (S, 3) and rotation (S, 3, 3) of the stations, from those of the nodes."""
        rotation = state.rotation[self.node]
        arm = np.einsum("sij,sj->si", rotation, self.offset)
        return replace(state, position=state.position[self.node] + arm, rotation=rotation)

    def start(self, state: BeamState) -> BeamContactHistory:
        """Return the history of yarns that have not moved yet."""
        return self._begun(self.places(state), self.pairs, self.carried)

    def begin(self, state: BeamState) -> BeamContactHistory:
        """Return the history with which an increment begins: its pairs are those that the search finds.

        Pairs that the search has added go once they are open and have rubbed no work. Where yarns overlap already when
        a pair is added, contact near it has carried them so far: the new pair carries what is more.
        """
        if self.search is None:
            return state.contact
        past, first = state.contact, np.arange(len(state.contact.s)) < len(self.pairs.start)
        past, places = past[first | (past.force > 0) | (past.rubbed > 0)], self.places(state)
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
        arm = self._arms(here, places.rotation, none[:, None])
        gap, zero = self._gap(here, pairs, carried), np.zeros((len(none), 3))
        pairs = replace(pairs, start=here.s)
        return BeamContactHistory(
            pairs, carried, here.s, arm, here.normal, gap, none, none, needed_hold(here), zero, none
        )

    def points(self, state: BeamState) -> BeamContactPoints:
        """Evaluate all pairs."""
        places, history = self.places(state), state.contact
        here = approach(self.curves, places.position, replace(history.pairs, start=history.s), history.hold)
        # Near yarns whose normal has turned round have passed through each other: r counts backwards.
        through = (np.einsum("ki,ki->k", here.normal, history.normal) < 0) & (history.gap < self.radius)
        sign = np.where(through, -1.0, 1.0)
        here = replace(here, distance=sign * here.distance, normal=sign[:, None] * here.normal)
        anchor = self.curves.stencil(history.pairs.yarn, history.s)
        arm = np.einsum("kapij,kaj->kapi", places.rotation[anchor.stations], history.arm)
        material = anchor.of(anchor.value, places.position) + np.einsum("kap,kapi->kai", anchor.value, arm)
        gap = self._gap(here, history.pairs, history.carried)
        # A pair that has closed within this increment has slid in contact only for the rest of it.
        closes = (history.force <= 0) & (gap < 0) & (history.gap > 0) & np.isfinite(history.gap)
        now, then = np.where(closes, gap, 0.0), np.where(closes, history.gap, 0.0)
        span = np.where(closes, now - then, 1.0)
        share = np.where(closes, now / span, 1.0)
        apart = material[:, A] - material[:, B]
        plane = apart - here.normal * np.einsum("ki,ki->k", here.normal, apart)[:, None]
        sticking, force = self.law.share * self.law.stiffness(gap), self.law.force(gap)
        trial = (sticking * share)[:, None] * plane
        traction, status = self.friction.traction(trial, force)
        slipped = self.friction.slipped(trial, force) / np.where(force > 0, sticking, 1.0)
        rate = -then / span**2
        return BeamContactPoints(
            here, anchor, arm, gap, apart, share, rate, sticking, trial, traction, force, status, slipped
        )

    def added(self, response: Response, state: BeamState) -> Response:
        """Return the response of beams and of their contact, with a tangent if that of the beams has one."""
        places, points = self.places(state), self.points(state)
        touching = points[points.status != OPEN]
        here, traction = touching.approach, touching.traction
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
        sheared = 0.5 * np.einsum("ki,ki->k", traction, traction) / touching.sticking
        stored = float(np.sum(self.law.energy(touching.gap) + sheared))
        rubbed = float(np.sum(state.contact.rubbed + self._work(points, state.contact)))
        energy = {"penalty": stored, "friction": rubbed}
        energy["numerical"] = (
            stored if self.law.exponent == 1 else 0.0
        )  # the patch of Hertz and Mindlin is real
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
        touches = points.status != OPEN
        elastic = points.traction / np.where(touches, points.sticking, 1.0)[:, None]
        here, pairs = points.approach, history.pairs
        within = here.free.all(axis=1)[:, None]
        return BeamContactHistory(
            pairs=replace(pairs, start=np.where(within, here.s, pairs.start)),
            carried=history.carried,
            s=here.s,
            arm=self._arms(here, self.places(state).rotation, elastic),
            normal=here.normal,
            gap=points.gap,
            force=points.force,
            slip=np.where(points.force > 0, history.slip + points.slipped, 0.0),
            hold=needed_hold(here),
            on_a=points.on_a,
            rubbed=history.rubbed + self._work(points, history),
        )

    def _gap(self, here: Approach, pairs: Pairs, carried: np.ndarray) -> np.ndarray:
        ends = (here.s <= 0) | (here.s >= self.curves.length[pairs.yarn])
        return np.where(ends.any(axis=1), np.inf, here.distance - 2 * self.radius + carried)

    def _arms(self, here: Approach, rotation: np.ndarray, elastic: np.ndarray) -> np.ndarray:
        """Reference arms (k, 2, 3) of material points half way between the yarns, `elastic` (k, 3) apart."""
        way = SIGNS * (0.5 * here.distance[:, None] * here.normal + 0.5 * elastic)[:, None]
        return np.linalg.solve(here.stencil.of(here.stencil.value, rotation), way[..., None])[..., 0]

    def _work(self, points: BeamContactPoints, history: BeamContactHistory) -> np.ndarray:
        """Work (k,) of friction within the increment, mu times the mean force of it times the slip [J]."""
        if not np.isfinite(self.friction.friction):
            return np.zeros(len(points.force))
        mean = 0.5 * (points.force + history.force)
        return self.friction.friction * mean * points.slipped

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
        normal, traction, force, apart = here.normal, points.traction, points.force, points.apart
        stiffness = self.law.stiffness(points.gap)
        level = np.einsum("ki,ki->k", normal, apart)
        plane = apart - normal * level[:, None]
        d_plane = -normal[:, :, None] * np.einsum("ki,kiz->kz", apart, change.normal)[:, None]
        d_plane -= level[:, None, None] * change.normal
        d_plane[:, :, 12:] += np.eye(3) - normal[:, :, None] * normal[:, None, :]
        d_trial = (points.sticking * points.share)[:, None, None] * d_plane
        rate = (
            points.sticking * points.share_rate
            + self.law.share * self.law.stiffening(points.gap) * points.share
        )
        d_trial += rate[:, None, None] * plane[:, :, None] * change.gap[:, None]
        d_traction = self.friction.tangent(
            points.trial,
            d_trial,
            stiffness[:, None] * change.gap,
            force,
            points.status,
        )
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
