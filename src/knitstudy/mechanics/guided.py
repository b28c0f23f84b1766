"""Newton's method with first guesses from elsewhere: from another model, or from an even stretch."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numpy as np

from knitstudy.mechanics.hold import Hold
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.newton import Iterate, Newton, NotConverged

log = logging.getLogger(__name__)

CLOSED = 0.1  # residual up to which springs hold a first guess


Guide = Callable[[float, float], np.ndarray | None]
"""Returns an estimate of the change (size,) of all unknowns between two load factors, or None."""


class GuidedNewton(Newton):
    """Newton's method whose iterations begin at the guess of a guide; where these fail, as without a guide."""

    def __init__(self, guide: Guide, *parts: Any) -> None:
        super().__init__(*parts)
        self.guide = guide

    def _solve_increment(self, now: Increment, target: float) -> Increment:
        for change in self._changes(now, target):
            try:
                at = self._predicted(now, target, (), change)
                self._require_finite(at.response)
                if self.settings.hold:
                    at = self._closed(at, now, target)
                return self._iterate_from(at, now, target)
            except NotConverged as failure:
                log.debug("iterations from the guide's guess fail: %s", failure)
        return super()._solve_increment(now, target)

    def _changes(self, now: Increment, target: float) -> list[np.ndarray]:
        """Return estimates of the change (size,) of all unknowns, the best first; none where the guide ends.

        From the third increment on the best estimate is the model's own rate, corrected by the change of the guide's
        rate. Before, and where iterations from there fail, the estimate is the guide's own.
        """
        change = self.guide(now.load, target)
        if change is None:
            return []
        if now.index < 2 or not now.rates:
            return [change]
        last, span = now.rates[0], target - now.load
        past = self.guide(now.load - last.increment, now.load)
        if past is None:
            return [change]
        return [change + span * (last.step - past / last.increment), change]

    def _closed(self, at: Iterate, now: Increment, target: float) -> Iterate:
        """Return the state near a first guess that is balanced with springs around it.

        Slack loops have motions of nearly no stiffness: corrections would be of metres.
        """
        try:
            self.hold = Hold(self.settings.hold * self.unit, at.total.copy())
            while at.residual > CLOSED:
                at = self._iterate(at, now, target)
        finally:
            self.hold = None
        self._reset(at)
        return at
