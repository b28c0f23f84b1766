"""The solid arcs of a window as a specimen of their own, whose yarns are the arcs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from knitstudy.geometry.pattern import Crossings, Knit
from knitstudy.geometry.spline import Centreline
from knitstudy.window.cells import Window


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
    window : Window
    """

    knit: Knit
    window: Window

    @property
    def radius(self) -> float:
        """Radius of the yarn [m]."""
        return self.knit.radius

    @cached_property
    def centrelines(self) -> tuple[Arc, ...]:
        """Of every piece."""
        lines, window = self.knit.centrelines, self.window
        return tuple(
            Arc(lines[yarn], low, high - low)
            for yarn, (low, high) in zip(window.yarn, window.arc, strict=True)
        )

    @cached_property
    def crossings(self) -> Crossings:
        """Crossings of the window, of pieces instead of yarns."""
        every, window = self.knit.crossings, self.window
        chosen = {name: getattr(every, name)[window.crossing] for name in Crossings.__dataclass_fields__}
        yarn, s = chosen["yarn"], chosen["arc_length"]
        piece = window.piece(yarn.ravel(), s.ravel()).reshape(yarn.shape)
        return replace(Crossings(**chosen), yarn=piece, arc_length=s - window.arc[piece, 0])

    def stations(self, piece: int) -> np.ndarray:
        """Return the ascending arc lengths (k,) of a piece's crossings [m]."""
        crossings = self.crossings
        return np.sort(crossings.arc_length[crossings.yarn == piece])
