"""Search for pairs of points of yarns that are near each other, or have come near since the last search.

One search serves until points have moved too far. Until then pieces of yarn bound how much nearer the points of a pair
have come, so that only few of the pairs are looked at.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.mechanics.arrays import Floats, Ints
from knitstudy.mechanics.batches import Chosen
from knitstudy.mechanics.motion_bound import affine_gradient, smallest_stretch

FAR = 1 << 6  # images are at most half as many periods away
PIECE = 64  # points of a piece of yarn


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


@dataclass(frozen=True, eq=False)
class FoundPairs:
    """All pairs of points that were nearer to each other than a distance, when they were searched for."""

    pairs: PointPairs
    far: float  # that distance [m]
    position: Floats  # (n, 3), of the points then [m]
    vectors: Floats  # (2, 3), of the lattice then [m]
    distance: Floats  # (k,), of the pairs then [m]
    pieces: Ints  # (g, 2), pieces of yarn that pairs lie on
    of_pieces: Ints  # (k,), row of the pieces of a pair
    images: Ints  # (2,), more periods than any pair is away

    @classmethod
    def of(cls, pairs: PointPairs, far: float, position: Floats, vectors: Floats) -> FoundPairs:
        """Return a search with such pairs."""
        count = len(position) // PIECE + 1
        number, of_pieces = np.unique(pairs.i // PIECE * count + pairs.j // PIECE, return_inverse=True)
        pieces = np.stack(np.divmod(number, count), axis=1)
        images = np.abs(pairs.image).max(axis=0, initial=1) + 1
        return cls(pairs, far, position, vectors, pairs.distance, pieces, of_pieces, images)

    def within(self, reach: float, position: Floats, vectors: Floats) -> PointPairs | None:
        """Return the pairs within a reach [m] now; None where others may have come as near.

        The knit as a whole has an affine motion, which shrinks no distance by more than its smallest stretch. Beyond
        this motion, pieces of yarn bound how much nearer points have come.
        """
        place, move = self.position - self.position.mean(axis=0), position - self.position
        move -= move.mean(axis=0)
        gradient = affine_gradient(place.T @ place, place.T @ move)
        move -= place @ gradient  # beyond the motion x -> X + (X - mean) G
        apart = self.images @ _lengths(vectors - self.vectors - self.vectors @ gradient)  # by the lattice
        shrink = smallest_stretch(gradient)
        if shrink * self.far - 2 * _lengths(move).max() - apart <= reach:
            return None
        first = np.arange(0, len(move), PIECE)
        count = np.diff(first, append=len(move))
        mean = np.add.reduceat(move, first) / count[:, None]
        rest = np.maximum.reduceat(_lengths(move - np.repeat(mean, count, axis=0)), first)
        one, other = self.pieces.T
        nearer = _lengths(mean[one] - mean[other]) + rest[one] + rest[other] + apart
        pairs = self.pairs[np.flatnonzero(shrink * self.distance < reach + nearer[self.of_pieces])]
        way = position[pairs.j] + pairs.image @ vectors - position[pairs.i]
        return replace(pairs, way=way)[np.einsum("ki,ki->k", way, way) < reach**2]


class PairSearch:
    """Search among all points of yarns, and their images where yarns repeat themselves."""

    def __init__(
        self,
        yarn: Ints,  # (n,), of every point; points of a yarn follow each other
        arc_length: Floats,  # (n,) [m]
        beside: float,  # lengths along a yarn within which it does not touch itself [m]
        period: Floats | None,  # (Y,), lengths of one period of the yarns; None where nothing repeats [m]
        # (n,), number of the tie that joins a point to others, or -1; None where nothing does
        joined: Ints | None,
    ) -> None:
        self.yarn, self.arc_length, self.beside = yarn, arc_length, beside
        self.period, self.joined = period, joined
        self._found: FoundPairs | None = None

    def within(self, reach: float, far: float, position: Floats, vectors: Floats) -> PointPairs:
        """Return the pairs within a reach [m] of points (n, 3) and lattice vectors (2, 3) [m].

        Where the last search does not serve any more, pairs nearer than `far` [m] are searched for.
        """
        pairs = None if self._found is None else self._found.within(reach, position, vectors)
        if pairs is None:
            pairs = self._all(far, position, vectors)
            self._found = FoundPairs.of(pairs, far, position, vectors)
            pairs = pairs[np.flatnonzero(pairs.distance < reach)]
        return pairs

    def _all(self, reach: float, position: Floats, vectors: Floats) -> PointPairs:
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
