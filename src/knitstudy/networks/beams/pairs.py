"""Which pieces of yarn face each other at crossings, as one pair of closest points each or as points along a line."""

from __future__ import annotations

import numpy as np

from knitstudy.geometry.pattern import Crossings
from knitstudy.mechanics.beam_contact.approach import Pairs
from knitstudy.mechanics.beam_contact.crossing_pairs import CrossingPairs

SPACING = 1 / 32
"""Distance of the points along a line of contact, over the radius: some ten where 10 N press with 10 E."""

REACH = 2.0
"""Length of a line of contact to either side of a crossing, over the radius, if no other crossing is nearer."""

PASS_SHARE = 0.5
"""The points of either yarn carry half of a line's stiffness."""


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
    pairs = Pairs(crossings.yarn[chosen], piece_bounds(crossings, length)[chosen], np.array([True, True]))
    count = len(chosen)
    return CrossingPairs(
        pairs, crossings.arc_length[chosen], np.ones(count), chosen, np.zeros(count, dtype=int)
    )


def line_pairs(crossings: Crossings, chosen: np.ndarray, length: np.ndarray, radius: float) -> CrossingPairs:
    """Return points along both yarns at the crossings `chosen` (k,), each against the other yarn."""
    bounds = piece_bounds(crossings, length)[chosen]
    middle = crossings.arc_length[chosen]
    passes = []
    for side in (0, 1):
        low = np.maximum(bounds[:, side, 0], middle[:, side] - REACH * radius)
        high = np.minimum(bounds[:, side, 1], middle[:, side] + REACH * radius)
        count = np.ceil((high - low) / (SPACING * radius)).astype(int)
        which = np.repeat(np.arange(len(chosen)), count)
        step = (high - low) / count
        number = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        s = low[which] + (number + 0.5) * step[which]
        yarn = crossings.yarn[chosen]
        order = [side, 1 - side]
        start = np.stack([s, middle[which, 1 - side]], axis=1)
        passes.append(
            (
                yarn[which][:, order],
                bounds[which][:, order],
                start,
                PASS_SHARE * step[which],
                chosen[which],
                np.full(len(which), side),
            )
        )
    yarn, bounds, start, weight, crossing, lower = (
        np.concatenate(part) for part in zip(*passes, strict=True)
    )
    pairs = Pairs(yarn, bounds, np.array([False, True]))
    return CrossingPairs(pairs, start, weight, crossing, lower)
