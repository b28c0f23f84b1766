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

from knitstudy.errors import ConvergenceError, MeshError
from knitstudy.mechanics.contact.friction import OPEN, SLIP, Coulomb
from knitstudy.mechanics.contact.history import ContactHistory, joined, same_pair, taken
from knitstudy.mechanics.contact.indentation import Indentation
from knitstudy.mechanics.contact.passes import PASS_SHARE
from knitstudy.mechanics.contact.points import ContactPoints
from knitstudy.mechanics.contact.projection import Projection, project
from knitstudy.mechanics.contact.quadrature import CHUNK, Quadrature
from knitstudy.mechanics.contact.search import Candidates, Search
from knitstudy.mechanics.contact.surface import Stencil, Surfaces
from knitstudy.mechanics.contact.tangent import CellPairs
from knitstudy.mechanics.contact.tangent import stiffness as tangent


@dataclass(frozen=True, eq=False)
class _Followed:
    """Pairs of one search: the history asked about, that history over all pairs, where all carriers were then, angles
    of the pairs, and the least gaps that these had where carriers were seen last.
    """

    source: ContactHistory
    history: ContactHistory
    searched: np.ndarray
    angle: np.ndarray | None
    least: np.ndarray
    seen: np.ndarray


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
    surfaces : Surfaces
    law : Coulomb or Indentation
    meets : ndarray of bool, shape (G, G), optional
        Which surfaces may touch each other; by default all, themselves included.
    pieces : ndarray of int, shape (R,), optional
        A number for every ring, surface by surface: those with the same one, unless it is negative, do not touch
        each other.
    points : int
        Gauss points along each side of a cell.
    margin : float
        Distance up to which pairs are followed [m]; the search is repeated when others could touch.
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
        surfaces: Surfaces,
        law: Coulomb | Indentation,
        *,
        meets: np.ndarray | None = None,
        pieces: np.ndarray | None = None,
        points: int = 3,
        margin: float,
        overlap: float,
    ) -> None:
        self.surfaces, self.law, self.margin = surfaces, law, margin
        self._undeformed = surfaces.carry(nodes)
        self.quadrature = Quadrature.on(surfaces, self._undeformed, points)
        if meets is None:
            meets = np.ones((len(surfaces.cells), len(surfaces.cells)), dtype=bool)
        self._search = Search(surfaces, self.quadrature, self._undeformed, meets, pieces)
        self._followed: _Followed | None = None
        self._pairs: CellPairs | None = None
        deepest = -self.smallest_gap(self.points(nodes, nodes, ContactHistory.empty()))
        if deepest > overlap:
            raise MeshError(
                f"surfaces overlap by {deepest:.3g} m before anything moves; allowed is {overlap:.3g} m. "
                "Use a larger pattern.clearance or pair.clearance, or a finer mesh.size"
            )

    def points(self, nodes: np.ndarray, before: np.ndarray, history: ContactHistory) -> ContactPoints:
        """Evaluate all pairs that can touch.

        Those are left out whose surfaces have moved too little since their gap was last known to close it.

        Parameters
        ----------
        nodes : ndarray, shape (N, 3)
            Where the nodes are [m].
        before : ndarray, shape (N, 3)
            Where they were at the last converged increment [m].
        history : ContactHistory
            Of that increment.
        """
        carriers = self.surfaces.carry(nodes)
        followed = self._follow(carriers, self.surfaces.carry(before), history)
        every = followed.history
        least = self.surfaces.motion(carriers, followed.seen).least(followed.least)
        left_out = (least > 0) & (every.pressure <= 0) & (every.multiplier == 0)
        number = np.flatnonzero(~left_out)
        apart = float(least[left_out].min(initial=np.inf))
        history = taken(every, number)
        angle = None if followed.angle is None else followed.angle[number]
        position = self._search.positions(history.point, carriers)
        projection, gap = self._project(history, position, carriers)
        least[number] = _known(gap)
        self._followed = replace(followed, least=least, seen=carriers)
        law = self.law
        # A point that has closed within this increment has slid in contact only for the rest of it.
        fresh = history.pressure <= 0
        closes = fresh & (gap < 0) & np.isfinite(history.gap) & (history.gap > 0)
        ends = np.where(closes, gap, 0.0), np.where(closes, history.gap, 0.0)
        span = np.where(closes, ends[0] - ends[1], 1.0)
        share = np.where(closes, ends[0] / span, 1.0)
        moved = projection.xi - np.where(fresh[:, None], history.xi, history.anchor)
        rate = (-ends[1] / span**2)[:, None] * moved
        slip = share[:, None] * moved
        local = law.at(gap, angle)
        if law.directional:
            # Stiffness that is gained carries nothing at first; what is lost takes its share of the traction along.
            carried = np.where(fresh[:, None], 0.0, history.xi - history.anchor)
            kept = np.minimum(law.at(history.gap, angle).tangential / local.tangential, 1.0)
            slip -= (1 - kept)[:, None] * carried
            step = share[:, None] * (projection.xi - history.xi) + (kept == 1)[:, None] * carried
            rate += (local.slope / local.tangential)[:, None] * step
        trial = np.einsum("ka,kai->ki", slip, projection.tangent)
        trial *= np.reshape(local.tangential, (-1, 1))
        pressure = law.pressure(gap, history.multiplier, angle)
        traction, status = local.traction(trial, pressure)
        return ContactPoints(
            history=history,
            followed=every,
            number=number,
            apart=apart,
            carriers=carriers,
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
        carried = np.zeros_like(self._undeformed)
        for stencil, sign in ((own, 1.0), (other, -1.0)):
            shares = sign * stencil.value[:, :, None] * force[:, None, :]
            for i in range(3):
                carried[:, i] += np.bincount(
                    stencil.nodes.ravel(), shares[..., i].ravel(), minlength=len(carried)
                )
        node_force = self.surfaces.collect(carried)
        answer = ContactResponse(points, node_force, self._energy(points, active, weight))
        if not stiffness:
            return answer
        full, symmetric, self._pairs = tangent(
            points, weight, own, other, self.surfaces.block, len(carried), self._pairs
        )
        pattern = self._pairs.indptr, self._pairs.indices
        return replace(
            answer,
            stiffness=self.surfaces.matrix(*pattern, full),
            symmetric=self.surfaces.matrix(*pattern, symmetric),
        )

    def commit(self, points: ContactPoints) -> ContactHistory:
        """Return the history that a converged increment leaves.

        Raises
        ------
        ConvergenceError
            If a point that touched has slid over the edge of the surface that it faced.
        """
        history, law, every = points.history, points.law, points.followed
        lost = (history.pressure > 0) & ~points.projection.found
        if lost.any():
            k = np.flatnonzero(lost)[0]
            raise ConvergenceError(
                f"contact slides over the end of a surface (surface {history.surface[k]}, place "
                f"{history.xi[k, 0]:.1f} of {self.surfaces.edges(history.surface[k])[0][-1]:.1f}): a yarn is "
                "pulled out of its loop, or the slip is longer than the surface; use a smaller load or longer yarns"
            )
        touches = points.status != OPEN
        slips = points.status == SLIP
        size = np.linalg.norm(points.trial[slips], axis=1)
        limit = law.friction * points.pressure[slips]
        slip = points.slip.copy()
        slip[slips] *= np.divide(limit, size, out=np.zeros_like(size), where=size > 0)[:, None]
        length = law.slipped(points.trial, points.pressure)
        xi, gap = self.everywhere(points)
        anchor = xi.copy()
        anchor[points.number] -= np.where(touches[:, None], slip, 0.0)
        none = np.zeros(len(gap))
        committed = ContactHistory(
            point=every.point,
            surface=every.surface,
            xi=xi,
            gap=gap,
            pressure=_put(none, points.number, points.pressure),
            traction=_put(np.zeros((len(gap), 3)), points.number, points.traction),
            # A multiplier stays with its point while contact moves on: kept, it would press across an open gap.
            multiplier=none,
            anchor=anchor,
            slip=_put(none, points.number, np.where(touches, history.slip + length, 0.0)),
            status=_put(np.full(len(gap), OPEN), points.number, points.status),
            dissipated=np.asarray(history.dissipated + self._dissipation(points)),
        )
        self._continue(every, committed)
        if self._followed.history is committed:
            self._followed = replace(self._followed, least=_known(gap), seen=points.carriers)
        return committed

    def augment(self, points: ContactPoints) -> ContactHistory:
        """Return the history with multipliers (Uzawa) that carry the present pressure without penetration."""
        history, every, number = points.history, points.followed, points.number
        touches = points.status != OPEN
        fresh = touches & (history.pressure <= 0)
        anchor = np.where(fresh[:, None], points.projection.xi - points.slip, history.anchor)
        augmented = replace(
            every,
            multiplier=_put(every.multiplier, number, -points.pressure),
            anchor=_put(every.anchor, number, anchor),
            # Positive from now on, so that the anchor stays where the point touched first.
            pressure=_put(every.pressure, number, np.where(fresh, np.finfo(float).tiny, history.pressure)),
        )
        self._continue(every, augmented)
        return augmented

    def reference(self, point: np.ndarray) -> np.ndarray:
        """Return the undeformed positions (k, 3) of Gauss points (k,) [m]."""
        return self._search.positions(point, self._undeformed)

    def smallest_gap(self, points: ContactPoints) -> float:
        """Return the smallest gap of all pairs that are followed [m]; inf if there are none."""
        nearest = float(points.gap.min(initial=np.inf))
        return nearest if nearest <= points.apart else float(self.everywhere(points)[1].min())

    def everywhere(self, points: ContactPoints) -> tuple[np.ndarray, np.ndarray]:
        """Return closest points (c, 2) and gaps (c,) of all pairs that are followed, those left out included."""
        every = points.followed
        xi, gap = np.empty_like(every.xi), np.empty_like(every.gap)
        xi[points.number], gap[points.number] = points.projection.xi, points.gap
        rest = np.ones(len(gap), dtype=bool)
        rest[points.number] = False
        rest = np.flatnonzero(rest)
        if len(rest):
            position = self._search.positions(every.point[rest], points.carriers)
            projection, gap[rest] = self._project(taken(every, rest), position, points.carriers)
            xi[rest] = projection.xi
        return xi, gap

    # ---- candidates -----------------------------------------------------------------------------------------

    def _angles(self, history: ContactHistory, before: np.ndarray) -> np.ndarray | None:
        """Return the angles (c,) between the first parameters' lines at all pairs; None if the law does not ask."""
        if not self.law.directional:
            return None
        cosine = np.empty(len(history.point))
        for low in range(0, len(cosine), CHUNK):
            part = slice(low, low + CHUNK)
            point = history.point[part]
            both = (
                (self.quadrature.surface[point], self.quadrature.xi[point]),
                (history.surface[part], history.xi[part]),
            )
            lines = [self.surfaces.places(*place, before)[1][:, 0] for place in both]
            sizes = np.prod([np.linalg.norm(line, axis=1) for line in lines], axis=0)
            cosine[part] = np.abs(np.einsum("ki,ki->k", *lines)) / sizes
        return np.arccos(np.minimum(cosine, 1.0))

    def _follow(self, carriers: np.ndarray, before: np.ndarray, history: ContactHistory) -> _Followed:
        """Return the history over all pairs that may touch now; what is kept only saves time."""
        kept = self._followed
        if kept is not None and kept.source is history:
            if kept.angle is None and self.law.directional:
                self._followed = kept = replace(kept, angle=self._angles(kept.history, before))
            if self.surfaces.motion(carriers, kept.searched).least(self.margin) >= 0:
                return kept
        found = self._search.find(carriers, self.margin)
        merged, least = self._merge(found, carriers, before, history)
        self._followed = _Followed(
            source=history,
            history=merged,
            searched=carriers,
            angle=self._angles(merged, before),
            least=least,
            seen=carriers,
        )
        return self._followed

    def _continue(self, history: ContactHistory, successor: ContactHistory) -> None:
        """Go on with the pairs of one search under the history that follows."""
        if self._followed is not None and self._followed.history is history:
            self._followed = replace(self._followed, source=successor, history=successor, angle=None)

    def _merge(
        self, found: Candidates, carriers: np.ndarray, before: np.ndarray, history: ContactHistory
    ) -> tuple[ContactHistory, np.ndarray]:
        """Return the history of the pairs found and of those that touch, and the least gaps that they have now.

        New pairs remember where they were.
        """
        now = self._search.positions(found.point, carriers)
        near = project(self.surfaces, carriers, found.surface, now, found.guess)
        gap = self._gap(found.point, found.surface, near)
        keep = np.flatnonzero(near.found & (gap < self.margin))
        point, surface, gap = found.point[keep], found.surface[keep], gap[keep]
        known = same_pair(point, surface, near.xi[keep], history)
        stays = history.pressure > 0
        stays[known[known >= 0]] = True
        least = np.full(len(history.point), -np.inf)
        least[known[known >= 0]] = gap[known >= 0]
        unknown = np.flatnonzero(known < 0)
        point, surface = point[unknown], surface[unknown]
        position = self._search.positions(point, before)
        projection = project(self.surfaces, before, surface, position, near.xi[keep[unknown]])
        many = len(unknown)
        new = ContactHistory(
            point=point,
            surface=surface,
            xi=projection.xi,
            gap=self._gap(point, surface, projection),
            pressure=np.zeros(many),
            traction=np.zeros((many, 3)),
            multiplier=np.zeros(many),
            anchor=projection.xi,
            slip=np.zeros(many),
            status=np.full(many, OPEN),
            dissipated=history.dissipated,
        )
        return joined(taken(history, np.flatnonzero(stays)), new), np.concatenate(
            [least[stays], gap[unknown]]
        )

    def _project(
        self, history: ContactHistory, position: np.ndarray, carriers: np.ndarray
    ) -> tuple[Projection, np.ndarray]:
        projection = project(self.surfaces, carriers, history.surface, position, history.xi)
        return projection, self._gap(history.point, history.surface, projection)

    def _gap(self, point: np.ndarray, surface: np.ndarray, projection: Projection) -> np.ndarray:
        offset = self.surfaces.offset
        gap = projection.distance + offset[surface] + offset[self.quadrature.surface[point]]
        return np.where(projection.found, gap, np.inf)

    # ---- energies -------------------------------------------------------------------------------------------

    def _energy(self, points: ContactPoints, active: np.ndarray, weight: np.ndarray) -> dict[str, float]:
        angle = None if points.angle is None else points.angle[active]
        pressed = self.law.stored(points.gap[active], points.pressure[active], angle)
        sheared = 0.5 * np.einsum("ki,ki->k", points.traction[active], points.traction[active])
        stored = float(weight @ (pressed + sheared / points.law.of(active).tangential))
        return {"penalty": stored, "friction": float(points.history.dissipated) + self._dissipation(points)}

    def _dissipation(self, points: ContactPoints) -> float:
        """Return the work of friction within the increment, mu p |slip| with the mean pressure of it [J]."""
        lost = self._hysteresis(points) if self.law.directional else 0.0
        if not np.isfinite(self.law.friction):
            return lost
        active = points.active
        weight = PASS_SHARE * self.quadrature.area[points.history.point[active]]
        pressure = points.pressure[active]
        length = points.law.of(active).slipped(points.trial[active], pressure)
        mean = 0.5 * (pressure + points.history.pressure[active])
        return lost + float(np.sum(weight * self.law.friction * mean * length))

    def _hysteresis(self, points: ContactPoints) -> float:
        """Return what sticking points lose as their stiffness changes with the gap [J].

        Stiffness that is gained carries nothing, and what is lost takes its share along: neither does work.
        """
        touched = np.flatnonzero(points.history.pressure > 0)
        history, now = taken(points.history, touched), points.law.of(touched).tangential
        before = self.law.at(history.gap, points.angle[touched]).tangential
        share = np.minimum(before / now, now / before)
        carried = np.einsum("ki,ki->k", history.traction, history.traction) / before
        weight = PASS_SHARE * self.quadrature.area[history.point]
        return 0.5 * float(weight @ ((1 - share) * carried))

    def _stencils(self, points: ContactPoints, active: np.ndarray) -> tuple[Stencil, Stencil]:
        history = points.history
        other = self.surfaces.stencil(history.surface[active], points.projection.xi[active])
        return self._search.stencil(history.point[active]), other


def _known(gap: np.ndarray) -> np.ndarray:
    """Return the least gaps (c,) [m] that gaps (c,) stand for: where no closest point was found, there is none."""
    return np.where(np.isfinite(gap), gap, -np.inf)


def _put(values: np.ndarray, number: np.ndarray, some: np.ndarray) -> np.ndarray:
    """Return values (c, ...) with some (k, ...) of the given numbers (k,) in their place."""
    values = values.copy()
    values[number] = some
    return values
