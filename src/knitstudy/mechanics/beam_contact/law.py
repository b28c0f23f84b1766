"""What a gap between two yarns costs: a penalty on sections that do not deform, or Hertz's crossed cylinders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Power:
    """Force coefficient (-gap)^exponent where yarns overlap, at a point [N] or along a line [N/m].

    Attributes
    ----------
    coefficient : float
        Of force over approach to the exponent.
    exponent : float
        1: a penalty.
    """

    coefficient: float
    exponent: float = 1.0

    def force(self, gap: np.ndarray) -> np.ndarray:
        """Return the forces (k,) at gaps (k,) [m]; zero where open."""
        return self.coefficient * np.maximum(0.0, -gap) ** self.exponent

    def stiffness(self, gap: np.ndarray) -> np.ndarray:
        """Return how fast (k,) the force grows with the approach."""
        return np.where(
            gap < 0, self.exponent * self.coefficient * np.maximum(0.0, -gap) ** (self.exponent - 1.0), 0.0
        )

    def energy(self, gap: np.ndarray) -> np.ndarray:
        """Return the stored energies (k,), at a point [J] or along a line [J/m]."""
        return self.coefficient / (self.exponent + 1.0) * np.maximum(0.0, -gap) ** (self.exponent + 1.0)


def hertz(youngs_modulus: float, poisson_ratio: float, radius: float, mode: str) -> Power:
    """Return the approach of two equal cylinders that cross at a right angle (Johnson 1985, section 4.1).

    At a point F = 4/3 E* sqrt(R) delta^1.5 with E* = E / 2 (1 - nu^2), as of a sphere of radius R on a plane. Along
    a line E*/2 times the approach: round sections that cross with the overlap delta - s^2 / 4 R then carry that same F,
    the integral of E*/2 (delta - s^2 / 4 R).

    Parameters
    ----------
    youngs_modulus : float
        [Pa]
    poisson_ratio : float
    radius : float
        Of both [m].
    mode : {"point", "line"}
    """
    contact_modulus = youngs_modulus / (2 * (1 - poisson_ratio**2))
    if mode == "line":
        return Power(0.5 * contact_modulus)
    return Power(4 / 3 * contact_modulus * np.sqrt(radius), 1.5)
