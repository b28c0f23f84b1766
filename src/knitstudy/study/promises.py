"""Bounds for knits from a box by a sample of other knits from it: order statistics, with a confidence.

The k-th smallest of n independent values lies above the quantile p of their population with the probability
P(Bin(n, p) <= k - 1), whatever the distribution (Wilks 1941, Annals of Mathematical Statistics 12). A regression on
the inputs of a knit explains a part of the values; its leave-one-out residuals are bounded in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

SMALLEST = 1e-4  # Least value: histories and Newton's method are no more accurate


@dataclass(frozen=True)
class Quantile:
    """The share of knits that a bound holds for, and the confidence with which it does."""

    coverage: float
    confidence: float

    def rank(self, count: int) -> int | None:
        """Return which of so many values, from the smallest (1), is the bound; None where there are too few.

        >>> Quantile(0.90, 0.95).rank(48)
        47
        """
        from scipy.special import bdtr

        certain = bdtr(np.arange(count), count, self.coverage) >= self.confidence
        return int(np.argmax(certain)) + 1 if certain.any() else None

    def of(self, values: np.ndarray) -> float:
        """Return the bound of values (n,), infinite where there are too few or too many are infinite."""
        rank = self.rank(len(values))
        return np.inf if rank is None else float(np.sort(values)[rank - 1])


@dataclass(frozen=True)
class Law:
    """Expected and largest positive value by inputs: factors on the exponential of a linear law."""

    coefficients: np.ndarray  # (1 + m,) of 1 and the inputs
    between: tuple[float, float]  # logarithms between which the sample's own expectations lie
    factor: float  # largest over expected value

    def expected(self, inputs: np.ndarray) -> np.ndarray:
        """Return the expected values for inputs (..., m)."""
        linear = self.coefficients[0] + inputs @ self.coefficients[1:]
        return np.exp(np.clip(linear, *self.between))

    def most(self, inputs: np.ndarray) -> np.ndarray:
        """Return the bounds for inputs (..., m)."""
        return self.factor * self.expected(inputs)


def law_of(inputs: np.ndarray, values: Sequence[float], quantile: Quantile) -> Law:
    """Return the sharper law of values (n,), which may be infinite: by the inputs (n, m), or the same for all.

    The sharper one has the smaller mean logarithm of its bound over the sample.
    """
    logs = np.log(np.maximum(np.asarray(values, dtype=float), SMALLEST))
    known = np.isfinite(logs)
    if not known.any():
        return Law(np.zeros(1 + inputs.shape[1]), (0.0, 0.0), np.inf)
    constant = np.zeros(1 + inputs.shape[1])
    constant[0] = np.median(logs[known])
    laws = [(constant, logs - constant[0])]
    used = np.append(True, np.ptp(inputs[known], axis=0) > 0)  # without inputs that never vary
    terms = np.column_stack([np.ones(len(inputs)), inputs])[:, used]
    if known.sum() > 2 * used.sum():
        inverse = np.linalg.pinv(terms[known])
        fitted = np.zeros(len(used))
        fitted[used] = inverse @ logs[known]
        leverage = np.einsum("nm,mn->n", terms[known], inverse)
        left_out = np.full(len(logs), np.inf)
        left_out[known] = (logs[known] - terms[known] @ fitted[used]) / np.maximum(1 - leverage, SMALLEST)
        laws.append((fitted, left_out))
    candidates = [(law, terms[known] @ law[used], quantile.of(residuals)) for law, residuals in laws]
    law, expected, margin = min(candidates, key=lambda each: each[1].mean() + each[2])
    return Law(law, (float(expected.min()), float(expected.max())), float(np.exp(margin)))
