"""The potential of two short pieces of yarn, from the force of two yarns that cross, and pairs of such pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.mechanics.batches import Chosen
from knitstudy.mechanics.beams.crossing_force import CrossedCylinders, Power
from knitstudy.mechanics.beams.hertz import LAYERS, Expansion, Patch


@dataclass(frozen=True)
class Repulsion:
    """The potential of two short pieces, from the force of two yarns that cross."""

    law: Power | CrossedCylinders  # of that force, over the gap
    diameter: float  # distance at which it begins, D [m]
    onset: float  # e [m]
    patch: Patch = LAYERS

    def shear(self, tangents: np.ndarray, bends: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Return the stiffness (k, 3, 3) against elastic slip over that against approach; see `Patch.shear`."""
        share = self.law.share if self.patch.poisson_ratio is None else 1.0
        return share * self.patch.shear(tangents, bends, normal)

    def _depth(self, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the approach (k,) at distances (k,) [m], with its soft begin, and its two derivatives."""
        e = self.onset
        delta = np.maximum(self.diameter - distance, 1e-9 * e)
        x, soft = delta / e, delta < e
        return (
            np.where(soft, e * (2 - x) * x**2, delta),
            -np.where(soft, (4 - 3 * x) * x, 1.0),
            np.where(soft, (4 - 6 * x) / e, 0.0),
        )

    def _spread(self, shape: np.ndarray | Expansion) -> np.ndarray | Expansion:
        """Return the factor f of half spaces by the shape of their contact, and 1 of layers.

        A contact of f times the force F(delta) spreads as a circle does at f^2 delta: what a yarn yields beyond a half
        space counts as much. So F, without the factor itself, is F(f^2 delta) / f^3.
        """
        return shape if self.patch.poisson_ratio is not None else shape * 0.0 + 1.0

    def closing(self, y: np.ndarray, shape: np.ndarray) -> np.ndarray:
        """Return F'' (k,) [N/m2] after an approach y (k,) [m] since first contact, its mean up to the onset."""
        f, late = self._spread(shape), np.maximum(y, self.onset)
        early = self.law.stiffness(-(f**2) * self.onset) / (f * self.onset)
        return np.where(y > self.onset, -f * self.law.stiffening(-(f**2) * late), early)

    def of(
        self, distance: np.ndarray, shape: np.ndarray | float = 1.0
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return V (k,) [N/m] at distances (k,) [m] within reach, and its two derivatives."""
        (r,) = Expansion.variables(distance[:, None])
        V = self.potential(r, r * 0.0 + shape)
        return V.value, V.slope[:, 0], V.bend[:, 0, 0]

    def push(
        self, share: np.ndarray, shape: np.ndarray, distance: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return parts (k,) of the force of pairs [N], and their derivatives by the distance [N/m]."""
        within = distance < self.diameter
        _, V1, V2 = self.of(distance, shape)
        return np.where(within, -share * V1, 0.0), np.where(within, -share * V2, 0.0)

    def potential(self, r: Expansion, shape: Expansion) -> Expansion:
        """Return V as a function of what the distance and the factor by the shape are functions of."""
        f = self._spread(shape)
        x = f * f * r.through(*self._depth(r.value))
        law, gap = self.law, -x.value
        F = x.through(law.force(gap), law.stiffness(gap), -law.stiffening(gap))
        return (1 / (2 * np.pi)) * (F * f.power(-3.0) * r.power(-1.0))


@dataclass(frozen=True, eq=False)
class PointPairs(Chosen):
    """Pairs of points in one configuration: of point i, and of the image of point j."""

    i: np.ndarray  # int (k,)
    j: np.ndarray  # int (k,)
    image: np.ndarray  # int (k, 2), how many periods away
    way: np.ndarray  # (k, 3), from i to the image of j [m]
    key: np.ndarray  # int (k,), ascending

    @property
    def distance(self) -> np.ndarray:
        """Distances (k,) [m]."""
        return np.linalg.norm(self.way, axis=1)

    @property
    def both(self) -> np.ndarray:
        """Points (k, 2)."""
        return np.stack([self.i, self.j], axis=1)
