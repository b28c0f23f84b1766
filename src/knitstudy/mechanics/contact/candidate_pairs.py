"""Pairs that may touch, searched for as seldom as the motion of surfaces allows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from knitstudy.mechanics.contact.friction import ContactHistory, ContactStatus, same_pair
from knitstudy.mechanics.contact.search import Search
from knitstudy.mechanics.contact.surface import Surfaces
from knitstudy.mechanics.contact.tangent import CHUNK
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import Reserve, by_parts
from knitstudy.mechanics.core.motion_bound import AffineMotion, Boxes, moments

# Distance up to which two rings share a neighbourhood, over the reach of a ring: two radii of yarns, and three.
WIDTH = 5.0
WIDER = 4.0  # ratio of the widths of neighbourhoods, up to that of the whole


class Neighbourhoods:
    """Boxes of space with those around them, and wider boxes for places that are too far apart for one neighbourhood.

    `of_ring` (R,) is the smallest box of every ring.
    """

    def __init__(
        self,
        surfaces: Surfaces,
        carriers: Floats,  # (M, 3), where neighbours are looked for [m]
        reach: float,  # largest distance of a ring's places from its middle [m]
    ) -> None:
        self._surfaces = surfaces
        rings = surfaces.centres(carriers)
        controls = surfaces.controls(carriers).mean(axis=1)
        self._origin, extent = controls.mean(axis=0), np.ptp(controls, axis=0).max()
        widths = [WIDTH * reach]
        influence = surfaces.influence(carriers)
        while widths[-1] < extent:
            widths.append(WIDER * widths[-1])
        self._apart = [width - 2 * reach for width in widths[:-1]]  # nearer places share a neighbourhood
        boxes = [Boxes(rings, controls, width + influence, surfaces.overshoot) for width in widths]
        self._boxes, *self._wider = boxes
        self.of_ring = self._boxes.of_ring

    def motion(self, now: Floats, then: Floats) -> AffineMotion:
        """Return how the surroundings of every box have moved between two states of the carriers (M, 3)."""
        return self._boxes.motion(*self._displacements(now, then))

    def may_meet(self, now: Floats, then: Floats, margin: float) -> bool:
        """Return whether places may meet now, of states (M, 3), that were farther apart than a margin [m] then."""
        seen = self._displacements(now, then)
        every = zip([self._boxes, *self._wider], [margin, *self._apart], strict=True)
        return any((boxes.motion(*seen).least(gap) < 0).any() for boxes, gap in every)

    def _displacements(self, now: Floats, then: Floats) -> tuple[Floats, Floats, Floats]:
        """Return where control points (S, a, 3) were, from the middle of all, ways since [m], and `moments`."""
        now, then = self._surfaces.controls(now), self._surfaces.controls(then)
        place = then - self._origin
        way = now - then
        return place, way, by_parts(lambda part: moments(place[part], way[part]), len(place), CHUNK)


def _in_order(
    one: ContactHistory, other: ContactHistory, chosen: Ints, least: Floats
) -> tuple[ContactHistory, Floats]:
    """Return the chosen (c,) of two histories' pairs, and values (c,), in an order that depends on the pairs alone.

    Sums then depend neither on when pairs were searched for nor on a restart.
    """
    both = one, other
    along, surface, point = (
        np.concatenate(values)[chosen]
        for values in (
            [points.xi[:, 0] for points in both],
            [points.surface for points in both],
            [points.point for points in both],
        )
    )
    order = np.lexsort((along, surface, point))
    return one.joined(other, chosen=chosen[order]), least[order]


class CandidatePairs:
    """Pairs that may touch, from one configuration to the next: searched for as seldom as motion allows.

    The state of this object saves time: answers depend on earlier questions by no more than rounding.
    """

    def __init__(
        self,
        search: Search,
        # distance up to which pairs are followed [m]; the search is repeated when others could touch
        margin: float,
        angles: bool,  # whether the angles between the lines of both surfaces are asked for
        reserve: Reserve,  # given back before a search, which needs as much memory
    ) -> None:
        self._search, self._margin, self._with_angles, self._reserve = search, margin, angles, reserve
        self.history = ContactHistory.empty()  # of all pairs; open ones are filled in when they are asked for
        self._angle = np.empty(0)  # (c,), between their lines at the last increment; nan: not asked for
        self._source: ContactHistory | None = None  # the history asked about
        # Of the last search; there is none before the first question.
        self._search_status: ContactStatus
        self._before: np.ndarray
        self._box: np.ndarray

    def may_touch(
        self,
        carriers: Floats,  # (M, 3), of the surfaces, now and at the last converged increment [m]
        before: Floats,  # likewise
        history: ContactHistory,  # of that increment
        reach: float = 0.0,  # gap up to which pairs count as touching [m]
    ) -> tuple[Ints, Floats]:
        """Return which (k,) of all pairs can touch, and the least gaps (c,) of all [m].

        Those cannot whose surfaces have moved too little since their gap was last known to close it.
        """
        # A history from a restart file
        if self._source is ContactHistory.empty() and history.search_status is not None:
            self._set(before, history, history, history.search_status)
        again = self._source is history and np.array_equal(self._before, before)
        if not again or self._neighbourhoods.may_meet(carriers, self._search_status.at_search, self._margin):
            self._search_all(carriers, before, history)
        every = self.history
        least = self._least(carriers)
        return np.flatnonzero(~((least > reach) & (every.pressure <= 0) & (every.multiplier == 0))), least

    def last_converged(self, number: Ints) -> tuple[ContactHistory, Floats | None]:
        """Return the history of pairs (k,), and the angles (k,) between their lines, at the last increment.

        Pairs that were open then are only now looked for there.
        """
        every = self.history
        new = number[np.isneginf(every.gap[number])]
        position = self._search.positions(every.point[new], self._before)
        pairs = every.point[new], every.surface[new], every.xi[new]
        projection, every.gap[new] = self._search.closest(*pairs, position, self._before)
        every.xi[new] = projection.xi
        if not self._with_angles:
            return every[number], None
        new = number[np.isnan(self._angle[number])]
        self._angle[new] = self._angles(every[new], self._before)
        return every[number], self._angle[number]

    def _least(self, carriers: Floats) -> Floats:
        """Return lower bounds of the gaps (c,) of all pairs [m]."""
        status = self._search_status
        return self._neighbourhoods.motion(carriers, status.seen).least(status.least, self._box)

    def set_bounds(self, carriers: Floats, least: Floats) -> None:
        """Set lower bounds of the gaps (c,) of all pairs [m], which hold where carriers (M, 3) are."""
        self._search_status.seen, self._search_status.least = carriers, least

    def replace_history(
        self,
        history: ContactHistory,
        successor: ContactHistory,
        # (M, 3), where carriers were at the increment that this has ended [m]; left out within one
        before: Floats | None = None,
    ) -> ContactHistory:
        """Replace a history by its successor, which has the same pairs, and return the successor."""
        if self.history is not history:
            return successor
        self._source = self.history = successor = replace(successor, search_status=self._search_status)
        if before is not None:
            self._before = before
            self._angle = np.full(len(successor.xi), np.nan)
        return successor

    def _search_all(self, carriers: Floats, before: Floats, history: ContactHistory) -> None:
        """Search for pairs that may touch now; pairs of a history keep their part of it.

        Pairs of trial states, which may lie far from the path, are forgotten.
        """
        self._reserve.give_back()
        pairs, arc, gap = self._search.find(carriers, self._margin)
        same = same_pair(pairs, arc, history, self._search.arc(history.surface, history.xi[:, 0]))
        least = np.full(len(history.point), -np.inf)
        least[same[same >= 0]] = gap[same >= 0]
        pressed = history.pressure > 0
        pressed[same[same >= 0]] = True
        stays = np.flatnonzero(pressed)
        new = np.flatnonzero(same < 0)
        chosen = np.append(stays, len(history.point) + new)
        every, least = _in_order(history, pairs, chosen, np.append(least[stays], gap[new]))
        self._set(before, history, every, ContactStatus(carriers, carriers, least))

    def _set(
        self, before: Floats, history: ContactHistory, every: ContactHistory, status: ContactStatus
    ) -> None:
        """Set the pairs, after a search, and the history that they come from."""
        self._source = history
        self._before = before
        self.history = replace(every, search_status=status)
        self._search_status = status
        self._neighbourhoods = Neighbourhoods(self._search.surfaces, status.at_search, self._search.reach)
        self._angle = np.full(len(every.point), np.nan)
        cell = every.point // self._search.quadrature.per_cell
        self._box = self._neighbourhoods.of_ring[self._search.ring(cell)]  # (c,), box that a pair lies in

    def _angles(self, history: ContactHistory, before: Floats) -> Floats:
        """Return the angles (c,) between the first parameters' lines at pairs."""
        surfaces, quadrature = self._search.surfaces, self._search.quadrature

        def cosine(part: slice) -> Floats:
            point = history.point[part]
            both = quadrature.places(point), (history.surface[part], history.xi[part])
            lines = [surfaces.places(*place, before)[1][:, 0] for place in both]
            sizes = np.prod([np.linalg.norm(line, axis=1) for line in lines], axis=0)
            return np.abs(np.einsum("ki,ki->k", *lines)) / sizes

        return np.arccos(np.minimum(by_parts(cosine, len(history.point), CHUNK), 1.0))
