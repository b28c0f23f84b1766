"""The camera of three-dimensional pictures: a parallel projection onto the plane of the picture.

Lengths in that plane are true, so a picture can carry a scale bar, and everything that is drawn over it
finds its place by the same projection.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class View:
    """A direction of sight and what is up in it.

    Attributes
    ----------
    towards : tuple of 3 floats
        From the eye into the scene.
    up : tuple of 3 floats
        Appears upright; needs not be normal to ``towards``.
    """

    towards: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)

    @classmethod
    def orbit(cls, turn: float, tilt: float) -> View:
        """Return the view onto the xy plane after going round y by `turn` and then up by `tilt` [deg]."""
        a, b = np.radians([turn, tilt])
        eye = np.array([np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)])
        return cls(tuple(-eye))

    @cached_property
    def basis(self) -> np.ndarray:
        """Unit vectors to the right, up and to the eye as rows (3, 3)."""
        back = -np.asarray(self.towards, dtype=float)
        back /= np.linalg.norm(back)
        right = np.cross(self.up, back)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return places (..., 2) of points (..., 3) in the plane of the picture, in the unit of the points."""
        return np.asarray(points) @ self.basis[:2].T

    def nearness(self, points: np.ndarray) -> np.ndarray:
        """Return how far points (..., 3) lie towards the eye (...,)."""
        return np.asarray(points) @ self.basis[2]


FRONT = View((0.0, 0.0, -1.0))
"""Onto the plane of the fabric."""
