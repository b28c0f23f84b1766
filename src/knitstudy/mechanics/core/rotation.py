"""Finite rotations SO(3): exponential, logarithm and the maps of the rotation halfway between two frames.

A rotation vector is Th = theta n (angle times unit axis); `hat(Th)` is its skew matrix. With

    Th = log(R1^T R2),    Rm = R1 exp(Th / 2)

and spins that act from the left, dR_a = hat(w_a) R_a, the components of all spins in the frame Rm give

    dTh = H(Th) (w2 - w1)                      H = a I + g Th Th^T,  a = (theta/2) / sin(theta/2)
    w_m = (w1 + w2) / 2 - b Th x (w2 - w1)     b = tan(theta/4) / (2 theta)

where w_m is the spin of Rm and g = (1 - a) / theta^2. H is symmetric in this frame. The scalars
are even functions of theta with their nearest pole at 2 pi: power series in (theta / 2 pi)^2, whose
coefficients are values of Dirichlet's eta and lambda functions, are accurate to rounding for all angles up
to pi, the small ones included, without branches.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import zeta

from knitstudy.mechanics.core.arrays import Floats

_TERMS = np.arange(1, 29)  # (theta / 2 pi)^2 <= 1/4 for theta <= pi: the last term is below 1e-16
_ETA = zeta(2.0 * _TERMS) * (1.0 - 2.0 ** (1 - 2 * _TERMS))
_LAMBDA = zeta(2.0 * _TERMS) * (1.0 - 4.0**-_TERMS)
_UNIT = 4.0 * np.pi**2
# a = 1 - theta^2 g,  g = -2 sum eta(2n) x^(n-1) / (2 pi)^2,  b = sum lambda(2n) x^(n-1) / pi^2
_G = np.polynomial.Polynomial(-2.0 * _ETA / _UNIT)
_B = np.polynomial.Polynomial(4.0 * _LAMBDA / _UNIT)
_DG, _DB = _G.deriv(), _B.deriv()


def hat(v: Floats) -> Floats:
    """Return the skew matrices (..., 3, 3) of vectors (..., 3): ``hat(v) @ u = v x u``.

    Examples
    --------
    >>> hat([0, 0, 1]) @ [1, 0, 0]  # the cross product of z and x is y
    array([0., 1., 0.])
    """
    v = np.asarray(v, dtype=float)
    skew = np.zeros((*v.shape, 3))
    skew[..., 0, 1] = -v[..., 2]
    skew[..., 0, 2] = v[..., 1]
    skew[..., 1, 2] = -v[..., 0]
    skew[..., 1, 0] = v[..., 2]
    skew[..., 2, 0] = -v[..., 1]
    skew[..., 2, 1] = v[..., 0]
    return skew


def exp(v: Floats) -> Floats:
    """Return the rotations (..., 3, 3) of rotation vectors (..., 3) [rad], by Rodrigues' formula.

    Examples
    --------
    >>> (exp([0, 0, np.pi / 2]) @ [1, 0, 0]).round(12) + 0.0  # a quarter turn about z takes x to y
    array([0., 1., 0.])
    """
    v = np.asarray(v, dtype=float)
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    skew = hat(v)
    # np.sinc carries the limits at angle 0: sin(t)/t and (1 - cos t)/t^2 = sinc^2(t/2)/2.
    return np.eye(3) + np.sinc(angle / np.pi) * skew + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (skew @ skew)


def log(rotation: Floats) -> Floats:
    """Return the rotation vectors (..., 3) [rad] of rotations (..., 3, 3).

    Meant for angles below pi: the axis comes from the skew part, whose rounding error grows as
    1e-16 / (pi - angle).

    Examples
    --------
    >>> log(exp([0.1, 0.2, 0.3])).round(12)
    array([0.1, 0.2, 0.3])
    """
    skew = 0.5 * (rotation - np.swapaxes(rotation, -1, -2))
    sine = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)  # sin(theta) n
    cosine = 0.5 * (np.trace(rotation, axis1=-2, axis2=-1) - 1.0)
    angle = np.arctan2(np.linalg.norm(sine, axis=-1), cosine)
    return sine / np.sinc(angle / np.pi)[..., None]


def turns(before: Floats, after: Floats) -> Floats:
    """Return the rotation vectors (k, 3) that turn unit vectors into others the shortest way [rad].

    Examples
    --------
    >>> turns(np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]])).round(4).tolist()
    [[0.0, 0.0, 1.5708]]
    """
    axis = np.cross(before, after)
    sine = np.linalg.norm(axis, axis=1)
    angle = np.arctan2(sine, np.einsum("ei,ei->e", before, after))
    return np.divide(angle, sine, out=np.ones_like(angle), where=sine > 0)[:, None] * axis


@dataclass(frozen=True)
class Halfway:
    """The scalars of the maps above for k rotation vectors, and their derivatives over the angle.

    ``d(a) = da Th . dTh`` and so on; derivatives are evaluated where they are asked for.
    """

    square: Floats  # (k,), the angles' squares [rad2]
    a: Floats  # (k,), as b and g: see above
    b: Floats
    g: Floats

    @classmethod
    def of(cls, Th: Floats) -> Halfway:
        """Return the scalars for rotation vectors Th (k, 3) of angles up to pi."""
        square = np.einsum("ki,ki->k", Th, Th)
        g = _G(square / _UNIT)
        return cls(square, a=1.0 - square * g, b=_B(square / _UNIT), g=g)

    @property
    def da(self) -> Floats:
        """Derivative (k,) of a."""
        return -2.0 * self.g - self.square * self.dg

    @property
    def db(self) -> Floats:
        """Derivative (k,) of b."""
        return 2.0 / _UNIT * _DB(self.square / _UNIT)

    @cached_property
    def dg(self) -> Floats:
        """Derivative (k,) of g."""
        return 2.0 / _UNIT * _DG(self.square / _UNIT)

    def H(self, Th: Floats) -> Floats:
        """Return the matrices (k, 3, 3) that take w2 - w1 to dTh."""
        return self.a[:, None, None] * np.eye(3) + self.g[:, None, None] * Th[:, :, None] * Th[:, None, :]

    def Hm(self, Th: Floats, m: Floats) -> Floats:
        """Return ``H(Th) m`` (k, 3) for vectors m (k, 3)."""
        along = self.g * np.einsum("ki,ki->k", Th, m)
        return self.a[:, None] * m + along[:, None] * Th

    def dHm(self, Th: Floats, m: Floats) -> Floats:
        """Return the derivatives (k, 3, 3) of ``H(Th) m`` over Th for fixed vectors m (k, 3)."""
        dot = np.einsum("ki,ki->k", Th, m)[:, None, None]
        g, da, dg = (value[:, None, None] for value in (self.g, self.da, self.dg))
        outer = Th[:, :, None] * Th[:, None, :]
        m_Th = m[:, :, None] * Th[:, None, :]
        return da * m_Th + dg * dot * outer + g * (dot * np.eye(3) + np.swapaxes(m_Th, 1, 2))
