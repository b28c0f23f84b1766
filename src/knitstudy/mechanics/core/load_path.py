"""The load path: increments that grow where they converge soon, and are halved where they do not.

The path drives any `Model` to equilibrium under prescribed unknowns. Where Newton's own first guess fails, a guide or
a viscous flow continues it.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Any

import numpy as np

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.core.increment import Hold, Increment, PrescribedDisplacement, Rate, Settings
from knitstudy.mechanics.core.linear import LinearSolver
from knitstudy.mechanics.core.model import Model, summed
from knitstudy.mechanics.core.newton import AMPLE, NewtonIterate, NewtonSolver, NotConverged

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

    Yields every converged increment in order, starting with the undeformed state unless resumed. Newton's method
    balances states that are not stable as well, beside which others have less energy: `Increment.negative_eigenvalues`.

    Raises ConvergenceError if halving the increment `settings.cutbacks` times does not help, `settings.waste`
    iterations bring nothing, or rounding keeps the residual up; increments that were yielded stay valid.
    """
    parts = model, prescribed, settings, solver
    newton = NewtonSolver(*parts) if guide is None else GuidedNewton(guide, *parts)
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

    def __init__(self, newton: NewtonSolver, now: Increment) -> None:
        self.newton, self.flow = newton, Flow(newton)
        self.settings, self.prescribed = newton.settings, newton.prescribed
        self.waste = max(self.settings.waste, int(WORK / (500 + newton.model.size)))
        self.reason = ""  # why the last attempt failed
        self.accept(now)

    def accept(self, now: Increment) -> None:
        """Go on from an increment."""
        self.now = now
        self.size = now.size
        self.largest = min(now.largest, 1.0 / self.settings.increments)
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
        spent = self.method.spent
        self.reason = reason
        self.cutbacks = self.cutbacks + 1
        self.spent = self.spent + spent
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


# Newton's method with first guesses from elsewhere: from another model, or from an even stretch

CLOSED = 0.1  # residual up to which springs hold a first guess


Guide = Callable[[float, float], np.ndarray | None]
"""Returns an estimate of the change (size,) of all unknowns between two load factors, or None."""


class GuidedNewton(NewtonSolver):
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
        last = now.rates[0]
        span = target - now.load
        past = self.guide(now.load - last.increment, now.load)
        if past is None:
            return [change]
        return [change + span * (last.step - past / last.increment), change]

    def _closed(self, at: NewtonIterate, now: Increment, target: float) -> NewtonIterate:
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


# Viscous flow, which continues a load path where Newton's method makes no progress
# Within an increment of the load, steps of a quasi-static flow follow each other: viscous forces c D (u - u_n) hold all
# unknowns near u_n, the last balanced state. Every balanced state is committed as a converged increment is, so that
# friction follows the path of the flow and its contacts. Shorter steps have a larger c.
#
# c falls from `FIRST` to zero as long as viscous forces do not grow, as they do where equilibrium is unstable: there a
# c smaller than the missing stiffness does not converge, or goes back. c rises where steps become longer than half an
# element, so that the trapezoidal rule gives the work of viscous forces, and where steps do not balance. A flow ends at
# c = 0, or where viscous forces are a hundredth of the allowed residual: very soft motions would go on for ever. Its
# last state is in equilibrium as that of any other increment.

FIRST = 1e-2  # viscosity at first, over the stiffness of a typical unknown
MOST = 1.0  # the same where less does not balance, beyond which the increment is too large
FADING = 0.1  # smallest ratio of viscosities that follow each other
SOONER = 0.7  # ratio of such ratios, from 1 on
GROWTH = 1.5  # ratio of viscous forces that follow each other from which viscosity does not fall
RISING = 2.5  # ratio of viscosities after a step that does not balance, or is longer than meant by as much
LEAST = 1e-9  # viscosity after which there is none: that of bending waves of 100 elements
# Largest displacement that one correction may make, and steps are meant to make, over the element size
STRIDE = 0.5


class Flow:
    """A viscous flow in place of Newton's method alone, for one increment of the load at a time."""

    def __init__(self, newton: NewtonSolver) -> None:
        self.newton = newton
        self.spent = np.zeros(2, dtype=int)  # iterations of Newton's method and the linear solver

    def increment(self, now: Increment, target: float, most: int) -> Increment:
        """Return the increment at load factor `target` to which a viscous flow leads, or raise NotConverged.

        It ends after `most` iterations. The load moves in its first step. The work of viscous forces counts, by the
        trapezoidal rule, less the work that the driven side did against them.
        """
        model, prescribed, settings = self.newton.model, self.newton.prescribed, self.newton.settings
        change = target - now.load
        fixed = prescribed.fixed
        moved = prescribed.at(target) - prescribed.at(now.load)
        near = replace(settings, stride=min(settings.stride, STRIDE * model.length))
        anchor = replace(now, rates=(), updates=())
        level = FIRST
        fading = FADING
        guess = None
        total = np.zeros(model.size)
        pull = np.zeros(model.size)
        size = 0.0
        work = 0.0
        pulled = moved
        self.spent = spent = np.zeros(2, dtype=int)
        while spent[0] <= most and level <= MOST:
            viscosity = level * self.newton.unit
            viscous = NewtonSolver(model, prescribed, near, self.newton.solver, hold=Hold(viscosity))
            try:
                reached = viscous.increment(anchor, target, guess)
                step = reached.rates[0].step * change
                far = 0.0 if guess is None else self.newton.largest(step) / (STRIDE * model.length)
                if far > RISING:
                    raise NotConverged("the step is too long")
            except (NotConverged, ConvergenceError) as failure:
                log.debug("viscosity %.1e: %s", level, failure)
                spent += viscous.spent
                level = max(level, LEAST) * RISING
                fading = 1.0
                guess = None if guess is None else guess / RISING
                continue
            spent += viscous.spent
            log.debug("viscosity %.1e: balanced after %d iterations", level, viscous.spent[0])
            before = pull
            pull = viscosity * step
            work += 0.5 * float((before + pull) @ step)
            total = total + step
            pulled = reached.response.force[fixed] if guess is None else pulled
            past = size
            size = float(np.linalg.norm(pull / model.scale))
            grows = guess is not None and size > GROWTH * past
            if viscous.residual(replace(reached.response, force=pull)) <= AMPLE * settings.residual_tolerance:
                released = max(work - 0.5 * float((pulled - reached.response.force[fixed]) @ moved), 0.0)
                energy = summed(reached.response.energy, {"stabilisation": released})
                return replace(
                    reached,
                    rates=(Rate(change, total / change), *now.rates)[: settings.predictor],
                    response=replace(reached.response, energy=energy, force=reached.response.force - pull),
                    damped=now.damped + released,
                    newton_iterations=spent[0],
                    krylov_iterations=spent[1],
                )
            anchor = replace(reached, load=now.load, index=now.index, rates=(), updates=())
            guess = np.zeros(model.size) if guess is None else step / max(far, 1.0)
            fading = 1.0 if grows else max(FADING, SOONER * fading)
            level = level * max(fading, min(far, RISING)) if level > LEAST else 0.0
        raise NotConverged(f"a viscous flow finds no equilibrium; the last viscosity is {level:.1e}")
