"""Several cells of an endless structure as one larger cell: which places and pairs are copies of which."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.beams.pair_search import named_from_first, pair_keys, pairs_of
from knitstudy.mechanics.core.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class Tiling:
    """How the m places along the yarns of a larger cell follow from the n places of a cell.

    A yarn of the larger cell is as many copies of a yarn, one behind the other, as the cell has along courses; copies
    along wales are yarns of their own, those of a cell together.
    """

    counts: Ints  # (2,), cells along courses and along wales
    place: Ints  # (m,), place of the cell that each is a copy of
    cell: Ints  # (m, 2), which cell of the larger one it lies in

    @classmethod
    def of(cls, yarn: Ints, counts: Ints) -> Tiling:
        """Return the tiling of places on yarns (n,); places of a yarn follow each other.

        Examples
        --------
        >>> Tiling.of(np.array([0, 0, 1]), np.array([2, 1])).place.tolist()
        [0, 1, 0, 1, 2, 2]
        """
        courses, wales = counts
        yarns = [np.flatnonzero(yarn == number) for number in np.unique(yarn)]
        place = np.concatenate([np.tile(places, courses) for places in yarns])
        along = np.concatenate([np.repeat(np.arange(courses), len(places)) for places in yarns])
        across = np.repeat(np.arange(wales), len(place))
        return cls(
            counts=np.asarray(counts),
            place=np.tile(place, wales),
            cell=np.column_stack([np.tile(along, wales), across]),
        )

    @property
    def number(self) -> Ints:
        """Numbers (courses, wales, n) of the copies of every place."""
        number = np.empty((*self.counts, self.place.max() + 1), dtype=np.int64)
        number[self.cell[:, 0], self.cell[:, 1], self.place] = np.arange(len(self.place))
        return number

    def positions(self, position: Floats, vectors: Floats) -> Floats:
        """Return positions (m, 3) from those of a cell (n, 3) and its lattice vectors (2, 3) [m]."""
        return position[self.place] + self.cell @ vectors

    def friction(self, key: Ints, traction: Floats, stored: Floats) -> tuple[Ints, Floats, Floats]:
        """Return keys, tractions and stored energies of the copies of all pairs; arguments as of `LineHistory`.

        Both points of a pair see each other, and its key names one of them first. In the larger cell this may be the
        other one: then the traction is that on the other yarn.
        """
        number = self.number
        i, j, image = pairs_of(key, number.shape[2])
        courses, wales = np.indices(tuple(self.counts.tolist())).reshape(2, -1)
        cell = np.repeat(np.column_stack([courses, wales]), len(key), axis=0)
        i, j, image, traction, stored = (
            np.concatenate([values] * len(courses)) for values in (i, j, image, traction, stored)
        )
        periods, other = np.divmod(cell + image, self.counts)
        first, second = number[cell[:, 0], cell[:, 1], i], number[other[:, 0], other[:, 1], j]
        turned = ~named_from_first(first, second, periods)
        first[turned], second[turned] = second[turned], first[turned]
        periods[turned] *= -1
        traction[turned] = -traction[turned, ::-1]
        tiled = pair_keys(first, second, periods, len(self.place))
        order = np.argsort(tiled)
        return tiled[order], traction[order], stored[order]
