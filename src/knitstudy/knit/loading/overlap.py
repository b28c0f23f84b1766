"""How deep yarns pass through each other: a plain computation on centrelines, independent of any search for contact.

Two places of yarn overlap where their centrelines are nearer than a diameter. Places of one yarn that are at most half
a turn around the section apart along it are neighbours: a half turn as tight as the yarn allows ends a diameter away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from knitstudy.knit.loading.history import Stations
from knitstudy.mechanics.core.arrays import Floats, Ints

# Distance of the places that are compared, over the radius: an overlap comes out smaller by at most a hundredth
SPACING = 0.25
# Images of all yarns, by periods: one of every pair that is each other's mirror image
IMAGES = [(i, j) for j in range(3) for i in range(-2, 3) if (j, i) >= (0, 0)]


@dataclass(frozen=True, eq=False)
class Repeats:
    """How yarns repeat themselves; yarns beyond those of `length` are images."""

    length: Floats  # (Y,), of one period along every yarn, whose images the first vector takes on [m]
    vectors: Floats  # (2, 3), of the lattice, undeformed [m]

    def stretched(self, strain: Floats) -> Floats:
        """Return the vectors (2, 3) under strains in the plane (3,): along x and y, and the angle of shear."""
        x, y, shear = strain
        return self.vectors @ np.array([[1 + x, shear / 2, 0], [shear / 2, 1 + y, 0], [0, 0, 1]])


def largest_overlap(
    stations: Stations,
    places: Floats,  # (S, 3), where the stations are [m]
    radius: Floats | float,  # of the yarns (Y,), or of all [m]
    length: Floats | None = None,  # (Y,), of one period of yarns that repeat themselves [m]
    vectors: Floats | None = None,  # (2, 3), of the lattice by which they do [m]
) -> float:
    """Return how deep two places of yarn overlap at most, over their mean radius; 0 where none do.

    Examples
    --------
    >>> crossed = np.array([[-5.0, 0, 0], [0, 0, 0], [5, 0, 0], [0, -5, 1.5], [0, 0, 1.5], [0, 5, 1.5]])
    >>> stations = Stations(np.repeat([0, 1], 3), np.tile([0.0, 5.0, 10.0], 2), crossed)
    >>> largest_overlap(stations, crossed, radius=1.0)
    0.5
    """
    points, yarn, s = _fine(stations, places, float(np.min(radius)), length, vectors)
    own = np.broadcast_to(radius, int(yarn.max()) + 1)[yarn]
    reach = 2 * float(np.max(radius))
    tree = cKDTree(points)
    low = points.min(axis=0) - reach
    high = points.max(axis=0) + reach
    nearest = 2.0
    for image in [(0, 0)] if vectors is None else IMAGES:
        moved = points if vectors is None else points + image @ vectors
        here = np.flatnonzero(((moved >= low) & (moved <= high)).all(axis=1))
        near = cKDTree(moved[here]).sparse_distance_matrix(tree, reach, output_type="ndarray")
        one = here[near["i"]]
        other = near["j"]
        along = s[one] - s[other] + (0 if length is None else image[0] * length[yarn[one]])
        beside = (yarn[one] == yarn[other]) & (image[1] == 0) & (np.abs(along) <= np.pi * own[one])
        mean = 0.5 * (own[one] + own[other])
        nearest = (near["v"] / mean)[~beside].min(initial=nearest)
    return float(2 - nearest)


def _fine(
    stations: Stations,
    places: Floats,
    radius: float,
    length: Floats | None,
    vectors: Floats | None,
) -> tuple[Floats, Ints, Floats]:
    """Return places (k, 3) close together along all yarns that are no images, their yarns and arc lengths (k,)."""
    parts = []
    for number in range(int(stations.yarn.max()) + 1 if length is None else len(length)):
        here = stations.yarn == number
        s = stations.arc_length[here]
        x = places[here]
        if length is not None and vectors is not None and s[-1] < (1 - 1e-9) * length[number]:
            s = np.append(s, length[number])
            x = np.concatenate([x, x[:1] + vectors[0]])
        fine = np.linspace(s[0], s[-1], 1 + int(np.ceil((s[-1] - s[0]) / (SPACING * radius))))
        parts.append((CubicSpline(s, x)(fine), np.full(len(fine), number), fine))
    points, yarns, s = (np.concatenate(values) for values in zip(*parts, strict=True))
    return points, yarns, s
