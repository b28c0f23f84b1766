"""Modulus and friction from a measured curve, in least squares, with the intervals of a profile likelihood.

Forces are proportional to the modulus, so that the best modulus for a coefficient of friction has a closed form. The
search runs over one bounded variable, the friction, on curves that are interpolated between simulated frictions.

Noise has one size at all points, or is in proportion to the force, whichever is likelier: least squares of forces, or
of their logarithms. Intervals hold values whose sum of squares is at most S_min (1 + F(1, n - p) / (n - p)): Bates and
Watts 1988, "Nonlinear regression analysis and its applications", section 6.1.

Forces of a more accurate model at some frictions correct all others by a ratio that is interpolated over friction. The
error that is left is taken to lie evenly within plus and minus what the correction changed, a standard uncertainty of
that over sqrt(3) (Guide to the Expression of Uncertainty in Measurement, 4.3.7), and joins the intervals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.stats import f as fisher
from scipy.stats import norm

from knitstudy.errors import DataFileError
from knitstudy.mechanics.core.arrays import Floats

LEVEL = 0.95  # of the intervals
SIMULATED, GRID = 7, 1001  # frictions that are simulated, and those that a curve is interpolated at
LEAST = 4  # points that a curve is fitted to
LEFT = norm.ppf(0.5 + LEVEL / 2) / np.sqrt(3)  # half an interval over the change by a correction
TINY = np.finfo(float).tiny

Interval = tuple[float, float, float]
"""A value, and the lowest and the highest one that fit as well."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Fit to a measured curve of n points."""

    factor: Interval  # of the modulus, over the one that the forces were simulated with
    friction: Interval  # of one friction alone, if only one friction is simulated
    forces: Floats  # (n,) of the best fit
    proportional: bool  # whether the noise is in proportion to the force
    noise: float  # its standard deviation, over the force or over the largest force
    correlation: float  # of the residuals at neighbouring points; 0 where chance explains the correlation
    likelihood: float  # its logarithm, but for a constant
    bounds: tuple[float, float]  # of the friction
    correction: tuple[float, float] | None = None  # smallest and largest one of a force, over the force

    def remarks(self) -> list[str]:
        """Return remarks on the intervals, a line each."""
        remarks = []
        (lowest, highest) = self.bounds
        low = self.friction[1] <= lowest
        high = self.friction[2] >= highest
        if lowest == highest:
            remarks.append("friction cannot be determined: no yarns of the scene slide with friction")
        elif low or high:
            bound = f"at most {self.friction[2]:.3g}" if low else f"at least {self.friction[1]:.3g}"
            fact = "cannot be determined from this curve" if low and high else f"is {bound}"
            remarks.append(f"friction {fact}: all such values between {lowest:g} and {highest:g} fit as well")
        if self.correlation:
            remarks.append(
                f"neighbours correlate by {self.correlation:.2g}, so that residuals are not noise: intervals are "
                "wider, and the scene misses the shape of the curve (check loop, yarn, load.lateral)"
            )
        if self.correction is None:
            remarks.append(
                "the intervals do not contain the error of the model: --check KEY=VALUE adds the error"
            )
        else:
            least, most = (f"{100 * bound:.2g}" for bound in self.correction)
            remarks.append(
                f"forces are corrected by {least} to {most} % to the more accurate model; the intervals contain the "
                "change of the values by this correction, for the error of the model"
            )
        return remarks


def fit(
    measured: Floats,
    simulated: Mapping[float, Floats],
    check: Callable[[list[float]], Mapping[float, Floats]] | None = None,
) -> Fit:
    """Return the fit of measured forces (n,) by simulated ones (n,) by friction.

    `check` returns the forces of a more accurate model by friction. It is asked for the best friction and the ends of
    its interval, until the best one lies between simulated ones; frictions that it cannot simulate are left out.
    """
    if len(measured) < LEAST:
        raise DataFileError(f"{len(measured)} measured points are too few: {LEAST} are needed")
    if not all(np.any(forces) for forces in simulated.values()):
        raise DataFileError("simulated forces are zero at all measured points: set a larger load.strain")
    if not np.any(measured):
        raise DataFileError("measured forces are zero up to where simulations end: set a larger load.strain")
    frictions = np.linspace(min(simulated), max(simulated), GRID if len(simulated) > 1 else 1)
    forces = _at(frictions, simulated)
    first = best = _likeliest(measured, frictions, forces)
    tried: set[float] = set()
    checked: dict[float, Floats] = {}
    while check and not min(checked, default=np.inf) <= best.friction[0] <= max(checked, default=0):
        if not (new := sorted({*best.friction} - tried)):
            break
        tried |= {*new}
        if checked := checked | {**check(new)}:
            places = np.array([*checked])
            ratio = _at(
                frictions, dict(zip(places, [*checked.values()] / _at(places, simulated), strict=True))
            )
            best = _widened(_likeliest(measured, frictions, ratio * forces), first, ratio)
    return best


def _interval(values: Iterable[float]) -> Interval:
    best, lowest, highest = map(float, values)
    return best, lowest, highest


def _at(frictions: Floats, curves: Mapping[float, Floats]) -> Floats:
    """Return the curve (n,) at every friction (g,): between those of known frictions, beyond them the last one."""
    known = sorted(curves)
    forces = np.array([curves[friction] for friction in known])
    if len(known) == 1:
        return np.repeat(forces, len(frictions), axis=0)
    return PchipInterpolator(known, forces)(np.clip(frictions, known[0], known[-1]))


def _widened(best: Fit, before: Fit, ratio: Floats) -> Fit:
    """Return a corrected fit whose intervals hold the error that is left by the correction as well."""

    def interval(value: Interval, other: Interval, bounds: tuple[float, float]) -> Interval:
        ends = np.hypot(np.subtract(value, value[0]), LEFT * (value[0] - other[0])) * [0, -1, 1]
        return _interval(np.clip(value[0] + ends, *bounds))

    return replace(
        best,
        factor=interval(best.factor, before.factor, (-np.inf, np.inf)),
        friction=interval(best.friction, before.friction, best.bounds),
        correction=(float(ratio.min()) - 1, float(ratio.max()) - 1),
    )


def _likeliest(measured: Floats, frictions: Floats, forces: Floats) -> Fit:
    kinds = (False, True) if (measured > 0).all() and (forces > 0).all() else (False,)
    fits = [_fit(measured, frictions, forces, kind) for kind in kinds]
    return max(fits, key=lambda best: best.likelihood)


def _fit(measured: Floats, frictions: Floats, f: Floats, proportional: bool) -> Fit:
    """Return the fit by one of the curves (g, n) of frictions (g,), for one kind of noise."""
    n = len(measured)
    free = 1 + (len(frictions) > 1)
    best_of = np.exp if proportional else np.asarray
    # y = offset + a slope + noise, where exp a or a is the factor of the modulus
    y, offset, slope = (np.log(measured), np.log(f), np.ones_like(f)) if proportional else (measured, 0.0, f)
    information = (slope * slope).sum(axis=1)
    a = (slope * (y - offset)).sum(axis=1) / information
    residuals = y - offset - a[:, None] * slope
    squares = (residuals**2).sum(axis=1)
    best = int(squares.argmin())
    deviation = np.sqrt(squares[best] / (n - free))
    left = residuals[best]
    correlation = left[1:] @ left[:-1] / max(squares[best], TINY)
    correlation = float(correlation) if correlation > 2 / np.sqrt(n) else 0.0
    freedom = max(n * (1 - correlation) / (1 + correlation) - free, 1.0)
    limit = squares[best] * (1 + fisher.ppf(LEVEL, 1, freedom) / freedom)
    inside = squares <= limit
    half = np.sqrt((limit - squares[inside]) / information[inside])
    ends = a[best], (a[inside] - half).min(), (a[inside] + half).max()
    return Fit(
        factor=_interval(best_of(ends)),
        friction=_interval((frictions[best], *frictions[inside][[0, -1]])),
        forces=best_of(a[best]) * f[best],
        proportional=proportional,
        noise=float(deviation / (1.0 if proportional else np.abs(measured).max())),
        correlation=correlation,
        likelihood=float(-n * np.log(max(deviation, TINY)) - (y.sum() if proportional else 0.0)),
        bounds=(float(frictions[0]), float(frictions[-1])),
    )
