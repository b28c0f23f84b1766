"""Contact with friction of yarns that are beams: `line_contact` between points that stations carry along.

Stations lie on rigid arms of nodes: nodes of ties carry two of them. Pressure within the disc of a tie is carried by
the tie. Forces are reported by crossings; a pair of points counts to the nearest crossing of its yarns.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.beams.beam import BeamContactHistory, BeamState, LineHistory
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.line_contact import SOFT, LineContact
from knitstudy.mechanics.beams.line_friction import ActivePairs
from knitstudy.mechanics.beams.pair_search import PointPairs
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.model import Response
from knitstudy.mechanics.core.rotation import hat

NO_LATTICE = np.zeros((2, 3))
NO_MOVES = np.zeros((2, 3, 3))


class BeamContact:
    """Contact of yarns of one radius."""

    def __init__(
        self,
        line: LineContact,
        points: ContactPoints,
        node: Ints,  # (S,), node that carries a station
        offset: Floats,  # (S, 3), rigid arm from that node to the station, in the reference [m]
        yarn: Ints,  # (K, 2), of crossings
        arc_length: Floats,  # (K, 2) [m]
    ) -> None:
        self.line, self.points, self.node, self.offset = line, points, node, offset
        self.yarn, self._points_follow = yarn, points.spread(NO_MOVES)
        self._active = lru_cache(maxsize=1)(self._find_active)  # the tangent needs what forces have needed
        self._apart = 2 * points.arc_length.max()  # farther than points of one yarn are [m]
        places = self._place(yarn, arc_length)
        self._turned = np.append(places[:, 0] > places[:, 1], False)
        self._tree = cKDTree(np.sort(places, axis=1))

    def places(self, state: BeamState) -> BeamState:
        """Return position (S, 3) and rotation (S, 3, 3) of the stations, from positions and rotations of the nodes."""
        rotation = state.rotation[self.node]
        arm = np.einsum("sij,sj->si", rotation, self.offset)
        return replace(state, position=state.position[self.node] + arm, rotation=rotation)

    def at_points(self, state: BeamState) -> BeamState:
        """Return position (p, 3) and rotation (p, 3, 3) of the points of contact."""
        return self.points.at(self.places(state), NO_LATTICE)

    def start(self, state: BeamState) -> BeamContactHistory:
        """Return the history of yarns that have not moved yet."""
        points = self.at_points(state)
        count = len(self.yarn)
        return BeamContactHistory(
            points=self.line.commit(points, NO_LATTICE, LineHistory.none()),
            on_stations=np.zeros((len(self.node), 3)),
            force=np.zeros((count, 3)),
            gap=self._gaps(points)[2],
            slip=np.zeros(count),
        )

    def respond(
        self, state: BeamState, stiffness: bool = False
    ) -> tuple[Floats, dict[str, float], sp.bsr_matrix | None]:
        """Return internal forces (S, 6) on the stations, energies and, if asked, the tangent (6 S + 3, 6 S + 3)."""
        points, active = self._active(state)
        force, energy, tangent = self.line.respond(
            points, NO_LATTICE, state.contact_history.points, stiffness, active, self._points_follow
        )
        return self._on_stations(force), energy, tangent

    def _find_active(self, state: BeamState) -> tuple[BeamState, ActivePairs]:
        """Return the points of contact, and what touches."""
        points = self.at_points(state)
        return points, self.line.active_pairs(points, NO_LATTICE, state.contact_history.points)

    def motion(self, state: BeamState, other: BeamState) -> float:
        """Return the largest change of the ways between points that are near each other in a state [m]."""
        before = self.at_points(state)
        near = self._near(before)
        way = self.at_points(other).position - before.position
        return float(np.linalg.norm(way[near.j] - way[near.i], axis=1).max(initial=0.0))

    def _near(self, points: BeamState) -> PointPairs:
        """Return the pairs of points that are near each other."""
        return self.line.pairs(points.position, NO_LATTICE, near=True)

    def _on_stations(self, force: Floats) -> Floats:
        """Return forces and moments (S, 6) of those on points and lattice vectors (6 p + 6,)."""
        return self._points_follow.forces(force)[:-3].reshape(-1, 6)

    def added(self, response: Response, state: BeamState) -> Response:
        """Return the response of beams and of their contact, with a tangent if that of the beams has one."""
        stiffness = response.stiffness
        at_stations, energy, own = self.respond(state, stiffness is not None)
        arm = self.places(state).position - state.position[self.node]
        force = response.force.reshape(-1, 6).copy()
        total = at_stations.copy()
        total[:, 3:] += np.cross(arm, at_stations[:, :3])  # about the nodes
        np.add.at(force, self.node, total)
        # The patch of Hertz and Mindlin is real.
        energy["numerical"] = energy["penalty"] if self.line.repulsion.law.penalty else 0.0
        if stiffness is not None:
            stiffness = stiffness + self._about_nodes(own, at_stations, arm, len(force))
        return replace(
            response,
            force=force.ravel(),
            energy=response.energy | energy,
            status=SOFT,
            stiffness=stiffness,
        )

    def _about_nodes(self, tangent: sp.bsr_matrix, force: Floats, arm: Floats, count: int) -> sp.bsr_matrix:
        """Return a tangent over stations, on which forces (S, 6) act, over the motion of nodes that carry them."""
        lever = hat(arm)
        rows = np.arange(2 * len(arm) + 1)
        motion = np.tile(np.eye(6), (len(arm), 1, 1))
        motion[:, :3, 3:] = -lever
        # The lattice does not follow any node.
        blocks = motion.reshape(-1, 3, 6), np.repeat(self.node, 2), np.append(rows, rows[-1])
        motion = sp.bsr_matrix(blocks, shape=(tangent.shape[0], 6 * count))
        # An arm turns under the force at its end: d(r x F) = F^ r^ w.
        turning = np.zeros((count, 6, 6))
        nodes = np.arange(count + 1)
        np.add.at(turning[:, 3:, 3:], self.node, hat(force[:, :3]) @ lever)
        total = motion.T @ tangent @ motion
        total.sort_indices()  # so that sums are sorted as well: factors need that
        return total + sp.bsr_matrix((turning, nodes[:-1], nodes))

    def _crossings(self, pairs: PointPairs) -> tuple[Ints, Bools]:
        """Return the crossings (k,) that are nearest to pairs along their yarns, and whether i is on the first yarn.

        Pairs of yarns that have no crossing are at crossing K.
        """
        at = self._place(self.points.yarn, self.points.arc_length)[pairs.both]
        _, near = self._tree.query(np.sort(at, axis=1), distance_upper_bound=self._apart)
        return near, (at[:, 0] < at[:, 1]) != self._turned[near]

    def _place(self, yarn: Ints, arc_length: Floats) -> Floats:
        """Return places on one axis, yarn after yarn."""
        return 4 * self._apart * yarn + arc_length

    def _gaps(self, points: BeamState) -> tuple[Ints, PointPairs, Floats]:
        """Return crossings (m,) where yarns are near each other, their nearest points, and all gaps (K + 1,)."""
        near = self._near(points)
        gap = np.full(len(self.yarn) + 1, np.nan)
        # Pairs are in the order of their points: of a point with all points of a yarn, the nearest one counts.
        yarn = self.points.yarn[near.j]
        distance = near.distance
        first = np.flatnonzero(np.diff(near.i, prepend=-1) | np.diff(yarn, prepend=-1))
        if len(first):
            least = np.repeat(np.minimum.reduceat(distance, first), np.diff(first, append=len(yarn)))
            near = near[np.flatnonzero(distance == least)]
        at = self._crossings(near)[0]
        order = np.lexsort((near.distance, at))
        at, nearest = np.unique(at[order], return_index=True)
        near = near[order[nearest]]
        gap[at] = self.line.gaps(near, points, NO_LATTICE)
        return at, near, gap

    def commit(self, state: BeamState) -> BeamContactHistory:
        """Return the history that a converged increment leaves.

        Raises ConvergenceError if yarns that pressed each other touch at the end of one of them.
        """
        past = state.contact_history
        points = self.at_points(state)
        count = len(self.yarn)
        active = self.line.active_pairs(points, NO_LATTICE, past.points, slip=True)
        loads = self.line.loads(points, NO_LATTICE, active)
        pairs, friction, on_j = active.pairs, active.friction, loads.on_j
        at, first = self._crossings(pairs)
        force = np.zeros((count + 1, 3))
        np.add.at(force, at, np.where(first, 1.0, -1.0)[:, None] * on_j)
        weight = np.linalg.norm(on_j[friction.pair], axis=1)
        slid, pressed = np.zeros((2, count + 1))
        np.add.at(pressed, at[friction.pair], weight)
        np.add.at(slid, at[friction.pair], weight * friction.slid)
        slip = np.divide(slid, pressed, out=np.zeros_like(slid), where=pressed > 0)[:-1]
        at, near, gap = self._gaps(points)
        pressed_before = np.append(past.force.any(axis=1), False)[at]
        ends = pressed_before & np.isin(near.both, self.points.ends).any(axis=1)
        if ends.any():
            one, other = self.yarn[at[int(np.argmax(ends))]]
            raise ConvergenceError(
                f"the contact of yarns {one} and {other} has slid to the end of a yarn, which is pulled out of its "
                "loop; use a smaller load"
            )
        return BeamContactHistory(
            points=self.line.commit(points, NO_LATTICE, past.points, active),
            on_stations=self._on_stations(self.line.forces(loads, len(points.position)))[:, :3],
            force=force[:-1],
            gap=gap,
            slip=np.where(pressed[:-1] > 0, past.slip + slip, 0.0),
        )
