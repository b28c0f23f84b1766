"""Newton's method with a line search: equilibrium at the end of one increment of the load."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.core.increment import (
    PHASES,
    Hold,
    Increment,
    PrescribedDisplacement,
    Rate,
    Settings,
    Trial,
    extrapolated,
    line_search,
    typical_stiffness,
)
from knitstudy.mechanics.core.linear import LinearSolver, SingularStiffness, System
from knitstudy.mechanics.core.model import Model, Response, eliminate, summed

log = logging.getLogger(__name__)

# Correction over the element size that is nothing but rounding: further ones leave the residual where it is.
ROUNDING = 1e-13

NEAR = 1e-2  # residual up to which one accurate step usually balances a state
# Share of the allowed residual up to which corrections do not count: loose loops have motions that nothing resists
AMPLE = 1e-2
FAR = 1.0  # residual from which extrapolation through the last states has failed
ROUGHLY = 1e-3  # residual at which a state is balanced well enough to ask whether the model has to settle it


class NotConverged(Exception):
    """An increment that did not converge; the message says why."""


@dataclass
class NewtonIterate:
    """A state on its way to equilibrium within one increment.

    `total` is its change (size,) from the beginning, `updates` what `total` was whenever the model settled the state;
    `iterations` counts from the last time that it did. `extrapolated` tells whether the first guess follows the
    increments before.
    """

    state: Any
    total: Floats
    response: Response
    residuals: list[float]
    correction: float = np.inf
    changed: bool = False
    updates: list[np.ndarray] = field(default_factory=list)
    extrapolated: bool = False
    iterations: int = 0
    still: int = 0
    tangent_is_stale: bool = True
    negative_eigenvalues: int | None = None  # of the last tangent

    @property
    def residual(self) -> float:
        """The last residual: the largest unbalanced force over the mean force."""
        return self.residuals[-1]

    @property
    def idle(self) -> int:
        """Iterations since the smallest residual."""
        return self.iterations - int(np.argmin(self.residuals[len(self.residuals) - 1 - self.iterations :]))


class NewtonSolver:
    """Newton's method for one increment of the load at a time."""

    def __init__(
        self,
        model: Model,
        prescribed: PrescribedDisplacement,
        settings: Settings,
        solver: LinearSolver,
        hold: Hold | None = None,
    ) -> None:
        self.model, self.prescribed, self.settings, self.solver = model, prescribed, settings, solver
        self.hold = hold
        prescribed.require_of(model.size)
        self.free = np.ones(model.size, dtype=bool)
        self.free[prescribed.fixed] = False
        self.spent = np.zeros(2, dtype=int)  # iterations of Newton's method and the linear solver
        self.seconds = dict.fromkeys(PHASES, 0.0)

    @cached_property
    def unit(self) -> Floats:
        """The stiffness (size,) of a typical unknown; that of prescribed ones is zero."""
        return typical_stiffness(self.model, self.prescribed.fixed)

    def increment(self, now: Increment, target: float, guess: np.ndarray | None = None) -> Increment:
        """Return the converged increment at load factor `target`, or raise NotConverged.

        `guess` (size,) is the change of all unknowns to begin with, where there is a better one than the path's.
        """
        self.spent = np.zeros(2, dtype=int)
        self.seconds = dict.fromkeys(PHASES, 0.0)
        if guess is None:
            return self._solve_increment(now, target)
        return self._iterate_from(self._start_at(now, target, guess), now, target)

    def _solve_increment(self, now: Increment, target: float) -> Increment:
        """Return the converged increment that the path's own first guess leads to, or raise NotConverged."""
        return self._iterate_from(self._predict(now, target), now, target)

    def _reset(self, at: NewtonIterate) -> None:
        """Start the iterations again in a state whose forces have changed."""
        at.iterations = 0
        at.correction = np.inf
        at.tangent_is_stale = True
        at.response = self._respond(at.state, at.total, stiffness=False)
        self._require_finite(at.response)
        at.residuals.append(self.residual(at.response))

    def _iterate_from(self, at: NewtonIterate, now: Increment, target: float) -> Increment:
        """Return the converged increment that iterations from a state lead to, or raise NotConverged."""
        try:
            while not self._is_accepted(at, now):
                at = self._iterate(at, now, target)
            at.negative_eigenvalues = self._negative_eigenvalues()
        finally:
            self.solver.forget()
        return self._converged(at, now, target)

    def _iterate(self, at: NewtonIterate, now: Increment, target: float) -> NewtonIterate:
        """Return the state after one iteration of Newton's method, or raise NotConverged."""
        self._require_progress(at)
        # A balanced state needs only the proof that its last correction is small: the tangent of the iteration
        # before serves for that.
        if at.tangent_is_stale or not self._in_equilibrium(at) or self.settings.exact:
            self._eliminate(self._tangent(at.state, at.total))
            at.tangent_is_stale = False
        step = self._solve(np.where(self.free, -at.response.force, 0.0), self._forcing(at))
        if at.changed and at.residual > NEAR:
            # The step will not balance contact: its tangent makes room for searches on the way.
            self.solver.release()
            at.tangent_is_stale = True
        self._accept(at, self._search(at, step))
        if at.extrapolated and at.iterations == 1 and at.residual > at.residuals[-2]:
            # The path has turned: the tangent at its beginning predicts better.
            return self._predict(now, target, turned=True)
        return at

    def _start_at(self, now: Increment, target: float, guess: Floats) -> NewtonIterate:
        """Return the state with which the iterations start, a guess (size,) away from where the increment begins."""
        state = self.model.advance(self.model.begin(now.state, target, target - now.load), guess)
        response = self._respond(state, guess, stiffness=False)
        self._require_finite(response)
        return NewtonIterate(state, guess.copy(), response, [self.residual(response)], changed=True)

    def _predict(self, now: Increment, target: float, turned: bool = False) -> NewtonIterate:
        """Return the state with which the iterations start: on the curve through those before, or on its tangent.

        Where the path has turned, the curve through earlier states predicts badly.
        """
        turned = turned or self.prescribed.turns(now.load)
        rates = () if turned else now.rates[: self.settings.predictor]
        at = self._predicted(now, target, rates)
        if len(rates) > 1 and not at.residual <= FAR:
            at = self._predicted(now, target, rates[:1])
        self._require_finite(at.response)
        return at

    def _predicted(
        self, now: Increment, target: float, rates: tuple[Rate, ...], change: Floats | None = None
    ) -> NewtonIterate:
        """Return the predicted state: a change (size,) away, or else by rates; without these, by the tangent.

        A straight step stretches yarns that turn, and the tangent of the state accounts for that. A curve through
        earlier states includes the turning; but where the curve overshoots it compresses yarns, which may then have no
        stiffness.
        """
        begun = self.model.begin(now.state, target, target - now.load)
        # Multipliers start from zero again, and so do the displacements that they caused.
        if change is not None:
            guess = self._with_prescribed(now, target, change)
        else:
            guess = self._guess(now, begun, target, rates)
        total = guess - sum(now.updates)
        state = self.model.advance(begun, total)
        if len(rates) > 1 or change is not None:
            state = self.model.begin(state, target, target - now.load)
        response = self._respond(state, total, stiffness=False)
        residuals = [self.residual(response)]
        changed = response.status is not None
        return NewtonIterate(state, total, response, residuals, changed=changed, extrapolated=bool(rates))

    def _guess(self, now: Increment, begun: Any, target: float, rates: tuple[Rate, ...]) -> Floats:
        """First guess (size,) of the change of all unknowns, exact where they are prescribed."""
        guess = extrapolated(rates, target - now.load) if rates else np.zeros(self.model.size)
        guess = self._with_prescribed(now, target, guess)
        if rates:
            return guess
        # Moving the prescribed nodes alone would crush the elements there: the tangent spreads their motion.
        response = self._tangent(begun, 0.0)
        pull = -(response.tangent @ guess) - (response.force if response.pulled else 0.0)
        self._eliminate(response)
        return guess + self._solve(np.where(self.free, pull, 0.0), 1e-12 if self.settings.exact else 1e-3)

    def _with_prescribed(self, now: Increment, target: float, change: Floats) -> Floats:
        """Return a change (size,) with the prescribed motion in it."""
        change = change.copy()
        change[self.prescribed.fixed] = self.prescribed.at(target) - self.prescribed.at(now.load)
        return change

    def _in_equilibrium(self, at: NewtonIterate) -> bool:
        return at.residual <= self.settings.residual_tolerance

    def _is_accepted(self, at: NewtonIterate, now: Increment) -> bool:
        """Return whether a state has converged and its model accepts it as it is; else it has to be balanced further.

        A state that the next update of the model changes anyway need not be balanced to the last digit.
        """
        while True:
            converged = self._in_equilibrium(at) and self._correction_is_small(at)
            if not converged and (at.changed or not at.residual <= ROUGHLY):
                return False
            settled = self.model.settle(at.state)
            if settled is None:
                return converged
            self._continue_settled(at, settled, now)

    def _correction_is_small(self, at: NewtonIterate) -> bool:
        """Return whether the last correction is small, or the state balanced so well that corrections do not count."""
        ample = at.residual <= AMPLE * self.settings.residual_tolerance and np.isfinite(at.correction)
        return bool(at.correction <= self.settings.correction_tolerance or ample)

    def _continue_settled(self, at: NewtonIterate, settled: Any, now: Increment) -> None:
        """Continue from a settled state, by the change after the same settling in the increment before."""
        at.state = settled
        at.updates.append(at.total.copy())
        if len(at.updates) <= len(now.updates):
            step = now.updates[len(at.updates) - 1]
            at.state = self.model.advance(at.state, step)
            at.total = at.total + step
        self._reset(at)

    def _require_progress(self, at: NewtonIterate) -> None:
        """Raise NotConverged if iterations make no progress, ConvergenceError if no shorter increment can help."""
        settings = self.settings
        if at.iterations == settings.iterations or at.idle >= settings.patience:
            residual = f"the residual is {at.residual:.2e} (allowed {settings.residual_tolerance:.1e})"
            if np.isfinite(at.correction):  # there is none right after a change of contact
                allowed = settings.correction_tolerance
                residual += f" and the correction {at.correction:.2e} h (allowed {allowed:.1e})"
            raise NotConverged(f"after {at.iterations} iterations {residual}")
        if at.still >= 2 and not self._in_equilibrium(at):
            raise ConvergenceError(
                f"rounding keeps the residual at {at.residual:.1e} (allowed {settings.residual_tolerance:.1e}): some "
                "stiffness is too large beside the others, or the load is nearly zero. Use a contact stiffness nearer "
                "to that of the elements, a larger load or a larger tolerance of the residual"
            )

    def _accept(self, at: NewtonIterate, taken: Trial) -> None:
        """Accept the trial state of the line search."""
        at.changed = not taken.response.same_status(at.response)
        at.state, at.response = taken.state, taken.response
        at.total += taken.step
        at.iterations += 1
        self.spent[0] += 1
        at.correction = self.largest(taken.step) / self.model.length
        at.still = at.still + 1 if at.correction <= ROUNDING and not at.changed else 0
        at.residuals.append(taken.residual)
        if at.changed:
            at.correction = np.inf
            at.tangent_is_stale = True
        elif taken.share == 1.0 and at.residual <= 0.3 * self.settings.residual_tolerance:
            # Corrections fall as residuals do: the next one need not be computed to be known.
            at.correction *= min(at.residual / max(at.residuals[-2], 1e-300), 1.0)
        number = len(at.residuals) - 1
        log.debug("iteration %d: residual %.3e, correction %.3e h", number, at.residual, at.correction)

    def _converged(self, at: NewtonIterate, now: Increment, target: float) -> Increment:
        change = target - now.load
        response = at.response
        if now.damped:
            energy = summed(response.energy, {"stabilisation": now.damped})
            response = replace(response, energy=energy)
        unbalanced = self._unbalanced_work(at)
        return Increment(
            index=now.index + 1,
            load=target,
            state=self.model.commit(at.state),
            response=response,
            damped=now.damped,
            unbalanced=unbalanced,
            unbalanced_so_far=now.unbalanced_so_far + unbalanced,
            size=change,
            rates=(Rate(change, at.total / change), *now.rates)[: max(self.settings.predictor, 1)],
            updates=tuple(after - before for before, after in pairwise([*at.updates, at.total])),
            newton_iterations=self.spent[0],
            krylov_iterations=self.spent[1],
            residual=at.residual,
            correction=at.correction,
            negative_eigenvalues=at.negative_eigenvalues,
            residuals=tuple(at.residuals),
            timings=self.seconds,
        )

    def _unbalanced_work(self, at: NewtonIterate) -> float:
        """Return the most work that forces can have done which the tolerance of the residual leaves unbalanced [J].

        No unbalanced force is larger than the tolerance times the mean force, and each works on its own displacement:
        the energies of a path are not known better.
        """
        largest = self.settings.residual_tolerance * at.response.mean_force
        return largest * float(np.abs(at.total * self.model.scale)[self.free].sum())

    def _respond(self, state: Any, change: Floats | float, stiffness: bool) -> Response:
        started = time.perf_counter()
        response = self.model.respond(state, stiffness)
        if self.hold is not None:
            response = self.hold.added(response, change)
        spent = time.perf_counter() - started
        self.seconds["assembly"] += response.assembly_seconds
        self.seconds["elements"] += spent - response.assembly_seconds
        return response

    def _tangent(self, state: Any, change: Floats | float) -> Response:
        # Two tangents at once would be the largest part of the memory.
        self.solver.release()
        return self._respond(state, change, stiffness=True)

    def _eliminate(self, response: Response) -> None:
        started = time.perf_counter()
        eliminate(response.tangent, self.prescribed.fixed)
        if response.unsymmetric is not None:
            eliminate(response.unsymmetric, self.prescribed.fixed, diagonal=0.0)
        self.solver.use(System(response.tangent, response.unsymmetric, response.touching, response.moved))
        self.seconds["constraints"] += time.perf_counter() - started

    def _solve(self, rhs: Floats, tolerance: float) -> Floats:
        started = time.perf_counter()
        try:
            solution = self.solver.solve(rhs, tolerance)
        except SingularStiffness as error:
            name_of = getattr(self.model, "name_of", "unknown {}".format)
            what = name_of(error.unknown)
            raise NotConverged(
                f"nothing resists a motion of {what}, and the stiffness matrix is singular"
            ) from error
        except ConvergenceError as error:
            raise NotConverged(str(error)) from error
        self.spent[1] += solution.iterations
        # Factors that were made on the way are set-up, not solution.
        self.seconds["setup"] += self.solver.setup_seconds
        self.seconds["solve"] += time.perf_counter() - started - self.solver.setup_seconds
        return solution.x

    def _negative_eigenvalues(self) -> int | None:
        """Return those of the last tangent, None if they are not known: springs that hold hide some."""
        count = self.solver.negative_eigenvalues()
        held = self.hold is not None and np.any(self.hold.stiffness)
        return count or None if held else count

    def _forcing(self, at: NewtonIterate) -> float:
        """Relative accuracy of the linear solve that Newton can use (Eisenstat and Walker 1996, choice 2).

        Large knits have soft motions, which a small residual does not show: in one increment of 16 x 16 cells with
        friction, Newton's method takes 8 iterations with 1e-3 and 14 with 3e-2.
        """
        if self.settings.exact:
            return 1e-12
        eta = 1e-3
        if len(at.residuals) > 1 and at.residual < at.residuals[-2]:
            eta = min(eta, 0.9 * (at.residual / at.residuals[-2]) ** 2)
        # Nothing is gained by solving further than the increment has to be balanced.
        floor = 0.1 * self.settings.residual_tolerance / max(at.residual, 1e-300)
        if at.residual <= NEAR and not at.changed:
            # Balance is one good step away: a few more Krylov iterations spare a tangent.
            eta = min(eta, floor)
        return min(max(eta, floor, 1e-8), 1e-1)

    def _search(self, at: NewtonIterate, step: Floats) -> Trial:
        """Return the trial state to accept along a step, which moves no farther than a stride."""
        longest = self._longest(at.state, step)
        stride = self.settings.stride
        cut = stride / longest if longest > stride else 1.0
        step = cut * step if cut < 1 else step

        def trial(share: float) -> Trial:
            part = share * step
            moved = self.model.advance(at.state, part)
            reply = self._respond(moved, at.total + part, stiffness=False)
            return Trial(share, part, moved, reply, float(step @ reply.force), self.residual(reply))

        slope = float(step @ at.response.force)
        result = line_search(trial, slope, at.residual, self.settings.residual_tolerance)
        if result is None:
            raise NotConverged("the line search found no shorter step that lowers the residual")
        return result if cut == 1 else replace(result, share=cut * result.share)

    def _longest(self, state: Any, step: Floats) -> float:
        """Return the motion of a step that `Settings.stride` limits [m].

        Of models with `motion_of_neighbours`, bodies that are near each other, it is their largest relative motion over
        the step, which is at most twice the largest displacement.
        """
        size = self.largest(step)
        of_neighbours = getattr(self.model, "motion_of_neighbours", None)
        if of_neighbours is None or 2 * size <= self.settings.stride:
            return size
        return of_neighbours(state, step)

    def largest(self, step: Floats) -> float:
        """Return the largest displacement of a step."""
        return float(np.max(np.abs(step * self.model.scale)[self.free], initial=0.0))

    def residual(self, response: Response) -> float:
        """Return the largest force of a response on unknowns that are free, over its mean force."""
        unbalanced = float(np.max(np.abs(response.force / self.model.scale)[self.free], initial=0.0))
        if unbalanced == 0.0:
            return 0.0
        return unbalanced / response.mean_force if response.mean_force > 0.0 else np.inf

    def _require_finite(self, response: Response) -> None:
        if not np.all(np.isfinite(response.force)):
            raise NotConverged("the predicted state has folded elements or forces that are not finite")
