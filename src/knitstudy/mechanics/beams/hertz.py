"""Contact of two curved yarns of one radius: force and shear stiffness by the curvatures of their surfaces.

Two yarns whose axes have the unit tangents a and b at their closest points, and bend towards each other with the
curvatures k_a and k_b, touch with surfaces that part by x . M x / 2R over their common tangent plane,

    M = 2 I - alpha a a^T - beta b b^T,   alpha = 1 / (1 - k_a R),   beta = 1 / (1 - k_b R):

the inner side of a bend has the curvature k / (1 - k R) along the yarn. Straight yarns that cross at a right angle have
M = I and carry F(delta) at an approach delta. Everything else follows from the trace and the determinant of M.

Half spaces (Hertz; Johnson 1985, section 4.2). The patch has the semi-axes a > b and the eccentricity e; l = B / A is
the ratio of the principal values of M. With the complete elliptic integrals K(e), E(e) and D = (K - E) / e^2,

    l = (E / (1 - e^2) - K) / (K - E),   F(delta; M) = F(delta) g(l) det(M)^(-1/4)
    g = (pi / sqrt 2) D^(1/2) K^(-3/2) l^(1/4).

Bodies that stick are held with s dF/d(delta) (Mindlin 1949; Deresiewicz 1957), along and across the patch with

    s = (1 - nu) K / ((1 - nu) K + nu D)   and   s = (1 - nu) K / ((1 - nu) K + nu (K - D)).

Layers, whose pressure is a power of their compression point by point, carry F(delta) / sqrt(det M) for any power.

An integral of a potential over both axes (`line_contact`) carries F(delta) sqrt(alpha beta / det M) for any law F.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import ellipk, elliprd

# Hertz's patch is small against R. The patch of yarns that conform or lie along each other is not: curvatures that
# become flat or sharp there have smooth lower bounds. Up to kR = 0.45 around each other, or down to 15 degrees, the
# bounds change forces by less than 2 %.
LEAST_DET = 0.006  # of det M
LEAST_OPEN = 0.015  # of 2 - alpha: yarns bent beyond 1 / 2R do not touch at one point
LEAST_INNER = 0.02  # of 1 - kR: a yarn bent to its own radius has no inner side

_LOGARITHMS = np.linspace(0.0, 9.0, 400)  # of l, beyond the largest that `LEAST_DET` admits


@dataclass(frozen=True, eq=False)
class Expansion:
    """A function (k,) of v variables with its first derivatives, and its second ones where they are asked for."""

    value: np.ndarray  # (k,)
    slope: np.ndarray  # (k, v)
    bend: np.ndarray | None  # (k, v, v)

    @classmethod
    def variables(cls, values: np.ndarray, second: bool = True) -> list[Expansion]:
        """Return the variables (k, v) themselves."""
        k, v = values.shape
        zero = np.zeros((k, v, v)) if second else None
        return [cls(values[:, c], np.tile(np.eye(v)[c], (k, 1)), zero) for c in range(v)]

    @classmethod
    def over_roots(cls, values: np.ndarray, top: int, below: list[int], second: bool) -> Expansion:
        """Return one of the variables (k, v) over the roots of others, which are positive."""
        per = 1 / np.sqrt(values[:, below].prod(axis=1))
        value, slope, bend = values[:, top] * per, np.zeros(values.shape), None
        by = -0.5 / values[:, below]
        slope[:, top], slope[:, below] = per, value[:, None] * by
        if second:
            bend = np.zeros((*values.shape, values.shape[1]))
            for column, one in zip(below, by.T, strict=True):
                bend[:, top, column] = bend[:, column, top] = per * one
                bend[:, column, below] = slope[:, below] * one[:, None]
                bend[:, column, column] *= 3.0
        return cls(value, slope, bend)

    def through(self, value: np.ndarray, first: np.ndarray, second: np.ndarray) -> Expansion:
        """Return an outer function of this one, from the outer value and derivatives (k,) by this one."""
        bend = None
        if self.bend is not None:
            bend = second[:, None, None] * self.slope[:, :, None] * self.slope[:, None, :]
            bend = bend + first[:, None, None] * self.bend
        return Expansion(value, first[:, None] * self.slope, bend)

    def of(self, inner: list[Expansion]) -> Expansion:
        """Return the composition with inner functions, one for every variable of this function."""
        J = np.stack([variable.slope for variable in inner], axis=1)  # (k, v, w)
        bend = None
        if self.bend is not None:
            bend = J.swapaxes(1, 2) @ self.bend @ J
            for c, variable in enumerate(inner):
                bend += self.slope[:, c, None, None] * variable.bend
        return Expansion(self.value, np.einsum("kv,kvw->kw", self.slope, J), bend)

    def power(self, exponent: float) -> Expansion:
        """Return a power of this function."""
        x, n = self.value, exponent
        return self.through(x**n, n * x ** (n - 1), n * (n - 1) * x ** (n - 2))

    def at_least(self, least: float) -> Expansion:
        """Return a smooth lower bound y of this function x: (y - least) (y - x) = least^2."""
        x = self.value - least
        root = np.sqrt(x**2 + 4 * least**2)
        return self.through(least + 0.5 * (x + root), 0.5 * (1 + x / root), 2 * least**2 / root**3)

    def times(self, factor: np.ndarray) -> Expansion:
        """Return this function times constants (k,)."""
        return self.through(self.value * factor, factor, np.zeros_like(factor))

    def __add__(self, other: Expansion | float) -> Expansion:
        if not isinstance(other, Expansion):
            return Expansion(self.value + other, self.slope, self.bend)
        bend = None if self.bend is None else self.bend + other.bend
        return Expansion(self.value + other.value, self.slope + other.slope, bend)

    __radd__ = __add__

    def __mul__(self, other: Expansion | float) -> Expansion:
        if not isinstance(other, Expansion):
            return self.times(np.full(len(self.value), other))
        f, g, bend = self.value[:, None], other.value[:, None], None
        if self.bend is not None:
            cross = self.slope[:, :, None] * other.slope[:, None, :]
            bend = f[..., None] * other.bend + g[..., None] * self.bend + cross + cross.swapaxes(1, 2)
        return Expansion(self.value * other.value, f * other.slope + g * self.slope, bend)

    __rmul__ = __mul__


def eccentricity_squared(ratio: np.ndarray) -> np.ndarray:
    """Return e^2 (k,) of patches between surfaces whose relative curvatures have the ratio l >= 1 (k,).

    Examples
    --------
    >>> float(eccentricity_squared(np.array([1.0]))[0].round(12)) + 0.0  # yarns that cross at right angles
    0.0
    """
    return -np.expm1(_flattening()(np.log(ratio)))


@cache
def _flattening() -> CubicSpline:
    """Return the spline of ln(1 - e^2) over ln l."""
    log = -16 * np.linspace(0.0, 1.0, 2001)[1:] ** 2
    m = -np.expm1(log)
    ratio = elliprd(0, 1, 1 - m) / elliprd(0, 1 - m, 1)  # l (DLMF 19.25.1)
    return CubicSpline(np.append(0.0, np.log(ratio)), np.append(0.0, log))


def _integrals(ratio: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return K and D (k,) of patches with curvature ratios l (k,)."""
    m = eccentricity_squared(ratio)
    return ellipk(m), elliprd(0, 1 - m, 1) / 3


@cache
def _shape() -> tuple[CubicSpline, CubicSpline, CubicSpline]:
    """Return ln g over y = tr(M)^2 / (4 det M) - 1 = sinh^2(ln(l) / 2), and its two derivatives."""
    K, D = _integrals(np.exp(_LOGARITHMS))
    log = np.log(np.pi / np.sqrt(2) * D**0.5 * K**-1.5) + 0.25 * _LOGARITHMS
    curve = CubicSpline(np.sinh(0.5 * _LOGARITHMS) ** 2, log)
    return curve, curve.derivative(1), curve.derivative(2)


@dataclass(frozen=True)
class Patch:
    """Effect of the shape of a contact on its force and its stiffness."""

    poisson_ratio: float | None = None  # of half spaces; None: layers

    def density(
        self, k_a: Expansion, k_b: Expansion, cos: Expansion, near: Expansion
    ) -> tuple[Expansion, Expansion]:
        """Return the factor of the integrand of a potential over both axes, and the force over F(delta) that it makes.

        Arguments are k_a R, k_b R, the cosine of the angle and the distance over the diameter. From closest points of
        axes that are nearer than a diameter their distance grows faster than the gap of the undeformed surfaces, which
        Hertz's law is about; layers are pressed by the overlap itself.
        """
        both, trace, det = _surfaces(k_a, k_b, cos)
        force = self._force(trace, det)
        if self.poisson_ratio is not None:
            both, _, det = _surfaces(k_a * near, k_b * near, cos)
        return force * det.power(0.5) * both.power(-0.5), force

    def _force(self, trace: Expansion, det: Expansion) -> Expansion:
        if self.poisson_ratio is None:
            return det.power(-0.5)
        y = 0.25 * (trace * trace * det.power(-1.0)) + (-1.0)
        value, first, second = (curve(y.value) for curve in _shape())
        g = np.exp(value)
        return y.through(g, g * first, g * (second + first**2)) * det.power(-0.25)

    def shear(self, tangents: np.ndarray, bends: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Return the shear stiffness over dF/d(delta) (k, 3, 3) in the tangent plane.

        `tangents` (k, 2, 3) are of both axes, `bends` (k, 3) as for `force`, `normal` (k, 3) is a unit vector.
        """
        flat = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        nu = self.poisson_ratio
        if nu is None:
            return flat
        _, trace, det = _surfaces(*Expansion.variables(bends, second=False))
        half = 0.5 * trace.value
        root = np.sqrt(np.maximum(half**2 - det.value, 0.0))
        ratio = np.maximum((half + root) / np.maximum(half - root, 1e-3 * LEAST_DET), 1.0)
        K, D = _integrals(np.minimum(ratio, np.exp(_LOGARITHMS[-1])))
        along = (1 - nu) * K / ((1 - nu) * K + nu * D)
        across = (1 - nu) * K / ((1 - nu) * K + nu * (K - D))
        # The patch is long where M is small: M = 2 I - alpha a a^T - beta b b^T.
        axes = np.einsum("kij,kaj->kai", flat, tangents)
        weight = 1 / np.maximum(1 - bends[:, :2], 0.5)
        M = 2 * flat - np.einsum("ka,kai,kaj->kij", weight, axes, axes)
        # Deviator of M over its size is e2 e2^T - e1 e1^T of both principal directions.
        deviator = M - 0.5 * np.trace(M, axis1=1, axis2=2)[:, None, None] * flat
        size = np.sqrt(0.5 * np.einsum("kij,kij->k", deviator, deviator))
        deviator = np.divide(
            deviator, size[:, None, None], out=np.zeros_like(M), where=(size > 1e-12)[:, None, None]
        )
        mean, half_difference = 0.5 * (along + across), 0.5 * (across - along)
        return mean[:, None, None] * flat + half_difference[:, None, None] * deviator


def _surfaces(k_a: Expansion, k_b: Expansion, cos: Expansion) -> tuple[Expansion, Expansion, Expansion]:
    """Return alpha beta, the trace and the determinant of M."""
    alpha, beta = ((1.0 + (-1.0) * k).at_least(LEAST_INNER).power(-1.0) for k in (k_a, k_b))
    one, other = ((2.0 + (-1.0) * angle).at_least(LEAST_OPEN) for angle in (alpha, beta))
    crossed = (2.0 + (-1.0) * one) * (2.0 + (-1.0) * other) * (cos * cos)
    return alpha * beta, one + other, (one * other + (-1.0) * crossed).at_least(LEAST_DET)


LAYERS = Patch()
