"""Orthonormal polynomials on the unit disc: Zernike's, degree by degree, and a quadrature for their products.

Born and Wolf 1999, Principles of Optics, section 9.2.1 and appendix VII.

With z = x1 + i x2 and rho = |z|^2 the functions of degree n are c Re z^m P(2 rho - 1) and c Im z^m P(2 rho - 1),
m = n, n - 2, ..., where P is the Jacobi polynomial P_j^(0, m), j = (n - m) / 2. Their mean square over the disc is 1,
so that phi_0 = 1, phi_1 = 2 x1 and phi_2 = 2 x2. On the rim P is 1: they are c cos(m theta) and c sin(m theta) there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy

LARGEST_DEGREE = 12
"""Beyond it nothing has been verified, and a span costs more than those that it saves."""


def size(degree: int | np.ndarray) -> int | np.ndarray:
    """Return the number of functions up to a degree: 1, 3, 6, 10, 15, ..."""
    return (degree + 1) * (degree + 2) // 2


@dataclass(frozen=True, eq=False)
class Modes:
    """Degree n, wave number m (n_p,) of the functions up to some degree, which are sines, and their factors c."""

    degree: np.ndarray
    wave: np.ndarray
    sine: np.ndarray
    factor: np.ndarray


@cache
def modes(degree: int) -> Modes:
    """Return what the functions up to a degree are, by rising degree."""
    rows = [
        (n, m, sine) for n in range(degree + 1) for m in range(n, -1, -2) for sine in ((0, 1) if m else (0,))
    ]
    n, m, sine = np.array(rows).T
    return Modes(n, m, sine.astype(bool), np.sqrt((n + 1) * np.where(m > 0, 2.0, 1.0)))


def values(degree: int, x: np.ndarray) -> np.ndarray:
    """Return phi (k, n_p) at points x (k, 2), also outside of the disc."""
    kind = modes(degree)
    power, radial = _power(degree, x), _radial(kind, x)
    return kind.factor * _part(power[:, kind.wave], kind) * radial


def gradients(degree: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return phi (k, n_p) and its derivatives (k, n_p, 2) at points x (k, 2)."""
    kind = modes(degree)
    power, radial = _power(degree, x), _radial(kind, x)
    j, m = (kind.degree - kind.wave) // 2, kind.wave
    squared = np.einsum("kc,kc->k", x, x)[:, None]
    slope = np.where(
        j > 0, (j + m + 1) * scipy.special.eval_jacobi(np.maximum(j - 1, 0), 1, m + 1, 2 * squared - 1), 0.0
    )
    wave = _part(power[:, m], kind)
    turned = m * power[:, np.maximum(m - 1, 0)]  # d z^m / d x1; times i: d / d x2
    first = _part(turned, kind) * radial + wave * slope * 2 * x[:, :1]
    second = _part(1j * turned, kind) * radial + wave * slope * 2 * x[:, 1:]
    return kind.factor * wave * radial, kind.factor[:, None] * np.stack([first, second], axis=-1)


@cache
def quadrature(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (m, 2) and weights (m,) that integrate up to degree 2 p + 2: Gauss in r^2 times 2 p + 3 angles.

    Two degrees more than products of two functions have, for the Jacobian of a bent yarn and for strains that are not
    linear in displacements. The weights add up to pi.
    """
    node, weight = np.polynomial.legendre.leggauss((degree + 3) // 2)
    angles = 2 * degree + 3
    theta = 2 * np.pi * np.arange(angles) / angles
    r = np.sqrt(0.5 * (1 + node))
    ring = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    points = (r[:, None, None] * ring).reshape(-1, 2)
    return points, np.repeat(0.5 * np.pi * weight / angles, angles)


def _power(degree: int, x: np.ndarray) -> np.ndarray:
    """Return z^m (k, degree + 1)."""
    return np.vander(x[:, 0] + 1j * x[:, 1], degree + 1, increasing=True)


def _part(power: np.ndarray, kind: Modes) -> np.ndarray:
    return np.where(kind.sine, power.imag, power.real)


def _radial(kind: Modes, x: np.ndarray) -> np.ndarray:
    squared = np.einsum("kc,kc->k", x, x)[:, None]
    return scipy.special.eval_jacobi((kind.degree - kind.wave) // 2, 0, kind.wave, 2 * squared - 1)
