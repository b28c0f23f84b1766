"""Contact of smooth surfaces: Gauss points of each against the other, both ways with half the stiffness each.

Two passes leave no bias of master and slave. The points' history holds what friction remembers: where a point last
stuck on the other surface, in convected coordinates, so that a rotation of both changes nothing. It is updated only
when an increment has converged. References: Wriggers, Computational Contact Mechanics (2006), chapters 5 and 6;
Laursen, Computational Contact and Impact Mechanics (2002), chapter 5.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from knitstudy.contact.friction import OPEN, SLIP, Coulomb
from knitstudy.contact.kinematics import Kinematics
from knitstudy.contact.projection import Projection, project
from knitstudy.contact.quadrature import Quadrature
from knitstudy.contact.search import Candidates, Search
from knitstudy.contact.surface import Grid, Stencil, Surfaces, interpolate
from knitstudy.errors import ConvergenceError, MeshError

PASS_SHARE = 0.5
"""Each of the two surfaces' points carries half of the contact stiffness."""

CHUNK = 256
"""Points whose stiffness is formed at once: 32 x 32 blocks each."""

SAME_PIECE = 4.0
"""Slices that the closest point of one pair may lie apart in two searches; another piece of a yarn is farther."""


@dataclass(frozen=True, eq=False)
class ContactHistory:
    """What contact points remember of the last converged increment; all arrays run over the candidate pairs.

    Attributes
    ----------
    point, surface : ndarray of int, shape (c,)
        Gauss point and the surface that it faces.
    xi : ndarray, shape (c, 2)
        Its closest point.
    gap : ndarray, shape (c,)
        Its gap [m]; inf where the closest point was not within the surface's edges.
    pressure : ndarray, shape (c,)
        Its pressure [Pa], what multipliers carried included; where it is positive, the anchor counts.
    traction : ndarray, shape (c, 3)
        Its tangential traction [Pa].
    multiplier : ndarray, shape (c,)
        Pressure (negative) that augmentation has added within the increment [Pa].
    anchor : ndarray, shape (c, 2)
        Convected coordinates at which the point would carry no tangential traction.
    slip : ndarray, shape (c,)
        Length slipped since it first touched [m].
    status : ndarray of int, shape (c,)
        OPEN, STICK or SLIP.
    dissipated : ndarray, shape ()
        Work of friction so far [J].
    """

    point: np.ndarray
    surface: np.ndarray
    xi: np.ndarray
    gap: np.ndarray
    pressure: np.ndarray
    traction: np.ndarray
    multiplier: np.ndarray
    anchor: np.ndarray
    slip: np.ndarray
    status: np.ndarray
    dissipated: np.ndarray

    @classmethod
    def empty(cls) -> ContactHistory:
        """Return the history of a model in which nothing has touched yet."""
        number, value = np.empty(0, dtype=np.int64), np.empty(0)
        places = np.empty((0, 2))
        vectors = np.empty((0, 3))
        return cls(number, number, places, value, value, vectors, value, places, value, number, np.zeros(()))


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """All candidate pairs in one configuration.

    Attributes
    ----------
    history : ContactHistory
        What they remember, in the same order.
    position : ndarray, shape (c, 3)
        Points [m].
    projection : Projection
        Against the surfaces that they face.
    gap : ndarray, shape (c,)
        Gaps [m]; inf where there is no closest point.
    slip : ndarray, shape (c, 2)
        Convected coordinates since the anchor, s.
    slip_rate : ndarray, shape (c, 2)
        ds/dg of points that have touched within this increment, else 0.
    slip_share : ndarray, shape (c,)
        ds/dxi: 1, or the share of the increment in contact.
    trial : ndarray, shape (c, 3)
        Trial traction epsT s [Pa].
    pressure : ndarray, shape (c,)
    traction : ndarray, shape (c, 3)
        Tangential part [Pa].
    status : ndarray of int, shape (c,)
        OPEN, STICK or SLIP.
    """

    history: ContactHistory
    position: np.ndarray
    projection: Projection
    gap: np.ndarray
    slip: np.ndarray
    slip_rate: np.ndarray
    slip_share: np.ndarray
    trial: np.ndarray
    pressure: np.ndarray
    traction: np.ndarray
    status: np.ndarray

    @property
    def active(self) -> np.ndarray:
        """Pairs (a,) that touch."""
        return np.flatnonzero(self.status != OPEN)

    def signature(self) -> np.ndarray:
        """Return points, surfaces and status (a, 3) of the pairs that touch: what must not change any more."""
        active = self.active
        table = np.stack(
            [self.history.point[active], self.history.surface[active], self.status[active]], axis=1
        )
        return table[np.lexsort(table.T)]


@dataclass(frozen=True, eq=False)
class _Followed:
    """Pairs of one search: the history asked about, that history over all pairs, points' stencils, where nodes were."""

    source: ContactHistory
    history: ContactHistory
    own: Stencil
    searched: np.ndarray


@dataclass(frozen=True, eq=False)
class ContactResponse:
    """Forces of contact in one configuration.

    Attributes
    ----------
    points : ContactPoints
    node_force : ndarray, shape (N, 3)
        Internal force at all nodes [N].
    energy : dict of str to float
        "penalty": stored in penetration and elastic slip; "friction": dissipated since the start [J].
    stiffness : bsr matrix, shape (3 N, 3 N), or None
    symmetric : bsr matrix, shape (3 N, 3 N), or None
        Its symmetric positive part, of the same pattern.
    """

    points: ContactPoints
    node_force: np.ndarray
    energy: dict[str, float]
    stiffness: sp.bsr_matrix | None = None
    symmetric: sp.bsr_matrix | None = None


class Contact:
    """Contact between the surfaces of one model.

    Parameters
    ----------
    nodes : ndarray, shape (N, 3)
        Undeformed nodes [m].
    grids : sequence of Grid
        The surfaces.
    law : Coulomb
    meets : ndarray of bool, shape (G, G), optional
        Which surfaces may touch each other; by default all, themselves included.
    pieces : ndarray of int, shape (R,), optional
        A number for every row of nodes, surface by surface: rows with the same one, unless it is negative, do not
        touch each other.
    points : int
        Gauss points along each side of a cell.
    margin : float
        Distance up to which pairs are followed [m]; the search is repeated when half of it is used up.
    overlap : float
        Largest penetration of the undeformed surfaces [m].

    Raises
    ------
    MeshError
        If undeformed surfaces overlap by more than that.
    """

    def __init__(
        self,
        nodes: np.ndarray,
        grids: list[Grid] | tuple[Grid, ...],
        law: Coulomb,
        *,
        meets: np.ndarray | None = None,
        pieces: np.ndarray | None = None,
        points: int = 3,
        margin: float,
        overlap: float,
    ) -> None:
        self.nodes, self.law, self.margin = nodes, law, margin
        self.surfaces = Surfaces(grids)
        self.quadrature = Quadrature.on(self.surfaces, nodes, points)
        if meets is None:
            meets = np.ones((len(grids), len(grids)), dtype=bool)
        self._search = Search(self.surfaces, self.quadrature, nodes, meets, pieces)
        self._skin = np.unique(np.concatenate([np.ravel(grid.nodes) for grid in grids]))
        self._followed: _Followed | None = None
        deepest = -self.smallest_gap(self.points(nodes, nodes, ContactHistory.empty()))
        if deepest > overlap:
            raise MeshError(
                f"surfaces overlap by {deepest:.3g} m before anything moves; allowed is {overlap:.3g} m. "
                "Use a larger pattern.clearance, or a finer mesh.size"
            )

    def points(self, nodes: np.ndarray, before: np.ndarray, history: ContactHistory) -> ContactPoints:
        """Evaluate all candidate pairs.

        Parameters
        ----------
        nodes : ndarray, shape (N, 3)
            Where the nodes are [m].
        before : ndarray, shape (N, 3)
            Where they were at the last converged increment [m].
        history : ContactHistory
            Of that increment.
        """
        followed = self._follow(nodes, before, history)
        history = followed.history
        position = interpolate(followed.own.value, followed.own.nodes, nodes)
        projection, gap = self._project(history, position, nodes)
        law = self.law
        # A point that has closed within this increment has slid in contact only for the rest of it.
        fresh = history.pressure <= 0
        closes = fresh & (gap < 0) & np.isfinite(history.gap) & (history.gap > 0)
        ends = np.where(closes, gap, 0.0), np.where(closes, history.gap, 0.0)
        span = np.where(closes, ends[0] - ends[1], 1.0)
        share = np.where(closes, ends[0] / span, 1.0)
        moved = projection.xi - np.where(fresh[:, None], history.xi, history.anchor)
        rate = -ends[1] / span**2
        slip = share[:, None] * moved
        trial = law.tangential * np.einsum("ka,kai->ki", slip, projection.tangent)
        pressure = law.pressure(gap, history.multiplier)
        traction, status = law.traction(trial, pressure)
        return ContactPoints(
            history=history,
            position=position,
            projection=projection,
            gap=gap,
            slip=slip,
            slip_rate=rate[:, None] * moved,
            slip_share=share,
            trial=trial,
            pressure=pressure,
            traction=traction,
            status=status,
        )

    def respond(
        self, nodes: np.ndarray, before: np.ndarray, history: ContactHistory, stiffness: bool
    ) -> ContactResponse:
        """Return forces and, if asked, the tangent; parameters as in `points`."""
        return self.forces(self.points(nodes, before, history), stiffness)

    def forces(self, points: ContactPoints, stiffness: bool) -> ContactResponse:
        """Return the forces of pairs that `points` has evaluated and, if asked, the tangent."""
        active = points.active
        weight = PASS_SHARE * self.quadrature.area[points.history.point[active]]
        own, other = self._stencils(points, active)
        force = points.traction[active] - points.pressure[active, None] * points.projection.normal[active]
        force *= weight[:, None]
        node_force = np.zeros_like(self.nodes)
        for stencil, sign in ((own, 1.0), (other, -1.0)):
            shares = sign * stencil.value[:, :, None] * force[:, None, :]
            for i in range(3):
                node_force[:, i] += np.bincount(
                    stencil.nodes.ravel(), shares[..., i].ravel(), minlength=len(node_force)
                )
        answer = ContactResponse(points, node_force, self._energy(points, active, weight))
        if not stiffness:
            return answer
        full, symmetric = self._stiffness(points, active, weight, own, other)
        return replace(answer, stiffness=full, symmetric=symmetric)

    def commit(self, points: ContactPoints) -> ContactHistory:
        """Return the history that a converged increment leaves.

        Raises
        ------
        ConvergenceError
            If a point that touched has slid over the edge of the surface that it faced.
        """
        history, law = points.history, self.law
        lost = (history.pressure > 0) & ~points.projection.found
        if lost.any():
            k = np.flatnonzero(lost)[0]
            raise ConvergenceError(
                f"contact slides over the end of a surface (surface {history.surface[k]}, place "
                f"{history.xi[k, 0]:.1f} of {self.surfaces.shape[history.surface[k], 0] - 1} slices): a yarn is "
                "pulled out of its loop, or the slip is longer than the surface; use a smaller load or longer yarns"
            )
        touches = points.status != OPEN
        slips = points.status == SLIP
        size = np.linalg.norm(points.trial[slips], axis=1)
        limit = law.friction * points.pressure[slips]
        slip = points.slip.copy()
        slip[slips] *= np.divide(limit, size, out=np.zeros_like(size), where=size > 0)[:, None]
        length = law.slipped(points.trial, points.pressure)
        committed = ContactHistory(
            point=history.point,
            surface=history.surface,
            xi=points.projection.xi,
            gap=points.gap,
            pressure=points.pressure,
            traction=points.traction,
            # A multiplier stays with its point while contact moves on: kept, it would press across an open gap.
            multiplier=np.zeros_like(history.multiplier),
            anchor=np.where(touches[:, None], points.projection.xi - slip, points.projection.xi),
            slip=np.where(touches, history.slip + length, 0.0),
            status=points.status,
            dissipated=np.asarray(history.dissipated + self._dissipation(points)),
        )
        self._continue(history, committed)
        return committed

    def augment(self, points: ContactPoints) -> ContactHistory:
        """Return the history with multipliers (Uzawa) that carry the present pressure without penetration."""
        history = points.history
        touches = points.status != OPEN
        fresh = touches & (history.pressure <= 0)
        anchor = np.where(fresh[:, None], points.projection.xi - points.slip, history.anchor)
        augmented = replace(
            history,
            multiplier=-points.pressure,
            anchor=anchor,
            # Positive from now on, so that the anchor stays where the point touched first.
            pressure=np.where(fresh, np.finfo(float).tiny, history.pressure),
        )
        self._continue(history, augmented)
        return augmented

    def reference(self, point: np.ndarray) -> np.ndarray:
        """Return the undeformed positions (k, 3) of Gauss points (k,) [m]."""
        return self._search.positions(point, self.nodes)

    def smallest_gap(self, points: ContactPoints) -> float:
        """Return the smallest gap of all pairs that are followed [m]; inf if there are none."""
        return float(points.gap.min(initial=np.inf))

    # ---- candidates -----------------------------------------------------------------------------------------

    def _follow(self, nodes: np.ndarray, before: np.ndarray, history: ContactHistory) -> _Followed:
        """Return the history over all pairs that may touch now; what is kept only saves time."""
        kept = self._followed
        if kept is not None and kept.source is history:
            moved = nodes[self._skin] - kept.searched[self._skin]
            if np.einsum("ni,ni->n", moved, moved).max() <= (0.5 * self.margin) ** 2:
                return kept
        found = self._search.find(nodes, self.margin)
        merged = self._merge(found, nodes, before, history)
        own = self._search.stencil(merged.point)
        self._followed = _Followed(history, merged, own, nodes)
        return self._followed

    def _continue(self, history: ContactHistory, successor: ContactHistory) -> None:
        """Go on with the pairs of one search under the history that follows."""
        if self._followed is not None and self._followed.history is history:
            self._followed = replace(self._followed, source=successor, history=successor)

    def _merge(
        self, found: Candidates, nodes: np.ndarray, before: np.ndarray, history: ContactHistory
    ) -> ContactHistory:
        """Return the history of the pairs found and of those that touch; new ones remember where they were."""
        position = self._search.positions(found.point, before)
        projection = project(self.surfaces, before, found.surface, position, found.guess)
        gap = self._gap(found.point, found.surface, projection)
        now = self._search.positions(found.point, nodes)
        near = project(self.surfaces, nodes, found.surface, now, projection.xi)
        keep = near.found & (self._gap(found.point, found.surface, near) < self.margin)
        new = ContactHistory(
            point=found.point[keep],
            surface=found.surface[keep],
            xi=projection.xi[keep],
            gap=gap[keep],
            pressure=np.zeros(keep.sum()),
            traction=np.zeros((keep.sum(), 3)),
            multiplier=np.zeros(keep.sum()),
            anchor=projection.xi[keep],
            slip=np.zeros(keep.sum()),
            status=np.full(keep.sum(), OPEN),
            dissipated=history.dissipated,
        )
        known = _same_pair(new, history)
        unknown = np.flatnonzero(known < 0)
        stays = np.zeros(len(history.point), dtype=bool)
        stays[known[known >= 0]] = True
        stays |= history.pressure > 0
        return _joined(_taken(history, np.flatnonzero(stays)), _taken(new, unknown))

    def _project(
        self, history: ContactHistory, position: np.ndarray, nodes: np.ndarray
    ) -> tuple[Projection, np.ndarray]:
        projection = project(self.surfaces, nodes, history.surface, position, history.xi)
        return projection, self._gap(history.point, history.surface, projection)

    def _gap(self, point: np.ndarray, surface: np.ndarray, projection: Projection) -> np.ndarray:
        offset = self.surfaces.offset
        gap = projection.distance + offset[surface] + offset[self.quadrature.surface[point]]
        return np.where(projection.found, gap, np.inf)

    # ---- energies -------------------------------------------------------------------------------------------

    def _energy(self, points: ContactPoints, active: np.ndarray, weight: np.ndarray) -> dict[str, float]:
        pressed = 0.5 * points.pressure[active] * np.abs(points.gap[active])
        sheared = 0.5 * np.einsum("ki,ki->k", points.traction[active], points.traction[active])
        stored = float(weight @ (pressed + sheared / self.law.tangential))
        return {"penalty": stored, "friction": float(points.history.dissipated) + self._dissipation(points)}

    def _dissipation(self, points: ContactPoints) -> float:
        """Return the work of friction within the increment, mu p |slip| with the mean pressure of it [J]."""
        if not np.isfinite(self.law.friction):
            return 0.0
        length = self.law.slipped(points.trial, points.pressure)
        mean = 0.5 * (points.pressure + points.history.pressure)
        weight = PASS_SHARE * self.quadrature.area[points.history.point]
        return float(np.sum(weight * self.law.friction * mean * length))

    # ---- stiffness ------------------------------------------------------------------------------------------

    def _stencils(self, points: ContactPoints, active: np.ndarray) -> tuple[Stencil, Stencil]:
        own = self._search.stencil(points.history.point[active])
        other = points.projection.stencil
        return own, Stencil(
            other.nodes[active], other.value[active], other.first[active], other.second[active]
        )

    def _stiffness(
        self, points: ContactPoints, active: np.ndarray, weight: np.ndarray, own: Stencil, other: Stencil
    ) -> tuple[sp.bsr_matrix, sp.bsr_matrix]:
        """Return the tangent and its symmetric positive part as sparse matrices over all nodes."""
        inner, positive = self._point_tangents(points, active)
        inner *= weight[:, None, None]
        positive *= weight[:, None, None]
        nodes = np.concatenate([own.nodes, other.nodes], axis=1)  # (a, 32)
        rows = np.zeros((len(active), 3, 32))  # V
        rows[:, 0, :16], rows[:, 0, 16:] = own.value, -other.value
        rows[:, 1:, 16:] = other.first
        # Points of one cell that face one cell share their 32 nodes: summed before they are scattered.
        _, order, start = _groups(nodes[:, [5, 10, 21, 26]])
        shared = nodes[order[start]]
        full, symmetric = (np.zeros((len(start), 32 * 32, 9)) for _ in range(2))
        bounds = np.append(start, len(order))
        first = 0
        while first < len(start):
            last = max(first + 1, int(np.searchsorted(bounds, bounds[first] + CHUNK, side="right")) - 1)
            here = order[bounds[first] : bounds[last]]
            begin = bounds[first:last] - bounds[first]
            v = rows[here]
            left = np.swapaxes(v, 1, 2) @ inner[here].reshape(-1, 3, 27)  # (k, 32, (i, m, j))
            left = left.reshape(-1, 32, 3, 3, 3).transpose(0, 1, 2, 4, 3).reshape(-1, 32 * 9, 3)
            blocks = (left @ v).reshape(-1, 32, 9, 32).transpose(0, 1, 3, 2).reshape(-1, 1024, 9)
            full[first:last] = np.add.reduceat(blocks, begin, axis=0)
            pair = (v[:, 0, :, None] * v[:, 0, None, :]).reshape(-1, 1024, 1)
            symmetric[first:last] = np.add.reduceat(pair * positive[here].reshape(-1, 1, 9), begin, axis=0)
            first = last
        return _scatter(shared, full, symmetric, len(self.nodes))

    def _point_tangents(self, points: ContactPoints, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return B (a, 9, 9) of R's derivative V^T B V, and the symmetric stiffness (a, 3, 3), without weights."""
        law, projection = self.law, _active(points.projection, active)
        kinematics = Kinematics.of(projection)
        pressure, status = points.pressure[active], points.status[active]
        normal = projection.normal
        change = law.normal * normal[:, :, None] * kinematics.gap[:, None, :]
        change -= pressure[:, None, None] * kinematics.normal
        if law.friction > 0:
            slip = points.slip_share[active, None, None] * kinematics.xi
            slip += points.slip_rate[active][:, :, None] * kinematics.gap[:, None, :]
            trial = np.einsum("kai,kaz->kiz", projection.tangent, slip)
            trial += np.einsum("ka,kaiz->kiz", points.slip[active], kinematics.tangent)
            change += law.tangent(
                points.trial[active], law.tangential * trial, kinematics.gap, pressure, status
            )
        traction = points.traction[active] - pressure[:, None] * normal
        inner = np.empty((len(active), 9, 9))
        inner[:, :3] = change
        for a in range(2):
            inner[:, 3 + 3 * a : 6 + 3 * a] = -traction[:, :, None] * kinematics.xi[:, a, None, :]
        return inner, law.symmetric_stiffness(points.trial[active], normal, pressure, status)


def _active(projection: Projection, active: np.ndarray) -> Projection:
    return Projection(
        xi=projection.xi[active],
        found=projection.found[active],
        stencil=projection.stencil,
        tangent=projection.tangent[active],
        curvature=projection.curvature[active],
        normal=projection.normal[active],
        distance=projection.distance[active],
    )


def _taken(history: ContactHistory, chosen: np.ndarray) -> ContactHistory:
    """Return the history of some pairs."""
    arrays = {name: value[chosen] for name, value in vars(history).items() if name != "dissipated"}
    return ContactHistory(**arrays, dissipated=history.dissipated)


def _joined(one: ContactHistory, other: ContactHistory) -> ContactHistory:
    """Return the history of the pairs of both."""
    arrays = {
        name: np.concatenate([value, getattr(other, name)])
        for name, value in vars(one).items()
        if name != "dissipated"
    }
    return ContactHistory(**arrays, dissipated=one.dissipated)


def _same_pair(new: ContactHistory, old: ContactHistory) -> np.ndarray:
    """Return for every new pair the same pair of an older history, or -1: the same point on the same piece."""
    if not len(old.point) or not len(new.point):
        return np.full(len(new.point), -1)
    count = 1 + max(new.surface.max(), old.surface.max())
    # Pairs of different points or surfaces lie farther apart in this plane than any two places of one surface.
    keys = [
        np.stack([1e6 * (history.point * count + history.surface), history.xi[:, 0]], axis=1)
        for history in (new, old)
    ]
    distance, index = cKDTree(keys[1]).query(keys[0], distance_upper_bound=SAME_PIECE)
    return np.where(np.isfinite(distance), index, -1)


def _groups(keys: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the group (k,) of equal rows, an order (k,) by group, and where each group starts in it."""
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.ravel()
    order = np.argsort(group, kind="stable")
    start = np.flatnonzero(np.diff(group[order], prepend=-1))
    return group, order, start


def _scatter(
    nodes: np.ndarray, full: np.ndarray, symmetric: np.ndarray, count: int
) -> tuple[sp.bsr_matrix, sp.bsr_matrix]:
    """Sum blocks (e, 1024, 9) of elements with nodes (e, 32) into two matrices over `count` nodes, of one pattern."""
    shape = (3 * count, 3 * count)
    row = np.repeat(nodes, 32, axis=1).ravel().astype(np.int64)
    column = np.tile(nodes, (1, 32)).ravel()
    key = row * count + column
    order = np.argsort(key, kind="stable")
    start = np.flatnonzero(np.diff(key[order], prepend=-1))
    unique = key[order[start]]
    indptr = np.searchsorted(unique, count * np.arange(count + 1, dtype=np.int64)).astype(np.int32)
    indices = (unique % count).astype(np.int32)
    matrices = []
    for blocks in (full, symmetric):
        if len(start):
            data = np.add.reduceat(blocks.reshape(-1, 9)[order], start, axis=0).reshape(-1, 3, 3)
        else:
            data = np.zeros((0, 3, 3))
        matrices.append(sp.bsr_matrix((data, indices, indptr), shape=shape))
    return matrices[0], matrices[1]
