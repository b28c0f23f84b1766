"""Bounds for knits from a box by a sample of other knits from it: order statistics, with a confidence.

The k-th smallest of n independent values lies above the quantile p of their population with the probability
P(Bin(n, p) <= k - 1), whatever the distribution (Wilks 1941, Annals of Mathematical Statistics 12).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


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

    def of(self, values: Sequence[float]) -> float:
        """Return the bound of values (n,), infinite where there are too few or too many are infinite."""
        rank = self.rank(len(values))
        return np.inf if rank is None else float(np.sort(values)[rank - 1])
