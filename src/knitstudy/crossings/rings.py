"""Where the rings of surfaces, the edges of contact's cells across a yarn, lie along their yarns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True, eq=False)
class Rings:
    """Rings of all yarns.

    Attributes
    ----------
    along : tuple of ndarray (r,)
        Of every yarn: the parameters of its rings, ascending.
    arc_length : tuple of ndarray (r,)
        Their arc lengths, m.
    """

    along: tuple[np.ndarray, ...]
    arc_length: tuple[np.ndarray, ...]

    @classmethod
    def of_rows(cls, arc_length: tuple[np.ndarray, ...]) -> Rings:
        """Return the rings of grids whose rows of nodes, which count as parameters, lie at arc lengths in m."""
        return cls(tuple(np.arange(float(len(s))) for s in arc_length), arc_length)

    @cached_property
    def _first(self) -> np.ndarray:
        return np.concatenate([[0], np.cumsum([len(along) for along in self.along])])

    def arc_length_at(self, yarn: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Return arc lengths (k,) in m of places with parameters (k,) on yarns (k,)."""
        return self._by_yarn(yarn, along, lambda n, x: np.interp(x, self.along[n], self.arc_length[n]))

    def nearest(self, yarn: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Return the rings (k,), counted through all yarns, next to places with parameters (k,) on yarns (k,)."""

        def ring(number: int, along: np.ndarray) -> np.ndarray:
            edges = self.along[number]
            return self._first[number] + np.searchsorted(0.5 * (edges[1:] + edges[:-1]), along)

        return self._by_yarn(yarn, along, ring).astype(np.int64)

    def _by_yarn(
        self, yarn: np.ndarray, along: np.ndarray, function: Callable[[int, np.ndarray], np.ndarray]
    ) -> np.ndarray:
        values = np.empty(len(yarn))
        for number in np.unique(yarn):
            here = yarn == number
            values[here] = function(number, along[here])
        return values
