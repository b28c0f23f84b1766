"""Contact between the points of yarns, as a double integral over both yarns.

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

Points (`contact_points`) have the lengths that they stand for. They resolve F from an approach e on, at which
the yarns touch over `SPACINGS` of their spacings. Below it F starts softly: the approach counts as e (2 - x) x^2 with
x = delta / e.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from knitstudy.mechanics.batches import by_parts, parts, share
from knitstudy.mechanics.beams.contact_points import Axes
from knitstudy.mechanics.beams.hertz import Expansion
from knitstudy.mechanics.beams.line_friction import (
    ClosePairs,
    PairFriction,
    closest_points,
    friction_tangent,
    remember,
)
from knitstudy.mechanics.beams.repulsion import PointPairs, Repulsion
from knitstudy.mechanics.beams.state import BeamState, LineHistory

NEAR = 1.1  # distance up to which pairs are near each other, and remembered, over the diameter
SPACINGS = 2.5  # length of contact from which on the law is exact in the mean, over the spacing of points
# Points between which curvatures are taken lie so far to both sides, over the diameter: a patch feels no sharper bend,
# and pointwise ones could fall into a kink.
CHORD = 0.25
# Friction of rough yarns: points that part lose their traction while their force fades, not all at once.
ROUGH = 100.0
BATCH = 8000  # pairs at once: their second derivatives take 120 MB
MARGIN = 0.1  # further distance within which pairs are searched, over that of near ones: they serve until points move


# z of a pair, and the scalar products that all depends on, with their second derivatives
W, K_A, K_B, T_A, T_B = range(5)
PRODUCTS = ((W, W), (K_A, W), (K_B, W), (T_A, T_A), (T_B, T_B), (T_A, T_B))
BOTH = np.zeros((len(PRODUCTS), 5, 3, 5, 3))
for _row, (_one, _other) in enumerate(PRODUCTS):
    BOTH[_row, _one, :, _other] += np.eye(3)
    BOTH[_row, _other, :, _one] += np.eye(3)
BOTH = BOTH.reshape(-1, 15, 15)


def products_by(z: np.ndarray) -> np.ndarray:
    """Return the derivatives (k, 6, 15) of the products by z (k, 5, 3)."""
    J = np.zeros((len(z), len(PRODUCTS), 5, 3))
    for row, (one, other) in enumerate(PRODUCTS):
        J[:, row, one] += z[:, other]
        J[:, row, other] += z[:, one]
    return J.reshape(len(z), len(PRODUCTS), 15)


@dataclass(frozen=True, eq=False)
class Loads:
    """Forces between pairs of points that touch."""

    pairs: PointPairs
    z: np.ndarray  # (k, 5, 3)
    energy: Expansion  # (k,) by the products of z [J]
    slope: np.ndarray  # (k, 5, 3), internal forces on z
    rubs: PairFriction
    on_j: np.ndarray  # (k, 3), internal forces on the yarns of j, friction included [N]


def shifts(pairs: PointPairs, moves: np.ndarray) -> np.ndarray:
    """Return the derivatives (k, 3, 3) of images of j by the unknowns of the lattice; `moves` as of `respond`."""
    return np.einsum("ka,aij->kij", pairs.image, moves)


def _serves(
    pairs: PointPairs,
    far: float,
    before: np.ndarray,
    lattice: np.ndarray,
    position: np.ndarray,
    vectors: np.ndarray,
    reach: float,
) -> bool:
    """Return whether the pairs nearer than `far` before have all those within a reach now."""
    move = position - before
    moved = 2 * np.linalg.norm(move - move.mean(axis=0), axis=1).max()
    images = np.abs(pairs.image).max(axis=0, initial=1) + 1
    return moved + images @ np.linalg.norm(vectors - lattice, axis=1) < far - reach


FAR = 1 << 6  # images are at most half as many periods away


class LineContact:
    """Contact of all points of yarns with each other, and with their images where yarns repeat themselves."""

    def __init__(
        self,
        yarn: np.ndarray,  # int (n,), of every point; those of a yarn follow each other
        arc_length: np.ndarray,  # (n,) [m]
        weight: np.ndarray,  # (n,), length that it stands for [m]
        repulsion: Repulsion,
        friction: float = 0.0,  # mu; at most `ROUGH`
        beside: float = np.inf,  # lengths along a yarn within which it does not touch itself [m]
        # (Y,), lengths of one period of the yarns, along the first lattice vector; None where nothing repeats [m]
        period: np.ndarray | None = None,
        # int (n,), number of the tie that carries what its points press, or -1; None: no tie does
        joined: np.ndarray | None = None,
    ) -> None:
        self.yarn, self.arc_length, self.weight, self.period = yarn, arc_length, weight, period
        self.repulsion, self.friction = repulsion, min(friction, ROUGH)
        self.beside, self.joined = beside, joined
        self.axes = Axes.of(yarn, arc_length, weight, CHORD * repulsion.diameter, period)
        # Pairs of the last search; their reach, points and lattice then
        self._found: tuple[PointPairs, float, np.ndarray, np.ndarray] | None = None

    def thinner(self, by: float) -> LineContact:
        """Return the contact of yarns whose diameter is smaller by a length [m]."""
        contact = copy(self)
        contact.repulsion = replace(self.repulsion, diameter=self.repulsion.diameter - by)
        return contact

    def pairs(self, position: np.ndarray, vectors: np.ndarray, near: bool = False) -> PointPairs:
        """Return the pairs that touch, or those `near` each other, of points (n, 3) and lattice vectors (2, 3) [m]."""
        reach = (NEAR if near else 1.0) * self.repulsion.diameter
        if self._found is None or not _serves(*self._found, position, vectors, reach):
            far = (1 + MARGIN) * NEAR * self.repulsion.diameter
            self._found = self._search(position, vectors, far), far, position, vectors
        pairs = self._found[0]
        way = position[pairs.j] + pairs.image @ vectors - position[pairs.i]
        return replace(pairs, way=way)[np.einsum("ki,ki->k", way, way) < reach**2]

    def _search(self, position: np.ndarray, vectors: np.ndarray, reach: float) -> PointPairs:
        n, extent, most = len(position), np.ptp(position[:, :2], axis=0) + reach, np.zeros(2, dtype=int)
        if self.period is not None:
            # (x, y) = vectors^T (a, b): bounds of a and b for all ways that points may be apart
            most = np.abs(np.linalg.inv(vectors[:, :2].T)) @ extent
            most = np.ceil(most).astype(int).clip(max=FAR // 2 - 1)
        a, b = np.meshgrid(np.arange(-most[0], most[0] + 1), np.arange(most[1] + 1), indexing="ij")
        image = np.stack([a.ravel(), b.ravel()], axis=1)
        # The others are these seen from the other point.
        image = image[(image[:, 1] > 0) | (image[:, 0] > 0)]
        tree = cKDTree(position)
        i, j = tree.query_pairs(reach, output_type="ndarray").T.astype(np.int64)
        of_image = np.zeros((len(i), 2), dtype=np.int64)
        if len(image):
            moved = (position + (image @ vectors)[:, None]).reshape(-1, 3)
            near = tree.sparse_distance_matrix(cKDTree(moved), reach, output_type="coo_matrix")
            i, j = np.append(i, near.row), np.append(j, near.col % n)
            of_image = np.concatenate([of_image, image[near.col // n]])
        a, b = of_image.T
        apart = self.arc_length[j] - self.arc_length[i]
        if self.period is not None:
            apart = apart + a * self.period[self.yarn[j]]
        chosen = (self.yarn[i] != self.yarn[j]) | (b != 0) | (np.abs(apart) > self.beside)
        if self.joined is not None:
            chosen &= (self.joined[i] < 0) | (self.joined[i] != self.joined[j])
        key = ((i * n + j) * FAR + a + FAR // 2) * FAR + b
        order = np.flatnonzero(chosen)[np.argsort(key[chosen])]
        i, j, of_image = i[order], j[order], of_image[order]
        return PointPairs(i, j, of_image, position[j] + of_image @ vectors - position[i], key[order])

    def bends(
        self, pairs: PointPairs, along: tuple[np.ndarray, np.ndarray], second: bool = False
    ) -> tuple[np.ndarray, list[Expansion]]:
        """Return z (k, 5, 3) and what U depends on: k_a R, k_b R, the cosine of the angle and r, by products of z.

        z are the way, the second derivatives of both yarns and their tangents: `along` are those of all points.
        """
        first, bend = along
        z = np.stack([pairs.way, bend[pairs.i], bend[pairs.j], first[pairs.i], first[pairs.j]], axis=1)
        values = np.stack([np.einsum("ki,ki->k", z[:, one], z[:, other]) for one, other in PRODUCTS], axis=1)
        squared, of_a, of_b, square_a, square_b, both = Expansion.variables(values, second)
        per_r, per_a, per_b = (each.power(-0.5) for each in (squared, square_a, square_b))
        R = 0.5 * self.repulsion.diameter
        return z, [R * (of_a * per_r), -R * (of_b * per_r), both * per_a * per_b, squared.power(0.5)]

    def shaped(self, pairs: PointPairs, bends: list[Expansion]) -> tuple[Expansion, Expansion, Expansion]:
        """Return r [m], c times both lengths [m2], and the factor by the shape, as functions of `bends`."""
        values = np.stack([bend.value for bend in bends], axis=1)
        k_a, k_b, cos, r = Expansion.variables(values, second=bends[0].bend is not None)
        density, shape = self.repulsion.patch.density(k_a, k_b, cos)
        return r, density.times(self.weight[pairs.i] * self.weight[pairs.j]), shape

    def energy(
        self, pairs: PointPairs, along: tuple[np.ndarray, np.ndarray], second: bool = False
    ) -> tuple[np.ndarray, Expansion]:
        """Return z (k, 5, 3) of pairs, and their energies (k,) [J] as functions of its products."""
        z, bends = self.bends(pairs, along, second)
        r, density, shape = self.shaped(pairs, bends)
        return z, (density * self.repulsion.potential(r, shape)).of(bends)

    def loads(
        self, state: BeamState, vectors: np.ndarray, history: LineHistory, second: bool = False
    ) -> Loads:
        """Return the forces between pairs of points that touch."""
        pairs, along = self.pairs(state.position, vectors), self.axes.at(state.position, vectors)

        def energy(part: slice) -> tuple[np.ndarray, ...]:
            z, U = self.energy(pairs[part], along, second)
            return z, U.value, U.slope, *((U.bend,) if second else ())

        z, *U = by_parts(energy, len(pairs.i), BATCH)
        U = Expansion(*U) if second else Expansion(*U, None)
        slope = np.einsum("kv,kvz->kz", U.slope, products_by(z)).reshape(-1, 5, 3)
        rubs = PairFriction.of(self.repulsion, self.friction, state, pairs, history)
        on_j = slope[:, W].copy()
        on_j[rubs.pair] -= rubs.traction
        return Loads(pairs, z, U, slope, rubs, on_j)

    def respond(
        self, state: BeamState, vectors: np.ndarray, moves: np.ndarray, history: LineHistory, stiffness: bool
    ) -> tuple[np.ndarray, dict[str, float], sp.csr_matrix | None]:
        """Return internal forces (6 n + 3,), energies and, if asked, the tangent.

        The lattice has the vectors (2, 3); `moves` (2, 3, 3) is their derivative by its three unknowns.
        """
        # Without friction pairs have nothing to remember.
        loads = self.loads(state, vectors, history if self.friction else LineHistory.none(), stiffness)
        rubs, n = loads.rubs, len(state.position)
        energy = {"penalty": float(loads.energy.value.sum() + rubs.stored.sum())}
        energy["friction"] = history.dissipated + float(rubs.dissipated.sum()) + rubs.left_behind
        return self.forces(loads, moves, n), energy, self._tangent(loads, moves, 6 * n) if stiffness else None

    def forces(self, loads: Loads, moves: np.ndarray, n: int) -> np.ndarray:
        """Return internal forces (6 n + 3,) on n points and the lattice."""
        pairs, slope, rubs, on_j = loads.pairs, loads.slope, loads.rubs, loads.on_j
        total, nodes = np.zeros((n, 6)), pairs.both
        sign = np.array([-1.0, 1.0])[:, None]
        np.add.at(total[:, :3], nodes, sign * on_j[:, None])
        np.add.at(total[:, 3:], nodes[rubs.pair], -sign * np.cross(rubs.arm, rubs.traction[:, None]))
        on_lattice = np.einsum("kij,ki->j", shifts(pairs, moves), on_j)
        axes, on_axes = self.axes, np.zeros((2, n, 3))
        np.add.at(on_axes[1], nodes, slope[:, 1:3])
        np.add.at(on_axes[0], nodes, slope[:, 3:])
        at_points = axes.first[..., None] * on_axes[0, :, None] + axes.second[..., None] * on_axes[1, :, None]
        np.add.at(total[:, :3], axes.points, at_points)
        on_lattice += np.einsum("np,npi->i", axes.image, at_points) @ moves[0]
        return np.append(total.ravel(), on_lattice)

    def _tangent(self, loads: Loads, moves: np.ndarray, size: int) -> sp.csr_matrix:
        """Return the tangent over `size` unknowns of all points and the lattice, a batch of pairs at a time."""
        pairs, rubs, U, shift = loads.pairs, loads.rubs, loads.energy, shifts(loads.pairs, moves)

        def pressed(part: slice) -> tuple[np.ndarray, np.ndarray]:
            J = products_by(loads.z[part])
            bend = J.swapaxes(1, 2) @ U.bend[part] @ J + np.tensordot(U.slope[part], BOTH, 1)
            unknowns, motion = self._motion(pairs[part], shift[part], moves, size)
            return unknowns, motion.swapaxes(1, 2) @ bend @ motion

        def rubbed(part: slice) -> tuple[np.ndarray, np.ndarray]:
            return friction_tangent(self.friction, pairs, rubs[part], shift, size)

        work = [(pressed, part) for part in parts(len(pairs.i), BATCH)]
        if self.friction > 0:
            work += [(rubbed, part) for part in parts(len(rubs.pair), BATCH)]

        def summed(number: int) -> sp.csr_matrix:
            blocks_of, part = work[number]
            at, blocks = blocks_of(part)
            row, column = np.repeat(at, at.shape[1], axis=1), np.tile(at, at.shape[1])
            return sp.csr_matrix((blocks.ravel(), (row.ravel(), column.ravel())), (size + 3, size + 3))

        return sum(share(summed, len(work)), sp.csr_matrix((size + 3, size + 3)))

    def _motion(
        self, pairs: PointPairs, shift: np.ndarray, moves: np.ndarray, size: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return unknowns (k, 21), three points around i, three around j, the lattice; and z by them (k, 15, 21)."""
        axes, k = self.axes, len(pairs.i)
        of_points, of_lattice = np.zeros((k, 5, 6)), np.zeros((k, 5, 3, 3))  # derivatives of z
        of_points[:, 0, 1], of_points[:, 0, 4], of_lattice[:, 0] = -1.0, 1.0, shift
        for side, at in enumerate((pairs.i, pairs.j)):
            mine = slice(3 * side, 3 * side + 3)
            for row, weights in ((1 + side, axes.second[at]), (3 + side, axes.first[at])):
                of_points[:, row, mine] = weights
                of_lattice[:, row] = (weights * axes.image[at]).sum(axis=1)[:, None, None] * moves[0]
        motion = np.einsum("kpa,ij->kpiaj", of_points, np.eye(3)).reshape(k, 15, 18)
        points = axes.points[pairs.both].reshape(k, 6)
        unknowns = (6 * points[..., None] + np.arange(3)).reshape(k, 18)
        unknowns = np.concatenate([unknowns, np.broadcast_to(size + np.arange(3), (k, 3))], axis=1)
        return unknowns, np.concatenate([motion, of_lattice.reshape(k, 15, 3)], axis=2)

    def gaps(self, pairs: PointPairs, state: BeamState, vectors: np.ndarray) -> np.ndarray:
        """Return the gaps (k,) of the yarns of pairs at their closest points, by parabolas there [m]."""
        z, _ = self.bends(pairs, self.axes.at(state.position, vectors))
        D = self.repulsion.diameter
        return closest_points(z, 0.5 * D)[1] - D

    def commit(self, state: BeamState, vectors: np.ndarray, history: LineHistory) -> LineHistory:
        """Return the history that a converged increment leaves."""
        rubs = PairFriction.of(
            self.repulsion, self.friction, state, self.pairs(state.position, vectors), history
        )
        return self.remembered(state, vectors, history, rubs)

    def remembered(
        self, state: BeamState, vectors: np.ndarray, history: LineHistory, rubs: PairFriction
    ) -> LineHistory:
        """Return the history that a converged increment with such friction leaves."""
        pairs = self.pairs(state.position, vectors, near=True)
        z, bends = self.bends(pairs, self.axes.at(state.position, vectors))
        _, *weights = self.shaped(pairs, bends)
        density, shape = (weight.value for weight in weights)
        angles = np.stack([each.value for each in bends[:3]], axis=1)
        close = ClosePairs(pairs, z, angles, density, shape)
        return remember(self.repulsion, self.friction, state, close, rubs, history.dissipated)
