"""The surface of solid yarns whose displacements are polynomials over the section times splines: the rim r = 1.

On the rim the functions of one spline are the 2 p + 1 sines and cosines of the angle, m = 0 ... p. They are the
carriers, spline by spline along a yarn: every coefficient of the yarn goes into one of them, so that contact works with
(d + 1) (2 p + 1) carriers a place instead of (d + 1) (p + 1) (p + 2) / 2 coefficients, and its matrix is expanded once.
The surface is as smooth as the splines are, and round where the yarn is undeformed.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.contact.surface import ALONG, AROUND, Stencil
from knitstudy.mechanics.core import basis as disc
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.basis import Spline
from knitstudy.mechanics.solids.spline_yarn.space import Space

CHUNK = 1_000  # pairs of stations that are expanded at once; bounds the memory


class Cylinders:
    """The surfaces of solid yarns; see `surface.Surfaces`.

    Parameters are arc length and angle, both in units of the arc 2 pi R / `angles`.
    """

    def __init__(
        self,
        space: Space,  # all of its splines of one degree
        radius: float,  # R of the yarns [m]
        # (m + 1,), arc lengths [m] of the edges of cells of every yarn, its ends included
        along: list[np.ndarray],
        angles: int,  # cells around
    ) -> None:
        yarns = len(space.yarns)
        self.closed = np.ones(yarns, dtype=bool)
        self.offset = np.zeros(yarns)
        self.cells = np.array([[len(edges) - 1, angles] for edges in along])
        own = [yarn.spline.spans[yarn.own] for yarn in space.yarns]
        beyond = [
            (edges[1:] <= spans[0, 0]) | (edges[:-1] >= spans[-1, 1])
            for edges, spans in zip(along, own, strict=True)
        ]
        self.images: Bools | None = np.repeat(np.concatenate(beyond), angles)
        self.unit = 2 * np.pi * radius / angles
        self._turn = 2 * np.pi / angles
        self._along = along
        self._ends = np.array([edges[[0, -1]] for edges in along]) / self.unit
        degree = max(yarn.degree for yarn in space.yarns)
        self.block = 2 * degree + 1
        splines = [yarn.spline for yarn in space.yarns]
        # One evaluator of all yarns: every place says which span it is on.
        self._spline = Spline(splines[0].degree, np.concatenate([spline.knots for spline in splines]))
        self._first_span = np.concatenate([[0], np.cumsum([len(spline.spans) for spline in splines])])
        # All yarns on one line: a yarn follows the one before.
        lengths = np.array([spline.spans[-1, 1] - spline.spans[0, 0] for spline in splines])
        self._start = np.cumsum(lengths) - lengths - [spline.spans[0, 0] for spline in splines]
        self._starts = self._spline.spans[:, 0] + np.repeat(self._start, np.diff(self._first_span))
        # Every coefficient goes to one carrier of its station, a spline of a yarn: that of its wave, times a factor.
        kind = disc.modes(degree)
        self._factor = kind.factor
        self._wave = np.where(kind.wave > 0, 2 * kind.wave - 1 + kind.sine, 0)
        many = np.concatenate([disc.size(yarn.degrees) for yarn in space.yarns])
        self._first = np.concatenate([[0], np.cumsum(many)])  # coefficient of every station
        carrier = self.block * np.repeat(np.arange(len(many)), many) + self._wave[space.order]
        entries = self._factor[space.order], (carrier, np.arange(space.size))
        self._total = sp.csr_matrix(entries, shape=(self.block * len(many), space.size))
        self._rings = self._values_at(along)
        self._first_ring = np.concatenate([[0], np.cumsum(self.cells[:, 0] + 1)])
        # Waves of degree p are at most 1 / cos(pi p / n) times their largest values at n > 2 p equal angles (Ehlich and
        # Zeller 1964).
        controls = 2 * self.block
        self._control_waves = _waves(self.block, 2 * np.pi * np.arange(controls) / controls, 0)[0]
        self.overshoot = float(1 / np.cos(np.pi * degree / controls))

    def edges(self, number: int) -> tuple[Floats, Floats]:
        """Return the parameters of the edges of cells along (m + 1,) and around (n + 1,)."""
        return self._along[number] / self.unit, np.arange(self.cells[number, 1] + 1.0)

    def stencil(self, surface: Ints, xi: Floats) -> Stencil:
        """Return the stencils of places xi (k, 2) on surfaces (k,)."""
        span, station, along, around = self._functions(surface, xi)
        weights = along[ALONG].transpose(1, 0, 2)[..., None] * around[AROUND].transpose(1, 0, 2)[:, :, None]
        wide = (self._spline.degree + 1) * self.block
        nodes = (self.block * station)[:, None] + np.arange(wide)
        return Stencil(nodes, weights.reshape(len(xi), 6, wide), key=span)

    def places(self, surface: Ints, xi: Floats, carriers: Floats) -> tuple[Floats, Floats, Floats]:
        """Return places, derivatives and second ones at xi (k, 2) on surfaces (k,); see `surface.Surfaces.places`.

        Splines are summed before waves, which takes fewer products than the weights of all carriers.
        """
        _, station, along, around = self._functions(surface, xi)
        near = self._near(station, carriers)
        waves = (along.transpose(1, 0, 2) @ near).reshape(len(xi), 3, self.block, 3)
        around = around.transpose(1, 0, 2)
        here, slope, bend = (around[:, : 3 - order] @ waves[:, order] for order in range(3))
        first = np.stack([slope[:, 0], here[:, 1]], axis=1)
        return here[:, 0], first, np.stack([bend[:, 0], slope[:, 1], here[:, 2]], axis=1)

    def positions(self, surface: Ints, xi: Floats, carriers: Floats) -> Floats:
        """Return places (k, 3) alone; see `surface.Surfaces.positions`."""
        _, station, along, around = self._functions(surface, xi, orders=0)
        waves = along[0][:, None] @ self._near(station, carriers)
        return (around[0][:, None] @ waves.reshape(len(xi), self.block, 3))[:, 0]

    def clamp(self, surface: Ints, xi: Floats) -> Floats:
        """Return xi (k, 2) moved to the nearest place within the yarns' ends."""
        return np.stack([np.clip(xi[:, 0], *self._ends[surface].T), xi[:, 1]], axis=1)

    def carry(self, nodes: Floats) -> Floats:
        """Return the carriers (M, 3) of coefficients (N, 3)."""
        return self._total @ nodes

    def collect(self, force: Floats) -> Floats:
        """Return forces (N, 3) on the coefficients from those on carriers (M, 3)."""
        return self._total.T @ force

    def matrix(self, indptr: np.ndarray, indices: np.ndarray, data: Floats) -> sp.bsr_matrix:
        """Return the matrix over the coefficients of one over carriers; see `surface.Surfaces.matrix`."""
        many = np.diff(self._first)
        stations = len(self._first) - 1
        row = np.repeat(np.arange(stations), np.diff(indptr))
        before = np.concatenate([[0], np.cumsum(many[indices])])  # columns of the pairs of stations before
        wide = before[indptr[1:]] - before[indptr[:-1]]  # columns of a row of blocks
        size = 3 * self._total.shape[1]
        lines = np.concatenate([[0], np.cumsum(np.repeat(wide, many))])
        compliance = np.empty((lines[-1], 3, 3))
        columns = np.empty(lines[-1], dtype=np.int32)
        start = lines[self._first[row]] + before[:-1] - before[indptr[row]]  # of a pair's first line
        for n, m in np.unique(np.stack([many[row], many[indices]], axis=1), axis=0):
            pairs = np.flatnonzero((many[row] == n) & (many[indices] == m))
            line = np.arange(n)[:, None]
            column = np.arange(m)
            place = start[pairs, None, None] + wide[row[pairs], None, None] * line + column
            entry = self.block * self._wave[:n, None] + self._wave[:m]
            scale = self._factor[:n, None] * self._factor[:m]
            for low in range(0, len(pairs), CHUNK):
                part = slice(low, low + CHUNK)
                blocks = data[pairs[part]][:, entry] * scale[..., None]
                compliance[place[part]] = blocks.reshape(*blocks.shape[:-1], 3, 3)
                columns[place[part]] = self._first[indices[pairs[part]], None, None] + column + 0 * line
        return sp.bsr_matrix((compliance, columns, lines), shape=(size, size))

    def centres(self, carriers: Floats) -> Floats:
        """Return the middles (R, 3) of all rings, yarn by yarn."""
        return self._rings @ carriers[:: self.block]

    def ring(self, number: int, row: Ints, carriers: Floats) -> Floats:
        """Return places (k, n + 1, 3) on rings (k,) of one yarn, at the edges of cells around."""
        rings, place = np.unique(row, return_inverse=True)
        wave = self._rings[self._first_ring[number] + rings] @ carriers.reshape(-1, 3 * self.block)
        table = _waves(self.block, self._turn * np.arange(self.cells[number, 1] + 1.0), 0)[0]
        return (table @ wave.reshape(-1, self.block, 3))[place]

    def controls(self, carriers: Floats) -> Floats:
        """Return rings (S, a, 3) of control points: splines add up to 1, so no place goes farther than theirs."""
        return self._control_waves @ carriers.reshape(-1, self.block, 3)

    def influence(self, carriers: Floats) -> float:
        """Return how far control points are from rings beside which places depend on them [m]: the next ring's, too."""
        middle = self.centres(carriers)
        ring = np.repeat(np.arange(len(middle)), np.diff(self._rings.indptr))
        control = carriers[:: self.block][self._rings.indices]
        step = np.linalg.norm(np.diff(middle, axis=0), axis=1)
        step[self._first_ring[1:-1] - 1] = 0
        return float(np.linalg.norm(middle[ring] - control, axis=1).max() + step.max())

    def _functions(self, surface: Ints, xi: Floats, orders: int = 2) -> tuple[Ints, Ints, Floats, Floats]:
        """Return spans (k,), first stations (k,), splines (n, k, d + 1) and waves (n, k, block) with derivatives."""
        s = self.unit * xi[:, 0]
        span = self._span(surface, s)
        first, along = self._spline.basis(s, orders, span)
        around = _waves(self.block, self._turn * xi[:, 1], orders)
        for order in range(1, orders + 1):
            along[order] *= self.unit**order
            around[order] *= self._turn**order
        return span, first - (self._spline.degree + 1) * surface, along, around

    def _near(self, station: Ints, carriers: Floats) -> Floats:
        """Return the carriers (k, d + 1, 3 block) of spans with first stations (k,)."""
        return carriers.reshape(-1, 3 * self.block)[station[:, None] + np.arange(self._spline.degree + 1)]

    def _span(self, surface: Ints, s: Floats) -> Ints:
        """Return the spans (k,) of all yarns that arc lengths (k,) of surfaces (k,) lie in."""
        span = np.searchsorted(self._starts, s + self._start[surface], side="right") - 1
        return np.clip(span, self._first_span[surface], self._first_span[surface + 1] - 1)

    def _values_at(self, along: list[np.ndarray]) -> sp.csr_matrix:
        """Return the splines (R, stations) at the rings of all yarns."""
        surface = np.repeat(np.arange(len(along)), [len(edges) for edges in along])
        s = np.concatenate(along)
        first, values = self._spline.basis(s, 0, self._span(surface, s))
        wide = self._spline.degree + 1
        station = (first - wide * surface)[:, None] + np.arange(wide)
        shape = len(s), len(self._first) - 1
        return sp.csr_matrix((values[0].ravel(), station.ravel(), wide * np.arange(len(s) + 1)), shape=shape)


def _waves(block: int, angle: Floats, orders: int = 2) -> Floats:
    """Return 1, cos t, sin t, cos 2 t, ... and derivatives (orders + 1, k, block) at angles (k,)."""
    waves = np.empty((orders + 1, len(angle), block))
    waves[0, :, 0] = 1.0
    cosine, sine = np.cos(angle), np.sin(angle)
    if block > 1:
        waves[0, :, 1], waves[0, :, 2] = cosine, sine
    for last in range(1, block - 2, 2):
        even = waves[0, :, last]
        odd = waves[0, :, last + 1]
        waves[0, :, last + 2] = even * cosine - odd * sine
        waves[0, :, last + 3] = odd * cosine + even * sine
    wave = (np.arange(block) + 1) // 2
    if orders > 0:
        # The derivative of a cosine is the sine beside it, and the other way round.
        beside = np.where(np.arange(block) % 2 == 1, 1, -1)
        partner = np.arange(block) + np.where(wave > 0, beside, 0)
        np.multiply(waves[0][:, partner], -wave * beside, out=waves[1])
    if orders > 1:
        np.multiply(waves[0], -(wave**2), out=waves[2])
    return waves
