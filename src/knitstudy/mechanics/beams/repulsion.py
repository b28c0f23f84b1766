"""Forces of two yarns that cross, the potential of two short pieces of yarn, and pairs of such pieces.

The laws `Power` and `CrossedCylinders` give the force over the approach, which is the overlap of the yarns as beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from knitstudy.mechanics.beams.hertz import LAYERS, Expansion, Patch
from knitstudy.mechanics.contact.compliance import local_compliance


@dataclass(frozen=True)
class Power:
    """Force of two yarns that cross at a right angle: coefficient approach^exponent [N]."""

    coefficient: float  # of force over approach to the exponent
    # Above 1: under a linear law, pieces would touch with their full stiffness, and later pieces would not rub.
    exponent: float = 1.5
    share: float = 1.0  # stiffness against elastic slip over that against approach
    penalty: bool = False  # whether the stiffness is a numerical penalty

    def force(self, approach: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the force (k,) [N] at approaches (k,) [m] and its two derivatives; zero where open.

        Examples
        --------
        >>> force, stiffness, _ = Power(3.0, exponent=2.0).force(np.array([-0.1, 0.1]))
        >>> force.round(3).tolist(), stiffness.round(3).tolist()
        ([0.0, 0.03], [0.0, 0.6])
        """
        c, n = self.coefficient, self.exponent
        depth = np.where(approach > 0, approach, 1.0)
        values = c * depth**n, n * c * depth ** (n - 1.0), n * (n - 1.0) * c * depth ** (n - 2.0)
        return tuple(np.where(approach > 0, value, 0.0) for value in values)


# The local compliance of a cylinder (`local_compliance`) is that of a half space and a further compliance C, which
# hardly depends on the radius a of the patch. Two yarns approach by
#
#     delta = delta_H(P) + 2 C(a) P,   a^2 = R delta_H.
#
# C is negative: at an approach of 0.03 R the force is 17 % larger than between half spaces.

PATCHES = (0.2, 0.35, 0.5)  # semi-axes over R from which C(a) follows as a parabola
DEEPEST = 0.35  # delta_H over R up to which the law is tabulated
# Mean displacement of a half space under an even pressure, times E a / (1 - nu^2)
UNIFORM = 16 / (3 * np.pi**2)


@dataclass(frozen=True, eq=False)
class CrossedCylinders:
    """Force of two equal elastic cylinders at a right angle over the approach of their axes as beams."""

    coefficient: float  # of Hertz's law F = coefficient delta^1.5 [N/m^1.5]
    radius: float  # R [m]
    share: float  # stiffness against elastic slip over that against approach
    table: CubicSpline  # F over Hertz's, by sqrt(delta / R)
    exponent: float = 1.5
    penalty: bool = False

    @classmethod
    def of(cls, youngs_modulus: float, poisson_ratio: float, radius: float) -> CrossedCylinders:
        """Return the law of cylinders of a modulus [Pa] and a radius [m]."""
        nu = poisson_ratio
        modulus = youngs_modulus / (2 * (1 - nu**2))
        return cls(4 / 3 * modulus * np.sqrt(radius), radius, 2 * (1 - nu) / (2 - nu), _finite_thickness(nu))

    def force(self, approach: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the force (k,) [N] at approaches (k,) [m] and its two derivatives; zero where open.

        With x = sqrt(delta / R) the force is k x^3 f(x); f is constant beyond its table.
        """
        x = np.sqrt(np.maximum(approach, 1e-300) / self.radius)
        k = self.coefficient * self.radius**1.5
        inside = np.minimum(x, self.table.x[-1])
        f, f1, f2 = (self.table(inside, order) for order in range(3))
        f1, f2 = np.where(inside < x, 0.0, f1), np.where(inside < x, 0.0, f2)
        by_x, by_xx = k * (3 * x**2 * f + x**3 * f1), k * (6 * x * f + 6 * x**2 * f1 + x**3 * f2)
        per = 1 / (2 * x * self.radius)  # dx / d delta
        values = k * x**3 * f, by_x * per, by_xx * per**2 - by_x * per**2 / x
        return tuple(np.where(approach > 0, value, 0.0) for value in values)


@cache
def _finite_thickness(poisson_ratio: float) -> CubicSpline:
    """Return F over Hertz's by sqrt(delta / R)."""
    nu = poisson_ratio
    C = [local_compliance(a, nu)[0] - UNIFORM * (1 - nu**2) / a for a in PATCHES]
    a = np.linspace(0.0, np.sqrt(DEEPEST), 200)  # over R
    P = 2 / 3 / (1 - nu**2) * a**3  # over E R^2
    x = np.sqrt(a**2 + 2 * np.polyval(np.polyfit(PATCHES, C, 2), a) * P)
    return CubicSpline(x, np.divide(a, x, out=np.ones_like(a), where=x > 0) ** 3)


@dataclass(frozen=True)
class Repulsion:
    """The potential of two short pieces, from the force of two yarns that cross."""

    law: Power | CrossedCylinders  # of that force, over the approach
    diameter: float  # distance at which it begins, D [m]
    onset: float  # e [m]
    patch: Patch = LAYERS

    def shear(self, tangents: np.ndarray, bends: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Return the stiffness (k, 3, 3) against elastic slip over that against approach; see `Patch.shear`."""
        share = self.law.share if self.patch.poisson_ratio is None else 1.0
        return share * self.patch.shear(tangents, bends, normal)

    def _depth(self, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the approach (k,) at distances (k,) [m], which begins softly, and its two derivatives."""
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

        A contact of f times the force F(delta) spreads as a circle does at f^2 delta: the compliance of a yarn
        beyond that of a half space counts as much. So F, without the factor itself, is F(f^2 delta) / f^3.
        """
        return shape if self.patch.poisson_ratio is not None else shape * 0.0 + 1.0

    def closing(self, y: np.ndarray, shape: np.ndarray) -> np.ndarray:
        """Return F'' (k,) [N/m2] after an approach y (k,) [m] since first contact, its mean up to the onset."""
        f, late = self._spread(shape), np.maximum(y, self.onset)
        early = self.law.force(f**2 * self.onset)[1] / (f * self.onset)
        return np.where(y > self.onset, f * self.law.force(f**2 * late)[2], early)

    def of(
        self, distance: np.ndarray, shape: np.ndarray | float = 1.0
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return V (k,) [N/m] at distances (k,) [m] within reach, and its two derivatives."""
        (r,) = Expansion.variables(distance[:, None])
        V = self.potential(r, r * 0.0 + shape)
        return V.value, V.slope[:, 0], V.bend[:, 0, 0]

    def push(
        self, share: np.ndarray, thinning: np.ndarray, shape: np.ndarray, distance: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return parts (k,) of the force of pairs [N], and their derivatives by the distance [N/m].

        Parts (k,) of the density and of its derivative by the distance are those of the last increment.
        """
        within = distance < self.diameter
        V, V1, V2 = self.of(distance, shape)
        force, change = share * V1 + thinning * V, share * V2 + thinning * V1
        return np.where(within, -force, 0.0), np.where(within, -change, 0.0)

    def potential(self, r: Expansion, shape: Expansion) -> Expansion:
        """Return V as a function of the variables of the distance and of the factor by the shape."""
        f = self._spread(shape)
        x = f * f * r.through(*self._depth(r.value))
        F = x.through(*self.law.force(x.value))
        return (1 / (2 * np.pi)) * (F * f.power(-3.0) * r.power(-1.0))
