"""Points of contact along yarns: where they are between the stations of beams, and how yarns bend there.

A yarn between its stations is a cubic spline, so that what slides along it feels no stations: position, tangent and
curvature go on through all of them. It follows stations linearly, with weights that never change, and a point follows
the six stations around it.

Tangents and curvatures at points come from parabolas through points farther apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import BSpline

from knitstudy.errors import GeometryError
from knitstudy.mechanics.beams.beam import BeamState
from knitstudy.mechanics.core.arrays import Floats, Ints


def parabolas(knots: Floats, at: Floats) -> tuple[Floats, Floats, Floats]:
    """Return weights (n, 3) of three values, and for both derivatives, of parabolas through knots (n, 3) at (n,).

    Examples
    --------
    >>> value, slope, bend = parabolas(np.array([[-1.0, 0.0, 1.0]]), np.array([0.5]))
    >>> value.tolist(), slope.tolist(), bend.tolist()
    ([[-0.125, 0.75, 0.375]], [[0.0, -1.0, 1.0]], [[1.0, -2.0, 1.0]])
    """
    others = knots[:, [[1, 2], [0, 2], [0, 1]]]
    per = 1 / np.prod(knots[..., None] - others, axis=2)
    way = at[:, None, None] - others
    return per * way.prod(axis=2), per * way.sum(axis=2), 2 * per


def beside(yarn: Ints, count: Ints | int, closed: bool) -> tuple[Ints, Ints]:
    """Return three places (n, 3) around each place, `count` places apart, and how many periods away they are (n, 3).

    The middle one is the place itself, but for the ends of yarns that are not closed.

    Examples
    --------
    >>> beside(np.array([0, 0, 0, 0]), 1, closed=False)[0].tolist()
    [[0, 1, 2], [0, 1, 2], [1, 2, 3], [1, 2, 3]]
    """
    at = np.arange(len(yarn))
    begin = np.searchsorted(yarn, yarn)
    end = np.searchsorted(yarn, yarn, side="right") - 1
    count = np.minimum(count, (end - begin) // 2)
    middle = at if closed else np.clip(at, begin + count, end - count)
    places = np.stack([middle - count, middle, middle + count], axis=1)
    image = 1 * (places > end[:, None]) - 1 * (places < begin[:, None])
    return places - image * (end - begin + 1)[:, None], image


CUBIC = 3


def spline_weights(knots: Floats, at: Floats, period: float | None) -> tuple[sp.csr_matrix, Floats]:
    """Return weights (p, m), of values at knots (m,), of a cubic spline at places (p,); and of periods (p,) to add.

    The spline has two continuous derivatives. Every coefficient is the blossom of the parabola through the nearest
    three values (quasi-interpolation; de Boor and Fix 1973): parabolas are exact, and cubics where knots are even. A
    place follows six values at most. With knots h apart, the spline misses the values by h^4 / 36 of the fourth
    derivative: one through all values would follow all of them.

    Without a period the spline ends in its outer knots. With one, images of the knots and their values follow each
    other a period apart, and `periods` says how many of them count at a place.

    Examples
    --------
    >>> knots = np.array([0.0, 1.0, 2.5, 3.0, 4.0])
    >>> weights, _ = spline_weights(knots, np.array([0.0, 1.7]), None)
    >>> (weights @ knots**2).round(12).tolist()
    [0.0, 2.89]
    """
    count = len(knots)
    reach = 0 if period is None else CUBIC + 1  # knots of images to either side
    around, number = np.divmod(np.arange(-reach, count + reach), count)
    x = knots[number] if period is None else knots[number] + around * period
    ends = CUBIC if period is None else 0  # how often the ends are knots again
    breaks = np.pad(x, ends, mode="edge")
    low, middle, high = breaks[1:-3], breaks[2:-2], breaks[3:-1]
    nearest = np.clip(np.arange(len(middle)) + 2 - ends, 1, len(x) - 2)
    places = nearest[:, None] + np.arange(-1, 2)
    value, slope, bend = parabolas(x[places], middle)
    before, after = (low - middle)[:, None], (high - middle)[:, None]
    blossom = value + slope * (before + after) / 3 + bend * before * after / 6
    rows = np.arange(0, blossom.size + 1, 3)
    coefficients = sp.csr_matrix((blossom.ravel(), places.ravel(), rows), (len(blossom), len(x)))
    weights = sp.csr_matrix(BSpline.design_matrix(at, breaks, CUBIC) @ coefficients)
    images = sp.csr_matrix((np.ones(len(x)), (np.arange(len(x)), number)), (len(x), count))
    return sp.csr_matrix(weights @ images), weights @ around.astype(float)


class Spread:
    """How places and turns of p points of contact and the lattice vectors (6 p + 6,) follow the unknowns of a model."""

    def __init__(self, matrix: sp.bsr_matrix) -> None:
        self.matrix, self._transposed = matrix, matrix.T.tobsr()

    def forces(self, force: Floats) -> Floats:
        """Return the forces on the unknowns of forces (6 p + 6,)."""
        return self._transposed @ force

    def tangent(self, tangent: sp.bsr_matrix) -> sp.bsr_matrix:
        """Return the tangent over the unknowns of one over the points and the lattice vectors."""
        return self._transposed @ tangent @ self.matrix


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Points of contact of yarns with stations; the section of the nearest station turns them."""

    yarn: Ints  # (p,)
    arc_length: Floats  # (p,) [m]
    weight: Floats  # (p,), length that they stand for [m]
    station: Ints  # (p,), whose section it is
    weights: sp.csr_matrix  # (p, n), of the positions of stations
    around: Floats  # (p,), the same of images of stations, in periods along the yarn

    @classmethod
    def of(
        cls,
        yarn: Ints,  # (n,), of the stations; stations of a yarn follow each other
        arc_length: Floats,  # (n,), rising [m]
        per_station: int,  # points for every station
        period: Floats | None = None,  # (Y,), lengths of yarns that go on as their own images [m]
    ) -> ContactPoints:
        """Return the points; raises GeometryError if a yarn has fewer than three stations."""
        number, count = np.unique(yarn, return_counts=True)
        if count.min() < 3:
            k = int(np.argmin(count))
            raise GeometryError(
                f"yarn {number[k]} has {count[k]} beam nodes: a smooth centreline needs at least 3; use shorter beam "
                "elements"
            )
        n = len(yarn)
        s = arc_length
        places, image = beside(yarn, 1, period is not None)
        knots = s[places] if period is None else s[places] + image * period[yarn][:, None]
        # A station stands for half the way to both beside it; the last ones of a yarn that ends for one half.
        before = knots < s[:, None]
        after = knots > s[:, None]
        low = np.where(before.any(axis=1), 0.5 * (s + np.where(before, knots, -np.inf).max(axis=1)), s)
        high = np.where(after.any(axis=1), 0.5 * (s + np.where(after, knots, np.inf).min(axis=1)), s)
        share = (np.arange(per_station) + 0.5) / per_station
        station = np.repeat(np.arange(n), per_station)
        at = (low[:, None] + (high - low)[:, None] * share).ravel()
        parts = [
            spline_weights(s[yarn == k], at[yarn[station] == k], None if period is None else period[k])
            for k in number
        ]
        weights = sp.block_diag([part for part, _ in parts], format="csr")
        around = np.concatenate([part for _, part in parts])
        return cls(yarn[station], at, (high - low)[station] / per_station, station, weights, around)

    @property
    def ends(self) -> Ints:
        """First and last points (m,) of yarns."""
        first = np.flatnonzero(np.diff(self.yarn, prepend=-1))
        return np.append(first, np.append(first[1:], len(self.yarn)) - 1)

    def at(self, stations: BeamState, vectors: Floats) -> BeamState:
        """Return position and rotation of the points, of all stations (n, 3) and lattice vectors (2, 3) [m]."""
        position = self.weights @ stations.position + self.around[:, None] * vectors[0]
        return replace(stations, position=position, rotation=stations.rotation[self.station])

    def spread(self, moves: Floats) -> Spread:
        """Return how places and turns of points and the lattice vectors (6 p + 6,) follow the unknowns (6 n + 3,).

        Unknowns are places and turns of stations, and three of the lattice, by which `moves` (2, 3, 3) are the
        derivatives of its vectors.
        """
        p, n = self.weights.shape
        turns = sp.csr_matrix((np.ones(p), (np.arange(p), self.station)), (p, n))
        places = sp.kron(self.weights, sp.diags([1.0] * 3 + [0.0] * 3))
        both = places + sp.kron(turns, sp.diags([0.0] * 3 + [1.0] * 3))
        lattice = np.zeros((p, 6, 3))
        lattice[:, :3] = self.around[:, None, None] * moves[0]
        return Spread(sp.bmat([[both, lattice.reshape(-1, 3)], [None, moves.reshape(6, 3)]]).tobsr((3, 3)))


@dataclass(frozen=True, eq=False)
class Axes:
    """Derivatives of the yarns by arc length at their points."""

    points: Ints  # (n, 3), through which parabolas lead
    image: Ints  # (n, 3), how many periods along the yarn they are away
    first: Floats  # (n, 3), weights of the tangent [1/m]
    second: Floats  # (n, 3), weights of the second derivative [1/m2]

    @classmethod
    def of(
        cls,
        yarn: Ints,
        arc_length: Floats,
        weight: Floats,
        length: Floats | float,  # from a point to both others, nearly; of every point (n,) or of all [m]
        period: Floats | None,
    ) -> Axes:
        """Return the derivatives at points; arguments as for `ContactPoints`."""
        points, image = beside(yarn, np.maximum(np.rint(length / weight), 1).astype(int), period is not None)
        knots = arc_length[points]
        if period is not None:
            knots = knots + image * period[yarn][:, None]
        _, first, second = parabolas(knots, arc_length)
        return cls(points, image, first, second)

    def at(self, which: Ints, position: Floats, vectors: Floats) -> tuple[Floats, Floats]:
        """Return the derivatives (k, 3) at some points (k,), of all points (n, 3) and lattice vectors (2, 3) [m]."""
        place = position[self.points[which]] + self.image[which][..., None] * vectors[0]
        return tuple(np.einsum("np,npi->ni", weights[which], place) for weights in (self.first, self.second))
