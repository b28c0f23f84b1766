"""How much nearer surfaces can have come: by what affine maps of their neighbourhoods do, and what these leave.

A fabric as a whole shears and bends unevenly, a few loops of it much less: every neighbourhood has an affine map of its
own. What is nearer to each other than a neighbourhood is wide follows one map, what is farther apart that of the whole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.contact.surface import Surfaces

WIDTH = 5.0
"""Distance up to which two rings share a neighbourhood, over the reach of a ring: two radii of yarns, and three."""

AT_ONCE = 200_000
"""Control points whose rest is held at a time."""

FLAT = 1e-9
"""Squared extents of a neighbourhood, over its largest, below which it has none: a straight yarn is no solid."""


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


class Neighbourhoods:
    """Boxes that rings lie in, with all that places around these depend on.

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
        around = WIDTH * reach + surfaces.influence(carriers)
        self._apart = (WIDTH - 2) * reach
        side, low = 0.5 * around, np.minimum(rings.min(axis=0), controls.min(axis=0))
        box, place = (np.floor((points - low) / side).astype(np.int64) + 2 for points in (rings, controls))
        shape = np.maximum(box.max(axis=0), place.max(axis=0)) + 3
        keys, self.of_ring = np.unique(np.ravel_multi_index(box.T, shape), return_inverse=True)
        pairs = []
        for shift in np.ndindex(5, 5, 5):
            key = np.ravel_multi_index((place + shift - 2).T, shape)
            number = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
            inside = np.flatnonzero(keys[number] == key)
            pairs.append(np.stack([number[inside], inside]))
        pairs = np.concatenate(pairs, axis=1)
        self._box, self._member = pairs[:, np.argsort(pairs[0], kind="stable")]
        self._first = np.searchsorted(self._box, np.arange(len(keys)))
        self._count = np.diff(np.append(self._first, len(self._box)))[:, None]

    def motion(self, now: np.ndarray, then: np.ndarray) -> Motion:
        """Return how every box has moved between two states of the carriers (M, 3)."""
        now, then = self._surfaces.controls(now), self._surfaces.controls(then)
        return self._motion(now, then, self._member, self._first, self._box)

    def stay_apart(self, now: np.ndarray, then: np.ndarray) -> bool:
        """Return whether what was too far apart for one neighbourhood has not met since."""
        now, then = self._surfaces.controls(now), self._surfaces.controls(then)
        every = np.arange(len(now))
        whole = self._motion(
            now, then, every, np.zeros(1, dtype=np.int64), np.zeros(len(now), dtype=np.int64)
        )
        return bool(whole.least(self._apart)[0] >= 0)

    def _motion(
        self, now: np.ndarray, then: np.ndarray, member: np.ndarray, first: np.ndarray, box: np.ndarray
    ) -> Motion:
        """Return the motion of boxes from controls (S, a, 3): members (m,), box after box from `first` on."""
        count = np.diff(np.append(first, len(member)))[:, None]
        place, way = then.mean(axis=1)[member], (now - then).mean(axis=1)[member]
        middle, shift = (np.add.reduceat(values, first) / count for values in (place, way))
        place -= middle[box]
        way -= shift[box]
        spread, sheared = (
            np.add.reduceat(place[:, :, None] * values[:, None, :], first) for values in (place, way)
        )
        gradient = np.linalg.pinv(spread, rcond=FLAT, hermitian=True) @ sheared
        rest = np.empty(len(member))
        step = max(1, AT_ONCE // now.shape[1])
        for low in range(0, len(member), step):
            part = slice(low, low + step)
            here, number = box[part], member[part]
            apart = now[number] - then[number] - shift[here, None]
            apart -= (then[number] - middle[here, None]) @ gradient[here]
            rest[part] = np.einsum("nai,nai->na", apart, apart).max(axis=1)
        largest = self._surfaces.overshoot * np.sqrt(np.maximum.reduceat(rest, first))
        return Motion(np.linalg.svd(np.eye(3) + gradient, compute_uv=False)[:, -1], largest)
