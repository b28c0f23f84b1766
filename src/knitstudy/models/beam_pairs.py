"""Pairs of beam elements that may touch."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.geometry.crossings import Crossings
from knitstudy.mechanics.beam_contact.approach import A, B, Curves, Pairs, approach
from knitstudy.mechanics.beam_contact.contact import CrossingPairs


def piece_bounds(crossings: Crossings, length: np.ndarray) -> np.ndarray:
    """Return the piece (K, 2, 2) of either yarn that belongs to a crossing: half way to the next along the yarn [m]."""
    yarn, s = crossings.yarn.ravel(), crossings.arc_length.ravel()
    order = np.lexsort((s, yarn))
    middle = 0.5 * (s[order][1:] + s[order][:-1])
    same = yarn[order][1:] == yarn[order][:-1]
    low = np.concatenate([[0.0], np.where(same, middle, 0.0)])
    high = np.concatenate([np.where(same, middle, length[yarn[order][:-1]]), [length[yarn[order][-1]]]])
    bounds = np.empty((len(s), 2))
    bounds[order] = np.stack([low, high], axis=1)
    return bounds.reshape(-1, 2, 2)


def point_pairs(crossings: Crossings, chosen: np.ndarray, length: np.ndarray) -> CrossingPairs:
    """Return one pair of closest points for each of the crossings `chosen` (k,); yarns are `length` (Y,) long [m]."""
    pairs = Pairs(crossings.yarn[chosen], piece_bounds(crossings, length)[chosen])
    return CrossingPairs(pairs, crossings.arc_length[chosen], chosen)


MARGIN = 0.3
"""Gap up to which pieces count as near, over the radius."""


@dataclass(frozen=True, eq=False)
class Gaps:
    """Smallest gaps of yarns in one configuration.

    Attributes
    ----------
    crossing : ndarray, shape (K,)
        Of the two pieces that belong to a crossing [m]; inf where they are not near.
    elsewhere : float
        Of all other pieces [m]; inf if none are near.
    yarn : tuple of int
        The yarns of that gap.
    arc_length : tuple of float
        Where it is on them [m].
    """

    crossing: np.ndarray
    elsewhere: float
    yarn: tuple[int, int]
    arc_length: tuple[float, float]

    @property
    def smallest(self) -> float:
        """Smallest of all [m]."""
        return min(self.elsewhere, float(self.crossing.min(initial=np.inf)))


class Neighbours:
    """Search for pieces of yarn that are near each other, a yarn with itself included.

    Parameters
    ----------
    curves : Curves
    yarn : ndarray of int, shape (S,)
        Of the stations.
    crossings : Crossings
    radius : float
        [m]
    """

    def __init__(self, curves: Curves, yarn: np.ndarray, crossings: Crossings, radius: float) -> None:
        self.curves, self.yarn, self.radius = curves, np.asarray(yarn), radius
        self.count = len(crossings.row)
        bounds = piece_bounds(crossings, curves.length)
        self._starts = [
            _Starts.of(bounds[here, side, 0], here)
            for number in range(len(curves.length))
            for here, side in [np.nonzero(crossings.yarn == number)]
        ]
        self._step = float(np.diff(curves.arc_length).max())

    def gaps(self, position: np.ndarray) -> Gaps:
        """Return the gaps where the stations are at positions (S, 3) [m]."""
        reach = (2 + MARGIN) * self.radius + self._step
        one, other = cKDTree(position).query_pairs(reach, output_type="ndarray").T
        s = self.curves.arc_length
        near = np.stack([one, other], axis=1)
        near = near[self._may_meet(self.yarn[near], s[near]) & self._nearest(near, position)]
        crossing = np.full(self.count, np.inf)
        if not len(near):
            return Gaps(crossing, np.inf, (-1, -1), (np.nan, np.nan))
        start = s[near]
        low = np.maximum(start - self._step, 0.0)
        high = np.minimum(start + self._step, self.curves.length[self.yarn[near]])
        pairs = Pairs(self.yarn[near], np.stack([low, high], axis=-1))
        here = approach(self.curves, position, pairs, start)
        gap = np.where(self._may_meet(pairs.yarn, here.s), here.distance - 2 * self.radius, np.inf)
        known = self._crossing_of(pairs.yarn, here.s)
        np.minimum.at(crossing, known[known >= 0], gap[known >= 0])
        beyond = np.where(known < 0, gap, np.inf)
        k = int(np.argmin(beyond))
        return Gaps(crossing, float(beyond[k]), tuple(map(int, pairs.yarn[k])), tuple(map(float, here.s[k])))

    def _nearest(self, near: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Return which pairs of stations (k, 2) are no farther apart than those beside them along their yarns."""
        distance = np.linalg.norm(position[near[:, A]] - position[near[:, B]], axis=1)
        nearest = np.ones(len(near), dtype=bool)
        low, high = self.curves.first[self.yarn[near]], self.curves.first[self.yarn[near] + 1] - 1
        for step in product((-1, 0, 1), repeat=2):
            beside = np.clip(near + np.array(step), low, high)
            nearest &= distance <= np.linalg.norm(position[beside[:, A]] - position[beside[:, B]], axis=1)
        return nearest

    def _may_meet(self, yarn: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return whether points (k, 2) may touch: only a yarn bent to less than its radius could beside itself."""
        return (yarn[:, A] != yarn[:, B]) | (np.abs(s[:, A] - s[:, B]) > np.pi * self.radius)

    def _crossing_of(self, yarn: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return the crossing (k,) that both points belong to, or -1."""
        crossing = np.full(yarn.shape, -1)
        for number, starts in enumerate(self._starts):
            crossing[yarn == number] = starts.crossing_at(s[yarn == number])
        return np.where(crossing[:, A] == crossing[:, B], crossing[:, A], -1)


@dataclass(frozen=True, eq=False)
class _Starts:
    """Where the pieces of one yarn begin, ascending, and the crossings that they belong to."""

    arc_length: np.ndarray
    crossing: np.ndarray

    @classmethod
    def of(cls, arc_length: np.ndarray, crossing: np.ndarray) -> _Starts:
        order = np.argsort(arc_length)
        # A yarn without crossings has no pieces.
        return cls(np.append(-np.inf, arc_length[order]), np.append(-1, crossing[order]))

    def crossing_at(self, s: np.ndarray) -> np.ndarray:
        return self.crossing[np.searchsorted(self.arc_length, s, side="right") - 1]
