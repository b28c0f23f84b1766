"""Contact of smooth surfaces in two passes: Gauss points of each surface against the other, so that none is master.

In one pass the points of one surface of a pair, the slave, carry all of the contact.

The points' history holds the memory of friction: where a point last stuck on the other surface, in convected
coordinates, so that a rotation of both changes nothing. It is updated when an increment has converged. Sources:
Wriggers, Computational Contact Mechanics (2006), chapters 5 and 6; Laursen, Computational Contact and Impact Mechanics
(2002), chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from knitstudy.errors import ConfigurationError, ConvergenceError, MeshError
from knitstudy.mechanics.contact.candidate_pairs import CandidatePairs
from knitstudy.mechanics.contact.cylinders import Cylinders
from knitstudy.mechanics.contact.friction import (
    OPEN,
    SLIP,
    ContactHistory,
    Coulomb,
    FrictionPoints,
    TouchedPoints,
)
from knitstudy.mechanics.contact.indentation import Indentation
from knitstudy.mechanics.contact.search import Search
from knitstudy.mechanics.contact.surface import CHUNK, Projection, Surfaces
from knitstudy.mechanics.contact.tangent import CellPairs, Quadrature
from knitstudy.mechanics.contact.tangent import stiffness as tangent
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.batches import Reserve, by_parts, share

# Gaps over the margin of pairs that are pulled together: by so much more than the smallest at rest, and at most
NEARLY, AT_MOST = 0.01, 0.1
PASS_SHARE = 0.5  # each of the two surfaces' points carries half of the contact stiffness


@dataclass(frozen=True, eq=False)
class ContactResponse:
    """Forces of contact in one configuration."""

    points: FrictionPoints
    node_force: Floats  # (N, 3), internal force at all nodes [N]
    # "penalty": stored in penetration and elastic slip; "friction": dissipated since the start; "numerical": the part
    # of the penalty that stands for no deformation of the bodies [J]
    energy: dict[str, float]
    stiffness: sp.bsr_matrix | None = None  # (3 N, 3 N)
    symmetric: sp.bsr_matrix | None = None  # (3 N, 3 N), its symmetric positive part, of the same pattern


class Contact:
    """Contact between the surfaces of one model.

    Raises MeshError if undeformed surfaces overlap by more than is allowed, ConfigurationError for a law of indentation
    on surfaces of other elements than spline yarns.
    """

    def __init__(
        self,
        nodes: Floats,  # (N, 3), undeformed [m]
        surfaces: Surfaces,
        law: Coulomb | Indentation,
        *,
        # (G, G), whose points (rows) may touch which surfaces (columns); by default all, themselves included
        meets: Bools | None = None,
        # which (k,) of undeformed places (k, 3) [m] on the surfaces may touch; by default all
        free: Callable[[np.ndarray], np.ndarray] | None = None,
        points: int = 3,  # Gauss points along each side of a cell
        splits: bool = True,  # whether tangents come with their symmetric part, which iterative solvers take
        # whether the points of one surface of a pair carry all: `meets` then says of which (slave, master)
        one_pass: bool = False,
        margin: float,  # distance up to which pairs are followed [m]
        overlap: float,  # largest penetration of the undeformed surfaces [m]
    ) -> None:
        if isinstance(law, Indentation) and not isinstance(surfaces, Cylinders):
            raise ConfigurationError(
                "the law of indentation adds the part of an indentation that spline yarns cannot resolve; these "
                "surfaces belong to other elements, which resolve all of it: use Coulomb"
            )
        self.surfaces, self.law, self.margin, self.splits = surfaces, law, margin, splits
        self._undeformed = surfaces.carry(nodes)
        self.quadrature = Quadrature.on(surfaces, self._undeformed, points)
        if one_pass:  # a point stands for the area of both surfaces
            self.quadrature = replace(self.quadrature, area=self.quadrature.area / PASS_SHARE)
        if meets is None:
            meets = np.ones((len(surfaces.cells), len(surfaces.cells)), dtype=bool)
        self._search = Search(surfaces, self.quadrature, self._undeformed, meets, free)
        self.reserve = Reserve()  # of tangents
        self._candidates = CandidatePairs(self._search, margin, law.directional, self.reserve)
        self._pairs: CellPairs | None = None
        deepest = -self.smallest_gap(self.points(nodes, nodes, ContactHistory.empty()))
        self._pull = min(max(-deepest, 0.0) + NEARLY * margin, AT_MOST * margin)
        if deepest > overlap:
            raise MeshError(
                f"surfaces overlap by {deepest:.3g} before anything moves; allowed is {overlap:.3g}. Move them "
                "apart, or use a finer mesh"
            )

    def points(
        self,
        nodes: Floats,  # (N, 3), where the nodes are [m]
        before: Floats,  # (N, 3), where they were at the last converged increment [m]
        history: ContactHistory,  # of that increment
        pulled: bool = False,
    ) -> FrictionPoints:
        """Evaluate all pairs that can touch; pressures and slips of those alone that touch or touched.

        Those are left out whose surfaces have moved too little since their gap was last known to close it. Of surfaces
        that are `pulled` together, all pairs touch that are nearly as near as the nearest ones were at rest, and
        pressures are negative where they are open.
        """
        reach = self._pull if pulled else 0.0
        carriers, before = self.surfaces.carry(nodes), self.surfaces.carry(before)
        evaluated, least = self._candidates.may_touch(carriers, before, history, reach)
        every = self._candidates.history

        def touching(part: slice) -> tuple[np.ndarray | Projection, ...]:
            number = evaluated[part]
            pairs = every.point[number], every.surface[number], every.xi[number]
            position = self._search.positions(pairs[0], carriers)
            projection, gap = self._search.closest(*pairs, position, carriers)
            touched = (every.pressure[number] > 0) | (every.multiplier[number] != 0)
            near = np.flatnonzero((gap < reach) | touched)
            return projection.xi, gap, number[near], position[near], projection[near], gap[near]

        xi, gaps, number, position, projection, gap = by_parts(touching, len(evaluated), CHUNK)
        least[evaluated] = np.where(np.isfinite(gaps), gaps, -np.inf)  # no place found: nothing is known
        self._candidates.set_bounds(carriers, least)
        history, angle = self._candidates.last_converged(number)
        local = self.law.at(gap - reach, angle)
        slip, rate, share = self._slip(history, projection.xi, gap, local, angle)
        trial = np.einsum("ka,kai->ki", slip, projection.tangent)
        trial *= np.reshape(local.tangential, (-1, 1))
        pressure = self.law.pressure(gap - reach, history.multiplier, angle)
        traction, status = local.traction(trial, pressure)
        if pulled:
            pressure = np.where(status == OPEN, 0.0, -local.normal * gap)
        return FrictionPoints(
            followed=every,
            least=least,
            carriers=carriers,
            evaluated=evaluated,
            evaluated_xi=xi,
            evaluated_gap=gaps,
            number=number,
            history=history,
            position=position,
            projection=projection,
            gap=gap,
            slip=slip,
            slip_rate=rate,
            slip_share=share,
            trial=trial,
            pressure=pressure,
            traction=traction,
            status=status,
            law=local,
            angle=angle,
        )

    def _slip(
        self, history: ContactHistory, xi: Floats, gap: Floats, local: Coulomb, angle: Floats | None
    ) -> tuple[Floats, Floats, Floats]:
        """Return s (k, 2), ds/dg (k, 2) and ds/dxi (k,) of pairs with closest places (k, 2) and gaps (k,) [m]."""
        # A point that has closed within this increment has slid in contact only for the rest of it.
        fresh = history.pressure <= 0
        closes = fresh & (gap < 0) & np.isfinite(history.gap) & (history.gap > 0)
        ends = np.where(closes, gap, 0.0), np.where(closes, history.gap, 0.0)
        span = np.where(closes, ends[0] - ends[1], 1.0)
        share = np.where(closes, ends[0] / span, 1.0)
        moved = xi - np.where(fresh[:, None], history.xi, history.anchor)
        rate = (-ends[1] / span**2)[:, None] * moved
        slip = share[:, None] * moved
        if self.law.directional:
            # New stiffness carries nothing at first; lost stiffness takes its share of the traction along.
            carried = np.where(fresh[:, None], 0.0, history.xi - history.anchor)
            kept = np.minimum(self.law.at(history.gap, angle).tangential / local.tangential, 1.0)
            slip -= (1 - kept)[:, None] * carried
            step = share[:, None] * (xi - history.xi) + (kept == 1)[:, None] * carried
            rate += np.reshape(local.slope / local.tangential, (-1, 1)) * step
        return slip, rate, share

    def forces(self, points: FrictionPoints, stiffness: bool) -> ContactResponse:
        """Return the forces of pairs that `points` has evaluated and, if asked, the tangent."""
        active = points.active
        weight = PASS_SHARE * self.quadrature.area[points.history.point[active]]
        own = self._search.stencil(points.history.point[active])
        other = self.surfaces.stencil(points.history.surface[active], points.projection.xi[active])
        force = points.traction[active] - points.pressure[active, None] * points.projection.normal[active]
        force *= weight[:, None]
        carried = np.zeros_like(self._undeformed)
        for stencil, sign in ((own, 1.0), (other, -1.0)):
            shares = sign * stencil.value[:, :, None] * force[:, None, :]
            for i in range(3):
                carried[:, i] += np.bincount(
                    stencil.nodes.ravel(), shares[..., i].ravel(), minlength=len(carried)
                )
        tangents: list[sp.bsr_matrix] = []
        if stiffness:
            width = self.surfaces.block
            kept = self._pairs
            wanted = 1 + self.splits
            blocks, self._pairs = tangent(
                points, weight, own, other, width, len(carried), kept, self.reserve, wanted
            )
            pattern = self._pairs.indptr, self._pairs.indices
            tangents = share(lambda number: self.surfaces.matrix(*pattern, blocks[number]), wanted)
        energy = self._energy(points, active, weight)
        return ContactResponse(points, self.surfaces.collect(carried), energy, *tangents)

    def commit(self, points: FrictionPoints) -> ContactHistory:
        """Return the history that a converged increment leaves.

        Raises ConvergenceError if a point that touched has slid over the edge of the surface that it faced.
        """
        history, law, every = points.history, points.law, points.followed
        lost = (history.pressure > 0) & ~points.projection.found
        if lost.any():
            k = np.flatnonzero(lost)[0]
            raise ConvergenceError(
                f"contact slides over the end of a surface (surface {history.surface[k]}, place "
                f"{history.xi[k, 0]:.1f} of {self.surfaces.edges(history.surface[k])[0][-1]:.1f}): "
                "a body is pulled off the other; use a smaller load, or longer yarns or bodies"
            )
        touches = points.active
        slips = points.status == SLIP
        slip = points.slip.copy()
        slip[slips] *= law.share(points.trial[slips], points.pressure[slips])[:, None]
        length = law.slipped(points.trial, points.pressure)
        touched = TouchedPoints(
            pressure=points.pressure[touches],
            traction=points.traction[touches],
            # A multiplier stays with its point while contact moves on: kept, it would press across an open gap.
            multiplier=np.zeros(len(touches)),
            anchor=points.projection.xi[touches] - slip[touches],
            slip=history.slip[touches] + length[touches],
            status=points.status[touches],
        )
        count = len(every.point)
        committed = ContactHistory(
            point=every.point,
            surface=every.surface,
            xi=_put(every.xi, points.evaluated, points.evaluated_xi),
            gap=_put(np.broadcast_to(-np.inf, count), points.evaluated, points.evaluated_gap),
            row=_rows(points.number[touches], count),
            touched=touched,
            dissipated=np.asarray(history.dissipated + self._dissipation(points)),
        )
        return self._candidates.replace_history(every, committed, points.carriers)

    def augment(self, points: FrictionPoints) -> ContactHistory:
        """Return the history with multipliers (Uzawa) that carry the present pressure without penetration."""
        history, every, number = points.history, points.followed, points.number
        touches = points.status != OPEN
        fresh = touches & (history.pressure <= 0)
        anchor = np.where(fresh[:, None], points.projection.xi - points.slip, history.anchor)
        touched = TouchedPoints(
            # Positive from now on, so that the anchor stays where the point touched first.
            pressure=np.where(fresh, np.finfo(float).tiny, history.pressure),
            traction=history.traction,
            multiplier=-points.pressure,
            anchor=anchor,
            slip=history.slip,
            status=history.status,
        )
        row = _rows(number, len(every.row))
        return self._candidates.replace_history(every, replace(every, row=row, touched=touched))

    def motion(self, nodes: Floats, moved: Floats) -> float:
        """Return the largest motion [m] against each other of rings near each other, as nodes (N, 3) move [m]."""
        before, after = (self.surfaces.centres(self.surfaces.carry(place)) for place in (nodes, moved))
        near = cKDTree(before).query_pairs(2 * self._search.reach + self.margin, output_type="ndarray")
        way = (after - before)[near]
        return float(np.linalg.norm(way[:, 1] - way[:, 0], axis=1).max(initial=0.0))

    def reference(self, point: Ints) -> Floats:
        """Return the undeformed positions (k, 3) of Gauss points (k,) [m]."""
        return self._search.positions(point, self._undeformed)

    def smallest_gap(self, points: FrictionPoints) -> float:
        """Return the smallest gap of all pairs that are followed [m]; inf if there are none."""
        nearest = float(points.evaluated_gap.min(initial=np.inf))
        rest = points.followed[points.least < nearest]
        position = self._search.positions(rest.point, points.carriers)
        _, gap = self._search.closest(rest.point, rest.surface, rest.xi, position, points.carriers)
        return min(nearest, float(gap.min(initial=np.inf)))

    def _energy(self, points: FrictionPoints, active: Ints, weight: Floats) -> dict[str, float]:
        angle = None if points.angle is None else points.angle[active]
        pressed = self.law.stored(points.gap[active], points.pressure[active], angle)
        sheared = 0.5 * np.einsum("ki,ki->k", points.traction[active], points.traction[active])
        stored = float(weight @ (pressed + sheared / points.law[active].tangential))
        lost = float(points.history.dissipated) + self._dissipation(points)
        return {"penalty": stored, "friction": lost, "numerical": stored if self.law.numerical else 0.0}

    def _dissipation(self, points: FrictionPoints) -> float:
        """Return the work of friction within the increment, mu p |slip| with the mean pressure of it [J]."""
        lost = 0.0 if points.angle is None else self._hysteresis(points, points.angle)
        if not np.isfinite(self.law.friction):
            return lost
        active = points.active
        weight = PASS_SHARE * self.quadrature.area[points.history.point[active]]
        pressure = points.pressure[active]
        length = points.law[active].slipped(points.trial[active], pressure)
        mean = 0.5 * (pressure + points.history.pressure[active])
        return lost + float(np.sum(weight * self.law.friction * mean * length))

    def _hysteresis(self, points: FrictionPoints, angle: Floats) -> float:
        """Return the loss of energy at sticking points as their stiffness changes with the gap [J].

        New stiffness carries nothing, and lost stiffness takes its share along: neither does work.
        """
        touched = np.flatnonzero(points.history.pressure > 0)
        history = points.history[touched]
        now = points.law[touched].tangential
        before = self.law.at(history.gap, angle[touched]).tangential
        share = np.minimum(before / now, now / before)
        carried = np.einsum("ki,ki->k", history.traction, history.traction) / before
        weight = PASS_SHARE * self.quadrature.area[history.point]
        return 0.5 * float(weight @ ((1 - share) * carried))


def _rows(number: Ints, count: int) -> np.ndarray:
    """Return the row of a table for each of `count` pairs, -1 for none; `number` (k,) is the pair of each row."""
    row = np.full(count, -1, dtype=np.int32)
    row[number] = np.arange(len(number))
    return row


def _put(values: Floats, number: Ints, some: Floats) -> Floats:
    """Return a copy of values (c, ...) with the entries number (k,) replaced by some (k, ...)."""
    values = values.copy()
    values[number] = some
    return values
