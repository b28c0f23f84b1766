"""A material, and the registry of its laws: stored energy, stress and tangent as functions of Green's strain.

Every law maps a batch of Green strains E (e, 3, 3) to the stored energy density W (e,), the second
Piola-Kirchhoff stress S = dW/dE (e, 3, 3) and the tangent C = dS/dE (e, 6, 6) in the order 11, 22, 33, 12, 23, 13
(C maps engineering shears). A frame of reference enters only through E, so all of them are objective.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.registry import Registry

VOIGT = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)])
"""Index pairs of the six independent components."""

FULL = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
"""Position (3, 3) of every tensor component among the six."""


@dataclass(frozen=True)
class Stress:
    """Energy density (e,) [J/m3], second Piola-Kirchhoff stress (e, 3, 3) [Pa], tangent (e, 6, 6) [Pa] or None."""

    energy: np.ndarray
    stress: np.ndarray
    tangent: np.ndarray | None


Law = Callable[[np.ndarray, float, float, bool], Stress]
"""Response to Green strains (e, 3, 3) for mu [Pa] and lambda [Pa], with the tangent if the last is true."""


@dataclass(frozen=True)
class Kind:
    """A law with its name."""

    name: str
    meaning: str
    respond: Law


LAWS: Registry[Kind] = Registry("yarn.material", "knitstudy.mechanics.materials")


def law(name: str, meaning: str) -> Callable[[Law], Law]:
    """Return a decorator that registers a law under a name with what it means in one line."""

    def register(respond: Law) -> Law:
        LAWS.register(Kind(name, meaning, respond), respond.__module__)
        return respond

    return register


@dataclass(frozen=True)
class Material:
    """An isotropic elastic material.

    Attributes
    ----------
    law : str
        A name of `LAWS`.
    youngs_modulus : float
        E [Pa].
    poisson_ratio : float
        nu, in (-1, 0.5).

    Raises
    ------
    ConfigurationError
        For an unknown law or constants without a positive strain energy.
    """

    law: str
    youngs_modulus: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        LAWS.find(self.law)
        if not self.youngs_modulus > 0:
            raise ConfigurationError(
                f"yarn.youngs_modulus is {self.youngs_modulus}; it has to be positive [Pa]"
            )
        if not -1 < self.poisson_ratio < 0.5:
            raise ConfigurationError(
                f"yarn.poisson_ratio is {self.poisson_ratio}; it has to lie in (-1, 0.5)"
            )

    @property
    def shear_modulus(self) -> float:
        """mu = G [Pa]."""
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio))

    @property
    def lame(self) -> float:
        """First Lame constant [Pa]."""
        nu = self.poisson_ratio
        return self.youngs_modulus * nu / ((1 + nu) * (1 - 2 * nu))

    def respond(self, strain: np.ndarray, tangent: bool) -> Stress:
        """Return energy, stress and, if asked, tangent of Green strains (e, 3, 3)."""
        return LAWS.find(self.law).respond(strain, self.shear_modulus, self.lame, tangent)
