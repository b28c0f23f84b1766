"""Contact with friction between the points of yarns that repeat themselves, as a double integral over both yarns.

Yarns that lie along each other, wrap around each other or touch at several places need no closest points here: every
pair of short pieces of yarn repels with a potential V of the distance r of their centres (Kaldor, James and Marschner
2008),

    U = int int V(|x(s) - x(t)|) ds dt.

V follows from what is measured, the force F of two yarns that cross at a right angle. Straight ones a distance d apart
have |x(s) - x(t)|^2 = d^2 + s^2 + t^2, so that

    U(d) = 2 pi int_d^D V(r) r dr,   F = 2 pi d V(d),   V(r) = F(r) / (2 pi r).

Yarns at an angle carry F / sin(angle), and parallel ones a force per length that grows with the approach to the
exponent less a half: for F of Hertz's exponent 1.5 it is linear, as that of cylinders nearly is.

Points are the nodes of the beams, with the lengths that they stand for. They resolve F from an approach e on, at which
the yarns touch over four of their spacings. Below it F starts softly: the approach is replaced by (delta + e/2)^2 / 2e
where it lies between -e/2 and e/2.

Two pieces rub at the middle between them. Their friction t follows the slip u of two points of their sections that met
there, up to mu times the part f of their force along the common normal of both yarns: dt = k du. Two yarns that cross
are `share` times as stiff along each other as they are against approach (Mindlin 1949), and all their pieces begin to
slide at one slip:

    k = share f K(d) / F(d),   K = -F',   sum k = share K,   slip at which they slide: mu F / (share K).

K grows as yarns are pressed and what was sheared before stays (Mindlin and Deresiewicz 1953), so that increments take
the mean of k at both ends; a loss of f takes its share of t along. Pairs that do not touch yet are remembered as well:
they rub in the very increment in which they meet.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from knitstudy.mechanics.batches import Chosen
from knitstudy.mechanics.beam_contact import Power
from knitstudy.mechanics.rotation import hat

if TYPE_CHECKING:
    from knitstudy.mechanics.beam_model import BeamState

NEAR = 1.1  # distance up to which pairs are remembered, over the reach of pieces
SPACINGS = 4.0  # length of contact from which on the law is exact, over the spacing of points
# Nearly parallel yarns have no common normal: sin^2 of their angle below which the way between them counts
PARALLEL = 0.02


@dataclass(frozen=True)
class Repulsion:
    """The potential of two short pieces, from the force of two yarns that cross."""

    law: Power  # of that force, over the gap
    diameter: float  # distance at which it begins, D [m]
    onset: float  # e [m]

    @property
    def reach(self) -> float:
        """Largest distance at which pieces repel [m]."""
        return self.diameter + 0.5 * self.onset

    def crossing(self, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return F (k,) [N] of yarns that cross at distances (k,) [m], and its two derivatives."""
        e, p = self.onset, self.law.exponent
        x = np.maximum(self.reach - distance, 1e-12 * e)
        soft = x < e
        depth = np.where(soft, x**2 / (2 * e), x - 0.5 * e)
        d1, d2 = np.where(soft, x / e, 1.0), np.where(soft, 1 / e, 0.0)
        c = self.law.coefficient
        slope, bend = c * p * depth ** (p - 1), c * p * (p - 1) * depth ** (p - 2)
        return c * depth**p, -slope * d1, bend * d1**2 + slope * d2

    def of(self, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return V (k,) [N/m] at distances (k,) [m] within reach, and its two derivatives."""
        r, (F, F1, F2) = distance, self.crossing(distance)
        V = F / (2 * np.pi * r)
        V1 = (F1 / (2 * np.pi) - V) / r
        return V, V1, (F2 / (2 * np.pi) - 2 * V1) / r


@dataclass(frozen=True, eq=False)
class LineHistory:
    """What pairs that were near each other in the last converged increment remember."""

    key: np.ndarray  # int (m,), ascending; which pairs
    arm: np.ndarray  # (m, 2, 3), from the centres to the points that met, in the sections' axes [m]
    normal: np.ndarray  # (m, 3), common normal
    share: np.ndarray  # (m,), part of the pairs' force along it
    force: np.ndarray  # (m,), that part [N]
    spring: np.ndarray  # (m,), stiffness against elastic slip [N/m]
    traction: np.ndarray  # (m, 2, 3), friction on j in the axes of both sections [N]
    dissipated: float = 0.0  # work of friction so far [J]

    @classmethod
    def none(cls) -> LineHistory:
        """Return that of yarns that have not touched."""
        one, both = np.zeros(0), np.zeros((0, 2, 3))
        return cls(np.zeros(0, dtype=np.int64), both, np.zeros((0, 3)), one, one, one, both)

    @property
    def stored(self) -> float:
        """Energy of elastic slip [J]."""
        return _stored(self.traction[:, 0], self.spring)


@dataclass(frozen=True, eq=False)
class Touching(Chosen):
    """Pairs within reach in one configuration: of point i, and of the image of point j."""

    i: np.ndarray  # int (k,)
    j: np.ndarray  # int (k,)
    image: np.ndarray  # int (k, 2), how many periods away
    way: np.ndarray  # (k, 3), from i to the image of j [m]
    key: np.ndarray  # int (k,), ascending

    @property
    def distance(self) -> np.ndarray:
        """Distances (k,) [m]."""
        return np.linalg.norm(self.way, axis=1)


@dataclass(frozen=True, eq=False)
class Rubbing:
    """Friction of pairs that were near each other before, in one configuration."""

    pair: np.ndarray  # int (m,), which of the pairs within reach
    known: np.ndarray  # int (m,), which of those that the history has
    arm: np.ndarray  # (m, 2, 3), from the centres to the points that met [m]
    pulls: np.ndarray  # (m, 2, 3), friction of the history, turned with both sections [N]
    before: np.ndarray  # (m, 3), their mean in the tangent plane [N]
    kept: np.ndarray  # (m,), part of it that is left
    slip: np.ndarray  # (m, 3), of i against j within the increment, in the tangent plane [m]
    spring: np.ndarray  # (m,), stiffness against elastic slip [N/m]
    mean: np.ndarray  # (m,), its mean over the increment [N/m]
    rate: np.ndarray  # (m,), derivative of the mean by the distance [N/m2]
    force: np.ndarray  # (m,), normal force [N]
    trial: np.ndarray  # (m, 3), traction on j before Coulomb's limit [N]
    slides: np.ndarray  # bool (m,)
    traction: np.ndarray  # (m, 3), on j [N]

    @property
    def work(self) -> float:
        """Work of friction within the increment, stored or lost [J]."""
        return 0.5 * float(np.einsum("ki,ki->", self.before + self.traction, self.slip))

    @property
    def stored(self) -> float:
        """Energy of elastic slip [J]."""
        return _stored(self.traction, self.spring)


def _stored(traction: np.ndarray, spring: np.ndarray) -> float:
    square = np.einsum("ki,ki->k", traction, traction)
    return 0.5 * float(np.divide(square, spring, out=np.zeros_like(square), where=spring > 0).sum())


FAR = 1 << 6  # images are at most half as many periods away


class LineContact:
    """Contact of all points of yarns with each other and with their images."""

    def __init__(
        self,
        yarn: np.ndarray,  # int (n,), of every point
        arc_length: np.ndarray,  # (n,) [m]
        weight: np.ndarray,  # (n,), length that it stands for [m]
        period: np.ndarray,  # (Y,), lengths of one period of the yarns, along the first lattice vector [m]
        repulsion: Repulsion,
        friction: float = 0.0,  # mu
        beside: float = np.inf,  # lengths along a yarn within which it does not touch itself [m]
    ) -> None:
        self.yarn, self.arc_length, self.weight, self.period = yarn, arc_length, weight, period
        self.repulsion, self.friction, self.beside = repulsion, friction, beside

    def thinner(self, by: float) -> LineContact:
        """Return the contact of yarns whose diameter is smaller by a length [m]."""
        found = copy(self)
        found.repulsion = replace(self.repulsion, diameter=self.repulsion.diameter - by)
        return found

    def touching(self, position: np.ndarray, vectors: np.ndarray, reach: float) -> Touching:
        """Return the pairs nearer than a reach [m] of points (n, 3) with the lattice vectors (2, 3) [m]."""
        n, extent = len(position), np.ptp(position[:, :2], axis=0) + reach
        # (x, y) = vectors^T (a, b): bounds of a and b for all ways that points may be apart
        most = np.ceil(np.abs(np.linalg.inv(vectors[:, :2].T)) @ extent).astype(int).clip(max=FAR // 2 - 1)
        a, b = np.meshgrid(np.arange(-most[0], most[0] + 1), np.arange(most[1] + 1), indexing="ij")
        image = np.stack([a.ravel(), b.ravel()], axis=1)
        # The others are these seen from the other point.
        image = image[(image[:, 1] > 0) | (image[:, 0] >= 0)]
        moved = (position + (image @ vectors)[:, None]).reshape(-1, 3)
        found = cKDTree(position).sparse_distance_matrix(cKDTree(moved), reach, output_type="coo_matrix")
        i, other = found.row.astype(np.int64), found.col.astype(np.int64)
        which, j = other // n, other % n
        a, b = image[which].T
        apart = np.abs(self.arc_length[j] + a * self.period[self.yarn[j]] - self.arc_length[i])
        chosen = ((a != 0) | (b != 0) | (i < j)) & (
            (self.yarn[i] != self.yarn[j]) | (b != 0) | (apart > self.beside)
        )
        key = ((i * n + j) * FAR + a + FAR // 2) * FAR + b
        order = np.flatnonzero(chosen)[np.argsort(key[chosen])]
        i, j, which = i[order], j[order], which[order]
        return Touching(i, j, image[which], moved[other[order]] - position[i], key[order])

    def pairs(self, state: BeamState, vectors: np.ndarray) -> Touching:
        """Return the pairs that repel each other in a state."""
        return self.touching(state.position, vectors, self.repulsion.reach)

    def springs(
        self, pairs: Touching, share: np.ndarray, push: np.ndarray, change: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffnesses (k,) [N/m] of pairs against elastic slip, and their derivatives by the distance.

        Two yarns, `share` r apart, are `law.share` times as stiff along each other as they are against approach.
        """
        force, change = share * push, share * change
        F, F1, F2 = self.repulsion.crossing(share * pairs.distance)
        touch = force > 0
        F = np.where(touch, F, 1.0)
        steep, ratio = -F1 / F, self.repulsion.law.share * touch
        bend = share * (steep**2 - F2 / F)
        return ratio * force * steep, ratio * (change * steep + force * bend)

    def rubbing(
        self, state: BeamState, pairs: Touching, push: np.ndarray, change: np.ndarray, history: LineHistory
    ) -> Rubbing:
        """Return the friction of pairs that repel each other by `push` (k,) [N]; `change` is its derivative by r."""
        known = np.searchsorted(history.key, pairs.key)
        same = np.append(history.key, -1)[known] == pairs.key
        pair, known = np.flatnonzero(same), known[same]
        both = np.stack([pairs.i, pairs.j], axis=1)[pair]
        arm = np.einsum("kaij,kaj->kai", state.rotation[both], history.arm[known])
        pulls = np.einsum("kaij,kaj->kai", state.rotation[both], history.traction[known])
        normal = history.normal[known]

        def in_plane(v: np.ndarray) -> np.ndarray:
            return v - normal * np.einsum("ki,ki->k", normal, v)[:, None]

        slip, before = in_plane(arm[:, 0] - arm[:, 1] - pairs.way[pair]), in_plane(pulls.mean(axis=1))
        share = history.share[known]
        force, past = share * push[pair], history.force[known]
        kept = np.divide(force, past, out=np.ones_like(force), where=past > force)
        spring, rate = self.springs(pairs[pair], share, push[pair], change[pair])
        mean = 0.5 * (history.spring[known] + spring)
        trial = kept[:, None] * before + mean[:, None] * slip
        size, most = np.linalg.norm(trial, axis=1), self.friction * force
        slides = size > most
        ratio = np.divide(most, size, out=np.ones_like(size), where=slides)
        rate, traction = 0.5 * rate, ratio[:, None] * trial
        return Rubbing(
            pair, known, arm, pulls, before, kept, slip, spring, mean, rate, force, trial, slides, traction
        )

    def respond(
        self, state: BeamState, vectors: np.ndarray, moves: np.ndarray, history: LineHistory, stiffness: bool
    ) -> tuple[np.ndarray, dict[str, float], sp.csr_matrix | None]:
        """Return internal forces (6 n + 3,), energies and, if asked, the tangent.

        The lattice has the vectors (2, 3); `moves` (2, 3, 3) is their derivative by its three unknowns.
        """
        pairs, n = self.pairs(state, vectors), len(state.position)
        weight = self.weight[pairs.i] * self.weight[pairs.j]
        r = pairs.distance
        V, V1, V2 = (weight * each for each in self.repulsion.of(r))
        along = pairs.way / r[:, None]
        on_j = V1[:, None] * along  # internal: the derivative of the energy
        energy = {"penalty": float(V.sum()), "friction": history.dissipated}
        rubs = self.rubbing(state, pairs, -V1, -V2, history)
        forces = np.zeros((len(r), 2, 6))
        on_j[rubs.pair] -= rubs.traction
        forces[:, 0, :3], forces[:, 1, :3] = -on_j, on_j
        sign = np.array([1.0, -1.0])[:, None]
        forces[rubs.pair, :, 3:] = sign * np.cross(rubs.arm, rubs.traction[:, None])
        energy["friction"] += rubs.work + history.stored - rubs.stored
        energy["penalty"] += rubs.stored
        total = np.zeros(6 * n + 3)
        nodes = np.stack([pairs.i, pairs.j], axis=1)
        for c in range(6):
            total[c : 6 * n : 6] = np.bincount(nodes.ravel(), forces[..., c].ravel(), n)
        shift = np.einsum("ka,aij->kij", pairs.image, moves)  # of the image, by the lattice
        total[6 * n :] = np.einsum("kij,ki->j", shift, on_j)
        if not stiffness:
            return total, energy, None
        one = np.eye(3)
        block = (V1 / r)[:, None, None] * one
        block = block + (V2 - V1 / r)[:, None, None] * along[:, :, None] * along[:, None, :]
        motion = np.concatenate([np.tile(-one, (len(r), 1, 1)), np.tile(one, (len(r), 1, 1)), shift], axis=2)
        unknowns = [6 * pairs.i[:, None] + np.arange(3), 6 * pairs.j[:, None] + np.arange(3)]
        unknowns.append(np.broadcast_to(6 * n + np.arange(3), (len(r), 3)))
        parts = [(np.concatenate(unknowns, axis=1), motion.swapaxes(1, 2) @ block @ motion)]
        if len(rubs.pair) and self.friction > 0:
            parts.append(self._friction_tangent(pairs, rubs, history, along, V2, shift, n))
        data = np.concatenate([blocks.ravel() for _, blocks in parts])
        row = np.concatenate([np.repeat(at, at.shape[1], axis=1).ravel() for at, _ in parts])
        column = np.concatenate([np.tile(at, at.shape[1]).ravel() for at, _ in parts])
        return total, energy, sp.csr_matrix((data, (row, column)), shape=(6 * n + 3, 6 * n + 3))

    def _friction_tangent(
        self,
        pairs: Touching,
        rubs: Rubbing,
        history: LineHistory,
        along: np.ndarray,
        V2: np.ndarray,
        shift: np.ndarray,
        n: int,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return unknowns (m, 15) and blocks (m, 15, 15): nodes i and j, then the lattice."""
        at, m = rubs.pair, len(rubs.pair)
        motion = np.zeros((m, 3, 15))  # of the material points against each other
        motion[:, :, 0:3], motion[:, :, 6:9], motion[:, :, 12:] = np.eye(3), -np.eye(3), -shift[at]
        lever = hat(rubs.arm)
        motion[:, :, 3:6], motion[:, :, 9:12] = -lever[:, 0], lever[:, 1]
        pressed = np.zeros((m, 15))  # of the distance
        pressed[:, 0:3], pressed[:, 6:9] = -along[at], along[at]
        pressed[:, 12:] = np.einsum("ki,kij->kj", along[at], shift[at])
        normal = history.normal[rubs.known]
        flat = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        share = history.share[rubs.known]
        past, less = history.force[rubs.known], rubs.kept < 1
        fades = -np.divide(share * V2[at], past, out=np.zeros_like(past), where=less)
        change = rubs.mean[:, None, None] * flat @ motion
        grows = rubs.rate[:, None] * rubs.slip + fades[:, None] * rubs.before
        change += grows[:, :, None] * pressed[:, None]
        turned = -0.5 * rubs.kept[:, None, None, None] * flat[:, None] @ hat(rubs.pulls)
        change[:, :, 3:6] += turned[:, 0]
        change[:, :, 9:12] += turned[:, 1]
        size = np.where(rubs.slides, np.linalg.norm(rubs.trial, axis=1), 1.0)
        way = rubs.trial / size[:, None]
        limited = (rubs.force / size)[:, None, None] * (change - way[:, :, None] * (way[:, None] @ change))
        limited -= (share * V2[at])[:, None, None] * way[:, :, None] * pressed[:, None]
        change = np.where(rubs.slides[:, None, None], self.friction * limited, change)
        blocks = motion.swapaxes(1, 2) @ change
        pull = hat(rubs.traction)
        blocks[:, 3:6, 3:6] += pull @ lever[:, 0]
        blocks[:, 9:12, 9:12] -= pull @ lever[:, 1]
        unknowns = [6 * pairs.i[at, None] + np.arange(6), 6 * pairs.j[at, None] + np.arange(6)]
        unknowns.append(np.broadcast_to(6 * n + np.arange(3), (m, 3)))
        return np.concatenate(unknowns, axis=1), blocks

    def commit(
        self, state: BeamState, tangent: np.ndarray, vectors: np.ndarray, history: LineHistory
    ) -> LineHistory:
        """Return the history that a converged increment leaves, with tangents (n, 3) of the yarns at the points."""
        if self.friction == 0:
            return history
        pairs = self.touching(state.position, vectors, NEAR * self.repulsion.reach)
        r, weight = pairs.distance, self.weight[pairs.i] * self.weight[pairs.j]
        within = r < self.repulsion.reach
        push, change = (np.where(within, -weight * each, 0.0) for each in self.repulsion.of(r)[1:])
        rubs = self.rubbing(state, pairs, push, change, history)
        normal = _common_normal(pairs.way / r[:, None], tangent[pairs.i], tangent[pairs.j])
        share = np.einsum("ki,ki->k", normal, pairs.way) / r
        turned = state.rotation[np.stack([pairs.i, pairs.j], axis=1)]
        half = 0.5 * np.stack([pairs.way, -pairs.way], axis=1)
        arm = np.einsum("kaji,kaj->kai", turned, half)
        traction = np.zeros((len(r), 3))
        traction[rubs.pair] = rubs.traction
        spring, force = self.springs(pairs, share, push, change)[0], share * push
        # The new normal may leave less to friction.
        most, size = self.friction * force, np.linalg.norm(traction, axis=1)
        traction *= np.divide(most, size, out=np.ones_like(size), where=size > most)[:, None]
        found = LineHistory(
            pairs.key, arm, normal, share, force, spring, np.einsum("kaji,kj->kai", turned, traction)
        )
        dissipated = history.dissipated + rubs.work + history.stored - found.stored
        return replace(found, dissipated=dissipated)


def _common_normal(way: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return unit vectors (k, 3): ways less their parts along both tangents, which may be nearly parallel."""
    T = np.stack([one, other], axis=2)  # (k, 3, 2)
    inner = T.swapaxes(1, 2) @ T + PARALLEL * np.eye(2)
    part = np.linalg.solve(inner, np.einsum("kia,ki->ka", T, way)[..., None])
    left = way - (T @ part)[..., 0]
    size = np.linalg.norm(left, axis=1, keepdims=True)
    return np.where(size > 0.1, left / np.maximum(size, 0.1), way)
