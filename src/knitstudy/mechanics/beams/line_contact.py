"""Contact between the points of yarns, as a double integral over both yarns.

Yarns that lie along each other, wrap around each other or touch at several places need no closest points here: every
pair of short pieces of yarn repels with a potential V of the distance r of their centres (Kaldor, James and Marschner
2008),

    U = int int c V(|x(s) - x(t)|) ds dt.

V follows from the force F of two straight yarns that cross at a right angle. A distance d apart they have
|x(s) - x(t)|^2 = d^2 + s^2 + t^2, so that

    U(d) = 2 pi int_d^D V(r) r dr,   F = 2 pi d V(d),   V(r) = F(r) / (2 pi r).

Without c, yarns at an angle would carry F / sin(angle), and yarns that bend towards each other far too much. The
density c of `laws.Patch` makes of it the force of two curved surfaces. It depends on the tangents of both pieces and
on their curvatures along the way between them, which are differences of neighbouring points; forces and tangent are the
first and second derivatives of U with all of that. Parallel yarns have a force per length that grows with the approach
to the exponent less a half: for F of Hertz's exponent 1.5 it is linear, as that of cylinders nearly is.

Points (`contact_points`) have the lengths that they stand for: at most a tenth of R for forces within 2 %, where points
0.2 R apart err by -6.5 to +9.9 %. They resolve F from an approach e on, at which
the yarns touch over `SPACINGS` of their spacings. Below it F starts softly: the approach counts as e (2 - x) x^2 with
x = delta / e.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.beams.beam import BeamState, CommittedPoints, LineHistory
from knitstudy.mechanics.beams.contact_points import Axes, Spread
from knitstudy.mechanics.beams.expansion import Expansion
from knitstudy.mechanics.beams.laws import Repulsion
from knitstudy.mechanics.beams.line_friction import (
    ActivePairs,
    PairFriction,
    at_a_time,
    closest_points,
    committed_history,
    friction_tangent,
    unslipped_history,
)
from knitstudy.mechanics.beams.pair_search import PairSearch, PointPairs
from knitstudy.mechanics.core.batches import by_parts, parts, share

NEAR = 1.1  # distance up to which pairs are near each other, and have a history, over the diameter
SPACINGS = 2.5  # length of contact from which on the law is exact in the mean, over the spacing of points
# Points between which curvatures are taken lie so far to both sides, over the diameter: a patch feels no sharper bend,
# and pointwise ones could fall into a kink.
CHORD = 0.25
# Friction of rough yarns: points that part lose their traction while their force fades, not all at once.
ROUGH = 100.0
MARGIN = 0.1  # further distance within which pairs are searched, over that of near ones: they serve until points move
# Status of a `Response` with contact, which begins softly; a force may still jump within a step.
SOFT = np.zeros(1, dtype=np.int64)


# z of a pair, and the scalar products that all depends on, with their second derivatives
W, K_A, K_B, T_A, T_B = range(5)
ONE, OTHER = np.array([(W, W), (K_A, W), (K_B, W), (T_A, T_A), (T_B, T_B), (T_A, T_B)]).T
TWICE = np.zeros((len(ONE), 5, 5))  # 2 z_one . z_other = sum TWICE_ab z_a . z_b
np.add.at(TWICE, (np.arange(len(ONE)), ONE, OTHER), 1.0)
TWICE += TWICE.swapaxes(1, 2)
SECOND = np.kron(TWICE, np.eye(3))  # (6, 15, 15), second derivatives of the products by z


@dataclass(frozen=True, eq=False)
class Loads:
    """Forces between pairs of points that touch."""

    pairs: PointPairs
    z: np.ndarray  # (k, 5, 3)
    energy: Expansion  # (k,) by the products of z [J]
    slope: np.ndarray  # (k, 5, 3), internal forces on z
    friction: PairFriction
    on_j: np.ndarray  # (k, 3), internal forces on the yarns of j, friction included [N]


def in_blocks(at: np.ndarray, blocks: np.ndarray, size: int) -> sp.bsr_matrix:
    """Return a matrix of `size` rows of blocks with blocks (k, a, a, 3, 3) at rows and columns (k, a); some may repeat.

    Examples
    --------
    >>> in_blocks(np.array([[1]]), np.eye(3)[None, None, None], size=2).diagonal().tolist()
    [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    """
    row = at.ravel()
    a = at.shape[1]
    order = np.argsort(row, kind="stable")
    ends = a * np.cumsum(np.bincount(row, minlength=size))
    data = blocks.reshape(-1, a, 3, 3)[order].reshape(-1, 3, 3)
    return sp.bsr_matrix((data, at[order // a].ravel(), np.append(0, ends)), (3 * size, 3 * size))


class LineContact:
    """Contact of all points of yarns with each other, and with their images where yarns repeat themselves."""

    def __init__(
        self,
        yarn: np.ndarray,  # int (n,), of every point; points of a yarn follow each other
        arc_length: np.ndarray,  # (n,) [m]
        weight: np.ndarray,  # (n,), length that it stands for [m]
        repulsion: Repulsion,
        friction: float = 0.0,  # mu; at most `ROUGH`
        # length along a yarn within which it does not touch itself [m]; by default half a turn around its section
        beside: float | None = None,
        # (Y,), lengths of one period of the yarns, along the first lattice vector; None where nothing repeats [m]
        period: np.ndarray | None = None,
        # int (n,), number of the tie that carries the pressure of a point, or -1; None: no tie does
        joined: np.ndarray | None = None,
    ) -> None:
        self.yarn, self.arc_length, self.weight = yarn, arc_length, weight
        self.repulsion = repulsion
        self.mu = min(friction, ROUGH)
        self.axes = Axes.of(yarn, arc_length, weight, CHORD * repulsion.own_diameter, period)
        self.images = 0 if period is None else 2  # lattice vectors by which points have images
        around = 0.5 * np.pi * repulsion.own_diameter if beside is None else beside
        self.search = PairSearch(yarn, arc_length, around, period, joined)

    def of_diameter(self, diameter: float) -> LineContact:
        """Return the contact of yarns of another diameter [m]."""
        contact = copy(self)
        contact.repulsion = replace(self.repulsion, diameter=diameter)
        return contact

    def pairs(self, position: np.ndarray, vectors: np.ndarray, near: bool = False) -> PointPairs:
        """Return the pairs that touch, or those `near` each other, of points (n, 3) and lattice vectors (2, 3) [m]."""
        share = NEAR if near else 1.0
        D = self.repulsion.diameter
        found = self.search.within(share * D, (1 + MARGIN) * NEAR * D, position, vectors)
        own = self.repulsion.between(found)
        return found if own is self.repulsion else found[found.distance < share * own.diameter]

    def pair_geometry(
        self, pairs: PointPairs, position: np.ndarray, vectors: np.ndarray, second: bool = False
    ) -> tuple[np.ndarray, list[Expansion]]:
        """Return z (k, 5, 3) and the variables of U: k_a R, k_b R, the cosine of the angle and r, by products of z.

        z are the way, the second derivatives of both yarns and their tangents, of all points (n, 3) [m].
        """
        (first_i, bend_i), (first_j, bend_j) = (
            self.axes.at(which, position, vectors) for which in (pairs.i, pairs.j)
        )
        z = np.stack([pairs.way, bend_i, bend_j, first_i, first_j], axis=1)
        values = (z @ z.swapaxes(1, 2))[:, ONE, OTHER]
        squared, of_a, of_b, square_a, square_b, both = range(len(ONE))
        k_a, k_b = (Expansion.over_roots(values, product, [squared], second) for product in (of_a, of_b))
        cos = Expansion.over_roots(values, both, [square_a, square_b], second)
        R = 0.5 * self.repulsion.between(pairs).diameter
        r = Expansion.variables(values, second)[squared].power(0.5)
        return z, [k_a * R, k_b * -R, cos, r]

    def energy_factors(
        self, pairs: PointPairs, geometry: list[Expansion]
    ) -> tuple[Expansion, Expansion, Expansion]:
        """Return r [m], c times both lengths [m2], and the factor by the shape, as functions of `geometry`."""
        values = np.stack([each.value for each in geometry], axis=1)
        k_a, k_b, cos, r = Expansion.variables(values, second=geometry[0].bend is not None)
        own = self.repulsion.between(pairs)
        density, shape = own.patch.density(k_a, k_b, cos, r * (1 / own.diameter), *own.ratios)
        return r, density.times(self.weight[pairs.i] * self.weight[pairs.j]), shape

    def energy(
        self, pairs: PointPairs, position: np.ndarray, vectors: np.ndarray, second: bool = False
    ) -> tuple[np.ndarray, Expansion]:
        """Return z (k, 5, 3) of pairs, and their energies (k,) [J] as functions of its products."""
        z, geometry = self.pair_geometry(pairs, position, vectors, second)
        r, density, shape = self.energy_factors(pairs, geometry)
        return z, (density * self.repulsion.between(pairs).potential(r, shape)).of(geometry)

    def active_pairs(
        self, state: BeamState, vectors: np.ndarray, history: LineHistory, slip: bool = False
    ) -> ActivePairs:
        """Return the pairs that touch, and their friction; where there is none, their slip only if asked for."""
        pairs = self.pairs(state.position, vectors)
        past = history if slip or self.mu else LineHistory.none()
        parted = self._parted(past, pairs, state.position, vectors)
        past = self._with_new_pairs(past, pairs)
        return ActivePairs(pairs, PairFriction.of(self.repulsion, self.mu, state, pairs, past, parted))

    def _parted(
        self, history: LineHistory, touching: PointPairs, position: np.ndarray, vectors: np.ndarray
    ) -> PointPairs:
        """Return the pairs of a history that do not touch any more, but are near each other."""
        key = np.setdiff1d(history.key, touching.key, assume_unique=True)
        near = self.pairs(position, vectors, near=True) if len(key) else touching
        return near[np.flatnonzero(np.isin(near.key, key, assume_unique=True))]

    def loads(self, at: BeamState, vectors: np.ndarray, active: ActivePairs, second: bool = False) -> Loads:
        """Return the forces between pairs of points that touch."""
        pairs, friction = active.pairs, active.friction

        def energy(part: slice) -> tuple[np.ndarray, ...]:
            z, U = self.energy(pairs[part], at.position, vectors, second)
            return z, U.value, U.slope, *((U.bend,) if second else ())

        z, value, gradient, *bend = by_parts(energy, len(pairs.i), at_a_time(len(pairs.i)))
        U = Expansion(value, gradient, bend[0] if second else None)
        slope = np.tensordot(U.slope, TWICE, 1) @ z
        on_j = slope[:, W].copy()
        on_j[friction.pair] -= friction.traction
        return Loads(pairs, z, U, slope, friction, on_j)

    def respond(
        self,
        state: BeamState,
        vectors: np.ndarray,  # (2, 3), of the lattice [m]
        history: LineHistory,
        stiffness: bool,
        active: ActivePairs | None = None,  # of this state and this history, if it is known
        spread: Spread | None = None,  # how points follow the unknowns of the tangent
    ) -> tuple[np.ndarray, dict[str, float], sp.bsr_matrix | None]:
        """Return internal forces (6 n + 6,), energies and, if asked, the tangent in blocks (3, 3).

        Forces are on place and turn of the n points, and on the lattice vectors, which images of points follow. The
        tangent is over these as well, or over what they follow by `spread`.
        """
        active = active or self.active_pairs(state, vectors, history)
        loads = self.loads(state, vectors, active, stiffness)
        n = len(state.position)
        friction = active.friction
        energy = {"penalty": float(loads.energy.value.sum() + friction.stored.sum())}
        energy["friction"] = history.dissipated + float(friction.dissipated.sum()) + friction.left_behind
        return self.forces(loads, n), energy, self._tangent(loads, n, spread) if stiffness else None

    def forces(self, loads: Loads, n: int) -> np.ndarray:
        """Return internal forces (6 n + 6,) on n points and the lattice vectors."""
        pairs, slope, friction, on_j = loads.pairs, loads.slope, loads.friction, loads.on_j
        total = np.zeros((n, 6))
        nodes = pairs.both
        sign = np.array([-1.0, 1.0])[:, None]
        np.add.at(total[:, :3], nodes, sign * on_j[:, None])
        moment = np.cross(friction.arm, friction.traction[:, None])
        np.add.at(total[:, 3:], nodes[friction.pair], -sign * moment)
        on_vectors = pairs.image.T @ on_j
        touched, row = np.unique(nodes, return_inverse=True)
        axes = self.axes
        on_axes = np.zeros((2, len(touched), 3))
        np.add.at(on_axes[1], row, slope[:, 1:3])
        np.add.at(on_axes[0], row, slope[:, 3:])
        of_first, of_second = (weights[touched, :, None] for weights in (axes.first, axes.second))
        at_points = of_first * on_axes[0, :, None] + of_second * on_axes[1, :, None]
        np.add.at(total[:, :3], axes.points[touched], at_points)
        on_vectors[0] += np.einsum("np,npi->i", axes.image[touched], at_points)
        return np.append(total.ravel(), on_vectors.ravel())

    def _tangent(self, loads: Loads, n: int, spread: Spread | None = None) -> sp.bsr_matrix:
        """Return the tangent over n points and the lattice vectors, or what they follow; some pairs at a time."""
        pairs, friction, U = loads.pairs, loads.friction, loads.energy
        assert U.bend is not None, "loads were asked for without second derivatives"
        bend = U.bend

        def normal_blocks(part: slice) -> tuple[np.ndarray, np.ndarray]:
            J = np.tensordot(loads.z[part], TWICE, (1, 2)).transpose(0, 2, 3, 1).reshape(-1, len(ONE), 15)
            hessian = J.swapaxes(1, 2) @ bend[part] @ J + np.tensordot(U.slope[part], SECOND, 1)
            at, weights = self._weights(pairs[part], n)
            k, _, a = weights.shape
            # sum over c, d of w_cp w_dq d2U / dz_ci dz_dj
            left = (weights.swapaxes(1, 2) @ hessian.reshape(k, 5, 45)).reshape(k, a, 3, 5, 3).swapaxes(3, 4)
            return at, (left.reshape(k, 9 * a, 5) @ weights).reshape(k, a, 9, a).swapaxes(2, 3)

        every = parts(len(pairs.i), at_a_time(len(pairs.i)))

        def summed(number: int) -> sp.bsr_matrix:
            part = every[number]
            total = in_blocks(*normal_blocks(part), 2 * n + 2)
            if self.mu > 0:
                some = friction[slice(*np.searchsorted(friction.pair, [part.start, part.stop]))]
                total = total + in_blocks(*friction_tangent(self.mu, pairs, some, n, self.images), 2 * n + 2)
            return spread.tangent(total) if spread else total

        return reduce(add, share(summed, len(every)))

    def _weights(self, pairs: PointPairs, n: int) -> tuple[np.ndarray, np.ndarray]:
        """Return blocks (k, a): three of n points around i, three around j, lattice vectors; z's weights (k, 5, a)."""
        axes = self.axes
        k = len(pairs.i)
        weights = np.zeros((k, 5, 8))
        weights[:, W, 1] = -1.0
        weights[:, W, 4] = 1.0
        weights[:, W, 6:] = pairs.image
        for side, at in enumerate((pairs.i, pairs.j)):
            for row, of_points in ((K_A + side, axes.second[at]), (T_A + side, axes.first[at])):
                weights[:, row, 3 * side : 3 * side + 3] = of_points
                weights[:, row, 6] = np.einsum("kp,kp->k", of_points, axes.image[at])
        blocks = [2 * axes.points[pairs.both].reshape(k, 6), np.tile([2 * n, 2 * n + 1], (k, 1))]
        used = slice(6 + self.images)
        return np.column_stack(blocks)[:, used], weights[..., used]

    def gaps(self, pairs: PointPairs, state: BeamState, vectors: np.ndarray) -> np.ndarray:
        """Return the gaps (k,) of the yarns of pairs at their closest points, by parabolas there [m]."""
        z, _ = self.pair_geometry(pairs, state.position, vectors)
        D = self.repulsion.between(pairs).diameter
        return closest_points(z, 0.5 * D)[1] - D

    def commit(
        self,
        state: BeamState,
        vectors: np.ndarray,  # (2, 3), of the lattice [m]
        history: LineHistory,
        # with their slip, of this state and this history, if they are known
        active: ActivePairs | None = None,
    ) -> LineHistory:
        """Return the history that a converged increment leaves."""
        active = active or self.active_pairs(state, vectors, history, slip=True)
        points = self.committed_points(state, vectors)
        unslipped = self._unslipped(points, active.pairs)
        return committed_history(self.mu, unslipped, points, active, history.dissipated)

    def restored_history(
        self, state: BeamState, vectors: np.ndarray, key: np.ndarray, traction: np.ndarray, stored: np.ndarray
    ) -> LineHistory:
        """Return the history of pairs that touch in a state, from their friction; see `LineHistory`."""
        points = self.committed_points(state, vectors)
        pairs = self.pairs(state.position, vectors)
        unslipped = self._unslipped(points, pairs[np.flatnonzero(np.isin(pairs.key, key))])
        return replace(unslipped, traction=traction, end_traction=traction, stored=stored, points=points)

    def committed_points(self, state: BeamState, vectors: np.ndarray) -> CommittedPoints:
        """Return all points, as a history keeps them."""
        return CommittedPoints(state.position, state.rotation, vectors, self.repulsion.diameter)

    def _unslipped(self, points: CommittedPoints, pairs: PointPairs) -> LineHistory:
        """Return the history of pairs in one configuration that have not slipped."""
        z, geometry = self.pair_geometry(pairs, points.position, points.vectors)
        _, density, shape = self.energy_factors(pairs, geometry)
        angles = np.stack([each.value for each in geometry[:3]], axis=1)
        by_distance = density.value, density.slope[:, -1]
        return unslipped_history(self.repulsion, points, pairs, z, angles, *by_distance, shape.value)

    def _with_new_pairs(self, history: LineHistory, pairs: PointPairs) -> LineHistory:
        """Return a history of all these pairs: that of new ones follows from where their points were."""
        points = history.points
        if points is None:
            return history
        new = pairs[np.flatnonzero(~np.isin(pairs.key, history.key, assume_unique=True))]
        position = points.position
        way = position[new.j] + new.image @ points.vectors - position[new.i]
        fresh = self.of_diameter(points.diameter)._unslipped(points, replace(new, way=way))
        both = history.joined(fresh)
        return both[np.argsort(both.key)]
