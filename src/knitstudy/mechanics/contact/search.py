"""Which Gauss points can touch which surface: all pairs nearer than a margin, so that no crossing escapes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.mechanics.contact.quadrature import CHUNK, Quadrature
from knitstudy.mechanics.contact.surface import Stencil, Surfaces

AT_ONCE = 16_384
"""Points or rings whose neighbours are held at a time: of each some tens are near, nearly all on its own yarn."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Pairs that may touch: points (c,), surfaces (c,) that they face, and guesses (c, 2) of the closest places."""

    point: np.ndarray
    surface: np.ndarray
    guess: np.ndarray


class Search:
    """Finds the pieces of surface that are near each other, in any configuration.

    Two surfaces are searched if ``meets`` says so, a surface with itself included: there, rings nearer than
    half a turn around the section along the yarn are left out, which only a yarn bent to less than its own radius
    could bring together. A point that is near two separate pieces of one surface faces both.

    Parameters
    ----------
    surfaces : Surfaces
    quadrature : Quadrature
    carriers : ndarray, shape (M, 3)
        Of the undeformed surfaces [m].
    meets : ndarray of bool, shape (G, G)
        Which surfaces may touch; symmetric.
    pieces : ndarray of int, shape (R,), optional
        A number for every ring: those with the same one, unless it is negative, do not touch.
    """

    def __init__(
        self,
        surfaces: Surfaces,
        quadrature: Quadrature,
        carriers: np.ndarray,
        meets: np.ndarray,
        pieces: np.ndarray | None = None,
    ) -> None:
        self.surfaces, self.quadrature, self.meets = surfaces, quadrature, meets
        rows = surfaces.cells[:, 0] + 1
        self._pieces = np.full(rows.sum(), -1) if pieces is None else pieces
        self._surface = np.repeat(np.arange(len(rows)), rows)
        self._row = np.concatenate([np.arange(count) for count in rows])
        self._first = np.concatenate([[0], np.cumsum(rows)])
        centres = surfaces.centres(carriers)
        self._reach = np.array([self._farthest(number, carriers, centres) for number in range(len(rows))])
        steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
        steps[self._first[1:-1] - 1] = 0
        self._arc = np.concatenate([[0], np.cumsum(steps)])
        self._step = float(steps.max())

    def find(self, carriers: np.ndarray, margin: float) -> Candidates:
        """Return all pairs whose distance may be below `margin` [m] where the carriers (M, 3) are now."""
        tree = cKDTree(self.surfaces.centres(carriers))
        point = self._points_of(self._near_rows(tree, margin))
        position = self.positions(point, carriers)
        parts = _parts(len(point))
        near = [self._nearest(point[part], position[part], tree, margin) for part in parts]
        which = _joined(part.start + i for part, (i, _) in zip(parts, near, strict=True))
        row = _joined(j for _, j in near)
        surface = self._surface[row]
        guess = np.empty((len(row), 2))
        for number in np.unique(surface):
            here = np.flatnonzero(surface == number)
            guess[here] = self._place(number, self._row[row[here]], position[which[here]], carriers)
        return Candidates(point[which], surface, guess)

    def positions(self, point: np.ndarray, carriers: np.ndarray) -> np.ndarray:
        """Return where points (k,) are [m], for current carriers (M, 3)."""
        position = np.empty((len(point), 3))
        surface, xi = self.quadrature.surface, self.quadrature.xi
        for low in range(0, len(point), CHUNK):
            part = slice(low, low + CHUNK)
            position[part] = self.surfaces.positions(surface[point[part]], xi[point[part]], carriers)
        return position

    def stencil(self, point: np.ndarray) -> Stencil:
        """Return the stencils of points (k,)."""
        return self.surfaces.stencil(self.quadrature.surface[point], self.quadrature.xi[point])

    def _farthest(self, number: int, carriers: np.ndarray, centres: np.ndarray) -> float:
        """Return the largest distance of a surface's rings from their middles [m]."""
        row = np.arange(self.surfaces.cells[number, 0] + 1)
        apart = self.surfaces.ring(number, row, carriers) - centres[self._first[number] + row, None]
        return float(np.linalg.norm(apart, axis=2).max())

    def _may_meet(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Return whether rings may touch: different surfaces that meet, or far pieces of the same one."""
        a, b = self._surface[one], self._surface[other]
        far = np.abs(self._arc[one] - self._arc[other]) > np.pi * self._reach[a]
        apart = (self._pieces[one] < 0) | (self._pieces[one] != self._pieces[other])
        return self.meets[a, b] & ((a != b) | far) & apart

    def _near_rows(self, tree: cKDTree, margin: float) -> np.ndarray:
        """Return the rings with another one that may touch them."""
        reach = 2 * self._reach.max() + margin + 2 * self._step
        near = np.zeros(tree.n, dtype=bool)
        for rows in _parts(tree.n):
            pairs = cKDTree(tree.data[rows]).sparse_distance_matrix(tree, reach, output_type="ndarray")
            one = pairs["i"] + rows.start
            near[one[self._may_meet(one, pairs["j"])]] = True
        return np.flatnonzero(near)

    def _points_of(self, rows: np.ndarray) -> np.ndarray:
        """Return the points (k,) of the cells beside rings."""
        surface = self._surface[rows]
        layer = np.concatenate([self._row[rows] - 1, self._row[rows]])
        surface = np.concatenate([surface, surface])
        inside = (layer >= 0) & (layer < self.surfaces.cells[surface, 0])
        key = np.unique(np.stack([surface[inside], layer[inside]], axis=1), axis=0)
        if not len(key):
            return np.empty(0, dtype=np.int64)
        surface, layer = key.T
        quadrature = self.quadrature
        count = quadrature.per_row[surface]
        start = quadrature.first[surface] + layer * count
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        return np.repeat(start, count) + within

    def _nearest(
        self, point: np.ndarray, position: np.ndarray, tree: cKDTree, margin: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers (k,) of points and rings, one pair for every point and connected piece of a surface."""
        reach = self._reach + margin + 0.5 * self._step
        pairs = cKDTree(position).sparse_distance_matrix(tree, reach.max(), output_type="ndarray")
        mine, row = point[pairs["i"]], pairs["j"]
        own_row = self._first[self.quadrature.surface[mine]] + self.quadrature.cell[mine, 0]
        allowed = self._may_meet(own_row, row)
        allowed &= pairs["v"] <= reach[self._surface[row]]
        pairs = pairs[allowed]
        if not len(pairs):
            return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
        pairs = pairs[np.lexsort((pairs["j"], pairs["i"]))]
        i, j = pairs["i"], pairs["j"]
        new = np.ones(len(pairs), dtype=bool)
        new[1:] = (np.diff(i) != 0) | (np.diff(self._surface[j]) != 0) | (np.diff(j) > 1)
        start = np.flatnonzero(new)
        closest = np.minimum.reduceat(pairs["v"], start)
        at_closest = np.flatnonzero(pairs["v"] == np.repeat(closest, np.diff(np.append(start, len(pairs)))))
        piece = np.cumsum(new)[at_closest]
        best = at_closest[np.unique(piece, return_index=True)[1]]
        return i[best], j[best]

    def _place(self, number: int, row: np.ndarray, position: np.ndarray, carriers: np.ndarray) -> np.ndarray:
        """Return the place (k, 2) on rings of a surface that is nearest to positions (k, 3)."""
        along, around = self.surfaces.edges(number)
        nearest = np.empty(len(row), dtype=np.int64)
        chunk = max(1, 400_000 // len(around))
        for low in range(0, len(row), chunk):
            part = slice(low, low + chunk)
            apart = self.surfaces.ring(number, row[part], carriers) - position[part, None]
            nearest[part] = np.argmin(np.einsum("kai,kai->ka", apart, apart), axis=1)
        return np.stack([along[row], around[nearest]], axis=1)


def _parts(count: int) -> list[slice]:
    return [slice(low, min(low + AT_ONCE, count)) for low in range(0, count, AT_ONCE)]


def _joined(numbers: Iterable[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.empty(0, dtype=np.int64), *numbers])
