"""Numbers with an uncertainty, and what they decide."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import floor, isnan, log10, nan

NONE = "no reference"
"""How an estimate is written that there is none of."""


@dataclass(frozen=True)
class Estimate:
    """A value that may be off by as much as its uncertainty either way; both are nan where there is none."""

    value: float
    uncertainty: float

    @property
    def known(self) -> bool:
        """Whether there is one."""
        return not isnan(self.value)

    def of(self, function: Callable[[float], float]) -> Estimate:
        """Return a function of it: the value there, and the larger change at the two ends."""
        value, ends = function(self.value), (self.value - self.uncertainty, self.value + self.uncertainty)
        return Estimate(value, max(abs(function(end) - value) for end in ends))

    def below(self, bar: float) -> bool | None:
        """Whether it is at most a bar; None where its uncertainty leaves that open, or it is not known."""
        if not self.known or self.value - self.uncertainty <= bar < self.value + self.uncertainty:
            return None
        return self.value <= bar

    def above(self, bar: float) -> bool | None:
        """Whether it is at least a bar; None where its uncertainty leaves that open, or it is not known."""
        return Estimate(-self.value, self.uncertainty).below(-bar)

    def __str__(self) -> str:
        if not self.known:
            return NONE
        # As many decimals as the first digit of the uncertainty has.
        decimals = 2 if self.uncertainty <= 0 else min(max(2, -floor(log10(self.uncertainty))), 4)
        return f"{self.value:.{decimals}f} ± {self.uncertainty:.{decimals}f}"


UNKNOWN = Estimate(nan, nan)


def all_hold(found: Iterable[bool | None]) -> bool | None:
    """Whether everything holds: False where something does not, else None where something is open."""
    found = list(found)
    if False in found:
        return False
    return None if None in found else True
