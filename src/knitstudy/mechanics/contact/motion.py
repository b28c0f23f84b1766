"""How much nearer surfaces can have come: by what affine maps of their neighbourhoods do, and what these leave.

A fabric as a whole shears and bends unevenly, a few loops of it much less: every neighbourhood has an affine map of its
own. What is nearer to each other than a neighbourhood is wide follows one map, what is farther apart that of the whole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.contact.surface import Surfaces

WIDTH = 5.0
"""Distance up to which two rings share a neighbourhood, over the reach of a ring: two radii of yarns, and three."""

FLAT = 1e-9
"""Squared extents of a neighbourhood, over its largest, below which it has none: a straight yarn is no solid."""

CORNERS = np.array(list(np.ndindex(2, 2, 2)), dtype=bool)
"""Of a box: where it takes the upper one of its limits."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Affine maps, and how far places may be from where these take them.

    Attributes
    ----------
    shrink : ndarray, shape (b,)
        Smallest stretch of every map.
    way : ndarray, shape (b,)
        Largest distance [m] of a place from where its map takes it.
    """

    shrink: np.ndarray
    way: np.ndarray

    def least(self, gap: np.ndarray | float, number: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return the least gaps [m] that gaps [m] of maps (k,) can have become; what is farther moves no nearer."""
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


class Neighbourhoods:
    """Boxes of space, each with those around it.

    Parameters
    ----------
    surfaces : Surfaces
    carriers : ndarray, shape (M, 3)
        Where neighbours are looked for [m].
    reach : float
        Largest distance of a ring's places from its middle [m].

    Attributes
    ----------
    of_ring : ndarray of int, shape (R,)
        Box of every ring.
    """

    def __init__(self, surfaces: Surfaces, carriers: np.ndarray, reach: float) -> None:
        self._surfaces = surfaces
        rings, controls = surfaces.centres(carriers), surfaces.controls(carriers).mean(axis=1)
        self._origin = controls.mean(axis=0)
        self._apart = (WIDTH - 2) * reach
        points = np.concatenate([rings, controls])
        side = WIDTH * reach + surfaces.influence(carriers)
        place = np.floor((points - points.min(axis=0)) / side).astype(np.int64) + 1
        shape = place.max(axis=0) + 2
        keys, box = np.unique(np.ravel_multi_index(place.T, shape), return_inverse=True)
        self.of_ring, self._box = np.split(box, [len(rings)])
        within = np.ones(len(controls)), (self._box, np.arange(len(controls)))
        self._sum = sp.csr_matrix(within, shape=(len(keys), len(controls)))
        around = np.array(list(np.ndindex(3, 3, 3))) - 1
        beside = np.stack(np.unravel_index(keys, shape), axis=1)[:, None] + around
        beside = np.ravel_multi_index(beside.reshape(-1, 3).T, shape)
        other = np.minimum(np.searchsorted(keys, beside), len(keys) - 1)
        pairs = np.flatnonzero((keys[other] == beside) & (np.diff(self._sum.indptr) > 0)[other])
        self._one, self._other = pairs // len(around), other[pairs]
        pairs = np.ones(len(pairs)), (self._one, self._other)
        self._beside = sp.csr_matrix(pairs, shape=(len(keys), len(keys)))

    def motion(self, now: np.ndarray, then: np.ndarray) -> Motion:
        """Return how what is around every box has moved between two states of the carriers (M, 3).

        What lies in a box is seen from the map of its own surroundings, and from there the map of a box beside it is
        off by as much as at a corner of what lies there.
        """
        return self._motion(*self._seen(now, then))

    def keeps_apart(self, now: np.ndarray, then: np.ndarray, margin: float) -> bool:
        """Return whether what was farther apart than a margin [m] then cannot have met between two states."""
        place, way = self._seen(now, then)
        if self._motion(place, way).least(margin).min() < 0:
            return False
        # What was too far apart for one neighbourhood follows the map of the whole.
        whole = _Maps.of(_moments(place, way).sum(axis=0, keepdims=True))
        rest = _farthest(way - whole.at(np.zeros(len(place), dtype=np.int64), place)).max(keepdims=True)
        return bool(Motion(whole.shrink, self._surfaces.overshoot * rest).least(self._apart)[0] >= 0)

    def _motion(self, place: np.ndarray, way: np.ndarray) -> Motion:
        """Return how boxes have moved, of control points (S, a, 3) with places and ways [m]."""
        moments = self._sum @ _moments(place, way).reshape(len(place), -1)
        maps = _Maps.of((self._beside @ moments).reshape(-1, 4, 7))
        many = len(moments)
        own, low, high = np.zeros(many), np.full((many, 3), np.inf), np.full((many, 3), -np.inf)
        np.maximum.at(own, self._box, _farthest(way - maps.at(self._box, place)))
        np.minimum.at(low, self._box, place.min(axis=1))
        np.maximum.at(high, self._box, place.max(axis=1))
        corners = np.where(CORNERS, high[:, None], low[:, None])[self._other]
        apart = _farthest(maps.at(self._other, corners) - maps.at(self._one, corners))
        largest = np.zeros(many)
        np.maximum.at(largest, self._one, own[self._other] + apart)
        return Motion(maps.shrink, self._surfaces.overshoot * largest)

    def _seen(self, now: np.ndarray, then: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where control points (S, a, 3) were, from the middle of all, and their ways since [m]."""
        now, then = self._surfaces.controls(now), self._surfaces.controls(then)
        return then - self._origin, now - then


def _moments(place: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return the sums (S, 4, 7) of (1, x) (1, x, u) over control points (S, a, 3) with places x and ways u."""
    one = np.ones((*place.shape[:2], 1))
    return np.einsum(
        "sai,saj->sij", np.concatenate([one, place], axis=2), np.concatenate([one, place, way], axis=2)
    )


def _farthest(way: np.ndarray) -> np.ndarray:
    """Return the lengths (k,) of the longest of ways (k, n, 3) [m]."""
    return np.sqrt(np.einsum("kni,kni->kn", way, way).max(axis=1))
