"""Contact between the points of yarns that repeat themselves, as a double integral over both yarns.

Yarns that lie along each other, wrap around each other or touch at several places need no closest points here: every
pair of short pieces of yarn repels with a potential V of the distance r of their centres (Kaldor, James and Marschner
2008),

    U = int int c V(|x(s) - x(t)|) ds dt.

V follows from the force F of two straight yarns that cross at a right angle. A distance d apart they have
|x(s) - x(t)|^2 = d^2 + s^2 + t^2, so that

    U(d) = 2 pi int_d^D V(r) r dr,   F = 2 pi d V(d),   V(r) = F(r) / (2 pi r).

Without c, yarns at an angle would carry F / sin(angle), and yarns that bend towards each other far too much. The
density c of `hertz.Patch` makes of it the force of two curved surfaces. It depends on the tangents of both pieces and
on their curvatures along the way between them, which are differences of neighbouring points; forces and tangent are the
first and second derivatives of U with all of that. Parallel yarns have a force per length that grows with the approach
to the exponent less a half: for F of Hertz's exponent 1.5 it is linear, as that of cylinders nearly is.

Points are the nodes of the beams, with the lengths that they stand for. They resolve F from an approach e on, at which
the yarns touch over four of their spacings. Below it F starts softly: the approach counts as e (2 - x) x^2 with
x = delta / e.
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
from knitstudy.mechanics.hertz import LAYERS, Expansion, Patch
from knitstudy.mechanics.line_friction import LineHistory, PairFriction, friction_tangent

if TYPE_CHECKING:
    from knitstudy.mechanics.beam_model import BeamState

NEAR = 1.1  # distance up to which pairs are remembered, over the reach of pieces
SPACINGS = 4.0  # length of contact from which on the law is exact, over the spacing of points
# Points between which curvatures are taken lie so far to both sides, over the diameter: a patch feels no sharper bend,
# and pointwise ones could fall into a kink.
CHORD = 0.25
MARGIN = 0.1  # further distance within which pairs are searched, over the reach: they serve until points have moved


@dataclass(frozen=True)
class Repulsion:
    """The potential of two short pieces, from the force of two yarns that cross."""

    law: Power  # of that force, over the gap
    diameter: float  # distance at which it begins, D [m]
    onset: float  # e [m]
    patch: Patch = LAYERS

    def shear(self, tangents: np.ndarray, bends: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Return the stiffness (k, 3, 3) against elastic slip over that against approach; see `Patch.shear`."""
        share = self.law.share if self.patch.poisson_ratio is None else 1.0
        return share * self.patch.shear(tangents, bends, normal)

    def _depth(self, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the approach (k,) at distances (k,) [m], with its soft begin, and its two derivatives."""
        e = self.onset
        delta = np.maximum(self.diameter - distance, 1e-9 * e)
        x, soft = delta / e, delta < e
        return (
            np.where(soft, e * (2 - x) * x**2, delta),
            -np.where(soft, (4 - 3 * x) * x, 1.0),
            np.where(soft, (4 - 6 * x) / e, 0.0),
        )

    def crossing(
        self, distance: np.ndarray, shape: np.ndarray | float = 1.0
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return F (k,) [N] of yarns that cross at distances (k,) [m], and its two derivatives.

        In a contact whose shape multiplies the force of half spaces by f, a force spreads over f^2 delta R: what is
        added to their approach counts as much more. F is that law without the factor itself.
        """
        f = shape if self.patch.poisson_ratio is not None else 1.0
        depth, d1, d2 = self._depth(distance)
        x = -(f**2) * depth
        F, slope, bend = (
            part / f**3 for part in (self.law.force(x), self.law.stiffness(x), -self.law.stiffening(x))
        )
        return F, slope * f**2 * d1, bend * f**4 * d1**2 + slope * f**2 * d2

    def closing(self, y: np.ndarray, shape: np.ndarray) -> np.ndarray:
        """Return F'' (k,) [N/m2] after an approach y (k,) [m] since first contact, its mean up to the onset."""
        late = y > self.onset
        early = -self.crossing(np.full_like(y, self.diameter - self.onset), shape)[1] / self.onset
        return np.where(late, self.crossing(self.diameter - np.where(late, y, self.onset), shape)[2], early)

    def of(
        self, distance: np.ndarray, shape: np.ndarray | float = 1.0
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return V (k,) [N/m] at distances (k,) [m] within reach, and its two derivatives; see `crossing`."""
        r, (F, F1, F2) = distance, self.crossing(distance, shape)
        V = F / (2 * np.pi * r)
        V1 = (F1 / (2 * np.pi) - V) / r
        return V, V1, (F2 / (2 * np.pi) - 2 * V1) / r

    def potential(self, r: Expansion, shape: Expansion) -> Expansion:
        """Return the same V as a function of what the distance and the shape are functions of."""
        if self.patch.poisson_ratio is None:
            return r.through(*self.of(r.value))
        x = shape * shape * r.through(*self._depth(r.value))
        law, gap = self.law, -x.value
        F = x.through(law.force(gap), law.stiffness(gap), -law.stiffening(gap))
        return (1 / (2 * np.pi)) * (F * shape.power(-3.0) * r.power(-1.0))


@dataclass(frozen=True, eq=False)
class PointPairs(Chosen):
    """Pairs of points in one configuration: of point i, and of the image of point j."""

    i: np.ndarray  # int (k,)
    j: np.ndarray  # int (k,)
    image: np.ndarray  # int (k, 2), how many periods away
    way: np.ndarray  # (k, 3), from i to the image of j [m]
    key: np.ndarray  # int (k,), ascending

    @property
    def distance(self) -> np.ndarray:
        """Distances (k,) [m]."""
        return np.linalg.norm(self.way, axis=1)

    @property
    def both(self) -> np.ndarray:
        """Points (k, 2)."""
        return np.stack([self.i, self.j], axis=1)


@dataclass(frozen=True, eq=False)
class Axes:
    """Derivatives of the yarns by arc length at their points, as differences of two points beside them."""

    points: np.ndarray  # int (n, 3), before, itself, after
    image: np.ndarray  # int (n, 3), how many periods along the yarn they are away
    first: np.ndarray  # (n, 3), weights of the tangent [1/m]
    second: np.ndarray  # (n, 3), weights of the second derivative [1/m2]; none at the ends of yarns

    @classmethod
    def of(cls, yarn: np.ndarray, spacing: np.ndarray, length: float, closed: bool) -> Axes:
        """Return those of yarns whose points follow each other, over `length` [m] to both sides.

        Closed yarns go on as their own images.
        """
        at = np.arange(len(yarn))
        begin, end = np.searchsorted(yarn, yarn), np.searchsorted(yarn, yarn, side="right") - 1
        count = np.minimum(np.maximum(np.rint(length / spacing), 1).astype(int), (end - begin) // 2)
        points = np.stack([at - count, at, at + count], axis=1)
        image = -1 * (points < begin[:, None]) + 1 * (points > end[:, None])
        points = points - image * (end - begin + 1)[:, None]
        h = (count * spacing)[:, None]
        first, second = np.array([-0.5, 0, 0.5]) / h, np.array([1.0, -2, 1]) / h**2
        if not closed:
            early, late = image[:, 0] < 0, image[:, 2] > 0
            first[early], first[late] = np.array([0, -1, 1]) / h[early], np.array([-1, 1, 0]) / h[late]
            second[early | late] = 0.0
        return cls(points, image, first, second)

    def at(self, position: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (n, 3) for points (n, 3) with the lattice vectors (2, 3) [m]."""
        place = position[self.points] + self.image[..., None] * vectors[0]
        return (np.einsum("np,npi->ni", each, place) for each in (self.first, self.second))


FAR = 1 << 6  # images are at most half as many periods away


class LineContact:
    """Contact of all points of yarns with each other and with their images."""

    def __init__(
        self,
        yarn: np.ndarray,  # int (n,), of every point; those of a yarn follow each other
        arc_length: np.ndarray,  # (n,) [m]
        weight: np.ndarray,  # (n,), length that it stands for [m]
        period: np.ndarray,  # (Y,), lengths of one period of the yarns, along the first lattice vector [m]
        repulsion: Repulsion,
        friction: float = 0.0,  # mu
        beside: float = np.inf,  # lengths along a yarn within which it does not touch itself [m]
        closed: bool = True,  # whether yarns go on as their own images
    ) -> None:
        self.yarn, self.arc_length, self.weight, self.period = yarn, arc_length, weight, period
        self.repulsion, self.friction, self.beside = repulsion, friction, beside
        self.axes = Axes.of(yarn, weight, CHORD * repulsion.diameter, closed)
        self._near: list = []  # points, lattice and reach of the last search, and what it found

    def thinner(self, by: float) -> LineContact:
        """Return the contact of yarns whose diameter is smaller by a length [m]."""
        found = copy(self)
        found.repulsion = replace(self.repulsion, diameter=self.repulsion.diameter - by)
        return found

    def touching(self, position: np.ndarray, vectors: np.ndarray, reach: float) -> PointPairs:
        """Return the pairs nearer than a reach [m] of points (n, 3) with the lattice vectors (2, 3) [m]."""
        if not (self._near and self._serves(position, vectors, reach)):
            far = (1 + MARGIN) * reach
            self._near[:] = position, vectors, far, self._search(position, vectors, far)
        near = self._near[3]
        way = position[near.j] + near.image @ vectors - position[near.i]
        return replace(near, way=way)[np.einsum("ki,ki->k", way, way) < reach**2]

    def _serves(self, position: np.ndarray, vectors: np.ndarray, reach: float) -> bool:
        """Return whether the pairs of the last search have all those within a reach now."""
        before, lattice, far, near = self._near
        move = position - before
        moved = 2 * np.linalg.norm(move - move.mean(axis=0), axis=1).max()
        images = np.abs(near.image).max(axis=0, initial=1) + 1
        return moved + images @ np.linalg.norm(vectors - lattice, axis=1) < far - reach

    def _search(self, position: np.ndarray, vectors: np.ndarray, reach: float) -> PointPairs:
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
        return PointPairs(i, j, image[which], moved[other[order]] - position[i], key[order])

    def pairs(self, state: BeamState, vectors: np.ndarray) -> PointPairs:
        """Return the pairs that repel each other in a state."""
        return self.touching(state.position, vectors, self.repulsion.diameter)

    def bends(
        self, pairs: PointPairs, state: BeamState, vectors: np.ndarray, second: bool
    ) -> tuple[np.ndarray, list[Expansion]]:
        """Return z (k, 5, 3) and what U depends on: k_a R, k_b R, the cosine of the angle and r, as functions of z.

        z are the way, the second derivatives of both yarns and their tangents.
        """
        first, bend = self.axes.at(state.position, vectors)
        z = np.stack([pairs.way, bend[pairs.i], bend[pairs.j], first[pairs.i], first[pairs.j]], axis=1)
        W, K_A, K_B, T_A, T_B = range(5)

        def product(one: int, other: int) -> Expansion:
            slope = np.zeros(z.shape)
            slope[:, one] += z[:, other]
            slope[:, other] += z[:, one]
            both = np.zeros((5, 5))
            both[one, other] += 1
            both[other, one] += 1
            bend = np.broadcast_to(np.kron(both, np.eye(3)), (len(z), 15, 15)) if second else None
            return Expansion(np.einsum("ki,ki->k", z[:, one], z[:, other]), slope.reshape(-1, 15), bend)

        r, stretch_a, stretch_b = (product(each, each).power(0.5) for each in (W, T_A, T_B))
        R, per_r = 0.5 * self.repulsion.diameter, r.power(-1.0)
        k_a, k_b = R * (product(K_A, W) * per_r), -R * (product(K_B, W) * per_r)
        return z, [k_a, k_b, product(T_A, T_B) * stretch_a.power(-1.0) * stretch_b.power(-1.0), r]

    def energy(self, pairs: PointPairs, bends: list[Expansion]) -> tuple[Expansion, np.ndarray, np.ndarray]:
        """Return the energies (k,) [J] of pairs as functions of z, c times both lengths (k,) [m2], and shapes (k,)."""
        values = np.stack([each.value for each in bends], axis=1)
        k_a, k_b, cos, r = Expansion.variables(values, second=bends[0].bend is not None)
        weight = self.weight[pairs.i] * self.weight[pairs.j]
        density, shape = self.repulsion.patch.density(k_a, k_b, cos)
        density = density.times(weight)
        return (density * self.repulsion.potential(r, shape)).of(bends), density.value, shape.value

    def respond(
        self, state: BeamState, vectors: np.ndarray, moves: np.ndarray, history: LineHistory, stiffness: bool
    ) -> tuple[np.ndarray, dict[str, float], sp.csr_matrix | None]:
        """Return internal forces (6 n + 3,), energies and, if asked, the tangent.

        The lattice has the vectors (2, 3); `moves` (2, 3, 3) is their derivative by its three unknowns.
        """
        pairs, n = self.pairs(state, vectors), len(state.position)
        U = self.energy(pairs, self.bends(pairs, state, vectors, stiffness)[1])[0]
        slope = U.slope.reshape(-1, 5, 3)  # internal forces on z
        rubs = PairFriction.of(self, state, pairs, history)
        on_j = slope[:, 0].copy()
        on_j[rubs.pair] -= rubs.traction
        total = np.zeros((n, 6))
        nodes = pairs.both
        sign = np.array([-1.0, 1.0])[:, None]
        np.add.at(total[:, :3], nodes, sign * on_j[:, None])
        np.add.at(total[:, 3:], nodes[rubs.pair], -sign * np.cross(rubs.arm, rubs.traction[:, None]))
        shift = np.einsum("ka,aij->kij", pairs.image, moves)  # of the image, by the lattice
        on_lattice = np.einsum("kij,ki->j", shift, on_j)
        axes, on_axes = self.axes, np.zeros((2, n, 3))
        np.add.at(on_axes[1], nodes, slope[:, 1:3])
        np.add.at(on_axes[0], nodes, slope[:, 3:])
        at_points = axes.first[..., None] * on_axes[0, :, None] + axes.second[..., None] * on_axes[1, :, None]
        np.add.at(total[:, :3], axes.points, at_points)
        on_lattice += np.einsum("np,npi->i", axes.image, at_points) @ moves[0]
        stored = float(rubs.stored.sum())
        energy = {"penalty": float(U.value.sum()) + stored}
        energy["friction"] = history.dissipated + float(rubs.dissipated.sum()) + rubs.left_behind
        total = np.append(total.ravel(), on_lattice)
        if not stiffness:
            return total, energy, None
        parts = [self._tangent(pairs, U.bend, shift, moves, n)]
        if len(rubs.pair) and self.friction > 0:
            parts.append(friction_tangent(self, pairs, rubs, shift, n))
        data = np.concatenate([blocks.ravel() for _, blocks in parts])
        row = np.concatenate([np.repeat(at, at.shape[1], axis=1).ravel() for at, _ in parts])
        column = np.concatenate([np.tile(at, at.shape[1]).ravel() for at, _ in parts])
        return total, energy, sp.csr_matrix((data, (row, column)), shape=(6 * n + 3, 6 * n + 3))

    def _tangent(
        self, pairs: PointPairs, bend: np.ndarray, shift: np.ndarray, moves: np.ndarray, n: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return unknowns (k, 21) and blocks (k, 21, 21): three points around i, three around j, the lattice."""
        axes, k = self.axes, len(pairs.i)
        of_points, of_lattice = np.zeros((k, 5, 6)), np.zeros((k, 5, 3, 3))  # derivatives of z
        of_points[:, 0, 1], of_points[:, 0, 4], of_lattice[:, 0] = -1.0, 1.0, shift
        for side, at in enumerate((pairs.i, pairs.j)):
            mine = slice(3 * side, 3 * side + 3)
            for row, weights in ((1 + side, axes.second[at]), (3 + side, axes.first[at])):
                of_points[:, row, mine] = weights
                of_lattice[:, row] = (weights * axes.image[at]).sum(axis=1)[:, None, None] * moves[0]
        motion = np.einsum("kpa,ij->kpiaj", of_points, np.eye(3)).reshape(k, 15, 18)
        motion = np.concatenate([motion, of_lattice.reshape(k, 15, 3)], axis=2)
        points = axes.points[pairs.both].reshape(k, 6)
        unknowns = (6 * points[..., None] + np.arange(3)).reshape(k, 18)
        unknowns = np.concatenate([unknowns, np.broadcast_to(6 * n + np.arange(3), (k, 3))], axis=1)
        return unknowns, motion.swapaxes(1, 2) @ bend @ motion

    def commit(self, state: BeamState, vectors: np.ndarray, history: LineHistory) -> LineHistory:
        """Return the history that a converged increment leaves."""
        if self.friction == 0:
            return history
        rubs = PairFriction.of(self, state, self.pairs(state, vectors), history)
        pairs = self.touching(state.position, vectors, NEAR * self.repulsion.diameter)
        return LineHistory.after(self, state, pairs, self.bends(pairs, state, vectors, False), rubs, history)
