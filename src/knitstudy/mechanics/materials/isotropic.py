"""Isotropic elastic laws: Hencky, neo-Hookean, St Venant-Kirchhoff."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.materials import FULL, MATERIALS, VOIGT, Axes, Field, Stress


@dataclass(frozen=True)
class Isotropic:
    """An isotropic elastic material; raises ConfigurationError for constants without a positive strain energy."""

    youngs_modulus: float  # E [Pa]
    poisson_ratio: float  # nu, in (-1, 0.5)

    directional: ClassVar[bool] = False
    logarithmic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not self.youngs_modulus > 0:
            raise ConfigurationError(f"Young's modulus is {self.youngs_modulus} and has to be positive")
        if not -1 < self.poisson_ratio < 0.5:
            raise ConfigurationError(f"Poisson's ratio is {self.poisson_ratio} and has to lie in (-1, 0.5)")

    @classmethod
    def of(cls, yarn: Any) -> Self:
        """Return the material of a scene's section `yarn`."""
        return cls(yarn.youngs_modulus, yarn.poisson_ratio)

    def without_dilatation(self) -> tuple[Self, float]:
        """Return the same law with a first Lame constant of zero, and that constant [Pa]."""
        return type(self)(2 * self.shear_modulus, 0.0), self.lame

    @property
    def shear_modulus(self) -> float:
        """mu = G [Pa]."""
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio))

    @property
    def lame(self) -> float:
        """First Lame constant [Pa]."""
        nu = self.poisson_ratio
        return self.youngs_modulus * nu / ((1 + nu) * (1 - 2 * nu))

    @property
    def moduli(self) -> Floats:
        """Stress over engineering strain (6, 6) of small strains [Pa]."""
        moduli = np.diag([2 * self.shear_modulus] * 3 + [self.shear_modulus] * 3)
        moduli[:3, :3] += self.lame
        return moduli

    @property
    def across(self) -> tuple[float, float]:
        """E [Pa] and nu."""
        return self.youngs_modulus, self.poisson_ratio


# Nodes of the logarithm's quadrature: all digits between stretches of 1/28 and 28, fewer beyond.
MOST_NODES = 256
# The 21 pairs (p, q) of two of six components, whatever their order.
PAIRS = np.array([(p, q) for p in range(6) for q in range(p, 6)])
FIRST = np.array([0, 6, 11, 15, 18, 20, 21])  # where the pairs of every p begin
UNIT = np.array([1.0, 1, 1, 0, 0, 0])[:, None]


@MATERIALS.register
class Hencky(Isotropic):
    """W = mu L : L + lame/2 (tr L)^2, L = ln(C) / 2, C = 1 + 2 E (Ogden 1997, section 6.1.4).

    With X = C - 1 and A(t) = (1 + t X)^-1, ln C is the integral of X A(t) over t from 0 to 1 and its derivative that of
    A H A (Higham 2008, sections 11.1 and 11.5). Both are taken at Gauss's nodes, as many as leave nothing out, and A is
    ((1 + t tr X) 1 - t X + t^2 adj X) / det(1 + t X): no axes and no differences of principal stretches, so neither
    small strains nor repeated stretches lose digits. L and C commute: S = C^-1 T with T = 2 mu L + lame tr L.
    """

    name: ClassVar[str] = "hencky"
    meaning: ClassVar[str] = "linear in logarithmic strain"

    def respond(self, strain: Floats, tangent: bool, axes: Axes = None, pressure: Field = 0.0) -> Stress:
        """Return the response to Green strains (e, 3, 3)."""
        mu, lame = self.shear_modulus, self.lame
        x = 2 * components(strain)
        resolvent = Resolvent(x)
        inverse, nodes, weights = resolvent.inverse, resolvent.nodes, resolvent.weights
        logs = 0.5 * product(x, resolvent.sum(weights))
        volume = logs[:3].sum(axis=0)
        energy = mu * ((logs[:3] ** 2).sum(axis=0) + 2 * (logs[3:] ** 2).sum(axis=0)) + 0.5 * lame * volume**2
        stress = product(inverse, 2 * mu * logs + (lame * volume + pressure) * UNIT)
        full = stress[FULL].transpose(2, 0, 1)
        if not tangent:
            return Stress(energy, full, None)
        # Of the derivative of C^-1 T: C^-1 A = (C^-1 - t A) / (1 - t).
        near = weights / (1 - nodes)
        pairs = resolvent.pairs(-mu * near * nodes)
        add_pairs(pairs, 0.5 * (mu * resolvent.sum(near) - stress), inverse)
        moduli = pairs[CROSSED[0]] + pairs[CROSSED[1]]
        if lame:
            add_pairs(moduli, 0.5 * lame * inverse, inverse)
        return Stress(energy, full, moduli[POSITION].transpose(2, 0, 1))


class Resolvent:
    """A(t) = (1 + t X)^-1 of symmetric tensors X (6, e) at the nodes of the logarithm's quadrature."""

    def __init__(self, x: Floats) -> None:
        self._x, self._adjugate = x, _adjugate(x)
        self._trace, second = x[:3].sum(axis=0), self._adjugate[:3].sum(axis=0)
        third = x[0] * self._adjugate[0] + x[3] * self._adjugate[3] + x[5] * self._adjugate[5]
        determinant = 1 + self._trace + second + third
        self._trace[~(determinant > 0)] = np.nan
        # (1 + X)^-1 (6, e): not a number where nothing is left of the volume.
        self.inverse = ((1 + self._trace) * UNIT - x + self._adjugate) / determinant
        self.nodes, self.weights = _quadrature(x, self.inverse)
        self._powers = self.nodes ** np.arange(5)[:, None]  # (5, n)
        invariants = np.stack([np.ones_like(second), self._trace, second, third])
        self._over_determinant = 1 / (self._powers[:4].T @ invariants)  # of 1 + t X: (n, e)

    def sum(self, factors: Floats) -> Floats:
        """Return the sum (6, e) of A over the nodes, times factors (n,)."""
        s = (factors * self._powers[:3]) @ self._over_determinant
        return (s[0] + self._trace * s[1]) * UNIT - s[1] * self._x + s[2] * self._adjugate

    def pairs(self, factors: Floats) -> Floats:
        """Return the sum (21, e) of the products of all pairs of components of A, times factors (n,)."""
        x, adjugate, trace = self._x, self._adjugate, self._trace
        s = (factors * self._powers) @ self._over_determinant**2
        of_unit = (s[0] + 2 * trace * s[1] + trace**2 * s[2]) * UNIT
        of_unit += 2 * ((s[2] + trace * s[3]) * adjugate - (s[1] + trace * s[2]) * x)
        total = np.zeros((len(PAIRS), len(trace)))
        for one, other in ((of_unit, UNIT), (s[2] * x - 2 * s[3] * adjugate, x), (s[4] * adjugate, adjugate)):
            add_pairs(total, 0.5 * one, other)
        return total


def add_pairs(total: Floats, one: Floats, other: Floats) -> None:
    """Add one_p other_q + one_q other_p to the pairs (21, e) of components (6, e)."""
    for p, (start, end) in enumerate(pairwise(FIRST)):
        total[start:end] += one[p] * other[p:]
        total[start:end] += other[p] * one[p:]


POSITION = np.empty((6, 6), dtype=int)  # of a pair of components among the 21
POSITION[PAIRS[:, 0], PAIRS[:, 1]] = POSITION[PAIRS[:, 1], PAIRS[:, 0]] = np.arange(len(PAIRS))
(_I, _J), (_K, _L) = VOIGT[PAIRS[:, 0]].T, VOIGT[PAIRS[:, 1]].T
# Where A_ik A_jl and A_il A_jk stand for every pair of the components ij and kl (21,).
CROSSED = POSITION[FULL[_I, _K], FULL[_J, _L]], POSITION[FULL[_I, _L], FULL[_J, _K]]


def crossed(pairs: Floats) -> Floats:
    """Return A_ik A_jl + A_il A_jk (6, 6, e) of pairs (21, e)."""
    return (pairs[CROSSED[0]] + pairs[CROSSED[1]])[POSITION]


def components(tensor: Floats) -> Floats:
    """Return the components (6, e) of symmetric tensors (e, 3, 3).

    Examples
    --------
    >>> components(np.diag([1.0, 2.0, 3.0])[None])[:, 0].tolist()
    [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]
    """
    return tensor.transpose(1, 2, 0)[VOIGT[:, 0], VOIGT[:, 1]]


def _adjugate(x: Floats) -> Floats:
    """Return the transposed cofactors of symmetric tensors (6, e)."""
    a, b, c, d, f, g = x
    return np.stack(
        [b * c - f * f, a * c - g * g, a * b - d * d, f * g - c * d, d * g - a * f, d * f - b * g]
    )


def product(one: Floats, other: Floats) -> Floats:
    """Return the product (6, e) of symmetric tensors (6, e) that commute.

    Examples
    --------
    >>> diagonal = np.array([[1.0], [2.0], [3.0], [0.0], [0.0], [0.0]])
    >>> product(diagonal, diagonal)[:, 0].tolist()
    [1.0, 4.0, 9.0, 0.0, 0.0, 0.0]
    """
    rows = [(FULL[i], FULL[j]) for i, j in VOIGT]
    return np.stack([sum(one[p] * other[q] for p, q in zip(*row, strict=True)) for row in rows])


def _quadrature(x: Floats, inverse: Floats) -> tuple[Floats, Floats]:
    """Return nodes and weights on (0, 1) that leave nothing out of ln C, up to `MOST_NODES`.

    With n nodes the error falls as r^(2n) for a squared stretch z, r = |1 - sqrt(z)| / (1 + sqrt(z)): 1 / (1 + t X) has
    its pole on the ellipse of axes 1 / r +- r about the interval (Trefethen 2013, theorem 19.3). Norms bound z.
    """
    ends = np.sqrt([1 + _norm(x), 1 / (1 + _norm(inverse - UNIT))])
    ratio = max(np.max(np.abs(1 - ends) / (1 + ends)), 1e-8)
    return _gauss(min(int(np.ceil(np.log(1e-17) / (2 * np.log(ratio)))), MOST_NODES))


def _norm(tensor: Floats) -> float:
    """Return the largest Frobenius norm of symmetric tensors (6, e)."""
    squares = (tensor[:3] ** 2).sum(axis=0) + 2 * (tensor[3:] ** 2).sum(axis=0)
    return float(np.sqrt(np.nanmax(squares, initial=0.0)))


@cache
def _gauss(count: int) -> tuple[Floats, Floats]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (1 + nodes) / 2, weights / 2


@MATERIALS.register
class NeoHooke(Isotropic):
    """W = mu/2 (tr C - 3) - mu ln J + lame/2 (ln J)^2 (Bonet and Wood 2008, section 6.4.3)."""

    name: ClassVar[str] = "neo_hookean"
    meaning: ClassVar[str] = "of rubber"

    def respond(self, strain: Floats, tangent: bool, axes: Axes = None, pressure: Field = 0.0) -> Stress:
        """Return the response to Green strains (e, 3, 3)."""
        mu, lame = self.shear_modulus, self.lame
        c = np.eye(3) + 2 * strain
        inverse = np.linalg.inv(c)
        log_j = 0.5 * np.log(np.linalg.det(c))
        trace = np.trace(strain, axis1=1, axis2=2)
        energy = mu * (trace - log_j) + 0.5 * lame * log_j**2
        # I - C^-1 = 2 C^-1 E keeps its digits at small strains.
        whole = np.asarray(lame * log_j + pressure)
        stress = 2 * mu * inverse @ strain + whole[:, None, None] * inverse
        stress = 0.5 * (stress + np.swapaxes(stress, 1, 2))
        if not tangent:
            return Stress(energy, stress, None)
        i, j = VOIGT.T
        dyad = inverse[:, i, j][:, :, None] * inverse[:, i, j][:, None, :]
        first = inverse[:, i[:, None], i] * inverse[:, j[:, None], j]
        second = inverse[:, i[:, None], j] * inverse[:, j[:, None], i]
        moduli = lame * dyad + (mu - whole)[:, None, None] * (first + second)
        return Stress(energy, stress, moduli)


@MATERIALS.register
class StVenantKirchhoff(Isotropic):
    """W = mu E:E + lame/2 (tr E)^2. Softens in compression: for comparison below 1% strain or with CalculiX."""

    name: ClassVar[str] = "st_venant_kirchhoff"
    meaning: ClassVar[str] = "linear in Green's strain"
    logarithmic: ClassVar[bool] = False

    def respond(self, strain: Floats, tangent: bool, axes: Axes = None, pressure: Field = 0.0) -> Stress:
        """Return the response to Green strains (e, 3, 3)."""
        mu, lame = self.shear_modulus, self.lame
        trace = np.trace(strain, axis1=1, axis2=2)
        energy = mu * np.einsum("eij,eij->e", strain, strain) + 0.5 * lame * trace**2
        stress = 2 * mu * strain + np.asarray(lame * trace + pressure)[:, None, None] * np.eye(3)
        constant = np.broadcast_to(self.moduli, (len(strain), 6, 6)) if tangent else None
        return Stress(energy, stress, constant)
