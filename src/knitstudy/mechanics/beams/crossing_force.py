"""Force of two straight yarns that cross at a right angle, over the gap of their axes as beams."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from knitstudy.mechanics.contact.patch_compliance import local_compliance


@dataclass(frozen=True)
class Power:
    """Force coefficient (-gap)^exponent [N] where yarns overlap."""

    coefficient: float  # of force over approach to the exponent
    # Pieces of a linear law would touch with all of its stiffness, and later ones rub with none.
    exponent: float = 1.5
    share: float = 1.0  # stiffness against elastic slip over that against approach
    penalty: bool = False  # whether it stands for nothing that yarns do

    def force(self, gap: np.ndarray) -> np.ndarray:
        """Return the forces (k,) at gaps (k,) [m]; zero where open."""
        return self.coefficient * np.maximum(0.0, -gap) ** self.exponent

    def stiffness(self, gap: np.ndarray) -> np.ndarray:
        """Return how fast (k,) the force grows with the approach."""
        return np.where(
            gap < 0, self.exponent * self.coefficient * np.maximum(0.0, -gap) ** (self.exponent - 1.0), 0.0
        )

    def stiffening(self, gap: np.ndarray) -> np.ndarray:
        """Return the derivative (k,) of the stiffness by the gap; zero where open."""
        n, depth = self.exponent, np.where(gap < 0, -gap, 1.0)
        return np.where(gap < 0, -n * (n - 1.0) * self.coefficient * depth ** (n - 2.0), 0.0)


# A yarn is no half space: what gives way under a patch is what a cylinder does beyond a beam (`local_compliance`), that
# of a half space and C a further compliance, which hardly depends on the patch. So two yarns approach by
#
#     delta = delta_H(P) + 2 C(a) P,   a^2 = R delta_H
#
# less than half spaces do: C is negative. The force of an approach of 0.03 R is 17 % larger.

PATCHES = (0.2, 0.35, 0.5)  # semi-axes over R from which C(a) follows as a parabola
DEEPEST = 0.35  # delta_H over R up to which the law is tabulated
# Mean displacement of a half space under an even pressure, times E a / (1 - nu^2)
UNIFORM = 16 / (3 * np.pi**2)


@dataclass(frozen=True, eq=False)
class CrossedCylinders:
    """Force of two equal elastic cylinders at a right angle over the gap of their axes as beams."""

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

    def _at(self, gap: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return F and its first two derivatives by delta: with x = sqrt(delta / R), F = k x^3 f(x)."""
        x = np.sqrt(np.maximum(-np.asarray(gap, dtype=float), 1e-300) / self.radius)
        k = self.coefficient * self.radius**1.5
        inside = np.minimum(x, self.table.x[-1])
        f, f1, f2 = (self.table(inside, order) for order in range(3))
        f1, f2 = np.where(inside < x, 0.0, f1), np.where(inside < x, 0.0, f2)
        by_x, by_xx = k * (3 * x**2 * f + x**3 * f1), k * (6 * x * f + 6 * x**2 * f1 + x**3 * f2)
        per = 1 / (2 * x * self.radius)  # dx / d delta
        return k * x**3 * f, by_x * per, by_xx * per**2 - by_x * per**2 / x

    def force(self, gap: np.ndarray) -> np.ndarray:
        """Return the forces (k,) at gaps (k,) [m]; zero where open."""
        return np.where(gap < 0, self._at(gap)[0], 0.0)

    def stiffness(self, gap: np.ndarray) -> np.ndarray:
        """Return how fast (k,) the force grows with the approach."""
        return np.where(gap < 0, self._at(gap)[1], 0.0)

    def stiffening(self, gap: np.ndarray) -> np.ndarray:
        """Return the derivative (k,) of the stiffness by the gap; zero where open."""
        return np.where(gap < 0, -self._at(gap)[2], 0.0)


@cache
def _finite_thickness(poisson_ratio: float) -> CubicSpline:
    """Return F over Hertz's by sqrt(delta / R)."""
    nu = poisson_ratio
    C = [local_compliance(a, nu)[0] - UNIFORM * (1 - nu**2) / a for a in PATCHES]
    a = np.linspace(0.0, np.sqrt(DEEPEST), 200)  # over R
    P = 2 / 3 / (1 - nu**2) * a**3  # over E R^2
    x = np.sqrt(a**2 + 2 * np.polyval(np.polyfit(PATCHES, C, 2), a) * P)
    return CubicSpline(x, np.divide(a, x, out=np.ones_like(a), where=x > 0) ** 3)
