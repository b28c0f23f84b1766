"""How much nearer points can have come: by affine maps of their neighbourhoods, and by the motion beyond these.

A fabric as a whole shears and bends unevenly, a few loops of it much less: every neighbourhood has an affine map of its
own. Places that are nearer to each other than a neighbourhood is wide follow one map; places farther apart follow that
of a wider neighbourhood. An affine map shrinks no distance by more than its smallest stretch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import by_parts

# Squared extents of a neighbourhood, over its largest, below which it has none: a straight yarn is no solid.
FLAT = 1e-9
# Of a box: where it takes the upper one of its limits.
CORNERS = np.array(list(np.ndindex(2, 2, 2)), dtype=bool)
CHUNK = 20_000  # control points at a time; bounds the memory


def affine_gradient(spread: Floats, sheared: Floats) -> Floats:
    """Return the gradients G (..., 3, 3) of the affine motions that fit ways best.

    `spread` and `sheared` are the sums of x x and of x u (..., 3, 3) over places x and ways u from their means.

    Examples
    --------
    >>> x = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])  # a straight yarn, stretched by a tenth
    >>> affine_gradient(x.T @ x, x.T @ (0.1 * x)).diagonal().round(12).tolist()
    [0.1, 0.0, 0.0]
    """
    return np.linalg.pinv(spread, rcond=FLAT, hermitian=True) @ sheared


def smallest_stretch(gradient: Floats) -> np.ndarray:
    """Return the smallest stretches (...) of affine motions with gradients (..., 3, 3)."""
    return np.linalg.svd(np.eye(3) + gradient, compute_uv=False)[..., -1]


@dataclass(frozen=True, eq=False)
class AffineMotion:
    """Affine maps, and how far places may be from where these take them."""

    shrink: Floats  # (b,), smallest stretch of every map
    way: Floats  # (b,), largest distance [m] of a place from where its map takes it

    def least(self, gap: Floats | float, number: Ints | slice = slice(None)) -> Floats:
        """Return the least gaps [m] that gaps [m] of maps (k,) can have become; farther places come no nearer."""
        return self.shrink[number] * gap - 2 * self.way[number]


@dataclass(frozen=True, eq=False)
class AffineMaps:
    """Affine displacements x -> U + (x - X) G: shapes (b, 3), (b, 3) and (b, 3, 3)."""

    middle: Floats
    shift: Floats
    gradient: Floats

    @classmethod
    def of(cls, moments: Floats) -> AffineMaps:
        """Fit maps to the moments (b, 4, 7) of boxes: sums of (1, x) (1, x, u)."""
        middle, shift = np.split(moments[:, 0, 1:] / moments[:, 0, :1], 2, axis=1)
        spread = moments[:, 1:, 1:4] - moments[:, 1:, :1] * middle[:, None]
        sheared = moments[:, 1:, 4:] - moments[:, 1:, :1] * shift[:, None]
        return cls(middle, shift, affine_gradient(spread, sheared))

    def at(self, number: Ints, place: Floats) -> Floats:
        """Return the displacements (k, n, 3) of maps (k,) at places (k, n, 3)."""
        return self.shift[number, None] + (place - self.middle[number, None]) @ self.gradient[number]

    @property
    def shrink(self) -> np.ndarray:
        """Smallest stretches (b,)."""
        return smallest_stretch(self.gradient)


class Boxes:
    """Boxes of space of one size, each with those around it."""

    def __init__(self, rings: Floats, controls: Floats, side: float, overshoot: float) -> None:
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
        self._one = pairs // len(around)
        self._other = other[pairs]
        beside_each = np.ones(len(pairs)), (self._one, self._other)
        self._beside = sp.csr_matrix(beside_each, shape=(len(keys), len(keys)))

    def motion(self, place: Floats, way: Floats, moments: Floats) -> AffineMotion:
        """Return how the surroundings of boxes have moved.

        Control points (S, a, 3) have places and ways [m], with `moments`.
        Places in a box are seen from the map of its own surroundings. From there the map of a box beside it is off by
        as much as at a corner of the places in that box.
        """
        maps = AffineMaps.of((self._beside @ (self._sum @ moments)).reshape(-1, 4, 7))

        def beyond(part: slice) -> Floats:
            return _farthest(way[part] - maps.at(self._box[part], place[part]))

        own = self._largest(by_parts(beyond, len(place), CHUNK))
        places = place.swapaxes(0, 1)  # NumPy's own reduction over so few takes five times as long
        low = -self._largest(-reduce(np.minimum, places))
        high = self._largest(reduce(np.maximum, places))
        corners = np.where(CORNERS, high[:, None], low[:, None])[self._other]
        apart = _farthest(maps.at(self._other, corners) - maps.at(self._one, corners))
        largest = np.zeros(self.count)
        np.maximum.at(largest, self._one, own[self._other] + apart)
        return AffineMotion(maps.shrink, self._overshoot * largest)

    def _largest(self, values: Floats) -> Floats:
        """Return the largest values (b, ...) of control points (S, ...) in boxes, minus infinity without one."""
        result = np.full((self.count, *values.shape[1:]), -np.inf)
        ordered = values[self._sum.indices]
        first = self._sum.indptr[:-1][self._known]
        result[self._known] = np.maximum.reduceat(ordered, first)
        return result


def moments(place: Floats, way: Floats) -> Floats:
    """Return the sums (S, 28) of (1, x) (1, x, u) over control points (S, a, 3) with places x and ways u."""
    one = np.ones((*place.shape[:2], 1))
    first = np.concatenate([one, place], axis=2)
    second = np.concatenate([one, place, way], axis=2)
    return (first.swapaxes(1, 2) @ second).reshape(len(place), -1)


def _farthest(way: Floats) -> Floats:
    """Return the lengths (k,) of the longest of ways (k, n, 3) [m]."""
    return np.sqrt(np.einsum("kni,kni->kn", way, way).max(axis=1))
