"""Yarns pressed between plates, and the force of two yarns that cross which follows from it.

A yarn is taken as a round layer whose pressure p grows with a power m of its compression u, point by point:
p = C u^m. Of a yarn of radius R between plates that approach by e, half of it is pressed by u = e/2 - x^2 / 2R at x
from its middle. Two yarns that cross at a right angle share u = e/2 - r^2 / 4R at r from the middle of the crossing.
Integrals of p are

    plates:   F / l = C (e/2)^m (R e)^(1/2) B(m + 1, 1/2)          ~ e^(m + 1/2)
    crossing: F     = C (e/2)^m 2 pi R e / (m + 1)                 ~ e^(m + 1)

with Euler's beta function B. So yarns that cross have the exponent of the plates and a half more. Where the length l of
the pressed piece is known, their force is that of the plates over l times
2 pi (R e)^(1/2) / ((m + 1) B(m + 1, 1/2)).
"""

from __future__ import annotations

from math import exp, pi, sqrt

import numpy as np
from scipy.special import beta
from scipy.stats import linregress, t

from knitstudy.use.curve_fit import LEVEL, Interval

HALF = 0.5
"""Exponent of the force of yarns that cross less that of a yarn between plates."""


def power_law(approach: np.ndarray, force: np.ndarray) -> tuple[Interval, Interval, float]:
    """Return k and n of F = k approach^n with 95 % intervals, and the scatter of ln F about it.

    The law is a line in logarithms, fitted in least squares. Intervals are those of independent points: where one power
    does not hold over all forces, neighbours deviate alike, and the scatter says by how much.

    Parameters
    ----------
    approach : (p,) array, over the diameter
    force : (p,) array [N]
    """
    x, y = np.log(approach), np.log(force)
    line = linregress(x, y)
    quantile = t.ppf(0.5 + LEVEL / 2, len(x) - 2)
    both = (line.slope, line.stderr), (line.intercept, line.intercept_stderr)
    n, k = ((best, best - quantile * by, best + quantile * by) for best, by in both)
    scatter = sqrt(np.mean((y - line.intercept - line.slope * x) ** 2))
    return tuple(map(exp, k)), n, scatter


def crossing_over_plates(exponent: float) -> float:
    """Return k_crossing l / (k_plates d) of F = k (e / d)^n, where plates press a length l with `exponent`."""
    m = exponent - HALF
    return 2 * pi * sqrt(0.5) / ((m + 1) * beta(m + 1, 0.5))
