"""Which Gauss points can touch which surface: all pairs nearer than a margin, so that no crossing escapes.

The search compares cells, of which there are a ninth as many as points. The closest place of a cell's middle bounds the
distances of its points, which differ by no more than the points are apart; their closest places follow to first order.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.mechanics.contact.friction import ContactHistory
from knitstudy.mechanics.contact.surface import Projection, Stencil, Surfaces, follows, project
from knitstudy.mechanics.contact.tangent import CHUNK, Quadrature
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.batches import by_parts

# Cells or rings whose neighbours are held at a time: of each some tens are near, nearly all on its own yarn.
AT_ONCE = 16_384

# Parameters by which closest places of a cell's points may be guessed apart from that of its middle.
FARTHEST = 2.0


class Search:
    """Finds the pieces of surface that are near each other, in any configuration.

    Points of a surface are searched near another one if ``meets`` says so, a surface with itself included: there,
    rings nearer than half a turn around the section along the yarn are left out, which only a yarn bent to less than
    its own radius could bring together. A point that is near two separate pieces of one surface faces both.
    """

    def __init__(
        self,
        surfaces: Surfaces,
        quadrature: Quadrature,
        carriers: Floats,  # (M, 3), of the undeformed surfaces [m]
        meets: Bools,  # (G, G), whose points may touch which surfaces
        free: Callable[[np.ndarray], np.ndarray] | None,  # which (P,) of places (P, 3) [m] may; None: all
    ) -> None:
        self.surfaces, self.quadrature, self.meets = surfaces, quadrature, meets
        rows = surfaces.cells[:, 0] + 1
        self._surface = np.repeat(np.arange(len(rows)), rows)
        self._row = np.concatenate([np.arange(count) for count in rows])
        self._first = np.concatenate([[0], np.cumsum(rows)])
        edges = [surfaces.edges(number)[0] for number in range(len(rows))]
        # Rings of all surfaces on one line: a surface follows the one before.
        lengths = np.array([edge[-1] - edge[0] + 1 for edge in edges])
        self._shift = np.cumsum(lengths) - lengths - [edge[0] for edge in edges]
        self._along = np.concatenate(edges) + np.repeat(self._shift, rows)
        self._arc = np.concatenate([[0], np.cumsum(self._steps(surfaces.centres(carriers)))])
        sizes = np.array([self._ring_sizes(number, carriers) for number in range(len(rows))])
        self._reach, self._chord = sizes.T
        self.reach = float(self._reach.max())  # largest distance of a ring's places from its middle [m]
        self._free: np.ndarray | None = None  # bool (P,)
        if free is not None:
            self._free = by_parts(
                lambda part: free(self.positions(quadrature.points(part), carriers)),
                len(quadrature.area),
                CHUNK,
            )

    def find(self, carriers: Floats, margin: float) -> tuple[ContactHistory, Floats, Floats]:
        """Return all pairs whose distance may be below `margin` [m] where the carriers (M, 3) are now, as open ones.

        And their arcs (c,), as of `arc`, and lower bounds of their gaps (c,) [m].
        """
        cell, size, row = self._near_cells(carriers, margin)
        surface = self._surface[row]
        middle = self._middles(cell, carriers)
        guess = np.empty((len(row), 2))
        for number in np.unique(surface):
            here = np.flatnonzero(surface == number)
            guess[here] = self._place(number, self._row[row[here]], middle[here], carriers)
        closest = project(self.surfaces, carriers, surface, middle, guess)
        gap = self.gap(self.quadrature.surface_of(cell), surface, closest)
        # Beyond an edge of the surface nothing is known of the points beside the middle.
        may_meet = self._may_meet(self.ring(cell), self._ring_at(surface, closest.xi[:, 0]))
        near = np.flatnonzero(((gap - size < margin) | ~closest.found) & may_meet)

        def points(part: slice) -> tuple[np.ndarray, ...]:
            these = near[part]
            found = self._points_of(
                cell[these], surface[these], middle[these], closest[these], gap[these], carriers
            )
            point, *_, least = found
            may_touch = (least < margin) & (True if self._free is None else self._free[point])
            return tuple(values[may_touch] for values in found)

        point, surface, guess, least = by_parts(points, len(near), AT_ONCE)
        arc = self.arc(surface, guess[:, 0])
        once = np.lexsort((arc, surface, point))
        # Two pieces of a surface that meet have one closest place.
        once = once[_changes(point[once]) | _changes(surface[once]) | _changes(arc[once], least=1)]
        pairs = ContactHistory.of_open(point[once], surface[once], guess[once], np.zeros(()))
        return pairs, arc[once], least[once]

    def closest(
        self,
        point: Ints,  # (c,)
        surface: Ints,  # (c,), that a point faces
        guess: Floats,  # (c, 2), of the closest place
        position: Floats,  # (c, 3), of the points [m]
        carriers: Floats,  # (M, 3) [m]
    ) -> tuple[Projection, Floats]:
        """Return the closest places and the gaps (c,) [m] of pairs."""
        projected = project(self.surfaces, carriers, surface, position, guess)
        return projected, self.gap(self.quadrature.surface(point), surface, projected)

    def gap(self, own: Ints, surface: Ints, closest: Projection) -> Floats:
        """Return the gaps (k,) [m] of points of surfaces (k,) over others (k,); inf where there is no closest place."""
        offset = self.surfaces.offset
        return np.where(closest.found, closest.distance + offset[surface] + offset[own], np.inf)

    def arc(self, surface: Ints, along: Floats) -> Floats:
        """Return undeformed arc lengths (k,) of parameters along (k,) on surfaces (k,), over the reach of a ring.

        Of two pieces of a surface that a point is near, places are farther apart than that.
        """
        return np.interp(along + self._shift[surface], self._along, self._arc) / self.reach

    def positions(self, point: Ints, carriers: Floats) -> Floats:
        """Return where points (k,) are [m], for current carriers (M, 3)."""
        surface, xi = self.quadrature.places(point)
        return by_parts(
            lambda part: self.surfaces.positions(surface[part], xi[part], carriers), len(point), CHUNK
        )

    def ring(self, cell: Ints) -> Ints:
        """Return the first of the two rings (k,) that cells (k,) lie between."""
        surface, place = self.quadrature.row_and_column(cell)
        return self._first[surface] + place[:, 0]

    def stencil(self, point: Ints) -> Stencil:
        """Return the stencils of points (k,)."""
        return self.surfaces.stencil(*self.quadrature.places(point))

    def _ring_sizes(self, number: int, carriers: Floats) -> tuple[float, float]:
        """Return the largest distances of a surface's rings from their middles and between neighbours on them [m]."""
        row = np.arange(self.surfaces.cells[number, 0] + 1)
        ring = self.surfaces.ring(number, row, carriers)
        middle = self.surfaces.centres(carriers)[self._first[number] + row, None]
        chords = np.diff(ring, axis=1, append=ring[:, : int(self.surfaces.closed[number])])
        reach, chord = (float(np.linalg.norm(apart, axis=2).max()) for apart in (ring - middle, chords))
        return reach, chord

    def _steps(self, centres: Floats) -> Floats:
        """Return the distances (R - 1,) of rings from the next ones [m]; 0 from one surface to another."""
        steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
        steps[self._first[1:-1] - 1] = 0
        return steps

    def _middles(self, cell: Ints, carriers: Floats) -> Floats:
        """Return the middles (k, 3) of cells (k,) [m]."""
        return self.surfaces.positions(*self.quadrature.within(cell, np.full(2, 0.5)), carriers)

    def _may_meet(self, one: Ints, other: Ints) -> Bools:
        """Return whether rings may touch: different surfaces that meet, or far pieces of the same one."""
        a, b = self._surface[one], self._surface[other]
        far = np.abs(self._arc[one] - self._arc[other]) > np.pi * self._reach[a]
        return self.meets[a, b] & ((a != b) | far)

    def _near_cells(self, carriers: Floats, margin: float) -> tuple[Ints, Floats, Ints]:
        """Return cells (k,), the ways (k,) from their middles to their points at most [m], and rings (k,) near them.

        There is one ring for every cell and connected piece of a surface, the nearest one.
        """
        centres = self.surfaces.centres(carriers)
        step = self._steps(centres)
        tree = cKDTree(centres)
        cell = self._cells_of(self._near_rows(tree, margin, step.max()))
        # Outside of a bend a yarn is at most twice as long as in its middle: none is bent to less than its radius.
        size = step[self.ring(cell)] + 0.5 * self._chord[self.quadrature.surface_of(cell)]
        reach = self._reach[self._surface] + margin + 0.5 * np.maximum(np.append(step, 0), np.append(0, step))
        return by_parts(
            lambda part: self._nearest(cell[part], size[part], tree, reach, carriers), len(cell), AT_ONCE
        )

    def _near_rows(self, tree: cKDTree, margin: float, step: float) -> Ints:
        """Return the rings with another one that may touch them; none are farther apart than `step` [m]."""
        reach = 2 * self.reach + margin + 2 * step

        def near(part: slice) -> Ints:
            pairs = cKDTree(tree.data[part]).sparse_distance_matrix(tree, reach, output_type="ndarray")
            one = part.start + pairs["i"]
            return np.unique(one[self._may_meet(one, pairs["j"])])

        return by_parts(near, tree.n, AT_ONCE)

    def _cells_of(self, rows: Ints) -> Ints:
        """Return the cells (k,) beside rings that have points."""
        surface = self._surface[rows]
        layer = np.concatenate([self._row[rows] - 1, self._row[rows]])
        surface = np.concatenate([surface, surface])
        inside = (layer >= 0) & (layer < self.surfaces.cells[surface, 0])
        surface, layer = np.unique(np.stack([surface[inside], layer[inside]]), axis=1)
        count = self.surfaces.cells[surface, 1]
        start = self.quadrature.first_cell[surface] + layer * count
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        cell = np.repeat(start, count) + within
        return cell if self.surfaces.images is None else cell[~self.surfaces.images[cell]]

    def _nearest(
        self, cell: Ints, size: Floats, tree: cKDTree, reach: Floats, carriers: Floats
    ) -> tuple[Ints, Floats, Ints]:
        """Return cells (k,), their sizes, and rings (k,): their middles are nearer than reach (R,) and size (c,) [m].

        Of every connected piece of a surface, the nearest ring.
        """
        middle = cKDTree(self._middles(cell, carriers))
        pairs = middle.sparse_distance_matrix(tree, reach.max() + size.max(initial=0), output_type="ndarray")
        i, row = pairs["i"], pairs["j"]
        near = pairs["v"] <= reach[row] + size[i]
        near[near] = self._may_meet(self.ring(cell[i[near]]), row[near])
        pairs = pairs[near]
        pairs = pairs[np.lexsort((pairs["j"], pairs["i"]))]
        i, j = pairs["i"], pairs["j"]
        piece = np.cumsum(_changes(i) | _changes(self._surface[j]) | _changes(j, least=2))
        nearest = np.lexsort((pairs["v"], piece))
        best = nearest[np.unique(piece[nearest], return_index=True)[1]]
        return cell[i[best]], size[i[best]], j[best]

    def _ring_at(self, surface: Ints, along: Floats) -> Ints:
        """Return the last rings (k,) before parameters along (k,) of surfaces (k,)."""
        ring = np.searchsorted(self._along, along + self._shift[surface], side="right") - 1
        return np.clip(ring, self._first[surface], self._first[surface + 1] - 1)

    def _points_of(
        self, cell: Ints, surface: Ints, middle: Floats, closest: Projection, gap: Floats, carriers: Floats
    ) -> tuple[Ints, Ints, Floats, Floats]:
        """Return numbers, surfaces, guesses and least gaps of all points of cells (k,) whose middles are projected."""
        many = self.quadrature.per_cell
        number = np.repeat(np.arange(len(cell)), many)
        point = many * cell[number] + np.tile(np.arange(many), len(cell))
        surface = surface[number]
        position = self.positions(point, carriers)
        way = position - middle[number]
        guess = closest.xi[number] + np.clip(follows(closest.tangent[number], way), -FARTHEST, FARTHEST)
        least = gap[number] - np.linalg.norm(way, axis=1)
        alone = np.flatnonzero(~closest.found[number])
        own = project(self.surfaces, carriers, surface[alone], position[alone], closest.xi[number[alone]])
        guess[alone] = own.xi
        least[alone] = self.gap(self.quadrature.surface(point[alone]), surface[alone], own)
        return point, surface, guess, least

    def _place(self, number: int, row: Ints, position: Floats, carriers: Floats) -> np.ndarray:
        """Return the place (k, 2) on rings of a surface that is nearest to positions (k, 3)."""
        along, around = self.surfaces.edges(number)

        def nearest(part: slice) -> Ints:
            apart = self.surfaces.ring(number, row[part], carriers) - position[part, None]
            return np.argmin(np.einsum("kai,kai->ka", apart, apart), axis=1)

        return np.stack(
            [along[row], around[by_parts(nearest, len(row), max(1, 400_000 // len(around)))]], axis=1
        )


def _changes(values: np.ndarray, least: float = 0) -> Bools:
    """Return where values (k,) differ from those before them, or are larger by that least; the first one does."""
    step = np.diff(values)
    return np.concatenate([[True], step >= least if least else step != 0])[: len(values)]
