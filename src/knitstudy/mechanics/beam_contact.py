"""Contact with friction between beams of circular section, at one pair of closest points a crossing.

The gap is |r| - 2R. The tangential traction is a stiffness times the elastic slip of two material points of the
surfaces, one on either yarn, that faced each other when the last increment had converged, up to mu times the normal
force. A material point is carried by its yarn's sections, so that friction knows their spin: a yarn that rolls on
another does not slip, one that spins in its place does. Friction acts on both yarns half way between the centrelines,
with the couple that it exerts there on their sections, so that forces and moments balance exactly. Friction that acted
on the centrelines alone would leave a couple of 2R times its force.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.beam_approach import A, Approach, B, Change, Curves, Pairs, Stencil, approach
from knitstudy.mechanics.beam_model import BeamModel, BeamState
from knitstudy.mechanics.contact.friction import OPEN, Coulomb
from knitstudy.mechanics.model import Memoryless, Response
from knitstudy.mechanics.rotation import hat


@dataclass(frozen=True)
class Power:
    """Force coefficient (-gap)^exponent [N] where yarns overlap."""

    coefficient: float  # of force over approach to the exponent
    exponent: float = 1.0  # 1: a penalty

    def force(self, gap: np.ndarray) -> np.ndarray:
        """Return the forces (k,) at gaps (k,) [m]; zero where open."""
        return self.coefficient * np.maximum(0.0, -gap) ** self.exponent

    def stiffness(self, gap: np.ndarray) -> np.ndarray:
        """Return how fast (k,) the force grows with the approach."""
        return np.where(
            gap < 0, self.exponent * self.coefficient * np.maximum(0.0, -gap) ** (self.exponent - 1.0), 0.0
        )

    def energy(self, gap: np.ndarray) -> np.ndarray:
        """Return the stored energies (k,) [J]."""
        return self.coefficient / (self.exponent + 1.0) * np.maximum(0.0, -gap) ** (self.exponent + 1.0)


def hertz(
    youngs_modulus: float,  # [Pa]
    poisson_ratio: float,
    radius: float,  # of both [m]
) -> Power:
    """Return the approach of two equal cylinders that cross at a right angle (Johnson 1985, section 4.1).

    F = 4/3 E* sqrt(R) delta^1.5 with E* = E / 2 (1 - nu^2), as of a sphere of radius R on a plane.
    """
    contact_modulus = youngs_modulus / (2 * (1 - poisson_ratio**2))
    return Power(4 / 3 * contact_modulus * np.sqrt(radius), 1.5)


@dataclass(frozen=True, eq=False)
class CrossingPairs:
    """Pairs of all crossings in contact."""

    pairs: Pairs  # k pairs; side A is the lower row's yarn
    start: np.ndarray  # (k, 2), arc lengths from which the closest points are first looked for [m]
    crossing: np.ndarray  # int (k,), crossing that a pair belongs to


@dataclass(frozen=True, eq=False)
class Places:
    """Current configuration of the stations: position (S, 3) [m] and rotation (S, 3, 3) from the reference."""

    position: np.ndarray
    rotation: np.ndarray


@dataclass(frozen=True, eq=False)
class BeamContactHistory:
    """What pairs remember of the last converged increment."""

    s: np.ndarray  # (k, 2), closest points; also where the material points belong [m]
    arm: np.ndarray  # (k, 2, 3), from the centreline to the material points, in the reference [m]
    gap: np.ndarray  # (k,) [m]; inf where there was no closest point
    force: np.ndarray  # (k,), normal force [N]; where it is positive the material points count as joined
    slip: np.ndarray  # (k,), length slipped since first contact [m]
    dissipated: float  # work of friction so far [J]


@dataclass(frozen=True, eq=False)
class BeamContactPoints:
    """All pairs in one configuration."""

    history: BeamContactHistory
    approach: Approach
    anchors: tuple[Stencil, Stencil]  # of the centrelines where the material points belong
    gap: np.ndarray  # (k,) [m]; inf where there is no closest point
    apart: np.ndarray  # (k, 3), from the material point of side B to that of side A [m]
    # (k,), part of the increment in contact: 1, or less for pairs that have closed within it
    share: np.ndarray
    share_rate: np.ndarray  # (k,), its derivative with respect to the gap [1/m]
    trial: np.ndarray  # (k, 3), tangential force on side B by side A's motion, before Coulomb's limit [N]
    traction: np.ndarray  # (k, 3), the same after it [N]
    force: np.ndarray  # (k,), normal force [N]
    status: np.ndarray  # int (k,) OPEN, STICK or SLIP


@dataclass(frozen=True, eq=False)
class BeamContactResponse:
    """Forces of contact in one configuration."""

    points: BeamContactPoints
    station_force: np.ndarray  # (S, 6), internal force [N] and moment [N m] at all stations
    # "penalty": stored in approach and elastic slip; "friction": dissipated since the start [J]
    energy: dict[str, float]
    stations: np.ndarray | None = None  # int (a, 16), stations of every pair that touches
    # (a, 96, 96), derivative of their forces with respect to their motions, six each
    stiffness: np.ndarray | None = None


class BeamContact:
    """Contact of yarns of one radius at crossings."""

    def __init__(
        self,
        curves: Curves,
        crossing: CrossingPairs,  # what may touch
        radius: float,  # [m]
        law: Power,  # normal force over gap
        tangential: float,  # stiffness against elastic slip [N/m]
        friction: float,  # mu; inf for rough contact, 0 for none
    ) -> None:
        self.curves, self.crossing, self.radius, self.law = curves, crossing, radius, law
        # Coulomb's law meets forces here: with a normal stiffness of one, a change of force is a change of gap.
        self.friction = Coulomb(normal=1.0, tangential=tangential, friction=friction)

    def start(self, places: Places) -> BeamContactHistory:
        """Return the history of yarns that have not moved yet."""
        k = len(self.crossing.start)
        here = approach(self.curves, places.position, self.crossing.pairs, self.crossing.start)
        arm = self._arms(here, places.rotation, np.zeros((k, 3)))
        return BeamContactHistory(here.s, arm, self._gap(here), np.zeros(k), np.zeros(k), 0.0)

    def points(self, places: Places, history: BeamContactHistory) -> BeamContactPoints:
        """Evaluate all pairs."""
        pairs = self.crossing.pairs
        here = approach(self.curves, places.position, pairs, history.s)
        anchors = tuple(self.curves.stencil(pairs.yarn[:, side], history.s[:, side]) for side in (A, B))
        material = [
            anchors[side].of(anchors[side].value, places.position)
            + np.einsum(
                "kp,kpij,kj->ki",
                anchors[side].value,
                places.rotation[anchors[side].stations],
                history.arm[:, side],
            )
            for side in (A, B)
        ]
        gap = self._gap(here)
        # A pair that has closed within this increment has slid in contact only for the rest of it.
        closes = (history.force <= 0) & (gap < 0) & (history.gap > 0) & np.isfinite(history.gap)
        now, then = np.where(closes, gap, 0.0), np.where(closes, history.gap, 0.0)
        span = np.where(closes, now - then, 1.0)
        share = np.where(closes, now / span, 1.0)
        apart = material[A] - material[B]
        plane = apart - here.normal * np.einsum("ki,ki->k", here.normal, apart)[:, None]
        trial = self.friction.tangential * share[:, None] * plane
        force = self.law.force(gap)
        traction, status = self.friction.traction(trial, force)
        return BeamContactPoints(
            history, here, anchors, gap, apart, share, -then / span**2, trial, traction, force, status
        )

    def respond(self, places: Places, history: BeamContactHistory, stiffness: bool) -> BeamContactResponse:
        """Return forces, energies and, if asked, the tangent."""
        points = self.points(places, history)
        active = np.flatnonzero(points.status != OPEN)
        here = points.approach[active]
        force = points.traction[active] + points.force[active, None] * here.normal
        couple = 0.5 * here.distance[:, None] * np.cross(here.normal, points.traction[active])
        station_force = np.zeros((len(places.position), 6))
        for side, sign in ((A, 1.0), (B, -1.0)):
            stencil = here.stencil[side]
            shares = stencil.value[:, :, None] * np.concatenate([sign * force, couple], axis=1)[:, None]
            np.add.at(station_force, stencil.stations, shares)
        answer = BeamContactResponse(points, station_force, self._energy(points, active))
        if not stiffness:
            return answer
        stations, blocks = self._stiffness(places, points, active)
        return replace(answer, stations=stations, stiffness=blocks)

    def commit(self, places: Places, history: BeamContactHistory) -> BeamContactHistory:
        """Return the history that a converged increment leaves.

        Raises ConvergenceError if a pair that touched has no closest points any more.
        """
        points = self.points(places, history)
        lost = (history.force > 0) & ~points.approach.found
        if lost.any():
            k = int(np.argmax(lost))
            raise ConvergenceError(
                f"contact at crossing {self.crossing.crossing[k]} has slid half way to the next crossing (yarns "
                f"{' and '.join(map(str, self.crossing.pairs.yarn[k]))}): a yarn is pulled out of its loop; use a "
                "smaller load"
            )
        touches = points.status != OPEN
        elastic = np.where(touches[:, None], points.traction / self.friction.tangential, 0.0)
        return BeamContactHistory(
            s=points.approach.s,
            arm=self._arms(points.approach, places.rotation, elastic),
            gap=points.gap,
            force=points.force,
            slip=np.where(points.force > 0, history.slip + self._slipped(points), 0.0),
            dissipated=history.dissipated + self._dissipation(points),
        )

    def crossing_force(self, points: BeamContactPoints, count: int) -> np.ndarray:
        """Return the force (count, 3) of contact on the lower row's yarn at every crossing [N]."""
        on_a = -(points.traction + points.force[:, None] * points.approach.normal)
        force = np.zeros((count, 3))
        force[self.crossing.crossing] = np.where((points.status != OPEN)[:, None], on_a, 0.0)
        return force

    def crossing_gap(self, points: BeamContactPoints, count: int) -> np.ndarray:
        """Return the smallest gap (count,) at every crossing [m]; nan where there is no contact."""
        gap = np.full(count, np.nan)
        gap[self.crossing.crossing] = np.where(np.isfinite(points.gap), points.gap, np.nan)
        return gap

    def _gap(self, here: Approach) -> np.ndarray:
        return np.where(here.found, here.distance - 2 * self.radius, np.inf)

    def _arms(self, here: Approach, rotation: np.ndarray, elastic: np.ndarray) -> np.ndarray:
        """Reference arms (k, 2, 3) of material points half way between the yarns, `elastic` (k, 3) apart."""
        half = 0.5 * here.distance[:, None] * here.normal
        arms = []
        for side, sign in ((A, 1.0), (B, -1.0)):
            stencil = here.stencil[side]
            turned = stencil.of(stencil.value, rotation)
            arms.append(np.linalg.solve(turned, (sign * (half + 0.5 * elastic))[..., None])[..., 0])
        return np.stack(arms, axis=1)

    def _energy(self, points: BeamContactPoints, active: np.ndarray) -> dict[str, float]:
        traction = points.traction[active]
        sheared = 0.5 * np.einsum("ki,ki->k", traction, traction) / self.friction.tangential
        stored = float(np.sum(self.law.energy(points.gap[active]) + sheared))
        return {"penalty": stored, "friction": points.history.dissipated + self._dissipation(points)}

    def _dissipation(self, points: BeamContactPoints) -> float:
        """Work of friction within the increment, mu times the mean force of it times the slip [J]."""
        if not np.isfinite(self.friction.friction):
            return 0.0
        mean = 0.5 * (points.force + points.history.force)
        return float(np.sum(self.friction.friction * mean * self._slipped(points)))

    def _slipped(self, points: BeamContactPoints) -> np.ndarray:
        """Return the length (k,) that every pair slips within the increment [m]."""
        return np.where(points.force > 0, self.friction.slipped(points.trial, points.force), 0.0)

    def _stiffness(
        self, places: Places, points: BeamContactPoints, active: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return stations (a, 16) and their stiffness (a, 96, 96)."""
        here = points.approach[active]
        inner = self._point_tangent(points, active, here)
        anchors = [points.anchors[side][active] for side in (A, B)]
        stations = np.concatenate([each.stations for each in (*here.stencil, *anchors)], axis=1)
        motion = np.zeros((len(active), 5, 3, 16, 6))  # z by the motion of the stations
        reaction = np.zeros((len(active), 8, 3, 16, 6))  # generalised forces of the two sides, likewise
        i = np.arange(3)
        for side in (A, B):
            at = slice(4 * side, 4 * side + 4)
            for order, weights in enumerate((here.stencil[side].value, here.stencil[side].first)):
                for xyz in i:
                    motion[:, 2 * side + order, xyz, at, xyz] = weights
                    reaction[:, 4 * side + order, xyz, at, xyz] = weights
                    reaction[:, 4 * side + 2 + order, xyz, at, 3 + xyz] = weights
            at = slice(8 + 4 * side, 12 + 4 * side)
            anchor, sign = anchors[side], 1.0 if side == A else -1.0
            arm = np.einsum(
                "kpij,kj->kpi", places.rotation[anchor.stations], points.history.arm[active, side]
            )
            for xyz in i:
                motion[:, 4, xyz, at, xyz] = sign * anchor.value
            turning = -sign * anchor.value[:, :, None, None] * hat(arm)  # (a, 4, 3, 3)
            motion[:, 4, :, at, 3:] = np.swapaxes(turning, 1, 2)
        motion, reaction = motion.reshape(-1, 15, 96), reaction.reshape(-1, 24, 96)
        return stations, np.swapaxes(reaction, 1, 2) @ (inner @ motion)

    def _point_tangent(self, points: BeamContactPoints, active: np.ndarray, here: Approach) -> np.ndarray:
        """Return the derivative (a, 24, 15) of generalised forces with respect to z.

        Rows are, for side A and then B, what works on X and X,_s (force) and on the spin and its derivative (couple).
        """
        change = Change.of(here)
        normal, traction = here.normal, points.traction[active]
        force, apart, share = points.force[active], points.apart[active], points.share[active]
        stiffness = self.law.stiffness(points.gap[active])
        level = np.einsum("ki,ki->k", normal, apart)
        plane = apart - normal * level[:, None]
        d_plane = -normal[:, :, None] * np.einsum("ki,kiz->kz", apart, change.normal)[:, None]
        d_plane -= level[:, None, None] * change.normal
        d_plane[:, :, 12:] += np.eye(3) - normal[:, :, None] * normal[:, None, :]
        d_trial = share[:, None, None] * d_plane
        d_trial += points.share_rate[active, None, None] * plane[:, :, None] * change.gap[:, None]
        d_traction = self.friction.tangent(
            points.trial[active],
            self.friction.tangential * d_trial,
            stiffness[:, None] * change.gap,
            force,
            points.status[active],
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


# Beams in contact with each other as a model that a solver can drive


@dataclass(frozen=True, eq=False)
class TouchingState:
    """Configuration of beams, and what their contact remembers."""

    beams: BeamState
    history: BeamContactHistory


class TouchingBeams(Memoryless):
    """Beams, and the contact of the stations along them."""

    def __init__(
        self,
        beams: BeamModel,  # with arms that turn, if it has any
        node: np.ndarray,  # int (S,), node that carries a station
        offset: np.ndarray,  # (S, 3), from that node to the station, in the reference [m]
        contact: BeamContact,
    ) -> None:
        self.beams, self.node, self.offset, self.contact = beams, node, offset, contact
        self.block, self.size, self.scale, self.length = beams.block, beams.size, beams.scale, beams.length

    def start(self) -> TouchingState:
        """Return the reference state."""
        beams = self.beams.start()
        return TouchingState(beams, self.contact.start(self.places(beams)))

    def advance(self, state: TouchingState, step: np.ndarray) -> TouchingState:
        """Return the state a step (size,) further: translations [m] and spins [rad] from the left."""
        return replace(state, beams=self.beams.advance(state.beams, step))

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
            response, force=force.ravel(), energy=response.energy | touch.energy, status=touch.points.status
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
