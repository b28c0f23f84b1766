"""Line search: how much of a Newton step is taken (Crisfield 1991, section 9.2).

Where a step closes a gap, force along it is nearly constant up to there and steep beyond. A step that is shortened
until the residual has just fallen ends far before; the root of the force along the step, kept between brackets, does
not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from knitstudy.mechanics.model import Response

TRIALS = 8
"""States at most along one step."""

CLOSE = 0.5
"""Force along the step over that at its start, at which the root counts as found."""

STEEP = 0.1
"""Residual over that at the start of the step, at which a trial is good in any case."""


@dataclass(frozen=True)
class Trial:
    """A state some share along a step.

    Attributes
    ----------
    share : float
    step : ndarray, shape (size,)
        That share of the step.
    state : object
    response : Response
    along : float
        Force along the whole step [J].
    residual : float
    """

    share: float
    step: np.ndarray
    state: Any
    response: Response
    along: float
    residual: float

    @property
    def finite(self) -> bool:
        """Whether no element has folded there."""
        return bool(np.isfinite(self.along))


def line_search(
    trial: Callable[[float], Trial], slope: float, residual: float, tolerance: float
) -> Trial | None:
    """Return the trial to go on with, or None if there is none that helps.

    Parameters
    ----------
    trial : callable
        The trial at a share of the step.
    slope : float
        Force along the step at its start [J].
    residual : float
        Residual there.
    tolerance : float
        Residual of a balanced state.
    """
    low, high = (0.0, slope), None
    share, best = 1.0, None
    for _ in range(TRIALS):
        tried = trial(share)
        if not tried.finite:
            high = share, np.nan
            share = low[0] + 0.25 * (share - low[0])
            continue
        if tried.residual <= max(tolerance, STEEP * residual) or abs(tried.along) <= CLOSE * abs(slope):
            return tried
        if best is None or abs(tried.along) < abs(best.along):
            best = tried
        before_root = tried.along * slope > 0
        if before_root and (high is None or np.isnan(high[1])):
            # The tangent is too stiff for the root to lie within the step, or the step leads uphill.
            if tried.residual <= residual or abs(tried.along) <= abs(slope):
                return tried
            high = share, np.nan
        elif before_root:
            low = share, tried.along
        else:
            high = share, tried.along
        share = _between(low, high, first=high[0] == 1.0 and low[0] == 0.0)
    # Where points begin to touch or to slip, force jumps: the next tangent knows better than a shorter step.
    if best is not None and (best.response.status is not None or best.residual < residual):
        return best
    return None


def _between(low: tuple[float, float], high: tuple[float, float], first: bool) -> float:
    """Return the next share to try, by regula falsi; away from the brackets, so that both move."""
    if np.isnan(high[1]):
        part = 0.5
    else:
        edge = 0.1 if first else 0.25
        part = min(max(low[1] / (low[1] - high[1]), edge), 1 - edge)
    return low[0] + part * (high[0] - low[0])
