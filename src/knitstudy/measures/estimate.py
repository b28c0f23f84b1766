"""Numbers with an uncertainty: estimates, decisions by them, and limits of refined discretisations.

Limits follow Richardson's extrapolation (Roache 1998, Verification and Validation in Computational Science and
Engineering, chapter 5) for element sizes, and Aitken's, which needs no order (Press and others 2007, Numerical Recipes,
section 5.3), for polynomial degrees. Their use: docs/notes/reference.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import floor, isnan, log10, nan

import numpy as np

from knitstudy.errors import DataFileError

NONE = "no reference"  # Text of an estimate that is not known
SMALLEST = 1e-4  # Least relative uncertainty of a limit: histories and Newton's method are no more accurate


@dataclass(frozen=True)
class Estimate:
    """A value that may be off by its uncertainty either way; both are nan where it is not known.

    >>> print(Estimate(0.4071, 0.02), Estimate(0.4071, 0.0), sep=", ")
    0.41 ± 0.02, 0.41
    """

    value: float
    uncertainty: float

    @property
    def known(self) -> bool:
        """Whether there is a value."""
        return not isnan(self.value)

    def of(self, function: Callable[[float], float]) -> Estimate:
        """Return a function of the estimate: its value, and the larger change at the two ends."""
        value = function(self.value)
        ends = (self.value - self.uncertainty, self.value + self.uncertainty)
        return Estimate(value, max(abs(function(end) - value) for end in ends))

    def below(self, bar: float) -> bool | None:
        """Whether the value is at most a bar; None where the uncertainty leaves that open, or there is no value."""
        if not self.known or self.value - self.uncertainty <= bar < self.value + self.uncertainty:
            return None
        return self.value <= bar

    def above(self, bar: float) -> bool | None:
        """Whether the value is at least a bar; None where the uncertainty leaves that open, or there is no value."""
        return Estimate(-self.value, self.uncertainty).below(-bar)

    def larger_than(self, other: Estimate) -> bool | None:
        """Whether the value is larger than another; None where both uncertainties together leave that open."""
        return Estimate(self.value - other.value, self.uncertainty + other.uncertainty).above(0.0)

    def over(self, other: Estimate) -> Estimate:
        """Return the ratio to another; both relative uncertainties add.

        >>> Estimate(3.0, 0.75).over(Estimate(2.0, 0.5))
        Estimate(value=1.5, uncertainty=0.75)
        """
        off = self.uncertainty / self.value + other.uncertainty / other.value
        return Estimate(self.value / other.value, off * self.value / other.value)

    def __str__(self) -> str:
        if not self.known:
            return NONE
        if self.uncertainty <= 0:
            return f"{self.value:.2f}"
        # As many decimals as the first digit of the uncertainty has.
        decimals = min(max(2, -floor(log10(self.uncertainty))), 3)
        return f"{self.value:.{decimals}f} ± {self.uncertainty:.{decimals}f}"


UNKNOWN = Estimate(nan, nan)


def all_hold(parts: Iterable[bool | None]) -> bool | None:
    """Whether all hold: False where one does not, else None where one is open."""
    parts = list(parts)
    if False in parts:
        return False
    return None if None in parts else True


@dataclass(frozen=True)
class Limit:
    """The limit of one discretisation; the order is the observed one of the last three values, nan if there is none."""

    value: float
    uncertainty: float
    order: float
    finest: float = nan  # the value of the finest resolution


def limit_of_sizes(sizes: Sequence[float], values: Sequence[float], order: float = 2.0) -> Limit:
    """Return the limit of values whose error falls with an element size to the power of an assumed order.

    With two sizes half of the correction is the uncertainty. With three or more it is the difference of the limits of
    the two finest and of the two before them, which shows whether the values have the assumed order.
    Raises DataFileError when fewer than two sizes differ.
    """
    h, f = _in_order("sizes", sizes, values, falling=True)
    weight = (h[:-1] / h[1:]) ** order
    limits = (weight * f[1:] - f[:-1]) / (weight - 1)
    spread = 0.5 * (limits[-1] - f[-1]) if len(limits) == 1 else limits[-1] - limits[-2]
    return _limit(limits[-1], spread, f[-1], observed_order(h, f))


def limit_of_degrees(degrees: Sequence[float], values: Sequence[float]) -> Limit:
    """Return the limit of values of polynomials of rising degree, whose error falls by a factor a degree.

    Aitken's extrapolation where the last two changes have one sign and the later is the smaller one, with half of the
    correction as uncertainty; else the last value, with its change from the one before as uncertainty.
    Raises DataFileError when fewer than two degrees differ.
    """
    _, f = _in_order("degrees", degrees, values)
    change = np.diff(f)
    factor = change[-1] / change[-2] if len(change) > 1 and change[-2] != 0 else np.nan
    if 0 < factor < 1:
        correction = change[-1] * factor / (1 - factor)
        return _limit(f[-1] + correction, 0.5 * correction, f[-1])
    return _limit(f[-1], change[-1], f[-1])


def _in_order(
    what: str, resolutions: Sequence[float], values: Sequence[float], falling: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return resolutions (n,) that differ, and their values (n,)."""
    ordered = dict(sorted(zip(resolutions, values, strict=True), reverse=falling))
    if len(ordered) < 2:
        raise DataFileError(
            f"extrapolation: {what} are {list(resolutions)} but must be two different ones or more"
        )
    return np.array(list(ordered)), np.array(list(ordered.values()), dtype=float)


def _limit(value: float, spread: float, finest: float, order: float = nan) -> Limit:
    return Limit(float(value), float(max(abs(spread), SMALLEST * abs(value))), order, float(finest))


def observed_order(sizes: np.ndarray, values: np.ndarray) -> float:
    """Return the order q of values a + b h^q at the three finest of falling sizes (n,), nan where there is none."""
    if len(sizes) < 3:
        return np.nan
    h = sizes[-3:]
    change = np.diff(values[-3:])
    wanted = change[0] / change[1] if change[1] != 0 else np.nan
    tried = np.linspace(0.1, 8.0, 400)
    ratio = (h[0] ** tried - h[1] ** tried) / (h[1] ** tried - h[2] ** tried)  # rises with the order
    return float(np.interp(wanted, ratio, tried)) if ratio[0] <= wanted <= ratio[-1] else np.nan


@dataclass(frozen=True)
class Common:
    """The limit of several discretisations, its uncertainty from theirs, and the distance of the farthest two.

    That distance is of their limits or of their finest values, whichever lie farther apart.
    """

    value: float
    extrapolation: float
    disagreement: float

    @property
    def uncertainty(self) -> float:
        """The larger one of extrapolation and disagreement."""
        return max(self.extrapolation, self.disagreement)

    @property
    def origin(self) -> str:
        """The larger part of the uncertainty."""
        return "disagreement" if self.disagreement > self.extrapolation else "extrapolation"


def common_limit(limits: Sequence[Limit]) -> Common:
    """Return the mean of limits of independent discretisations, weighted by the inverse squares of uncertainties.

    Where limits lie farther apart than their uncertainties explain, some uncertainty is too small. Then the same
    variance is added to all of them, the least that explains the distance [1].

    Raises DataFileError when there are fewer than two. [1] J. Mandel, R. C. Paule: Interlaboratory evaluation of a
    material with unequal numbers of replicates, Analytical Chemistry 42 (1970).
    """
    if len(limits) < 2:
        raise DataFileError(
            f"extrapolation: there are {len(limits)} limits but must be two or more, of independent discretisations"
        )
    value = np.array([limit.value for limit in limits])
    spread = np.array([limit.uncertainty for limit in limits])
    apart = max(np.ptp(value), np.nan_to_num(np.ptp([limit.finest for limit in limits])))
    if not spread.any():  # all values are 0
        return Common(float(value.mean()), 0.0, float(apart))
    variance = np.maximum(spread, SMALLEST * spread.max()) ** 2
    weight = 1 / (variance + _unexplained(value, variance))
    weight /= weight.sum()
    return Common(
        value=float(weight @ value),
        extrapolation=float(np.sqrt(weight**2 @ variance)),
        disagreement=float(apart),
    )


def _unexplained(value: np.ndarray, variance: np.ndarray) -> float:
    """Return the variance to add to all variances (n,) that explains the scatter of the values (n,)."""

    def excess(added: float) -> float:
        weight = 1 / (variance + added)
        mean = weight @ value / weight.sum()
        return float(weight @ (value - mean) ** 2) - (len(value) - 1)

    from scipy.optimize import brentq  # few tables get here

    return 0.0 if excess(0.0) <= 0 else float(brentq(excess, 0.0, np.ptp(value) ** 2))
