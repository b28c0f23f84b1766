"""Basis functions of a spline yarn: polynomials on the unit disc, B-splines along the yarn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from math import factorial
from typing import TypeVar

import numpy as np
import scipy
import scipy.sparse as sp
from scipy.interpolate import BSpline
from scipy.sparse.linalg import splu

from knitstudy.errors import MeshError
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints

Degree = TypeVar("Degree", int, np.ndarray)

# Orthonormal polynomials on the unit disc: Zernike's, degree by degree, and a quadrature for their products
# Born and Wolf 1999, Principles of Optics, section 9.2.1 and appendix VII.
#
# With z = x1 + i x2 and rho = |z|^2 the functions of degree n are c Re z^m P(2 rho - 1) and c Im z^m P(2 rho - 1),
# m = n, n - 2, ..., where P is the Jacobi polynomial P_j^(0, m), j = (n - m) / 2. Their mean square over the disc is 1,
# so that phi_0 = 1, phi_1 = 2 x1 and phi_2 = 2 x2. On the rim P is 1: they are c cos(m theta) and c sin(m theta) there.


def size(degree: Degree) -> Degree:
    """Return the number of functions up to a degree: 1, 3, 6, 10, 15, ...

    Examples
    --------
    >>> [size(degree) for degree in (1, 2, 3)]
    [3, 6, 10]
    """
    return (degree + 1) * (degree + 2) // 2


@dataclass(frozen=True, eq=False)
class Modes:
    """Degree n, wave number m (n_p,) of the functions up to some degree, which are sines, and their factors c."""

    degree: Ints
    wave: Ints
    sine: Bools
    factor: Floats


@cache
def modes(degree: int) -> Modes:
    """Return the functions up to a degree, by rising degree.

    Examples
    --------
    >>> modes(2).wave.tolist()  # 1; x1, x2; of degree 2
    [0, 1, 1, 2, 2, 0]
    """
    rows = [
        (n, m, sine) for n in range(degree + 1) for m in range(n, -1, -2) for sine in ((0, 1) if m else (0,))
    ]
    n, m, sine = np.array(rows).T
    return Modes(n, m, sine.astype(bool), np.sqrt((n + 1) * np.where(m > 0, 2.0, 1.0)))


def values(degree: int, x: Floats) -> Floats:
    """Return phi (k, n_p) at points x (k, 2), also outside of the disc.

    Examples
    --------
    >>> values(1, np.array([[0.5, 0.0]]))  # 1, 2 x and 2 y: orthonormal on the unit disc
    array([[1., 1., 0.]])
    """
    return gradients(degree, x)[0]


def gradients(degree: int, x: Floats) -> tuple[Floats, Floats]:
    """Return phi (k, n_p) and its derivatives (k, n_p, 2) at points x (k, 2)."""
    kind = modes(degree)
    m = kind.wave
    j = (kind.degree - kind.wave) // 2
    place = 2 * np.einsum("kc,kc->k", x, x)[:, None] - 1
    radial = scipy.special.eval_jacobi(j, 0, m, place)
    slope = np.where(
        j > 0, (j + m + 1) * scipy.special.eval_jacobi(np.maximum(j - 1, 0), 1, m + 1, place), 0.0
    )
    power = np.vander(x[:, 0] + 1j * x[:, 1], degree + 1, increasing=True)  # z^m
    turned = m * power[:, np.maximum(m - 1, 0)]  # d z^m / d x1; times i: d / d x2
    wave, *change = (np.where(kind.sine, z.imag, z.real) for z in (power[:, m], turned, 1j * turned))
    parts = [change[c] * radial + wave * slope * 2 * x[:, c : c + 1] for c in range(2)]
    return kind.factor * wave * radial, kind.factor[:, None] * np.stack(parts, axis=-1)


@cache
def quadrature(degree: int) -> tuple[Floats, Floats]:
    """Return points (m, 2) and weights (m,) that integrate up to degree 2 p + 2: Gauss in r^2 times 2 p + 3 angles.

    Two degrees more than products of two functions have, for the Jacobian of a bent yarn and for strains that are not
    linear in displacements. The weights add up to pi.

    Examples
    --------
    >>> points, weights = quadrature(2)
    >>> float((weights * points[:, 0] ** 2).sum().round(12))  # the integral of x^2, pi / 4
    0.785398163397
    """
    points, weight = on_rings((degree + 3) // 2, 2 * degree + 3)
    return points, np.pi * weight


def on_rings(rings: int, angles: int, turn: np.ndarray | float = 0.0) -> tuple[Floats, Floats]:
    """Return points (m, 2) and weights (m,) of the mean over the disc; rings `turn` (rings, 1) by parts of a step.

    Examples
    --------
    >>> points, weights = on_rings(rings=2, angles=8)
    >>> float(round(weights @ points[:, 1] ** 2, 12))  # mean of x2^2
    0.25
    """
    square, weight = np.polynomial.legendre.leggauss(rings)
    angle = 2 * np.pi * (np.arange(angles) + turn * np.ones((rings, 1))) / angles
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    points = np.sqrt(0.5 * (square + 1))[:, None, None] * ring
    return points.reshape(-1, 2), np.repeat(0.5 * weight / angles, angles)


# B-splines of one variable on an open knot vector: values and derivatives at many places at once


@dataclass(frozen=True, eq=False)
class Spline:
    """The B-splines of a degree on a knot vector whose first and last knot stand degree + 1 times."""

    degree: int  # d
    # (J + d + 1,), rising. J functions; the first and the last alone do not vanish at the ends.
    knots: Floats

    @classmethod
    def on(cls, breaks: Floats, degree: int, sharp: np.ndarray | Sequence[int] = ()) -> Spline:
        """Return the splines with knots at breaks (b,), smooth there but for the breaks of numbers `sharp`.

        At a sharp break the knot stands `degree` times: one function alone is 1 there, and a value that is prescribed
        on one side ends there exactly.

        Raises MeshError if the degree is no positive number, or breaks do not rise.
        """
        breaks = np.asarray(breaks, dtype=float)
        if degree < 1:
            raise MeshError(f"spline degree {degree} is not allowed; it must be at least 1")
        if len(breaks) < 2 or not np.all(np.diff(breaks) > 0):
            raise MeshError("spans of a yarn: there must be at least one, and every one longer than 0")
        times = np.ones(len(breaks), dtype=int)
        times[list(sharp)] = degree
        times[[0, -1]] = degree + 1
        return cls(degree, np.repeat(breaks, times))

    @property
    def size(self) -> int:
        """Number of functions J."""
        return len(self.knots) - self.degree - 1

    @cached_property
    def _interval(self) -> Ints:
        """Numbers (E,) of the knots that spans begin with."""
        return np.flatnonzero(np.diff(self.knots) > 0)

    @cached_property
    def spans(self) -> Floats:
        """Ends (E, 2) of the spans."""
        return np.stack([self.knots[self._interval], self.knots[self._interval + 1]], axis=-1)

    @cached_property
    def first(self) -> Ints:
        """First function (E,) of every span; d + 1 of them do not vanish there."""
        return self._interval - self.degree

    def span_at(self, s: Floats) -> Ints:
        """Return the spans (k,) of places (k,); the nearest one outside of the yarn."""
        return np.clip(np.searchsorted(self.spans[:, 0], s, side="right") - 1, 0, len(self.spans) - 1)

    def basis(
        self,
        s: Floats,  # (k,)
        orders: int = 0,  # highest derivative
        span: Ints | None = None,  # (k,), spans to evaluate; by default the spans of the places
    ) -> tuple[Ints, Floats]:
        """Return the first function (k,) and all of them with derivatives (orders + 1, k, d + 1) at places (k,).

        Outside of the yarn its last spans go on.
        """
        s = np.asarray(s, dtype=float)
        span = self.span_at(s) if span is None else span
        beyond = s - self.spans[span, 0]
        powers = np.zeros((len(s), orders + 1, self.degree + 1))
        for order in range(min(orders, self.degree) + 1):
            powers[:, order, order] = factorial(order)
            for n in range(order + 1, self.degree + 1):
                powers[:, order, n] = powers[:, order, n - 1] * (beyond * (n / (n - order)))
        return self.first[span], np.swapaxes(powers @ self._pieces[span], 0, 1)

    @cached_property
    def _pieces(self) -> Floats:
        """Coefficients (E, d + 1, d + 1) of the powers of the way into every span, for all functions there."""
        # Where knots fall, another yarn begins.
        yarns = np.split(self.knots, np.flatnonzero(np.diff(self.knots) < 0) + 1)
        return np.concatenate([_powers(knots, self.degree) for knots in yarns])

    def matrix(self, s: Floats) -> sp.csr_matrix:
        """Return the values (k, J) at places (k,)."""
        return sp.csr_matrix(BSpline.design_matrix(s, self.knots, self.degree, extrapolate=True))

    def fit(self, s: Floats, values: Floats) -> Floats:
        """Return the coefficients (J, m) of values (k, m) at rising places (k,) from end to end.

        Least squares, but the first and the last value are met.

        Raises MeshError if there are too few places for the spans.
        """
        ends = values[[0, -1]]
        matrix = self.matrix(s)
        inner = matrix[:, 1:-1]
        normal = sp.csc_matrix(inner.T @ inner)
        rest = inner.T @ (values - matrix[:, [0, self.size - 1]] @ ends)
        if not np.all(normal.diagonal() > 0) or len(s) < self.size:
            raise MeshError(f"{len(s)} places of a yarn are too few to fit {self.size} splines")
        coefficients = splu(normal).solve(np.ascontiguousarray(rest)) if inner.shape[1] else rest
        return np.concatenate([ends[:1], coefficients, ends[1:]])


def _powers(knots: Floats, degree: int) -> Floats:
    """Return Taylor's coefficients (E, d + 1, d + 1) of the functions of every span at its beginning."""
    count = degree + 1
    begin = np.flatnonzero(np.diff(knots) > 0)
    # Of every d + 1 functions in a row one alone does not vanish in a span: their sums are enough.
    sums = BSpline(knots, np.eye(count)[np.arange(len(knots) - count) % count], degree)
    powers = [sums(knots[begin], order) / factorial(order) for order in range(count)]
    own = (begin[:, None] - degree + np.arange(count)) % count
    return np.take_along_axis(np.stack(powers, axis=1), own[:, None], axis=2)
