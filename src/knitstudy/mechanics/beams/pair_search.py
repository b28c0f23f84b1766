"""Search for pairs of points of yarns that are near each other, or have come near since the last search."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.batches import Chosen
from knitstudy.mechanics.core.motion_bound import affine_gradient, smallest_stretch

FAR = 1 << 6  # images are at most half as many periods away


# A pair of n points is known by one number. It is named from the point that sees the other one, or the other one's
# image, ahead: in a later row, further along courses, or by a higher number.


def named_from_first(i: Ints, j: Ints, image: Ints) -> Bools:
    """Return whether pairs of points i (k,) and of images (k, 2) of points j (k,) are named from i."""
    along, across = image.T
    return (across > 0) | ((across == 0) & ((along > 0) | ((along == 0) & (i < j))))


def pair_keys(i: Ints, j: Ints, image: Ints, n: int) -> Ints:
    """Return the numbers (k,) of pairs.

    Examples
    --------
    >>> key = pair_keys(np.array([3]), np.array([1]), np.array([[-1, 2]]), n=10)
    >>> [part.tolist() for part in pairs_of(key, n=10)]
    [[3], [1], [[-1, 2]]]
    """
    along, across = image.T
    return ((i * n + j) * FAR + along + FAR // 2) * FAR + across


def pairs_of(key: Ints, n: int) -> tuple[Ints, Ints, Ints]:
    """Return the points (k,) and (k,) of pairs and the image (k, 2) of the second, from their numbers (k,)."""
    rest, across = np.divmod(key, FAR)
    both, along = np.divmod(rest, FAR)
    return *np.divmod(both, n), np.column_stack([along - FAR // 2, across])


@dataclass(frozen=True, eq=False)
class PointPairs(Chosen):
    """Pairs of points in one configuration: of point i, and of the image of point j."""

    i: Ints  # (k,)
    j: Ints  # (k,)
    image: Ints  # (k, 2), how many periods away
    way: Floats  # (k, 3), vectors from i to the image of j [m]
    key: Ints  # (k,), ascending

    @property
    def distance(self) -> Floats:
        """Distances (k,) [m]."""
        return _lengths(self.way)

    @property
    def both(self) -> Ints:
        """Points (k, 2)."""
        return np.stack([self.i, self.j], axis=1)


def _lengths(vectors: Floats) -> Floats:
    """Return the lengths (k,) of vectors (k, 3)."""
    return np.sqrt(np.einsum("ki,ki->k", vectors, vectors))


class PairSearch:
    """Search among all points of yarns, and their images where yarns repeat themselves.

    One search serves until other pairs may have come as near. The knit as a whole has an affine motion, which shrinks
    no distance by more than its smallest stretch; what points move beyond it adds to that.
    """

    def __init__(
        self,
        yarn: Ints,  # (n,), of every point; points of a yarn follow each other
        arc_length: Floats,  # (n,) [m]
        beside: Floats
        | float,  # lengths along a yarn within which it does not touch itself, (n,) or of all [m]
        period: Floats | None,  # (Y,), lengths of one period of the yarns; None where nothing repeats [m]
        # (n,), number of the tie that joins a point to others, or -1; None where nothing does
        joined: Ints | None,
    ) -> None:
        self.yarn, self.arc_length, self.beside = yarn, arc_length, beside
        self.period, self.joined = period, joined
        self._found: PointPairs | None = None  # by the last search, up to a distance `_far` [m]
        self._far = 0.0
        self._position, self._vectors = np.empty((0, 3)), np.zeros((2, 3))  # of points and lattice then [m]

    def within(self, reach: float, far: float, position: Floats, vectors: Floats) -> PointPairs:
        """Return the pairs within a reach [m] of points (n, 3) and lattice vectors (2, 3) [m].

        Where the last search does not serve any more, pairs nearer than `far` [m] are searched for.
        """
        found = self._found
        if found is None or self._least_of_others(found, position, vectors) <= reach:
            found = self._found = self._all(far, position, vectors)
            self._far, self._position, self._vectors = far, position, vectors
        way = position[found.j] + found.image @ vectors - position[found.i]
        return replace(found, way=way)[np.einsum("ki,ki->k", way, way) < reach**2]

    def _least_of_others(self, found: PointPairs, position: Floats, vectors: Floats) -> float:
        """Return the least distance [m] that other pairs than those found can have now."""
        place = self._position - self._position.mean(axis=0)
        move = position - self._position
        move -= move.mean(axis=0)
        gradient = affine_gradient(place.T @ place, place.T @ move)
        beyond = _lengths(move - place @ gradient).max()  # the motion x -> X + (X - mean) G
        images = np.abs(found.image).max(axis=0, initial=1) + 1  # more periods than any pair is away
        apart = images @ _lengths(vectors - self._vectors - self._vectors @ gradient)
        return float(smallest_stretch(gradient) * self._far - 2 * beyond - apart)

    def _all(self, reach: float, position: Floats, vectors: Floats) -> PointPairs:
        n = len(position)
        extent = np.ptp(position[:, :2], axis=0) + reach
        most = np.zeros(2, dtype=int)
        if self.period is not None:
            # (x, y) = vectors^T (a, b): bounds of a and b for all ways that points may be apart
            most = np.abs(np.linalg.inv(vectors[:, :2].T)) @ extent
            most = np.ceil(most).astype(int).clip(max=FAR // 2 - 1)
        a, b = np.meshgrid(np.arange(-most[0], most[0] + 1), np.arange(most[1] + 1), indexing="ij")
        image = np.stack([a.ravel(), b.ravel()], axis=1)
        # The others are these seen from the other point: see `named_from_first`.
        image = image[(image[:, 1] > 0) | (image[:, 0] > 0)]
        tree = cKDTree(position)
        i, j = tree.query_pairs(reach, output_type="ndarray").T.astype(np.int64)
        of_image = np.zeros((len(i), 2), dtype=np.int64)
        if len(image):
            moved = (position + (image @ vectors)[:, None]).reshape(-1, 3)
            near = tree.sparse_distance_matrix(cKDTree(moved), reach, output_type="coo_matrix")
            i = np.append(i, near.row)
            j = np.append(j, near.col % n)
            of_image = np.concatenate([of_image, image[near.col // n]])
        a, b = of_image.T
        apart = self.arc_length[j] - self.arc_length[i]
        if self.period is not None:
            apart = apart + a * self.period[self.yarn[j]]
        chosen = (
            (self.yarn[i] != self.yarn[j]) | (b != 0) | (np.abs(apart) > np.broadcast_to(self.beside, n)[i])
        )
        if self.joined is not None:
            chosen &= (self.joined[i] < 0) | (self.joined[i] != self.joined[j])
        key = pair_keys(i, j, of_image, n)
        order = np.flatnonzero(chosen)[np.argsort(key[chosen])]
        i, j, of_image = i[order], j[order], of_image[order]
        return PointPairs(i, j, of_image, position[j] + of_image @ vectors - position[i], key[order])
