"""Stress in the cells of solid yarns: what every fidelity's module of stress returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class CellStress:
    """Stress in the hexahedra of the mesh of a scene, in its order, whatever the yarns are divided into.

    Attributes
    ----------
    integral : ndarray, shape (E, 3, 3)
        Of the Cauchy stress over the deformed cell [N m].
    volume : ndarray, shape (E,)
        Of the deformed cell [m3].
    reference, place : ndarray, shape (E, 3)
        Its middle, undeformed and deformed [m].
    """

    integral: np.ndarray
    volume: np.ndarray
    reference: np.ndarray
    place: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        """Mean Cauchy stress (E, 3, 3) [Pa]."""
        return self.integral / self.volume[:, None, None]
