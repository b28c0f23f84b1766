"""The load path: increments that grow where they converge soon, and are halved where they do not.

The path drives any `Model` to equilibrium under prescribed unknowns.
"""

from __future__ import annotations

import logging
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.continuation import Flow, Guide, GuidedNewton
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
    parts = model, prescribed, settings, solver
    newton = Newton(*parts) if guide is None else GuidedNewton(guide, *parts)
    if resume is None:
        state = model.start()
        resume = Increment(0, 0.0, state, model.respond(state, stiffness=False), 1.0 / settings.increments)
        yield resume
    path = _Path(newton, resume)
    while path.now.load < 1.0:
        target = path.target()
        try:
            done = path.attempt(target)
        except NotConverged as failure:
            reason = f"{path.number} does not converge beyond load factor {path.now.load:.6g}: {failure}"
        else:
            rejected = yield done
            if not rejected:
                path.accept(done)
                continue
            reason = rejected
            # The next ones would be too large as well.
            path.largest = 0.5 * (target - path.now.load)
        path.shorten(target, reason)


class _Path:
    """The last accepted increment, and attempts at the next one, with what they have cost."""

    def __init__(self, newton: Newton, now: Increment) -> None:
        self.newton, self.flow = newton, Flow(newton)
        self.settings, self.prescribed = newton.settings, newton.prescribed
        self.waste = max(self.settings.waste, int(WORK / (500 + newton.model.size)))
        self.reason = ""  # why the last attempt failed
        self.accept(now)

    def accept(self, now: Increment) -> None:
        """Go on from an increment."""
        self.now, self.size, self.largest = now, now.size, min(now.largest, 1.0 / self.settings.increments)
        self.number = f"increment {now.index + 1}"
        # Iterations since the path last made progress, at a load factor: of failed attempts, and all
        self.since, self.failed, self.tried = now.headway
        self.cutbacks = 0
        self.spent = np.zeros(2, dtype=int)  # of failed attempts, in Newton's method and the linear solver

    def target(self) -> float:
        """Return the load factor to try next: a stop on the way, or a share of the load.

        Raises ConvergenceError if the increment has become too small.
        """
        now, increments = self.now.load, self.settings.increments
        target = now + self.size
        # Whole shares of the load stay free of rounding.
        whole = round(target * increments) / increments
        if abs(target - whole) < SMALLEST:
            target = whole
        stop = self.prescribed.next_stop(now + SMALLEST)
        if target > stop - SMALLEST:
            target = stop
        if target > 1.0 - SMALLEST:
            target = 1.0
        if not target - now > SMALLEST:
            raise ConvergenceError(
                f"{self.reason}; the increment has become too small. {self.settings.remedy}"
            )
        return target

    def attempt(self, target: float) -> Increment:
        """Return the increment at a load factor, by a viscous flow where Newton's method alone was in vain.

        Raises NotConverged if a shorter increment may help, ConvergenceError if none can.
        """
        flows = self.failed > self.settings.vain
        self.method = self.flow if flows else self.newton
        try:
            if flows:
                done = self.flow.increment(self.now, target, self.waste - self.tried)
            else:
                done = self.newton.increment(self.now, target)
        except ConvergenceError as error:
            raise ConvergenceError(f"{self.number}, load factor {target:.6g}: {error}") from None
        # An increment that was too coarse for the sums of a check does not limit increments far beyond it.
        most = min(1.0 / self.settings.increments, self.largest * self.settings.growth)
        quick = flows or done.newton_iterations <= self.settings.quick
        iterations, of_solver = (self.spent + self.method.spent).tolist()
        headway = self.since, int(self.failed), int(self.tried + self.method.spent[0])
        return replace(
            done,
            size=min(most, self.size * self.settings.growth) if quick else self.size,
            largest=most,
            newton_iterations=iterations,
            krylov_iterations=of_solver,
            headway=(target, 0, 0) if target - self.since >= min(self.largest, HEADWAY) else headway,
        )

    def shorten(self, target: float, reason: str) -> None:
        """Count a failed attempt, and halve the increment; raises ConvergenceError if that has become vain."""
        spent, self.reason = self.method.spent, reason
        self.cutbacks, self.spent = self.cutbacks + 1, self.spent + spent
        self.failed, self.tried = self.failed + spent[0], self.tried + spent[0]
        if self.cutbacks > self.settings.cutbacks:
            raise ConvergenceError(
                f"{reason}; the increment was halved {self.settings.cutbacks} times. {self.settings.remedy}"
            )
        if self.tried > self.waste:
            raise ConvergenceError(
                f"{self.number} makes no progress beyond load factor {self.now.load:.6g}: {self.tried} "
                f"iterations since load factor {self.since:.6g}; at last, {reason}. {self.settings.remedy}"
            )
        self.size = 0.5 * (target - self.now.load)
        log.info("%s: a shorter step follows, %.3g of the load", reason, self.size)
