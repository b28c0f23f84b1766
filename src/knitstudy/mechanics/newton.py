"""Newton's method with line search along a load path of adaptive increments.

The solver knows neither solids nor beams: it drives any `Model` to equilibrium under prescribed unknowns.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.constraints import DirichletElimination, without
from knitstudy.mechanics.increment import PHASES, Increment, PrescribedDisplacement, Rate, Settings
from knitstudy.mechanics.linear.solver import LinearSolver
from knitstudy.mechanics.model import Model, Response

log = logging.getLogger(__name__)

SMALLEST = 1e-9
"""Increment of the load factor below which the path counts as ended: rounding would go on for ever."""


class _Failed(Exception):
    """An increment that did not converge; the message says in what way."""


def trace(
    model: Model,
    prescribed: PrescribedDisplacement,
    settings: Settings,
    solver: LinearSolver,
    resume: Increment | None = None,
) -> Iterator[Increment]:
    """Follow the load path from the undeformed state (or from `resume`) to full load.

    Yields
    ------
    Increment
        Every converged increment in order, starting with the undeformed state unless resumed.

    Raises
    ------
    ConvergenceError
        If halving the increment `settings.cutbacks` times does not help; what was yielded stays valid.
    """
    largest = 1.0 / settings.increments
    now = resume
    if now is None:
        state = model.start()
        now = Increment(0, 0.0, state, model.respond(state, stiffness=False), largest)
        yield now
    path = _Path(model, prescribed, settings, solver)
    cutbacks, reason = 0, "nothing had failed"
    spent = [0, 0]
    size = now.size
    while now.load < 1.0:
        target = now.load + size
        # Whole shares of the load stay free of rounding.
        whole = round(target * settings.increments) / settings.increments
        if abs(target - whole) < 1e-9:
            target = whole
        stop = prescribed.next_stop(now.load)
        if target > stop - 1e-9:
            target = stop
        try:
            if not target - now.load > SMALLEST:
                raise _Failed(f"the increment has become too small; before that, {reason}")
            done = path.increment(now, target)
        except ConvergenceError as error:
            raise ConvergenceError(f"increment {now.index + 1}, load factor {target:.6g}: {error}") from None
        except _Failed as failure:
            cutbacks, reason = cutbacks + 1, str(failure)
            spent[0] += path.newton_iterations
            spent[1] += path.krylov_iterations
            if cutbacks > settings.cutbacks:
                raise ConvergenceError(
                    f"increment {now.index + 1} does not converge beyond load factor {now.load:.6g}: {failure}; "
                    f"the increment was halved {settings.cutbacks} times. Results up to there are kept. "
                    "More solver.increments, a finer mesh or a smaller load.strain may help."
                ) from None
            size = 0.5 * (target - now.load)
            log.warning("increment %d failed (%s); trying %.3g of the load", now.index + 1, failure, size)
            continue
        cutbacks = 0
        if done.newton_iterations <= settings.quick:
            size = min(largest, size * settings.growth)
        now = replace(
            done,
            size=size,
            newton_iterations=done.newton_iterations + spent[0],
            krylov_iterations=done.krylov_iterations + spent[1],
        )
        spent = [0, 0]
        yield now


class _Path:
    """One increment of the load path at a time."""

    def __init__(
        self, model: Model, prescribed: PrescribedDisplacement, settings: Settings, solver: LinearSolver
    ) -> None:
        self.model, self.prescribed, self.settings, self.solver = model, prescribed, settings, solver
        self.free = np.ones(model.size, dtype=bool)
        self.free[prescribed.fixed] = False
        self.elimination: DirichletElimination | None = None
        self.newton_iterations = 0
        self.krylov_iterations = 0
        self.seconds = dict.fromkeys(PHASES, 0.0)

    def increment(self, now: Increment, target: float) -> Increment:
        """Return the converged increment at load factor `target`, or raise _Failed."""
        model, settings = self.model, self.settings
        self.newton_iterations = self.krylov_iterations = 0
        self.seconds = dict.fromkeys(PHASES, 0.0)
        change = target - now.load
        begun = model.begin(now.state, target, change)
        total = self._predict(now, begun, target)
        state = model.advance(begun, total)
        response = self._respond(state, stiffness=False)
        self._require_finite(response)
        residuals = [self._residual(response)]
        correction = np.inf
        tangent_is_stale = True
        changed = response.status is not None
        settled = 0
        while True:
            balanced = residuals[-1] <= settings.residual_tolerance
            if balanced and correction <= settings.correction_tolerance:
                better = model.settle(state)
                if better is None:
                    break
                state, settled = better, self.newton_iterations
                response = self._respond(state, stiffness=False)
                residuals.append(self._residual(response))
                correction, tangent_is_stale = np.inf, True
                continue
            done = self.newton_iterations - settled
            idle = done - int(np.argmin(residuals[len(residuals) - 1 - done :]))
            if done == settings.iterations or idle >= settings.patience:
                raise _Failed(
                    f"after {done} iterations the residual is {residuals[-1]:.2e} "
                    f"(allowed {settings.residual_tolerance:.1e}) and the correction {correction:.2e} h "
                    f"(allowed {settings.correction_tolerance:.1e})"
                )
            # A balanced state needs only the proof that its last correction is small: the tangent of the
            # iteration before serves for that.
            if tangent_is_stale or not balanced or settings.exact:
                self._eliminate(self._tangent(state))
                tangent_is_stale = False
            forcing = self._forcing(residuals, changed)
            step = self._solve(np.where(self.free, -response.force, 0.0), forcing)
            before = response
            step, state, response = self._search(state, response, step)
            total += step
            self.newton_iterations += 1
            correction = float(np.max(np.abs(step * model.scale)[self.free], initial=0.0)) / model.length
            changed = not response.same_status(before)
            if changed:
                correction, tangent_is_stale = np.inf, True
            residuals.append(self._residual(response))
            log.debug(
                "iteration %d: residual %.3e, correction %.3e h",
                len(residuals) - 1,
                residuals[-1],
                correction,
            )
        return Increment(
            index=now.index + 1,
            load=target,
            state=model.commit(state),
            response=response,
            size=change,
            rates=(Rate(change, total / change), *now.rates)[: settings.predictor],
            newton_iterations=self.newton_iterations,
            krylov_iterations=self.krylov_iterations,
            residual=residuals[-1],
            correction=correction,
            residuals=tuple(residuals),
            timings=self.seconds,
        )

    def _predict(self, now: Increment, begun: Any, target: float) -> np.ndarray:
        """First guess (size,) of the change of all unknowns, exact where they are prescribed."""
        change = target - now.load
        moved = self.prescribed.at(target) - self.prescribed.at(now.load)
        rates = () if self.prescribed.turns(now.load) else now.rates[: self.settings.predictor]
        if not rates:
            # Moving the driven side alone would crush the elements there: let the tangent spread it.
            guess = np.zeros(self.model.size)
            guess[self.prescribed.fixed] = moved
            response = self._tangent(begun)
            pull = np.where(self.free, -(response.stiffness @ guess), 0.0)
            self._eliminate(response)
            return guess + self._solve(pull, 1e-12 if self.settings.exact else 1e-3)
        guess = change * rates[0].step
        if len(rates) > 1:
            bend = (change + rates[0].increment) / (rates[0].increment + rates[1].increment)
            guess += change * bend * (rates[0].step - rates[1].step)
        guess[self.prescribed.fixed] = moved
        return guess

    def _respond(self, state: Any, stiffness: bool) -> Response:
        started = time.perf_counter()
        response = self.model.respond(state, stiffness)
        spent = time.perf_counter() - started
        self.seconds["assembly"] += response.assembly_seconds
        self.seconds["elements"] += spent - response.assembly_seconds
        return response

    def _tangent(self, state: Any) -> Response:
        # Two tangents at once would be the largest part of the memory.
        self.solver.release()
        return self._respond(state, stiffness=True)

    def _eliminate(self, response: Response) -> None:
        started = time.perf_counter()
        stiffness, fixed = response.stiffness, self.prescribed.fixed
        if self.elimination is None or not self.elimination.fits(stiffness):
            self.elimination = DirichletElimination(stiffness, fixed)
        self.elimination.apply(stiffness)
        unsymmetric = response.unsymmetric
        if unsymmetric is not None:
            unsymmetric = without(unsymmetric, fixed)
        self.solver.use(stiffness, unsymmetric, response.touching)
        self.seconds["constraints"] += time.perf_counter() - started

    def _solve(self, rhs: np.ndarray, tolerance: float) -> np.ndarray:
        started = time.perf_counter()
        try:
            solution = self.solver.solve(rhs, tolerance)
        except ConvergenceError as error:
            raise _Failed(str(error)) from error
        self.krylov_iterations += solution.iterations
        # Factors that were made on the way are set-up, not solution.
        self.seconds["setup"] += self.solver.setup_seconds
        self.seconds["solve"] += time.perf_counter() - started - self.solver.setup_seconds
        return solution.x

    def _forcing(self, residuals: list[float], changed: bool) -> float:
        """Relative accuracy of the linear solve that Newton can use (Eisenstat and Walker 1996, choice 2).

        While contact points still change their status, more accuracy would be lost with the next change.
        """
        if self.settings.exact:
            return 1e-12
        eta = 3e-2 if changed else 1e-3
        if len(residuals) > 1:
            eta = min(eta, 0.9 * (residuals[-1] / residuals[-2]) ** 2)
        # Nothing is gained by solving further than the increment has to be balanced.
        floor = 0.1 * self.settings.residual_tolerance / max(residuals[-1], 1e-300)
        return min(max(eta, floor, 1e-8), 1e-1)

    def _search(self, state: Any, response: Response, step: np.ndarray) -> tuple[np.ndarray, Any, Response]:
        """Shorten the step until the force along it has fallen (Crisfield's s criterion)."""
        slope = float(step @ response.force)
        before = self._residual(response)
        alpha, best = 1.0, None
        for _ in range(6):
            trial = self.model.advance(state, alpha * step)
            reply = self._respond(trial, stiffness=False)
            if np.all(np.isfinite(reply.force)):
                s = float(step @ reply.force)
                if abs(s) <= 0.8 * abs(slope) or self._residual(reply) <= max(
                    before, self.settings.residual_tolerance
                ):
                    return alpha * step, trial, reply
                if best is None or self._residual(reply) < self._residual(best[2]):
                    best = alpha * step, trial, reply
                alpha *= min(max(slope / (slope - s), 0.1), 0.5) if slope != s else 0.5
            else:
                alpha *= 0.25
        # Where points begin to touch or to slip, force jumps: the next tangent knows better than a shorter step.
        if best is not None and best[2].status is not None:
            return best
        raise _Failed("the line search found no shorter step that lowers the residual")

    def _residual(self, response: Response) -> float:
        unbalanced = float(np.max(np.abs(response.force / self.model.scale)[self.free], initial=0.0))
        if unbalanced == 0.0:
            return 0.0
        return unbalanced / response.mean_force if response.mean_force > 0.0 else np.inf

    def _require_finite(self, response: Response) -> None:
        if not np.all(np.isfinite(response.force)):
            raise _Failed("the predicted state has folded elements or forces that are not finite")
