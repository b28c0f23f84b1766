"""Contact with friction between beams of circular section, at one pair of closest points a crossing.

The gap is |r| - 2R, and more where a tie carries part of the overlap. Points at the bound of their piece stay in
contact, so that no force is lost at once where they slide into the next piece. The force is that of yarns that cross at
a right angle times a factor of the shape of the surfaces (`hertz`), extrapolated to the end of the increment.

The traction t follows the slip u, within an increment, of two material points of the surfaces, one on either yarn, that
faced each other when it began: dt = K du (Mindlin and Deresiewicz 1953), with K = k S, k = dF/d(delta) and S the shear
stiffness of the patch over it. What has been sheared stays where k grows, and t is lost in proportion where k falls. A
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
    needed_hold,
)
from knitstudy.mechanics.contact.friction import OPEN, SLIP, STICK
from knitstudy.mechanics.hertz import Patch
from knitstudy.mechanics.model import Response
from knitstudy.mechanics.rotation import hat

if TYPE_CHECKING:
    from knitstudy.mechanics.beam_model import BeamState

SIGNS = np.array([[1.0], [-1.0]])  # of sides A and B

SLIDES = 6  # Newton steps of Coulomb's limit
SINGULAR = 0.1  # eigenvalue of H below which nothing goes on as before
AHEAD = 0.25  # largest extrapolation of arc lengths over R
GROWTH = 0.25  # the same of factors, over themselves
MOST = 3.0  # largest factor
LEVEL = 1e-5  # change of the overlap, over it, below which the mean stiffness is that of both ends


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
    factor: np.ndarray  # (k,), of the shape of the surfaces, on the force
    sense: np.ndarray  # (k,), 1 or -1: `Frame` halves the acute angle of the yarns
    spring: np.ndarray  # (k,), dF/d(delta) that came with the traction [N/m]
    shear: np.ndarray  # (k, 2, 2), S in the frame
    traction: np.ndarray  # (k, 2), on side B by side A's motion, in the frame [N]
    slip: np.ndarray  # (k,), length slipped since first contact [m]
    hold: np.ndarray  # (k,), springs of closest points, see `beam_approach`
    on_a: np.ndarray  # (k, 3), force of contact on side A, before springs are held anew [N]
    rate: np.ndarray  # (k, 3), change of s and the factor over that of the load, in the last increment
    change: float  # of the load, in this one
    rubbed: float  # work of friction so far [J]

    @property
    def stored(self) -> np.ndarray:
        """Energies (k,) of elastic slip [J]."""
        return _stored(self.traction, self.spring, self.shear)


def _stored(traction: np.ndarray, spring: np.ndarray, shear: np.ndarray) -> np.ndarray:
    """Return t . K^-1 . t / 2 (k,) of tractions (k, 2); zero without a spring."""
    slip = np.linalg.solve(shear, traction[..., None])[..., 0]
    twice = np.einsum("ka,ka->k", traction, slip)
    return 0.5 * np.divide(twice, spring, out=np.zeros_like(spring), where=spring > 0)


@dataclass(frozen=True, eq=False)
class Frame(Chosen):
    """Axes in the tangent plane that turn with both yarns: one half way between their tangents, one across."""

    sense: np.ndarray  # (k,), as in the history
    axes: np.ndarray  # (k, 3, 2)
    tangent: np.ndarray  # (k, 2, 3), unit tangents; side B's turned to an acute angle
    length: np.ndarray  # (k,), of the sum of both in the plane

    @classmethod
    def of(cls, here: Approach, sense: np.ndarray) -> Frame:
        """Return the frames at closest points."""
        tangent = here.tangent / np.linalg.norm(here.tangent, axis=2, keepdims=True)
        tangent[:, B] *= sense[:, None]
        middle = tangent.sum(axis=1)
        middle -= here.normal * np.einsum("ki,ki->k", here.normal, middle)[:, None]
        length = np.linalg.norm(middle, axis=1)
        middle /= length[:, None]
        return cls(sense, np.stack([middle, np.cross(here.normal, middle)], axis=2), tangent, length)

    def spin(self, here: Approach, change: Change) -> np.ndarray:
        """Return the spin (k, 3, 15) of the axes with the variables of `Change`."""
        turned = np.zeros_like(change.normal)
        for side, sign in ((A, np.ones(len(turned))), (B, self.sense)):
            t = self.tangent[:, side]
            moved = here.bend[:, side, :, None] * change.s[:, side, None]
            moved[:, :, 3 + 6 * side : 6 + 6 * side] += np.eye(3)
            moved -= t[:, :, None] * np.einsum("ki,kiz->kz", t, moved)[:, None]
            turned += moved * (sign / np.linalg.norm(here.tangent[:, side], axis=1))[:, None, None]
        across = self.axes[:, :, 1]
        level = np.einsum("ki,ki->k", here.normal, self.tangent.sum(axis=1))
        turned -= level[:, None, None] * change.normal
        about = np.einsum("ki,kiz->kz", across, turned) / self.length[:, None]
        return hat(here.normal) @ change.normal + here.normal[:, :, None] * about[:, None]


@dataclass(frozen=True, eq=False)
class BeamContactPoints(Chosen):
    """Pairs in one configuration; derivatives are by the gap, vectors (k, 2) in the frame."""

    approach: Approach
    anchor: Stencil  # (k, 2), of the centrelines where the material points belong
    # (k, 2, 4, 3), from the centreline to the material points, turned as each of its stations is [m]
    arm: np.ndarray
    gap: np.ndarray  # (k,) [m]; inf where the closest point is an end
    apart: np.ndarray  # (k, 3), from the material point of side B to that of side A [m]
    frame: Frame
    # (k,), part of the increment in contact: 1, or less for pairs that have closed within it
    share: np.ndarray
    spring: np.ndarray  # (k,), dF/d(delta) [N/m]
    mean: np.ndarray  # (k,), its mean over the increment [N/m]
    shear: np.ndarray  # (k, 2, 2), S
    before: np.ndarray  # (k, 2), what is left of the history's traction [N]
    # (k, 2) and (k,), derivatives of the traction before Coulomb's limit, and of `mean`
    rate: np.ndarray
    mean_rate: np.ndarray
    sliding: np.ndarray  # (k,), slip beyond the limit over the traction [m/N]
    pull: np.ndarray  # (k, 2), traction on side B by side A's motion [N]
    force: np.ndarray  # (k,), normal force [N]
    status: np.ndarray  # int (k,) OPEN, STICK or SLIP
    slipped: np.ndarray  # (k,), length within the increment [m]
    factor: np.ndarray  # (k,), of the shape of the surfaces, on the force

    @property
    def traction(self) -> np.ndarray:
        """Tangential force (k, 3) on side B by side A's motion [N]."""
        return np.einsum("kia,ka->ki", self.frame.axes, self.pull)

    @property
    def on_a(self) -> np.ndarray:
        """Force (k, 3) of contact on side A [N]."""
        on_a = -(self.traction + self.force[:, None] * self.approach.normal)
        return np.where((self.status != OPEN)[:, None], on_a, 0.0)

    @property
    def stored(self) -> np.ndarray:
        """Energies (k,) of elastic slip [J]."""
        return _stored(self.pull, self.spring, self.shear)


def _sliding(trial: np.ndarray, stiffness: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """Return g (k,) for which |t| is a limit (k,), t + g K t = `trial` (k, 2); 0 where `trial` is less.

    Slip g t has the direction of t, however much K (k, 2, 2) resists one direction more than another.
    """
    found = np.zeros(len(trial))
    slides = (np.linalg.norm(trial, axis=1) > limit) & (limit > 0)
    trial, stiffness, limit = trial[slides], stiffness[slides], limit[slides]
    g = np.zeros(len(trial))
    for _ in range(SLIDES):  # 1 / |t| is nearly linear in g, and exactly where K is a number
        inverse = np.linalg.inv(np.eye(2) + g[:, None, None] * stiffness)
        t = np.einsum("kab,kb->ka", inverse, trial)
        size = np.linalg.norm(t, axis=1)
        steep = np.einsum("ka,kab,kbc,kc->k", t, inverse, stiffness, t)
        g += (size / limit - 1) * size**2 / steep
    found[slides] = g
    return found


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
        patch: Patch | None = None,  # what the shape of the surfaces does; by default nothing
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
        factor, sense, shear = self._shape(here)
        return BeamContactHistory(
            pairs=replace(pairs, start=here.s),
            carried=carried,
            s=here.s,
            arm=self._arms(here, places.rotation),
            normal=here.normal,
            gap=self._gap(here, pairs, carried),
            force=none,
            factor=factor,
            sense=sense,
            spring=none,
            shear=shear,
            traction=np.zeros((len(none), 2)),
            slip=none,
            hold=needed_hold(here),
            on_a=np.zeros((len(none), 3)),
            rate=np.zeros((len(none), 3)),
            change=0.0,
            rubbed=0.0,
        )

    def _shape(self, here: Approach) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the factor (k,) on the force, the sense (k,) of the frame, and S (k, 2, 2) in it."""
        tangent = here.tangent / np.linalg.norm(here.tangent, axis=2, keepdims=True)
        cos = np.einsum("ki,ki->k", *tangent.swapaxes(0, 1))
        sense = np.where(cos < 0, -1.0, 1.0)
        if self.patch is None:
            return np.ones(len(cos)), sense, np.tile(self.law.share * np.eye(2), (len(cos), 1, 1))
        bends, axes = self.bends(here), Frame.of(here, sense).axes
        shear = self.patch.shear(tangent, bends, here.normal)
        return np.minimum(self.patch.force(bends).value, MOST), sense, axes.swapaxes(1, 2) @ shear @ axes

    def bends(self, here: Approach) -> np.ndarray:
        """Return (k_a R, k_b R, cos of the angle) (k, 3): curvatures towards the other yarn."""
        speed = np.linalg.norm(here.tangent, axis=2)
        tangent = here.tangent / speed[..., None]
        along = np.einsum("kai,kai->ka", tangent, here.bend)
        bend = (here.bend - along[..., None] * tangent) / speed[..., None] ** 2
        towards = self.radius * np.einsum("kai,ki->ka", bend, here.normal) * SIGNS[:, 0]
        return np.column_stack([towards, np.einsum("ki,ki->k", *tangent.swapaxes(0, 1))])

    def points(self, state: BeamState) -> BeamContactPoints:
        """Evaluate all pairs."""
        places, history = self.places(state), state.contact
        # Springs hold points near where they will be, and shapes go on to change, as in the last increment.
        most = np.stack([AHEAD * self.radius + 0 * history.s[:, 0]] * 2 + [GROWTH * history.factor], axis=1)
        ahead = np.clip(history.change * history.rate, -most, most)
        ahead[history.hold > SOFTEST - SINGULAR] = 0.0
        start = history.s + ahead[:, :2]
        here = approach(self.curves, places.position, replace(history.pairs, start=start), history.hold)
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
        share, share_rate = np.where(closes, now / span, 1.0), -then / span**2
        factor = history.factor + ahead[:, 2]
        law, k = self.law, history.spring
        force, spring, stiffening = (
            factor * each(gap) for each in (law.force, law.stiffness, law.stiffening)
        )
        # The mean of k over a steady approach; between k at both ends, so that no energy comes from nothing.
        deeper = np.maximum(-gap, 0.0) - np.maximum(-history.gap, 0.0)
        steady = np.abs(deeper) > LEVEL * np.abs(gap)
        over = np.where(steady, deeper, 1.0)
        mean = np.where(steady, (force - factor * law.force(history.gap)) / over, 0.5 * (k + spring))
        mean_rate = np.where(steady, (mean - spring) / over, 0.5 * stiffening)
        falls = spring < k
        least, most = falls | (mean > spring), mean < k
        mean_rate = np.where(least, stiffening, np.where(most, 0.0, mean_rate))
        mean = np.where(least, spring, np.maximum(mean, k))
        past = np.where(falls, k, 1.0)
        before = np.where(falls, spring / past, 1.0)[:, None] * history.traction
        frame, apart = Frame.of(here, history.sense), material[:, A] - material[:, B]
        way = np.einsum("kab,kib,ki->ka", history.shear, frame.axes, apart)
        trial = before + (mean * share)[:, None] * way
        rate = np.where(falls, stiffening / past, 0.0)[:, None] * history.traction
        rate += (mean * share_rate + mean_rate * share)[:, None] * way
        limit = self.friction * force if self.friction > 0 else 0.0 * force
        stiffness = mean[:, None, None] * history.shear
        sliding = _sliding(trial, stiffness, limit)
        pull = np.linalg.solve(np.eye(2) + sliding[:, None, None] * stiffness, trial[..., None])[..., 0]
        slipped = sliding * np.linalg.norm(pull, axis=1)
        if self.friction == 0:
            pull, slipped = (
                0 * pull,
                share * np.linalg.norm(np.einsum("kib,ki->kb", frame.axes, apart), axis=1),
            )
        touches = force > 0
        pull, slipped = touches[:, None] * pull, touches * slipped
        status = np.where(touches, np.where((sliding > 0) | (self.friction == 0), SLIP, STICK), OPEN)
        return BeamContactPoints(
            here,
            anchor,
            arm,
            gap,
            apart,
            frame,
            share,
            spring,
            mean,
            history.shear,
            before,
            rate,
            mean_rate,
            sliding,
            pull,
            force,
            status,
            slipped,
            factor,
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
        stored = float(np.sum(touching.factor * self.law.energy(touching.gap) + touching.stored))
        rubbed = state.contact.rubbed + self._work(points, state.contact)
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
        here, pairs = points.approach, history.pairs
        within = here.free.all(axis=1)[:, None]
        factor, sense, shear = self._shape(here)
        rate = np.column_stack([np.where(within, here.s - history.s, 0.0), factor - history.factor])
        # The patch has turned: its energy must not grow.
        traction = np.einsum("kia,ki->ka", Frame.of(here, sense).axes, points.traction)
        stored, turned = points.stored, _stored(traction, points.spring, shear)
        traction *= np.sqrt(np.divide(stored, turned, out=np.ones_like(turned), where=turned > stored))[
            :, None
        ]
        lost = float(np.sum(stored - _stored(traction, points.spring, shear)))
        return BeamContactHistory(
            pairs=replace(pairs, start=np.where(within, here.s, pairs.start)),
            carried=history.carried,
            s=here.s,
            arm=self._arms(here, self.places(state).rotation),
            normal=here.normal,
            gap=points.gap,
            force=points.force,
            factor=factor,
            sense=sense,
            spring=points.spring,
            shear=shear,
            traction=traction,
            slip=np.where(points.force > 0, history.slip + points.slipped, 0.0),
            hold=needed_hold(here),
            on_a=points.on_a,
            rate=rate / history.change if history.change > 0 else 0 * rate,
            change=0.0,
            rubbed=history.rubbed + self._work(points, history) + lost,
        )

    def _gap(self, here: Approach, pairs: Pairs, carried: np.ndarray) -> np.ndarray:
        ends = (here.s <= 0) | (here.s >= self.curves.length[pairs.yarn])
        return np.where(ends.any(axis=1), np.inf, here.distance - 2 * self.radius + carried)

    def _arms(self, here: Approach, rotation: np.ndarray) -> np.ndarray:
        """Reference arms (k, 2, 3) of material points half way between the yarns."""
        way = SIGNS * (0.5 * here.distance[:, None] * here.normal)[:, None]
        return np.linalg.solve(here.stencil.of(here.stencil.value, rotation), way[..., None])[..., 0]

    def _work(self, points: BeamContactPoints, history: BeamContactHistory) -> float:
        """Work that friction takes within the increment: none of its parts is negative [J].

        On elastic slip it is what the traction does less what is stored, on slip the mean limit times its length.
        """
        elastic = _stored(points.pull, points.mean, points.shear) - _stored(
            points.before, points.mean, points.shear
        )
        lost = elastic + history.stored - points.stored
        if 0 < self.friction < np.inf:
            lost += 0.5 * self.friction * (points.force + history.force) * points.slipped
        return float(np.sum(lost))

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
        normal, traction, force = here.normal, points.traction, points.force
        stiffness, axes, pull = self.law.stiffness(points.gap) * points.factor, points.frame.axes, points.pull
        spin = points.frame.spin(here, change)
        d_way = hat(points.apart) @ spin
        d_way[:, :, 12:] += np.eye(3)
        K, sliding = points.mean[:, None, None] * points.shear, points.sliding[:, None]
        d_pull = points.share[:, None, None] * K @ axes.swapaxes(1, 2) @ d_way
        sheared = points.shear @ pull[..., None]
        rate = points.rate - sliding * points.mean_rate[:, None] * sheared[..., 0]
        d_pull += rate[:, :, None] * change.gap[:, None]
        # Beyond the limit: t + g K t is the trial, and t . dt = mu^2 F dF.
        left = np.linalg.inv(np.eye(2) + sliding[..., None] * K)
        along, level = pull[:, None] @ left, np.where(np.isfinite(self.friction), self.friction, 0.0) ** 2
        slides = points.status == SLIP
        steep = np.where(slides[:, None, None] & (self.friction > 0), along @ K @ pull[..., None], 1.0)
        d_sliding = along @ d_pull + (level * force * stiffness)[:, None, None] * change.gap[:, None]
        d_pull = left @ (
            d_pull - (K @ pull[..., None]) * np.where(slides[:, None, None], d_sliding / steep, 0.0)
        )
        d_traction = axes @ d_pull * (self.friction > 0) - hat(traction) @ spin
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
