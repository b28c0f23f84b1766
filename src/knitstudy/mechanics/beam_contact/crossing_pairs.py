"""Pairs of closest points with the crossings that they belong to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.beam_contact.approach import Pairs


@dataclass(frozen=True, eq=False)
class CrossingPairs:
    """Pairs of all crossings in contact.

    Attributes
    ----------
    pairs : Pairs
        k pairs.
    start : ndarray, shape (k, 2)
        Arc lengths from which the closest points are first looked for [m].
    weight : ndarray, shape (k,)
        What a force density is multiplied by: 1 at a point, a length along a line [1 or m].
    crossing : ndarray of int, shape (k,)
        Crossing that a pair belongs to.
    lower : ndarray of int, shape (k,)
        Side (0 or 1) that is the lower row's yarn.
    """

    pairs: Pairs
    start: np.ndarray
    weight: np.ndarray
    crossing: np.ndarray
    lower: np.ndarray
