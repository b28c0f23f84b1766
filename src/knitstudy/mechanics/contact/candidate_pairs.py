"""How much nearer surfaces can have come: by affine maps of their neighbourhoods, and by the motion beyond these.

A fabric as a whole shears and bends unevenly, a few loops of it much less: every neighbourhood has an affine map of its
own. Places that are nearer to each other than a neighbourhood is wide follow one map; places farther apart follow that
of a wider neighbourhood.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.batches import Reserve, by_parts
from knitstudy.mechanics.contact.friction import ContactHistory, ContactStatus, same_pair
from knitstudy.mechanics.contact.search import Search
from knitstudy.mechanics.contact.surface import Surfaces
from knitstudy.mechanics.contact.tangent import CHUNK

# Distance up to which two rings share a neighbourhood, over the reach of a ring: two radii of yarns, and three.
WIDTH = 5.0
WIDER = 4.0  # ratio of the widths of neighbourhoods, up to that of the whole
# Share of the boxes up to which these are searched alone, and how often before all are
MOST, SEARCHES = 0.5, 4
# Squared extents of a neighbourhood, over its largest, below which it has none: a straight yarn is no solid.
FLAT = 1e-9
# Of a box: where it takes the upper one of its limits.
CORNERS = np.array(list(np.ndindex(2, 2, 2)), dtype=bool)


@dataclass(frozen=True, eq=False)
class Motion:
    """Affine maps, and how far places may be from where these take them."""

    shrink: np.ndarray  # (b,), smallest stretch of every map
    way: np.ndarray  # (b,), largest distance [m] of a place from where its map takes it

    def least(self, gap: np.ndarray | float, number: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return the least gaps [m] that gaps [m] of maps (k,) can have become; farther places come no nearer."""
        return self.shrink[number] * gap - 2 * self.way[number]


@dataclass(frozen=True, eq=False)
class _Maps:
    """Affine displacements x -> U + (x - X) G: shapes (b, 3), (b, 3) and (b, 3, 3)."""

    middle: np.ndarray
    shift: np.ndarray
    gradient: np.ndarray

    @classmethod
    def of(cls, moments: np.ndarray) -> _Maps:
        """Fit maps to the moments (b, 4, 7) of boxes: sums of (1, x) (1, x, u)."""
        middle, shift = np.split(moments[:, 0, 1:] / moments[:, 0, :1], 2, axis=1)
        spread = moments[:, 1:, 1:4] - moments[:, 1:, :1] * middle[:, None]
        sheared = moments[:, 1:, 4:] - moments[:, 1:, :1] * shift[:, None]
        return cls(middle, shift, np.linalg.pinv(spread, rcond=FLAT, hermitian=True) @ sheared)

    def at(self, number: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Return the displacements (k, n, 3) of maps (k,) at places (k, n, 3)."""
        return self.shift[number, None] + (place - self.middle[number, None]) @ self.gradient[number]

    @property
    def shrink(self) -> np.ndarray:
        """Smallest stretches (b,)."""
        return np.linalg.svd(np.eye(3) + self.gradient, compute_uv=False)[:, -1]


class _Boxes:
    """Boxes of space of one size, each with those around it."""

    def __init__(self, rings: np.ndarray, controls: np.ndarray, side: float, overshoot: float) -> None:
        """Divide space around rings (R, 3) and control points (S, 3) [m] into boxes of a side [m]."""
        self._overshoot = overshoot
        points = np.concatenate([rings, controls])
        place = np.floor((points - points.min(axis=0)) / side).astype(np.int64) + 1
        shape = place.max(axis=0) + 2
        keys, box = np.unique(np.ravel_multi_index(place.T, shape), return_inverse=True)
        self.count = len(keys)
        self.of_ring, self._box = np.split(box, [len(rings)])
        within = np.ones(len(controls)), (self._box, np.arange(len(controls)))
        self._sum = sp.csr_matrix(within, shape=(len(keys), len(controls)))
        self._known = np.diff(self._sum.indptr) > 0
        around = np.array(list(np.ndindex(3, 3, 3))) - 1
        beside = np.stack(np.unravel_index(keys, shape), axis=1)[:, None] + around
        beside = np.ravel_multi_index(beside.reshape(-1, 3).T, shape)
        other = np.minimum(np.searchsorted(keys, beside), len(keys) - 1)
        pairs = np.flatnonzero((keys[other] == beside) & self._known[other])
        self._one, self._other = pairs // len(around), other[pairs]
        beside_each = np.ones(len(pairs)), (self._one, self._other)
        self._beside = sp.csr_matrix(beside_each, shape=(len(keys), len(keys)))

    def motion(self, place: np.ndarray, way: np.ndarray, moments: np.ndarray) -> Motion:
        """Return how the surroundings of boxes have moved.

        Control points (S, a, 3) have places and ways [m], with `_moments`.
        Places in a box are seen from the map of its own surroundings. From there the map of a box beside it is off by
        as much as at a corner of the places in that box.
        """
        maps = _Maps.of((self._beside @ (self._sum @ moments)).reshape(-1, 4, 7))

        def beyond(part: slice) -> np.ndarray:
            return _farthest(way[part] - maps.at(self._box[part], place[part]))

        own = self._largest(by_parts(beyond, len(place), CHUNK))
        places = place.swapaxes(0, 1)  # NumPy's own reduction over so few takes five times as long
        low, high = -self._largest(-reduce(np.minimum, places)), self._largest(reduce(np.maximum, places))
        corners = np.where(CORNERS, high[:, None], low[:, None])[self._other]
        apart = _farthest(maps.at(self._other, corners) - maps.at(self._one, corners))
        largest = np.zeros(self.count)
        np.maximum.at(largest, self._one, own[self._other] + apart)
        return Motion(maps.shrink, self._overshoot * largest)

    def _largest(self, values: np.ndarray) -> np.ndarray:
        """Return the largest values (b, ...) of control points (S, ...) in boxes, minus infinity without one."""
        result = np.full((self.count, *values.shape[1:]), -np.inf)
        ordered, first = values[self._sum.indices], self._sum.indptr[:-1][self._known]
        result[self._known] = np.maximum.reduceat(ordered, first)
        return result


class Neighbourhoods:
    """Boxes of space with those around them, and wider boxes for places that are too far apart for one neighbourhood.

    `of_ring` (R,) is the smallest box of every ring.
    """

    def __init__(
        self,
        surfaces: Surfaces,
        carriers: np.ndarray,  # (M, 3), where neighbours are looked for [m]
        reach: float,  # largest distance of a ring's places from its middle [m]
    ) -> None:
        self._surfaces = surfaces
        rings, controls = surfaces.centres(carriers), surfaces.controls(carriers).mean(axis=1)
        self._origin, extent = controls.mean(axis=0), np.ptp(controls, axis=0).max()
        widths, influence = [WIDTH * reach], surfaces.influence(carriers)
        while widths[-1] < extent:
            widths.append(WIDER * widths[-1])
        self._apart = [width - 2 * reach for width in widths]  # nearer places share a neighbourhood
        boxes = [_Boxes(rings, controls, width + influence, surfaces.overshoot) for width in widths]
        self._boxes, *self._wider = boxes
        self.of_ring, self.count = self._boxes.of_ring, self._boxes.count

    def motion(self, now: np.ndarray, then: np.ndarray) -> Motion:
        """Return how the surroundings of every box have moved between two states of the carriers (M, 3)."""
        return self._boxes.motion(*self._displacements(now, then))

    def may_meet(self, now: np.ndarray, searched: np.ndarray, last: np.ndarray, margin: float) -> np.ndarray:
        """Return in which boxes (b,) places may have met since they were farther apart than a margin [m].

        Boxes were searched last (b,) at one of the states (n, M, 3), all of them at the first one.
        """
        seen = [self._displacements(now, then) for then in searched]
        for boxes, apart in zip(self._wider, self._apart, strict=False):
            if (boxes.motion(*seen[0]).least(apart) < 0).any():
                return np.ones(len(last), dtype=bool)
        least = [self._boxes.motion(*boxes).least(margin) for boxes in seen]
        return np.choose(last, least) < 0

    def _displacements(self, now: np.ndarray, then: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where control points (S, a, 3) were, from the middle of all, ways since [m], and `_moments`."""
        now, then = self._surfaces.controls(now), self._surfaces.controls(then)
        place, way = then - self._origin, now - then
        return place, way, by_parts(lambda part: _moments(place[part], way[part]), len(place), CHUNK)


def _moments(place: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return the sums (S, 28) of (1, x) (1, x, u) over control points (S, a, 3) with places x and ways u."""
    one = np.ones((*place.shape[:2], 1))
    first, second = np.concatenate([one, place], axis=2), np.concatenate([one, place, way], axis=2)
    return (first.swapaxes(1, 2) @ second).reshape(len(place), -1)


def _farthest(way: np.ndarray) -> np.ndarray:
    """Return the lengths (k,) of the longest of ways (k, n, 3) [m]."""
    return np.sqrt(np.einsum("kni,kni->kn", way, way).max(axis=1))


def _in_order(
    one: ContactHistory, other: ContactHistory, chosen: np.ndarray, least: np.ndarray
) -> tuple[ContactHistory, np.ndarray]:
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
        carriers: np.ndarray,  # (M, 3), of the surfaces, now and at the last converged increment [m]
        before: np.ndarray,  # likewise
        history: ContactHistory,  # of that increment
        reach: float = 0.0,  # gap up to which pairs count as touching [m]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which (k,) of all pairs can touch, and the least gaps (c,) of all [m].

        Those cannot whose surfaces have moved too little since their gap was last known to close it.
        """
        # A history from a restart file
        if self._source is ContactHistory.empty() and history.search_status is not None:
            first = history.search_status.searched[0]
            boxes = Neighbourhoods(self._search.surfaces, first, self._search.reach)
            self._set(before, history, history, boxes, history.search_status)
        again = self._source is history and np.array_equal(self._before, before)
        may_meet = np.ones(1, dtype=bool)
        if again:
            status = self._search_status
            may_meet = self._neighbourhoods.may_meet(carriers, status.searched, status.last, self._margin)
        if may_meet.any():
            if may_meet.mean() < MOST and len(status.searched) < SEARCHES:
                self._search_boxes(carriers, may_meet)
            else:
                # A search of all forgets pairs of trial states, which may lie far from the path.
                self._search_all(carriers, before, history)
        every, least = self.history, self._least(carriers)
        return np.flatnonzero(~((least > reach) & (every.pressure <= 0) & (every.multiplier == 0))), least

    def last_converged(self, number: np.ndarray) -> tuple[ContactHistory, np.ndarray | None]:
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

    def _least(self, carriers: np.ndarray) -> np.ndarray:
        """Return lower bounds of the gaps (c,) of all pairs [m]."""
        status = self._search_status
        return self._neighbourhoods.motion(carriers, status.seen).least(status.least, self._box)

    def set_bounds(self, carriers: np.ndarray, least: np.ndarray) -> None:
        """Set lower bounds of the gaps (c,) of all pairs [m], which hold where carriers (M, 3) are."""
        self._search_status.seen, self._search_status.least = carriers, least

    def replace_history(
        self,
        history: ContactHistory,
        successor: ContactHistory,
        # (M, 3), where carriers were at the increment that this has ended [m]; left out within one
        before: np.ndarray | None = None,
    ) -> ContactHistory:
        """Replace a history by its successor, which has the same pairs, and return the successor."""
        if self.history is not history:
            return successor
        self._source = self.history = successor = replace(successor, search_status=self._search_status)
        if before is not None:
            self._before, self._angle = before, np.full(len(successor.xi), np.nan)
        return successor

    def _search_all(self, carriers: np.ndarray, before: np.ndarray, history: ContactHistory) -> None:
        """Search everywhere for pairs that may touch now; pairs of a history keep their part of it."""
        every, least = self._search_pairs(carriers, history)
        boxes = Neighbourhoods(self._search.surfaces, carriers, self._search.reach)
        last = np.zeros(boxes.count, dtype=np.int64)
        status = ContactStatus(carriers[None], last, carriers, least)
        self._set(before, history, every, boxes, status)

    def _search_boxes(self, carriers: np.ndarray, boxes: np.ndarray) -> None:
        """Search in some boxes (b,) alone for pairs that may touch now."""
        status, here = self._search_status, boxes[self._box]
        among = boxes[self._neighbourhoods.of_ring]
        others, least = self.history[np.flatnonzero(~here)], self._least(carriers)[~here]
        own, gap = self._search_pairs(carriers, self.history[np.flatnonzero(here)], among)
        least = np.append(least, gap)
        every, least = _in_order(others, own, np.arange(len(least)), least)
        last = np.where(boxes, len(status.searched), status.last)
        status = ContactStatus(np.concatenate([status.searched, carriers[None]]), last, carriers, least)
        self._set(self._before, self._source, every, self._neighbourhoods, status)

    def _search_pairs(
        self, carriers: np.ndarray, history: ContactHistory, among: np.ndarray | None = None
    ) -> tuple[ContactHistory, np.ndarray]:
        """Return the pairs of a search, with their part of a history, and lower bounds of their gaps (c,) [m]."""
        self._reserve.give_back()
        pairs, arc, gap = self._search.find(carriers, self._margin, among)
        same = same_pair(pairs, arc, history, self._search.arc(history.surface, history.xi[:, 0]))
        least = np.full(len(history.point), -np.inf)
        least[same[same >= 0]] = gap[same >= 0]
        pressed = history.pressure > 0
        pressed[same[same >= 0]] = True
        stays, new = np.flatnonzero(pressed), np.flatnonzero(same < 0)
        chosen = np.append(stays, len(history.point) + new)
        return _in_order(history, pairs, chosen, np.append(least[stays], gap[new]))

    def _set(
        self,
        before: np.ndarray,
        history: ContactHistory | None,
        every: ContactHistory,
        boxes: Neighbourhoods,
        status: ContactStatus,
    ) -> None:
        """Set the pairs, after a search, and the history that they come from."""
        self._source, self._before, self.history = history, before, replace(every, search_status=status)
        self._search_status, self._neighbourhoods = status, boxes
        self._angle = np.full(len(every.point), np.nan)
        cell = every.point // self._search.quadrature.per_cell
        self._box = boxes.of_ring[self._search.ring(cell)]  # (c,), box that a pair lies in

    def _angles(self, history: ContactHistory, before: np.ndarray) -> np.ndarray:
        """Return the angles (c,) between the first parameters' lines at pairs."""
        surfaces, quadrature = self._search.surfaces, self._search.quadrature

        def cosine(part: slice) -> np.ndarray:
            point = history.point[part]
            both = quadrature.places(point), (history.surface[part], history.xi[part])
            lines = [surfaces.places(*place, before)[1][:, 0] for place in both]
            sizes = np.prod([np.linalg.norm(line, axis=1) for line in lines], axis=0)
            return np.abs(np.einsum("ki,ki->k", *lines)) / sizes

        return np.arccos(np.minimum(by_parts(cosine, len(history.point), CHUNK), 1.0))
