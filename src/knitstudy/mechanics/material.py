"""Isotropic elastic laws: stored energy, stress and tangent as functions of Green's strain.

Every law maps a batch of Green strains E (e, 3, 3) to the stored energy density W (e,), the second
Piola-Kirchhoff stress S = dW/dE (e, 3, 3) and the tangent C = dS/dE (e, 6, 6) in the order 11, 22, 33, 12, 23, 13
(C maps engineering shears). A frame of reference enters only through E, so all of them are objective.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from knitstudy.errors import ConfigurationError

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


@dataclass(frozen=True)
class Material:
    """An isotropic elastic material.

    Attributes
    ----------
    law : str
        ``"hencky"``, ``"neo_hookean"`` or ``"st_venant_kirchhoff"``.
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
        if self.law not in LAWS:
            raise ConfigurationError(f"yarn.material is {self.law!r}; allowed: {', '.join(sorted(LAWS))}")
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
        return LAWS[self.law](strain, self.shear_modulus, self.lame, tangent)


def st_venant_kirchhoff(strain: np.ndarray, mu: float, lame: float, tangent: bool) -> Stress:
    """W = mu E:E + lame/2 (tr E)^2. Softens in compression: for comparison below 1% strain or with CalculiX."""
    trace = np.trace(strain, axis1=1, axis2=2)
    energy = mu * np.einsum("eij,eij->e", strain, strain) + 0.5 * lame * trace**2
    stress = 2 * mu * strain + lame * trace[:, None, None] * np.eye(3)
    constant = np.broadcast_to(linear_stiffness(mu, lame), (len(strain), 6, 6)) if tangent else None
    return Stress(energy, stress, constant)


def linear_stiffness(mu: float, lame: float) -> np.ndarray:
    """Return the stiffness (6, 6) of small strains [Pa]."""
    stiffness = np.diag([2 * mu] * 3 + [mu] * 3).astype(float)
    stiffness[:3, :3] += lame
    return stiffness


def neo_hookean(strain: np.ndarray, mu: float, lame: float, tangent: bool) -> Stress:
    """W = mu/2 (tr C - 3) - mu ln J + lame/2 (ln J)^2 (Bonet and Wood 2008, section 6.4.3)."""
    c = np.eye(3) + 2 * strain
    inverse = np.linalg.inv(c)
    log_j = 0.5 * np.log(np.linalg.det(c))
    trace = np.trace(strain, axis1=1, axis2=2)
    energy = mu * (trace - log_j) + 0.5 * lame * log_j**2
    # I - C^-1 = 2 C^-1 E keeps its digits at small strains.
    stress = 2 * mu * inverse @ strain + (lame * log_j)[:, None, None] * inverse
    stress = 0.5 * (stress + np.swapaxes(stress, 1, 2))
    if not tangent:
        return Stress(energy, stress, None)
    i, j = VOIGT.T
    dyad = inverse[:, i, j][:, :, None] * inverse[:, i, j][:, None, :]
    first = inverse[:, i[:, None], i] * inverse[:, j[:, None], j]
    second = inverse[:, i[:, None], j] * inverse[:, j[:, None], i]
    moduli = lame * dyad + (mu - lame * log_j)[:, None, None] * (first + second)
    return Stress(energy, stress, moduli)


def hencky(strain: np.ndarray, mu: float, lame: float, tangent: bool) -> Stress:
    """W = mu sum(ln lambda_a)^2 + lame/2 (ln J)^2, in principal stretches (Ogden 1997, section 6.1.4).

    Differences of nearly equal stretches are divided through ``log1p``, so that neither small strains nor
    repeated stretches lose digits.
    """
    values, axes = np.linalg.eigh(strain)  # (e, 3), (e, 3, 3) with columns N_a
    square = 1 + 2 * values  # squared stretches
    logs = 0.5 * np.log1p(2 * values)
    volume = logs.sum(axis=1)
    energy = mu * (logs**2).sum(axis=1) + 0.5 * lame * volume**2
    principal = (2 * mu * logs + lame * volume[:, None]) / square
    stress = (axes * principal[:, None, :]) @ np.swapaxes(axes, 1, 2)
    if not tangent:
        return Stress(energy, stress, None)
    moduli = np.zeros((len(strain), 6, 6))
    a = np.arange(3)
    product = square[:, :, None] * square[:, None, :]
    moduli[:, :3, :3] = lame / product
    moduli[:, a, a] += (2 * mu - 2 * square * principal) / square**2
    for position, (p, q) in enumerate(VOIGT[3:], start=3):
        ratio = (square[:, p] - square[:, q]) / square[:, q]
        quotient = np.where(ratio == 0, 1.0, np.log1p(ratio) / np.where(ratio == 0, 1.0, ratio))
        slope = mu * quotient - 2 * mu * logs[:, q] - lame * volume
        moduli[:, position, position] = slope / product[:, p, q]
    rotation = rotate_strain(axes)
    return Stress(energy, stress, np.swapaxes(rotation, 1, 2) @ moduli @ rotation)


def rotate_strain(axes: np.ndarray) -> np.ndarray:
    """Return the matrices (e, 6, 6) that take engineering strains to the axes (e, 3, 3) in columns."""
    i, j = VOIGT.T
    # Component (p, q) in the axes is sum over I, J of N_Ip E_IJ N_Jq, with E_IJ = gamma_IJ / 2 off the diagonal.
    left = axes[:, i[None, :], i[:, None]] * axes[:, j[None, :], j[:, None]]
    right = axes[:, j[None, :], i[:, None]] * axes[:, i[None, :], j[:, None]]
    rotation = 0.5 * (left + right)
    rotation[:, 3:] *= 2
    return rotation


LAWS: dict[str, Callable[..., Stress]] = {
    "hencky": hencky,
    "neo_hookean": neo_hookean,
    "st_venant_kirchhoff": st_venant_kirchhoff,
}
