"""B-splines of one variable on an open knot vector: values and derivatives at many places at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from knitstudy.errors import MeshError


@dataclass(frozen=True, eq=False)
class Spline:
    """The B-splines of a degree on a knot vector whose first and last knot stand degree + 1 times.

    Attributes
    ----------
    degree : int
        d.
    knots : ndarray, shape (J + d + 1,)
        Rising. J functions; the first and the last alone do not vanish at the ends.
    """

    degree: int
    knots: np.ndarray

    @classmethod
    def on(cls, breaks: np.ndarray, degree: int, sharp: Sequence[int] = ()) -> Spline:
        """Return the splines with knots at breaks (b,), smooth there but for the breaks of numbers `sharp`.

        At a sharp break the knot stands `degree` times: one function alone is 1 there, and what is prescribed on one
        side ends there exactly.

        Raises
        ------
        MeshError
            If the degree is no positive number, or breaks do not rise.
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
    def _interval(self) -> np.ndarray:
        """Numbers (E,) of the knots that spans begin with."""
        return np.flatnonzero(np.diff(self.knots) > 0)

    @cached_property
    def spans(self) -> np.ndarray:
        """Ends (E, 2) of the spans."""
        return np.stack([self.knots[self._interval], self.knots[self._interval + 1]], axis=-1)

    @cached_property
    def first(self) -> np.ndarray:
        """First function (E,) of every span; d + 1 of them do not vanish there."""
        return self._interval - self.degree

    @cached_property
    def reach(self) -> np.ndarray:
        """Ends (J, 2) of what every function reaches over."""
        return np.stack([self.knots[: self.size], self.knots[self.degree + 1 :]], axis=-1)

    def span_at(self, s: np.ndarray) -> np.ndarray:
        """Return the spans (k,) of places (k,); the nearest one outside of the yarn."""
        return np.clip(np.searchsorted(self.spans[:, 0], s, side="right") - 1, 0, len(self.spans) - 1)

    def basis(
        self, s: np.ndarray, orders: int = 0, span: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the first function (k,) and all of them with derivatives (orders + 1, k, d + 1) at places (k,).

        Outside of the yarn its last spans go on.

        Parameters
        ----------
        s : ndarray, shape (k,)
        orders : int
            Highest derivative.
        span : ndarray of int, shape (k,), optional
            Spans to evaluate; by default those of the places.
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
    def _pieces(self) -> np.ndarray:
        """Coefficients (E, d + 1, d + 1) of the powers of the way into every span, for all functions there."""
        derivatives = self._recursion(self.spans[:, 0], self._interval)
        return np.stack([values / factorial(order) for order, values in enumerate(derivatives)], axis=1)

    def _recursion(self, s: np.ndarray, interval: np.ndarray) -> list[np.ndarray]:
        """Return all functions (k, d + 1) at places (k,) of spans, and each of their d derivatives.

        De Boor's recursion (Piegl and Tiller 1997, The NURBS Book, sections 2.2 and 2.3).
        """
        found = []
        for order in range(self.degree + 1):
            values = np.ones((len(s), 1))
            for q in range(1, self.degree + 1):
                values = self._raise(values, q, s, interval, derive=q > self.degree - order)
            found.append(values)
        return found

    def _raise(
        self, lower: np.ndarray, q: int, s: np.ndarray, interval: np.ndarray, derive: bool
    ) -> np.ndarray:
        """Return functions of degree q (k, q + 1), or their derivatives, from what those of degree q - 1 are."""
        around = self.knots[interval[:, None] + np.arange(1 - q, q + 1)]  # (k, 2 q)
        low, high = around[:, :q], around[:, q:]
        share = lower / (high - low)
        values = np.zeros((len(s), q + 1))
        if derive:
            values[:, 1:] += q * share
            values[:, :-1] -= q * share
        else:
            values[:, 1:] += (s[:, None] - low) * share
            values[:, :-1] += (high - s[:, None]) * share
        return values

    def matrix(self, s: np.ndarray) -> sp.csr_matrix:
        """Return the values (k, J) at places (k,)."""
        first, values = self.basis(s)
        column = first[:, None] + np.arange(self.degree + 1)
        indptr = np.arange(len(s) + 1) * (self.degree + 1)
        return sp.csr_matrix((values[0].ravel(), column.ravel(), indptr), shape=(len(s), self.size))

    def fit(self, s: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return the coefficients (J, m) of values (k, m) at rising places (k,) from end to end.

        Least squares, but the first and the last value are met.

        Raises
        ------
        MeshError
            If there are too few places for the spans.
        """
        ends = values[[0, -1]]
        matrix = self.matrix(s)
        inner = matrix[:, 1:-1]
        normal = sp.csc_matrix(inner.T @ inner)
        rest = inner.T @ (values - matrix[:, [0, self.size - 1]] @ ends)
        if not np.all(normal.diagonal() > 0) or len(s) < self.size:
            raise MeshError(f"{len(s)} places of a yarn are too few to fit {self.size} splines")
        found = splu(normal).solve(np.ascontiguousarray(rest)) if inner.shape[1] else rest
        return np.concatenate([ends[:1], found, ends[1:]])
