"""A surface of a three-dimensional picture. What renders it needs no more than this and numpy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Surface:
    """Facets of one colour.

    Attributes
    ----------
    points : ndarray, shape (N, 3)
        Corners [m].
    faces : ndarray of int, shape (F, 4)
        Corners of the facets, counter-clockwise from outside; two of them may coincide.
    colour : str
    opacity : float
    edges : bool
        Whether the edges of the facets are drawn.
    """

    points: np.ndarray
    faces: np.ndarray
    colour: str
    opacity: float = 1.0
    edges: bool = False
