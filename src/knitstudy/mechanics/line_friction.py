"""Friction of pairs of points of yarns that press each other by `line_contact`.

Two points rub at the middle between them. Their traction t follows the slip u of two points of their sections that met
there, up to mu times the part f of their force along the normal at the closest points of both yarns. They are as stiff
as their part of the yarns' contact is (Mindlin 1949),

    k = f K(d) / F(d),   K = -F',   dt = k S du,

where d is the distance of the yarns there and S the share of the patch (`hertz.Patch.shear`): sum k = K. All pieces of
a patch begin to slide at one slip.

Elastic slip stores psi = t . S^-1 t / 2k. In an increment from k_0 to k_1

    t' = t_0 min(1, k_1 / k_0),   k = (k_0 + k_1) / 2 where the patch grows, else k_1,   t = t' + k S (u - u_slid).

What was sheared before stays where the patch grows, and falls with it where the patch shrinks (Mindlin and Deresiewicz
1953; Walton 1987 without slip). Then the energy that is lost,

    (t . S^-1 t - t' . S^-1 t') / 2k + psi_0 - psi_1 + mu (f_0 + f_1) / 2 |u_slid|,

is never negative, in whatever order yarns are pressed and sheared. Normals and S turn with both sections; where those
of the end of an increment would raise psi or exceed Coulomb's limit, t falls. Pairs that do not touch yet are
remembered as well: they rub in the very increment in which they meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knitstudy.mechanics.rotation import hat

if TYPE_CHECKING:
    from knitstudy.mechanics.beam_model import BeamState
    from knitstudy.mechanics.hertz import Expansion
    from knitstudy.mechanics.line_contact import LineContact, PointPairs

# Yarns along each other have no closest points: smallest second derivative of r^2 / 2 along them
LEAST_BEND = 0.02


@dataclass(frozen=True, eq=False)
class LineHistory:
    """What pairs that were near each other in the last converged increment remember."""

    key: np.ndarray  # int (m,), ascending; which pairs
    arm: np.ndarray  # (m, 2, 3), from the centres to the points that met, in the sections' axes [m]
    normal: np.ndarray  # (m, 2, 3), at the closest points of both yarns, in the axes of both sections
    share: np.ndarray  # (m,), part of the pairs' force along it
    closest: np.ndarray  # (m,), distance of the yarns over that of the pair
    density: np.ndarray  # (m,), c times the lengths of both pieces [m2]
    shape: np.ndarray  # (m,), what the shape of the contact makes of F(delta)
    force: np.ndarray  # (m,), f [N]
    shear: np.ndarray  # (m, 2, 3, 3), S in the axes of both sections
    spring: np.ndarray  # (m,), k [N/m]
    traction: np.ndarray  # (m, 2, 3), friction on j in the axes of both sections [N]
    stored: np.ndarray  # (m,), energy of elastic slip [J]
    dissipated: float = 0.0  # work of friction so far [J]

    @classmethod
    def none(cls) -> LineHistory:
        """Return that of yarns that have not touched."""
        one, both = np.zeros(0), np.zeros((0, 2, 3))
        key, square = np.zeros(0, dtype=np.int64), np.zeros((0, 2, 3, 3))
        return cls(key, both, both, one, one, one, one, one, square, one, both, one)

    @classmethod
    def after(
        cls,
        contact: LineContact,
        state: BeamState,
        pairs: PointPairs,
        bends: tuple[np.ndarray, list[Expansion]],
        rubs: PairFriction,
        history: LineHistory,
    ) -> LineHistory:
        """Return the history of near pairs, with their `LineContact.bends`, after an increment with such friction."""
        (z, variables), law = bends, contact.repulsion
        _, density, shape = contact.energy(pairs, variables)
        tangent, bend = z[:, 3:], z[:, 1:3]
        size = np.linalg.norm(tangent, axis=2, keepdims=True)
        tangent, bend = tangent / size, bend / size**2
        normal, distance = _closest(z[:, 0], tangent, bend, 0.5 * law.diameter)
        r = pairs.distance
        share, closest = np.einsum("ki,ki->k", normal, pairs.way) / r, distance / r
        angles = np.stack([each.value for each in variables[:3]], axis=1)
        shear = law.shear(tangent, angles, normal)
        stiff = shear + normal[:, :, None] * normal[:, None, :]
        force, _ = _push(contact, share * density, shape, r)
        spring = _spring(contact, force, 0 * force, closest, shape, r)[0]
        traction, stored = np.zeros((len(r), 3)), np.zeros(len(r))
        old = np.searchsorted(pairs.key, rubs.key)
        traction[old], stored[old] = rubs.traction, rubs.stored
        traction -= normal * np.einsum("ki,ki->k", normal, traction)[:, None]
        energy = _energy(traction, stiff, spring)
        least = np.minimum(
            _ratio(contact.friction * force, np.linalg.norm(traction, axis=1)),
            np.sqrt(_ratio(stored, energy)),
        )
        traction = traction * np.minimum(least, 1.0)[:, None]
        turned = state.rotation[pairs.both]
        half = 0.5 * np.stack([pairs.way, -pairs.way], axis=1)
        energy = _energy(traction, stiff, spring)
        lost = rubs.dissipated.sum() + rubs.left_behind + rubs.stored.sum() - energy.sum()
        return cls(
            key=pairs.key,
            arm=np.einsum("kaji,kaj->kai", turned, half),
            normal=np.einsum("kaji,kj->kai", turned, normal),
            share=share,
            closest=closest,
            density=density,
            shape=shape,
            force=force,
            shear=turned.swapaxes(2, 3) @ shear[:, None] @ turned,
            spring=spring,
            traction=np.einsum("kaji,kj->kai", turned, traction),
            stored=energy,
            dissipated=history.dissipated + float(lost),
        )


def _closest(
    way: np.ndarray, tangent: np.ndarray, bend: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the normal (k, 3) at the closest points of both yarns and their distance (k,), by parabolas there."""
    slope = np.einsum("kai,ki->ka", tangent, way) * [-1.0, 1.0]
    hessian = np.zeros((len(way), 2, 2))
    hessian[:, [0, 1], [0, 1]] = 1 + np.einsum("kai,ki->ka", bend, way) * [-1.0, 1.0]
    hessian[:, 0, 1] = hessian[:, 1, 0] = -np.einsum("ki,ki->k", tangent[:, 0], tangent[:, 1])
    value, vector = np.linalg.eigh(hessian)
    step = -np.einsum("kab,kb,kcb,kc->ka", vector, 1 / np.maximum(value, LEAST_BEND), vector, slope)
    step *= np.minimum(1.0, _ratio(np.full(len(way), radius), np.linalg.norm(step, axis=1)))[:, None]
    on_yarn = tangent * step[..., None] + 0.5 * bend * step[..., None] ** 2
    way = way - on_yarn[:, 0] + on_yarn[:, 1]
    distance = np.linalg.norm(way, axis=1)
    return way / distance[:, None], distance


def _ratio(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return quotients (k,) where the second is positive, elsewhere 1."""
    return np.divide(one, other, out=np.ones_like(one), where=other > 0)


def _push(
    contact: LineContact, share: np.ndarray, shape: np.ndarray, r: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return parts (k,) of the force of pairs [N], and their derivatives by the distance [N/m]."""
    within = r < contact.repulsion.reach
    _, V1, V2 = contact.repulsion.of(r, shape)
    return np.where(within, -share * V1, 0.0), np.where(within, -share * V2, 0.0)


def _spring(
    contact: LineContact,
    force: np.ndarray,
    change: np.ndarray,
    closest: np.ndarray,
    shape: np.ndarray,
    r: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return k (k,) of pairs, and its derivatives by the distance."""
    F, F1, F2 = contact.repulsion.crossing(closest * r, shape)
    touch = (force > 0) & (F > 0)
    F = np.where(touch, F, 1.0)
    steep, bend = -F1 / F, closest * ((F1 / F) ** 2 - F2 / F)
    return np.where(touch, force * steep, 0.0), np.where(touch, change * steep + force * bend, 0.0)


def _energy(traction: np.ndarray, shear: np.ndarray, spring: np.ndarray) -> np.ndarray:
    """Return energies (k,) of elastic slip [J]; none where no spring is."""
    square = 0.5 * np.einsum("ki,ki->k", traction, np.linalg.solve(shear, traction[..., None])[..., 0])
    return np.divide(square, spring, out=np.zeros_like(square), where=spring > 0)


@dataclass(frozen=True, eq=False)
class PairFriction:
    """Friction of pairs that were near each other before, in one configuration."""

    pair: np.ndarray  # int (m,), which of the pairs within reach
    known: np.ndarray  # int (m,), which of those that the history has
    key: np.ndarray  # int (m,)
    arm: np.ndarray  # (m, 2, 3), from the centres to the points that met [m]
    pulls: np.ndarray  # (m, 2, 3), friction of the history, turned with both sections [N]
    kept: np.ndarray  # (m,), part of it that is left
    fades: np.ndarray  # (m,), its derivative by the distance [1/m]
    shear: np.ndarray  # (m, 2, 3, 3), S of the history, turned with both sections
    slip: np.ndarray  # (m, 3), of i against j within the increment [m]
    spring: np.ndarray  # (m,), k of the increment [N/m]
    rate: np.ndarray  # (m,), its derivative by the distance [N/m2]
    force: np.ndarray  # (m,), f [N]
    change: np.ndarray  # (m,), its derivative by the distance [N/m]
    trial: np.ndarray  # (m, 3), traction on j before Coulomb's limit [N]
    slides: np.ndarray  # bool (m,)
    traction: np.ndarray  # (m, 3), on j [N]
    stored: np.ndarray  # (m,), energy of elastic slip [J]
    dissipated: np.ndarray  # (m,), energy lost in the increment [J]
    left_behind: float  # energy of elastic slip of pairs that are not near any more [J]

    @classmethod
    def of(
        cls, contact: LineContact, state: BeamState, pairs: PointPairs, history: LineHistory
    ) -> PairFriction:
        """Return the friction of pairs that repel each other."""
        known = np.searchsorted(history.key, pairs.key)
        same = np.append(history.key, -1)[known] == pairs.key
        pair, known = np.flatnonzero(same), known[same]
        rotation, r = state.rotation[pairs.both[pair]], pairs.distance[pair]
        arm = np.einsum("kaij,kaj->kai", rotation, history.arm[known])
        pulls = np.einsum("kaij,kaj->kai", rotation, history.traction[known])
        normal = np.einsum("kaij,kaj->ki", rotation, history.normal[known]) / 2
        shear = rotation @ history.shear[known] @ rotation.swapaxes(2, 3)
        plane = shear.mean(axis=1)
        stiff = plane + normal[:, :, None] * normal[:, None, :]
        slip = arm[:, 0] - arm[:, 1] - pairs.way[pair]
        shape, closest = history.shape[known], history.closest[known]
        force, change = _push(contact, history.share[known] * history.density[known], shape, r)
        past, (now, rate) = history.spring[known], _spring(contact, force, change, closest, shape, r)
        grows = now >= past
        before, stored = pulls.mean(axis=1), history.stored[known]
        # Sections that have turned against S must not raise what is stored.
        kept = np.sqrt(np.minimum(_ratio(stored, _energy(before, stiff, past)), 1.0))
        fades = np.where(grows, 0.0, kept * _ratio(rate, past))
        kept = np.where(grows, kept, kept * _ratio(now, past))
        spring, rate = np.where(grows, 0.5 * (past + now), now), np.where(grows, 0.5, 1.0) * rate
        begin = kept[:, None] * before
        trial = begin + spring[:, None] * np.einsum("kij,kj->ki", plane, slip)
        size, most = np.linalg.norm(trial, axis=1), contact.friction * force
        slides = size > most
        ratio = np.divide(most, size, out=np.ones_like(size), where=slides)
        traction, after = ratio[:, None] * trial, _energy(ratio[:, None] * trial, stiff, now)
        # t . u_slid, with u_slid = S^-1 (trial - t) / k, and the mean of Coulomb's limit in place of the last one
        slid = 2 * ratio * (1 - ratio) * _energy(trial, stiff, spring)
        slid *= 0.5 + 0.5 * _ratio(history.force[known], force)
        lost = _energy(traction, stiff, spring) - _energy(begin, stiff, spring) + stored - after + slid
        behind = float(history.stored.sum() - stored.sum())
        return cls(
            pair, known, pairs.key[pair], arm, pulls, kept, fades, shear, slip, spring, rate, force, change, trial,
            slides, traction, after, lost, behind,
        )  # fmt: skip


def friction_tangent(
    contact: LineContact,
    pairs: PointPairs,
    rubs: PairFriction,
    shift: np.ndarray,  # (k, 3, 3), derivative of the image of j by the unknowns of the lattice
    n: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Return unknowns (m, 15) and blocks (m, 15, 15): nodes i and j, then the lattice."""
    at, m = rubs.pair, len(rubs.pair)
    along = pairs.way[at] / pairs.distance[at, None]
    motion = np.zeros((m, 3, 15))  # of the material points against each other
    motion[:, :, 0:3], motion[:, :, 6:9], motion[:, :, 12:] = np.eye(3), -np.eye(3), -shift[at]
    lever = hat(rubs.arm)
    motion[:, :, 3:6], motion[:, :, 9:12] = -lever[:, 0], lever[:, 1]
    pressed = np.zeros((m, 15))  # of the distance
    pressed[:, 0:3], pressed[:, 6:9] = -along, along
    pressed[:, 12:] = np.einsum("ki,kij->kj", along, shift[at])
    S, k = rubs.shear, rubs.spring[:, None, None]
    change = k * S.mean(axis=1) @ motion
    stretched = np.einsum("kaij,kj->kai", S, rubs.slip)
    grows = rubs.rate[:, None] * stretched.mean(axis=1)
    grows += rubs.fades[:, None] * rubs.pulls.mean(axis=1)
    change += grows[:, :, None] * pressed[:, None]
    turned = -rubs.kept[:, None, None, None] * hat(rubs.pulls)
    turned = 0.5 * (turned + k[:, None] * (S @ hat(rubs.slip)[:, None] - hat(stretched)))
    change[:, :, 3:6] += turned[:, 0]
    change[:, :, 9:12] += turned[:, 1]
    size = np.where(rubs.slides, np.linalg.norm(rubs.trial, axis=1), 1.0)
    way = rubs.trial / size[:, None]
    limited = (rubs.force / size)[:, None, None] * (change - way[:, :, None] * (way[:, None] @ change))
    limited += rubs.change[:, None, None] * way[:, :, None] * pressed[:, None]
    change = np.where(rubs.slides[:, None, None], contact.friction * limited, change)
    blocks = motion.swapaxes(1, 2) @ change
    pull = hat(rubs.traction)
    blocks[:, 3:6, 3:6] += pull @ lever[:, 0]
    blocks[:, 9:12, 9:12] -= pull @ lever[:, 1]
    unknowns = (6 * pairs.both[at][..., None] + np.arange(6)).reshape(m, 12)
    return np.concatenate([unknowns, np.broadcast_to(6 * n + np.arange(3), (m, 3))], axis=1), blocks
