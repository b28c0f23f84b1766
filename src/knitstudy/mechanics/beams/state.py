"""State of a network of beams, and the history of its contact at the last converged increment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.batches import Chosen


@dataclass(frozen=True, eq=False)
class CommittedPoints:
    """Points of contact at the last converged increment."""

    position: np.ndarray  # (p, 3) [m]
    rotation: np.ndarray  # (p, 3, 3), of the sections
    vectors: np.ndarray  # (2, 3), of the lattice [m]
    diameter: float  # of the yarns [m]


@dataclass(frozen=True, eq=False)
class LineHistory(Chosen):
    """History of the pairs of points that touched at the last converged increment, and all points then."""

    key: np.ndarray  # int (m,), ascending; which pairs
    arm: np.ndarray  # (m, 2, 3), from the centres to the points that met, in the sections' axes [m]
    normal: np.ndarray  # (m, 2, 3), at the closest points of both yarns, in the axes of both sections
    share: np.ndarray  # (m,), part of the pairs' force along it
    density: np.ndarray  # (m,), c times the lengths of both pieces [m2]
    thinning: np.ndarray  # (m,), its derivative by the distance [m]
    shape: np.ndarray  # (m,), factor of F(delta) by the shape of the contact
    distance: np.ndarray  # (m,), r [m]
    force: np.ndarray  # (m,), their part of the force [N]
    shear: np.ndarray  # (m, 2, 3, 3), S in the axes of both sections
    spring: np.ndarray  # (m,), k [N/m]
    traction: np.ndarray  # (m, 2, 3), friction on j in the axes of both sections [N]
    stored: np.ndarray  # (m,), energy of elastic slip [J]
    dissipated: float = 0.0  # work of friction so far [J]
    points: CommittedPoints | None = None  # None: nothing has been converged yet

    @classmethod
    def none(cls) -> LineHistory:
        """Return the history of yarns that have not touched."""
        one, both = np.zeros(0), np.zeros((0, 2, 3))
        key, square = np.zeros(0, dtype=np.int64), np.zeros((0, 2, 3, 3))
        return cls(key, both, both, one, one, one, one, one, one, square, one, both, one)


@dataclass(frozen=True, eq=False)
class BeamContactHistory:
    """History of contact at the last converged increment: of pairs of points and of K crossings."""

    points: LineHistory
    on_stations: np.ndarray  # (S, 3), internal forces of contact [N]
    force: np.ndarray  # (K, 3), of contact on the first yarn [N]
    # (K + 1,), of the yarns at their closest points, at last of those without a crossing; nan where none are near [m]
    gap: np.ndarray
    slip: np.ndarray  # (K,), mean length slid since first contact [m]


@dataclass(frozen=True, eq=False)
class BeamState:
    """Configuration of N nodes, or of points that nodes carry."""

    position: np.ndarray  # (N, 3), positions [m]
    rotation: np.ndarray  # (N, 3, 3), rotations from the reference, where they are the identity
    contact: BeamContactHistory | None = None
    released: float = 1.0  # share of the elements' natural curvature that acts

    @property
    def contact_history(self) -> BeamContactHistory:
        """History of contact of a state that a model with contact has made."""
        assert self.contact is not None, "this state is of a model without contact"
        return self.contact
