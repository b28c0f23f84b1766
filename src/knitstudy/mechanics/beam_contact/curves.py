"""Smooth centrelines through the nodes of beams: C1 cubic curves of the undeformed arc length.

Between two stations the curve is Hermite's cubic; its derivative at a station is that of the parabola through three
neighbours, with the arc lengths as they are (Catmull and Rom 1974, for uneven steps). It is linear in the stations,
and a contact point that slides over one feels no kink.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.errors import GeometryError

_POWERS = np.arange(4)
# Hermite's cubics of t in [0, 1] by power: value and slope at t = 0, value and slope at t = 1.
_HERMITE = np.array([[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]], dtype=float)


@dataclass(frozen=True, eq=False)
class Stencil:
    """Points (k,) of curves as weighted sums of stations.

    Attributes
    ----------
    stations : ndarray of int, shape (k, 4)
    value, first, second : ndarray, shape (k, 4)
        Weights of the position and of its derivatives with respect to arc length [1, 1/m, 1/m2].
    """

    stations: np.ndarray
    value: np.ndarray
    first: np.ndarray
    second: np.ndarray

    def of(self, weights: np.ndarray, field: np.ndarray) -> np.ndarray:
        """Return the sums (k, ...) of a field (S, ...) of the stations with one of the weights."""
        return np.einsum("kp,kp...->k...", weights, field[self.stations])

    def __getitem__(self, chosen: np.ndarray) -> Stencil:
        return Stencil(self.stations[chosen], self.value[chosen], self.first[chosen], self.second[chosen])


class Curves:
    """The centrelines of all yarns.

    Parameters
    ----------
    yarn : ndarray of int, shape (S,)
        Yarn of every station; the stations of a yarn follow each other, yarn 0 first.
    arc_length : ndarray, shape (S,)
        Where they are on the undeformed yarn, rising [m].

    Raises
    ------
    GeometryError
        If a yarn has fewer than three stations.
    """

    def __init__(self, yarn: np.ndarray, arc_length: np.ndarray) -> None:
        yarn, arc_length = np.asarray(yarn), np.asarray(arc_length, dtype=float)
        count = np.bincount(yarn)
        if count.min() < 3:
            raise GeometryError(
                f"yarn {int(np.argmin(count))} has {count.min()} beam nodes: a smooth centreline needs at least 3; "
                "use a smaller mesh.beam_size"
            )
        self.arc_length = arc_length
        self.first = np.concatenate([[0], np.cumsum(count)])
        self.length = arc_length[self.first[1:] - 1]
        # One rising coordinate for all yarns, so that one search serves them.
        self._origin = np.concatenate([[0.0], np.cumsum(2 * self.length)])[:-1]
        self._knots = self._origin[yarn] + arc_length
        self._weights = self._hermite_weights()

    def _hermite_weights(self) -> np.ndarray:
        """Weights (S, 4, 4) that give Hermite's data of the segment after a station from its stencil."""
        s, first = self.arc_length, self.first
        station = np.arange(len(s))
        yarn = np.repeat(np.arange(len(first) - 1), np.diff(first))
        centre = np.clip(station, first[yarn] + 1, first[yarn + 1] - 2)
        knots = s[centre[:, None] + [-1, 0, 1]]
        slope = _parabola_slopes(knots, s)
        weights = np.zeros((len(s), 4, 4))
        last = first[1:] - 1
        segment = np.setdiff1d(station, last)
        length = (s[segment + 1] - s[segment])[:, None]
        weights[segment, 0, 1] = weights[segment, 2, 2] = 1.0
        for row, end in ((1, segment), (3, segment + 1)):
            column = (centre[end] - segment)[:, None] + np.arange(3)
            weights[segment[:, None], row, column] = length * slope[end]
        return weights

    def stencil(self, yarn: np.ndarray, s: np.ndarray) -> Stencil:
        """Return the stencils of the points at arc lengths s (k,) [m] of yarns (k,)."""
        low, high = self.first[yarn], self.first[yarn + 1] - 2
        segment = np.clip(np.searchsorted(self._knots, self._origin[yarn] + s, side="right") - 1, low, high)
        length = self.arc_length[segment + 1] - self.arc_length[segment]
        t = ((s - self.arc_length[segment]) / length)[:, None]
        weights = self._weights[segment]
        value = t**_POWERS @ _HERMITE.T
        first = _POWERS[1:] * t ** _POWERS[:-1] @ _HERMITE[:, 1:].T / length[:, None]
        second = [2.0, 6.0] * t ** _POWERS[:2] @ _HERMITE[:, 2:].T / length[:, None] ** 2
        stations = np.clip(segment[:, None] + np.arange(-1, 3), low[:, None], high[:, None] + 1)
        return Stencil(
            stations, *(np.einsum("kh,khp->kp", basis, weights) for basis in (value, first, second))
        )


def _parabola_slopes(knots: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Weights (S, 3) of three values at knots (S, 3) in the slope of their parabola at places (S,)."""
    slopes = []
    for i in range(3):
        j, k = [n for n in range(3) if n != i]
        rise = 2 * at - knots[:, j] - knots[:, k]
        slopes.append(rise / ((knots[:, i] - knots[:, j]) * (knots[:, i] - knots[:, k])))
    return np.stack(slopes, axis=1)
