"""Pieces of a knit's yarns as a specimen of their own, whose yarns are the pieces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from knitstudy.geometry.pattern import Crossings, Knit
from knitstudy.geometry.spline import Centreline


@dataclass(frozen=True, eq=False)
class Arcs:
    """Which arcs of a knit's yarns are pieces, and the crossings that lie on them.

    Attributes
    ----------
    crossing : ndarray of int, shape (V,)
        Crossings of which both yarns are there, ascending.
    yarn : ndarray of int, shape (P,)
        Yarn of every arc, ascending.
    arc : ndarray, shape (P, 2)
        Where it begins and ends [m]; of a yarn ascending.
    """

    crossing: np.ndarray
    yarn: np.ndarray
    arc: np.ndarray

    def piece(self, yarn: np.ndarray, arc_length: np.ndarray) -> np.ndarray:
        """Return the arcs (k,) that places on yarns (k,) lie in, -1 where there is none."""
        inside = (yarn[:, None] == self.yarn) & (arc_length[:, None] > self.arc[:, 0])
        inside &= arc_length[:, None] < self.arc[:, 1]
        return np.where(inside.any(axis=1), inside.argmax(axis=1), -1)


@dataclass(frozen=True, eq=False)
class Arc:
    """A part of a centreline, with arc lengths of its own.

    Attributes
    ----------
    line : Centreline
    start, length : float
        Where it begins, and how long it is [m].
    """

    line: Centreline
    start: float
    length: float

    @property
    def curve(self):
        """Curve of the whole centreline, whose parameters `parameter` returns."""
        return self.line.curve

    def position(self, s: np.ndarray) -> np.ndarray:
        """Return points (k, 3) at arc lengths (k,) of this arc [m]."""
        return self.line.position(self.start + s)

    def tangent(self, s: np.ndarray) -> np.ndarray:
        """Return unit tangents (k, 3)."""
        return self.line.tangent(self.start + s)

    def parameter(self, s: np.ndarray) -> np.ndarray:
        """Return parameters (k,) of the curve."""
        return self.line.parameter(self.start + s)


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of yarns as a specimen: `radius`, `centrelines` and `crossings` as a knit has them.

    Attributes
    ----------
    knit : Knit
    arcs : Arcs
    """

    knit: Knit
    arcs: Arcs

    @property
    def radius(self) -> float:
        """Radius of the yarn [m]."""
        return self.knit.radius

    @cached_property
    def centrelines(self) -> tuple[Arc, ...]:
        """Of every piece."""
        lines = self.knit.centrelines
        return tuple(
            Arc(lines[yarn], low, high - low)
            for yarn, (low, high) in zip(self.arcs.yarn, self.arcs.arc, strict=True)
        )

    @cached_property
    def crossings(self) -> Crossings:
        """Crossings of the pieces, in the order of the knit, with pieces instead of yarns."""
        every, arcs = self.knit.crossings, self.arcs
        chosen = {name: getattr(every, name)[arcs.crossing] for name in Crossings.__dataclass_fields__}
        yarn, s = chosen["yarn"], chosen["arc_length"]
        piece = arcs.piece(yarn.ravel(), s.ravel()).reshape(yarn.shape)
        return replace(Crossings(**chosen), yarn=piece, arc_length=s - arcs.arc[piece, 0])

    def stations(self, piece: int) -> np.ndarray:
        """Return the ascending arc lengths (k,) of a piece's crossings [m]."""
        crossings = self.crossings
        return np.sort(crossings.arc_length[crossings.yarn == piece])
