"""What contact points remember from one converged increment to the next, and who is who after a new search."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial import cKDTree


@dataclass(frozen=True, eq=False)
class ContactHistory:
    """What contact points remember of the last converged increment; all arrays run over the candidate pairs.

    Attributes
    ----------
    point, surface : ndarray of int, shape (c,)
        Gauss point and the surface that it faces.
    xi : ndarray, shape (c, 2)
        Its closest point.
    gap : ndarray, shape (c,)
        Its gap [m]; inf where the closest point was not within the surface's edges, -inf where none was looked for:
        it was open then, and xi is a guess.
    pressure : ndarray, shape (c,)
        Its pressure [Pa], what multipliers carried included; where it is positive, the anchor counts.
    traction : ndarray, shape (c, 3)
        Its tangential traction [Pa].
    multiplier : ndarray, shape (c,)
        Pressure (negative) that augmentation has added within the increment [Pa].
    anchor : ndarray, shape (c, 2)
        Convected coordinates at which the point would carry no tangential traction.
    slip : ndarray, shape (c,)
        Length slipped since it first touched [m].
    status : ndarray of int, shape (c,)
        OPEN, STICK or SLIP.
    dissipated : ndarray, shape ()
        Work of friction so far [J].
    """

    point: np.ndarray
    surface: np.ndarray
    xi: np.ndarray
    gap: np.ndarray
    pressure: np.ndarray
    traction: np.ndarray
    multiplier: np.ndarray
    anchor: np.ndarray
    slip: np.ndarray
    status: np.ndarray
    dissipated: np.ndarray

    @classmethod
    @cache
    def empty(cls) -> ContactHistory:
        """Return the history of a model in which nothing has touched yet, the same one for all."""
        number, value = np.empty(0, dtype=np.int64), np.empty(0)
        places = np.empty((0, 2))
        vectors = np.empty((0, 3))
        return cls(number, number, places, value, value, vectors, value, places, value, number, np.zeros(()))


def taken(history: ContactHistory, chosen: np.ndarray) -> ContactHistory:
    """Return the history of some pairs."""
    arrays = {name: value[chosen] for name, value in vars(history).items() if name != "dissipated"}
    return ContactHistory(**arrays, dissipated=history.dissipated)


def joined(one: ContactHistory, other: ContactHistory) -> ContactHistory:
    """Return the history of the pairs of both."""
    arrays = {
        name: np.concatenate([value, getattr(other, name)])
        for name, value in vars(one).items()
        if name != "dissipated"
    }
    return ContactHistory(**arrays, dissipated=one.dissipated)


def same_pair(
    point: np.ndarray, surface: np.ndarray, arc: np.ndarray, old: ContactHistory, old_arc: np.ndarray
) -> np.ndarray:
    """Return for pairs found anew the same pair of an older history, or -1: the same point on the same piece.

    Parameters
    ----------
    point, surface : ndarray of int, shape (k,)
    arc : ndarray, shape (k,)
        Arc lengths of their closest points, in units of what two pieces of a surface are apart at least.
    old : ContactHistory
    old_arc : ndarray, shape (c,)
        Arc lengths of its closest points likewise.
    """
    if not len(old.point) or not len(point):
        return np.full(len(point), -1)
    count = 1 + max(surface.max(), old.surface.max())
    # Pairs of different points or surfaces lie farther apart in this plane than any two places of one surface.
    new = np.stack([1e6 * (point * count + surface), arc], axis=1)
    known = np.stack([1e6 * (old.point * count + old.surface), old_arc], axis=1)
    distance, index = cKDTree(known).query(new, distance_upper_bound=1.0)
    return np.where(np.isfinite(distance), index, -1)
