"""Modulus and friction from a measured curve, in least squares, with the intervals of a profile likelihood.

Forces are proportional to the modulus: for a friction, the best modulus is known in closed form. What remains is a
search in one bounded variable, on curves that are interpolated between some simulated frictions.

Noise has one size at all points, or is in proportion to the force, whichever is likelier: least squares of forces, or
of their logarithms. Intervals hold values whose sum of squares is at most S_min (1 + F(1, n - p) / (n - p)): Bates and
Watts 1988, "Nonlinear regression analysis and its applications", section 6.1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.stats import f as fisher

from knitstudy.errors import DataFileError

LEVEL = 0.95  # of the intervals
GRID = 2001  # frictions that the sum of squares is computed at, between those that are simulated
FIRST, MOST = 5, 9  # frictions that are simulated: first, evenly over the range, and in all
LEAST = 4  # points that a curve is fitted to
CLOSE = 0.02  # of the range: frictions that are simulated are at least so far apart
SETTLED = 0.1  # of the interval: a smaller change of its ends ends the search
TINY = np.finfo(float).tiny

Interval = tuple[float, float, float]
"""A value, and the lowest and the highest one that fit as well."""


@dataclass(frozen=True, eq=False)
class Fit:
    """What a measured curve of n points says."""

    factor: Interval  # of the modulus, over the one that the forces were simulated with
    friction: Interval | None  # None where forces of one friction alone are known
    forces: np.ndarray  # (n,) of the best fit
    proportional: bool  # whether the noise is in proportion to the force
    noise: float  # its standard deviation, over the force or over the largest force
    correlation: float  # of what is left at neighbouring points; 0 where that may be chance
    profile: np.ndarray  # (2, g) frictions, and the sum of squares over its limit
    likelihood: float  # its logarithm, but for a constant

    def remarks(self) -> list[str]:
        """Return what a reader should know of the intervals, a line each."""
        said, (frictions, share) = [], self.profile
        low, high, between = share[0] <= 1, share[-1] <= 1, f"between {frictions[0]:g} and {frictions[-1]:g}"
        if self.friction is None:
            said.append("friction cannot be told: no yarns of the scene slide with friction")
        elif low and high:
            said.append(f"friction cannot be told from this curve: all values {between} fit within the noise")
        elif low or high:
            bound = f"at most {self.friction[2]:.3g}" if low else f"at least {self.friction[1]:.3g}"
            said.append(f"friction is {bound}: all such values {between} fit within the noise")
        if self.correlation:
            what = f"neighbours correlate by {self.correlation:.2g}, so what is left is no noise: intervals are widened"
            said.append(
                f"{what}, and the scene misses the shape of the curve (check loop, yarn, load.lateral)"
            )
        return said


def fit(measured: np.ndarray, frictions: np.ndarray, forces: np.ndarray) -> Fit:
    """Return the fit of measured forces (n,) by forces (k, n) that were simulated with rising frictions (k,)."""
    free = 1 + (len(frictions) > 1)
    if len(measured) < LEAST:
        raise DataFileError(f"{len(measured)} measured points are too few: {LEAST} are needed")
    if len(frictions) > 1:
        grid = np.linspace(frictions[0], frictions[-1], GRID)
        frictions, forces = grid, PchipInterpolator(frictions, forces)(grid)
    kinds = (False, True) if (measured > 0).all() and (forces > 0).all() else (False,)
    fits = [_fit(measured, frictions, forces, free, each) for each in kinds]
    return max(fits, key=lambda found: found.likelihood)


def _fit(measured: np.ndarray, frictions: np.ndarray, f: np.ndarray, free: int, proportional: bool) -> Fit:
    """Return the fit by one of the curves (g, n) of frictions (g,), for one kind of noise."""
    n, best_of = len(measured), (np.exp if proportional else np.asarray)
    # y = offset + a slope + noise, where exp a or a is the factor of the modulus
    y, offset, slope = (np.log(measured), np.log(f), np.ones_like(f)) if proportional else (measured, 0.0, f)
    information = (slope * slope).sum(axis=1)
    a = (slope * (y - offset)).sum(axis=1) / information
    residuals = y - offset - a[:, None] * slope
    squares = (residuals**2).sum(axis=1)
    best = int(squares.argmin())
    deviation, left = np.sqrt(squares[best] / (n - free)), residuals[best]
    correlation = left[1:] @ left[:-1] / max(squares[best], TINY)
    correlation = float(correlation) if correlation > 2 / np.sqrt(n) else 0.0
    freedom = max(n * (1 - correlation) / (1 + correlation) - free, 1.0)
    limit = squares[best] * (1 + fisher.ppf(LEVEL, 1, freedom) / freedom)
    inside = squares <= limit
    half = np.sqrt((limit - squares[inside]) / information[inside])
    ends = a[best], (a[inside] - half).min(), (a[inside] + half).max()
    largest = 1.0 if proportional else np.abs(measured).max()
    return Fit(
        factor=tuple(map(float, best_of(ends))),
        friction=tuple(map(float, (frictions[best], *frictions[inside][[0, -1]]))) if free > 1 else None,
        forces=best_of(a[best]) * f[best],
        proportional=proportional,
        noise=float(deviation / largest),
        correlation=correlation,
        profile=np.array([frictions, squares / max(limit, TINY)]),
        likelihood=float(-n * np.log(max(deviation, TINY)) - (y.sum() if proportional else 0.0)),
    )


def search(
    measured: np.ndarray,
    simulate: Callable[[float], np.ndarray | None],
    bounds: tuple[float, float],
    ratio: np.ndarray | float = 1.0,
) -> Fit:
    """Return the fit of measured forces (n,) over a range of frictions.

    `simulate` returns the forces (n,) of a friction, or None where it cannot be simulated; `ratio` corrects them. More
    frictions are simulated where the best one and the ends of its interval are, until these stay.
    """
    tried, new, found = {}, list(np.linspace(*bounds, FIRST)), None
    while new:
        tried |= {each: simulate(each) for each in map(float, new)}
        known = {each: ratio * forces for each, forces in sorted(tried.items()) if forces is not None}
        if len(known) < 3:
            raise DataFileError(
                f"{len(known)} of {len(tried)} frictions could be simulated, and 3 are needed"
            )
        before, found = found, fit(measured, np.array([*known]), np.array([*known.values()]))
        change = np.inf if before is None else np.abs(np.subtract(found.friction, before.friction)).max()
        if change <= SETTLED * np.ptp(found.friction):
            break
        apart = CLOSE * (bounds[1] - bounds[0])
        new = [each for each in found.friction if min(abs(each - other) for other in tried) > apart]
        new = new[: min(1, MOST - len(tried))]
    return found
