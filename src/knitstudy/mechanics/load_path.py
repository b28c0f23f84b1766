"""The load path: increments that grow where they converge soon, and are halved where they do not.

The path drives any `Model` to equilibrium under prescribed unknowns.
"""

from __future__ import annotations

import logging
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.flow import Flow
from knitstudy.mechanics.guided import Guide, GuidedNewton
from knitstudy.mechanics.increment import Increment, PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LinearSolver
from knitstudy.mechanics.model import Model
from knitstudy.mechanics.newton import Newton, NotConverged

log = logging.getLogger(__name__)

# Increment of the load factor below which the path counts as ended: rounding would go on for ever.
SMALLEST = 1e-9

HEADWAY = 0.05  # share of the load by which a path has gone on, whatever failed on the way
WORK = 2.5e6  # unknowns times iterations without headway that small models may take: half a minute to two


def trace(
    model: Model,
    prescribed: PrescribedDisplacement,
    settings: Settings,
    solver: LinearSolver,
    resume: Increment | None = None,
    guide: Guide | None = None,
) -> Generator[Increment, str | None, None]:
    """Follow the load path from the undeformed state (or from `resume`) to full load.

    A `guide` returns the first guess of an increment; if iterations from there fail, the path uses its own prediction.
    The caller may reject an increment that is too large by sending the reason. The path then tries half of this
    increment, and lets increments grow from there.

    Yields
    ------
    Increment
        Every converged increment in order, starting with the undeformed state unless resumed.

    Raises
    ------
    ConvergenceError
        If halving the increment `settings.cutbacks` times does not help, `settings.waste` iterations bring nothing, or
        rounding keeps the residual up; increments that were yielded stay valid.
    """
    share, now = 1.0 / settings.increments, resume
    if now is None:
        state = model.start()
        now = Increment(0, 0.0, state, model.respond(state, stiffness=False), share)
        yield now
    parts = model, prescribed, settings, solver
    newton = Newton(*parts) if guide is None else GuidedNewton(guide, *parts)
    flow = Flow(newton)
    settings = replace(settings, waste=max(settings.waste, int(WORK / (500 + model.size))))
    attempts = _Attempts(settings, now.headway)
    size, largest = now.size, min(now.largest, share)
    while now.load < 1.0:
        target = _target(now.load, size, prescribed, settings)
        if not target - now.load > SMALLEST:
            raise ConvergenceError(
                f"{attempts.reason}; the increment has become too small. {settings.remedy}"
            )
        flows = attempts.failed > settings.vain
        method = flow if flows else newton
        try:
            left = settings.waste - attempts.tried
            done = flow.increment(now, target, left) if flows else newton.increment(now, target)
        except ConvergenceError as error:
            raise ConvergenceError(f"increment {now.index + 1}, load factor {target:.6g}: {error}") from None
        except NotConverged as failure:
            reason = (
                f"increment {now.index + 1} does not converge beyond load factor {now.load:.6g}: {failure}"
            )
        else:
            # An increment that was too coarse for the sums of a check does not limit increments far beyond it.
            most = min(share, largest * settings.growth)
            quick = flows or done.newton_iterations <= settings.quick
            iterations, of_solver = (attempts.spent + method.spent).tolist()
            done = replace(
                done,
                size=min(most, size * settings.growth) if quick else size,
                largest=most,
                newton_iterations=iterations,
                krylov_iterations=of_solver,
                headway=attempts.after(target, largest, method.spent),
            )
            reason = yield done
            if not reason:
                attempts.end(done.headway)
                now, size, largest = done, done.size, most
                continue
            # The next ones would be too large as well.
            largest = 0.5 * (target - now.load)
        attempts.add(now, method.spent, reason)
        size = 0.5 * (target - now.load)
        log.info("%s: a shorter step follows, %.3g of the load", reason, size)


def _target(load: float, size: float, prescribed: PrescribedDisplacement, settings: Settings) -> float:
    """Return the load factor at which an increment of a size ends: at a stop on the way, or where it is a share."""
    target = load + size
    # Whole shares of the load stay free of rounding.
    whole = round(target * settings.increments) / settings.increments
    if abs(target - whole) < SMALLEST:
        target = whole
    stop = prescribed.next_stop(load + SMALLEST)
    if target > stop - SMALLEST:
        target = stop
    return target if target < 1.0 - SMALLEST else 1.0


class _Attempts:
    """Failed attempts since the last increment, and since the path last made progress."""

    def __init__(self, settings: Settings, headway: tuple[float, int, int]) -> None:
        self.settings = settings
        self.reason = ""
        self.end(headway)

    def add(self, now: Increment, spent: np.ndarray, reason: str) -> None:
        """Count a failed attempt beyond an increment."""
        self._cutbacks, self.reason = self._cutbacks + 1, reason
        self.spent, self.failed, self.tried = (
            self.spent + spent,
            self.failed + spent[0],
            self.tried + spent[0],
        )
        if self._cutbacks > self.settings.cutbacks:
            raise ConvergenceError(
                f"{reason}; the increment was halved {self.settings.cutbacks} times. {self.settings.remedy}"
            )
        if self.tried > self.settings.waste:
            raise ConvergenceError(
                f"increment {now.index + 1} makes no progress beyond load factor {now.load:.6g}: {self.tried} "
                f"iterations since load factor {self._since:.6g}; at last, {reason}. {self.settings.remedy}"
            )

    def after(self, load: float, largest: float, spent: np.ndarray) -> tuple[float, int, int]:
        """Return the progress at a load factor that was reached; see `Increment.headway`."""
        if load - self._since >= min(largest, HEADWAY):
            return load, 0, 0
        return self._since, int(self.failed), int(self.tried + spent[0])

    def end(self, headway: tuple[float, int, int]) -> None:
        """Start counting anew after an accepted increment."""
        self._since, self.failed, self.tried = headway
        self._cutbacks = 0
        self.spent = np.zeros(2, dtype=int)  # iterations of Newton's method and of the linear solver
