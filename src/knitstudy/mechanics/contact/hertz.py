"""Two equal cylinders that cross, pressed on each other as half spaces are: Hertz, with exact elliptic integrals.

Johnson, Contact Mechanics (1985), sections 4.1 and 4.2. The gap of the undeformed surfaces is A x^2 + B y^2 with
A = (1 - cos w) / (2 R) and B = (1 + cos w) / (2 R); x lies on the bisector of the angle w between the axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk


@dataclass(frozen=True)
class Crossing:
    """Contact of two cylinders of unit radius at an angle; lengths are over R, forces over E* R^2.

    Attributes
    ----------
    curvature : tuple of float
        A and B.
    ratio : float
        b / a of the ellipse of contact, whose longer axis lies on the bisector.
    semiaxis : float
        a over P^(1/3).
    approach : float
        Of far points of both bodies, over P^(2/3).
    """

    curvature: tuple[float, float]
    ratio: float
    semiaxis: float
    approach: float

    @classmethod
    def at(cls, angle: float) -> Crossing:
        """Return the contact at an angle between the axes, 0 < angle <= pi / 2."""
        a, b = 0.5 * (1 - np.cos(angle)), 0.5 * (1 + np.cos(angle))

        def excess(ratio: float) -> float:
            first, second, parameter = _integrals(ratio)
            return (second / ratio**2 - first) / (first - second) - b / a if parameter > 1e-9 else 1.0 - b / a

        ratio = 1.0 if b / a - 1 < 1e-6 else float(brentq(excess, 1e-4, 1 - 1e-8))
        first, second, parameter = _integrals(ratio)
        flat = (first - second) / parameter if parameter > 1e-9 else np.pi / 4
        semiaxis = (3 * flat / (2 * np.pi * a)) ** (1 / 3)
        return cls((a, b), ratio, semiaxis, 3 * first / (2 * np.pi * semiaxis))

    @property
    def radius(self) -> float:
        """R_e = 1 / sin w, over R: a gap that is a paraboloid has the area 2 pi R_e delta at a depth delta."""
        return 0.5 / np.sqrt(self.curvature[0] * self.curvature[1])


def _integrals(ratio: float) -> tuple[float, float, float]:
    """Return the complete elliptic integrals K and E, and their parameter e^2 = 1 - (b / a)^2."""
    parameter = 1 - ratio**2
    return float(ellipk(parameter)), float(ellipe(parameter)), parameter
