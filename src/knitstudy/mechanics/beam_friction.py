"""Friction between beams at their closest points.

The traction t follows the slip u, within an increment, of two material points of the surfaces, one on either yarn, that
faced each other when it began: dt = K du with K = k S, k = dF/d(delta) and S the shear stiffness of the patch over it
(`hertz.Patch.shear`). What was sheared before stays where k grows, and t falls with k where yarns are released (Mindlin
and Deresiewicz 1953). Whatever mean K between those at both ends an increment takes, elastic slip loses energy:

    (t_0 + t) . u / 2 + psi_0 - psi >= 0,   psi = t . K^-1 t / 2.

Beyond Coulomb's limit mu F slip has the direction of t. t and S turn with both yarns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knitstudy.mechanics.batches import Chosen
from knitstudy.mechanics.beam_approach import A, Approach, B, Change
from knitstudy.mechanics.contact.friction import OPEN, SLIP, STICK
from knitstudy.mechanics.rotation import hat

if TYPE_CHECKING:
    from knitstudy.mechanics.beam_contact import BeamContactHistory

LEVEL = 1e-5  # change of the overlap, over it, below which the mean stiffness is that of both ends
STEPS = 6  # of Newton's method for Coulomb's limit


def stored_energy(traction: np.ndarray, spring: np.ndarray, shear: np.ndarray) -> np.ndarray:
    """Return t . K^-1 t / 2 (k,) of tractions (k, 2); zero where nothing resists."""
    slip = np.linalg.solve(shear, traction[..., None])[..., 0]
    twice = np.einsum("ka,ka->k", traction, slip)
    return 0.5 * np.divide(twice, spring, out=np.zeros_like(spring), where=spring > 0)


@dataclass(frozen=True, eq=False)
class Frame(Chosen):
    """Axes in the tangent plane that turn with both yarns: half way between their tangents, and across."""

    sense: np.ndarray  # (k,), 1, or -1 where side B's tangent makes an acute angle the other way round
    axes: np.ndarray  # (k, 3, 2)
    tangent: np.ndarray  # (k, 2, 3), unit tangents that make an acute angle
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

    def within(self, vectors: np.ndarray) -> np.ndarray:
        """Return the components (k, 2) of vectors (k, 3)."""
        return np.einsum("kia,ki->ka", self.axes, vectors)

    def spin(self, here: Approach, change: Change) -> np.ndarray:
        """Return the spin (k, 3, 15) of the axes with the variables of `Change`."""
        turned = np.zeros_like(change.normal)
        for side, sign in ((A, np.ones_like(self.sense)), (B, self.sense)):
            t = self.tangent[:, side]
            moved = here.bend[:, side, :, None] * change.s[:, side, None]
            moved[:, :, 3 + 6 * side : 6 + 6 * side] += np.eye(3)
            moved -= t[:, :, None] * np.einsum("ki,kiz->kz", t, moved)[:, None]
            turned += moved * (sign / np.linalg.norm(here.tangent[:, side], axis=1))[:, None, None]
        turned -= np.einsum("ki,kai->k", here.normal, self.tangent)[:, None, None] * change.normal
        about = np.einsum("ki,kiz->kz", self.axes[:, :, 1], turned) / self.length[:, None]
        return hat(here.normal) @ change.normal + here.normal[:, :, None] * about[:, None]


@dataclass(frozen=True, eq=False)
class Rubbing(Chosen):
    """Friction of pairs in one configuration: vectors (k, 2) are in the frame, rates are derivatives by the gap."""

    frame: Frame
    apart: np.ndarray  # (k, 3), from the material point of side B to that of side A [m]
    # (k,), part of the increment in contact: 1, or less for pairs that have closed within it
    share: np.ndarray
    shear: np.ndarray  # (k, 2, 2), S
    spring: np.ndarray  # (k,), dF/d(delta) [N/m]
    mean: np.ndarray  # (k,), its mean over the increment [N/m]
    mean_rate: np.ndarray  # (k,)
    rate: np.ndarray  # (k, 2), of the traction before Coulomb's limit [N/m]
    limit: np.ndarray  # (k,) [N]
    beyond: np.ndarray  # (k,), slip beyond the limit over the traction [m/N]
    pull: np.ndarray  # (k, 2), traction on side B by side A's motion [N]
    status: np.ndarray  # int (k,) OPEN, STICK or SLIP
    slipped: np.ndarray  # (k,), length within the increment [m]
    lost: np.ndarray  # (k,), work of friction within the increment, none of it negative [J]

    @classmethod
    def of(
        cls,
        history: BeamContactHistory,
        here: Approach,
        apart: np.ndarray,
        gap: np.ndarray,
        # (k,) at the gaps: force, dF/d(delta) and its rate; and the force at the gap of the history
        pressed: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
        friction: float,
    ) -> Rubbing:
        """Return the friction of pairs that are what their history says when the increment begins."""
        force, spring, stiffening, past_force = pressed
        # A pair that has closed within this increment has slid in contact only for the rest of it.
        closes = (history.force <= 0) & (gap < 0) & (history.gap > 0) & np.isfinite(history.gap)
        then = np.where(closes, history.gap, 0.0)
        span = np.where(closes, gap - then, 1.0)
        share, share_rate = np.where(closes, gap / span, 1.0), -then / span**2
        # Of a steady approach the mean of k is the change of F; it lies between both ends.
        k, deeper = history.spring, np.maximum(-gap, 0.0) - np.maximum(-history.gap, 0.0)
        steady = np.abs(deeper) > LEVEL * np.abs(gap)
        over = np.where(steady, deeper, 1.0)
        mean = np.where(steady, (force - past_force) / over, 0.5 * (k + spring))
        rate = np.where(steady, (mean - spring) / over, 0.5 * stiffening)
        falls = spring < k
        last = falls | (mean > spring)
        rate = np.where(last, stiffening, np.where(mean < k, 0.0, rate))
        mean = np.where(last, spring, np.maximum(mean, k))
        whole = np.where(falls, k, 1.0)
        before = np.where(falls, spring / whole, 1.0)[:, None] * history.traction
        frame = Frame.of(here, history.sense)
        slip = frame.within(apart)
        sheared = np.einsum("kab,kb->ka", history.shear, slip)
        trial = before + (mean * share)[:, None] * sheared
        trial_rate = np.where(falls, stiffening / whole, 0.0)[:, None] * history.traction
        trial_rate += (mean * share_rate + rate * share)[:, None] * sheared
        touches = force > 0
        limit = np.multiply(friction, force, out=np.zeros_like(force), where=touches)
        beyond, pull = _limited(trial, mean[:, None, None] * history.shear, limit)
        slips = touches & ((beyond > 0) | (limit == 0))
        slipped = np.where(limit > 0, beyond * np.linalg.norm(pull, axis=1), 0.0)
        # The traction does work on elastic slip, less what is stored; on other slip the mean of both limits does.
        lost = stored_energy(pull, mean, history.shear) - stored_energy(before, mean, history.shear)
        lost += history.stored - stored_energy(pull, spring, history.shear)
        lost[slips] += 0.5 * friction * ((force + history.force) * slipped)[slips]
        free = slips & (limit == 0)
        slipped[free] = (share * np.linalg.norm(slip, axis=1))[free]
        return cls(
            frame,
            apart,
            share,
            history.shear,
            spring,
            mean,
            rate,
            trial_rate,
            limit,
            beyond,
            pull,
            np.where(touches, np.where(slips, SLIP, STICK), OPEN),
            slipped,
            lost,
        )

    @property
    def traction(self) -> np.ndarray:
        """Tangential force (k, 3) on side B by side A's motion [N]."""
        return np.einsum("kia,ka->ki", self.frame.axes, self.pull)

    @property
    def stored(self) -> np.ndarray:
        """Energies (k,) of elastic slip [J]."""
        return stored_energy(self.pull, self.spring, self.shear)

    def tangent(self, here: Approach, change: Change, friction: float) -> np.ndarray:
        """Return the derivative (k, 3, 15) of the traction by the variables of `Change`."""
        spin, axes, pull = self.frame.spin(here, change), self.frame.axes, self.pull[..., None]
        way = hat(self.apart) @ spin
        way[:, :, 12:] += np.eye(3)
        K, beyond = self.mean[:, None, None] * self.shear, self.beyond[:, None, None]
        rate = self.rate[..., None] - beyond * self.mean_rate[:, None, None] * (self.shear @ pull)
        d_pull = self.share[:, None, None] * (K @ axes.swapaxes(1, 2) @ way) + rate * change.gap[:, None]
        # Beyond the limit, t + g K t is what it would be without, and t . dt = mu^2 F dF.
        left, slides = np.linalg.inv(np.eye(2) + beyond * K), self.beyond > 0
        along = pull.swapaxes(1, 2) @ left
        presses = np.where(slides, friction * self.spring, 0.0) * np.where(slides, self.limit, 0.0)
        d_beyond = along @ d_pull + presses[:, None, None] * change.gap[:, None]
        d_beyond /= np.where(slides[:, None, None], along @ K @ pull, np.inf)
        d_pull = left @ (d_pull - K @ pull @ d_beyond)
        d_pull[self.limit == 0] = 0.0
        return axes @ d_pull - hat(self.traction) @ spin


def _limited(trial: np.ndarray, K: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return g (k,) and t (k, 2) with t + g K t = `trial` (k, 2): g is 0, or |t| is the limit (k,)."""
    g, t = np.zeros(len(trial)), np.where((limit > 0)[:, None], trial, 0.0)
    some = np.flatnonzero(np.linalg.norm(t, axis=1) > limit)
    for _ in range(
        STEPS if len(some) else 0
    ):  # 1 / |t| is nearly linear in g, and linear where K is a number
        size = np.linalg.norm(t[some], axis=1)
        left = np.linalg.inv(np.eye(2) + g[some, None, None] * K[some])
        steep = np.einsum("ka,kab,kbc,kc->k", t[some], left, K[some], t[some])
        g[some] += (size / limit[some] - 1) * size**2 / steep
        t[some] = np.linalg.solve(np.eye(2) + g[some, None, None] * K[some], trial[some, :, None])[..., 0]
    return g, t
