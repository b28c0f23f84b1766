"""How the driven grips of a specimen move (section 2.3 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from knitstudy.geometry.fabric import Fabric
from knitstudy.mechanics.increment import between_corners
from knitstudy.study.problem_sections import Path, Tension
from knitstudy.study.scene import Scene

DIRECTIONS = ("course", "wale")
"""Of a knit's load, along x and y."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Straight legs from rest through a number of corners.

    Attributes
    ----------
    displacement : ndarray, shape (m, 3)
        Of the driven grips at the corners [m].
    corners : tuple of float
        Their load factors, rising to 1.
    stops : tuple of float
        Load factors at which an increment has to end.
    axis : int
        Direction of the force that is reported.
    length : float
        Length that strains along it refer to [m].
    """

    displacement: np.ndarray
    corners: tuple[float, ...]
    stops: tuple[float, ...]
    axis: int
    length: float

    def at(self, load: float) -> np.ndarray:
        """Return the displacement (3,) at a load factor [m]."""
        return between_corners(self.displacement, self.corners, load)


def load_path(scene: Scene, specimen: Fabric) -> Motion:
    """Return how a scene's grips move: a knit's along the load to its strain, a pair's along its path."""
    if isinstance(scene.load, Path):
        legs = np.array(scene.load.path)
        corners = tuple((np.arange(len(legs)) + 1) / len(legs))
        return Motion(legs, corners, (), axis=2, length=float(specimen.size[2]))
    axis = DIRECTIONS.index(scene.load.direction)
    length = float(specimen.size[axis])
    stops = tuple(stop / scene.load.strain for stop in scene.load.stops)
    return Motion(scene.load.strain * length * np.eye(3)[[axis]], (1.0,), stops, axis, length)


def place_on_path(load: Tension | Path, factor: float) -> str:
    """Return where a load factor is on the load path, in words: a knit's strain, the leg of a pair's path."""
    if isinstance(load, Tension):
        return f"strain {factor * load.strain:.2%}"
    legs = len(load.path)
    # Rounding at a corner must not begin the next leg.
    return f"leg {max(1, ceil(factor * legs - 1e-9))} of {legs}"
