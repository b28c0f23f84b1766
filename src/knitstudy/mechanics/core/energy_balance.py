"""Balance of energies along a load path: the work of what drives a model against the change of all its energies.

The work is a trapezoidal sum of forces over motions: independent of the potentials that it is compared with. A gap is
work that the computation has made or lost: increments that are too coarse for how the force changes within them, a
structure that snaps, or forces that no energy accounts for.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass

from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.core.increment import Increment

log = logging.getLogger(__name__)

# Shares of the allowed gap that one increment may add: of its own work, and of all work while little is done
OWN_SHARE, EARLY_SHARE = 0.5, 0.2

# Largest ratio of the error after and before two halvings of an increment at which halving goes on. Two halvings should
# divide that of the balance by 64; where the force jumps within the increment they may not reduce it at all.
WORTHWHILE = 0.75


@dataclass(frozen=True)
class Balance:
    """Balance of energies after an increment."""

    limit: float  # largest gap over the work
    work: float  # that counts: what has been done, and what is expected on the rest of the path [J]
    done: float  # in the last increment [J]
    gap: float  # work since the path began, less the change of all energies [J]
    added: float  # change of the gap in the last increment [J]
    # Up to these gaps do not count: the whole one, and that of an increment [J]
    least: float = 0.0
    least_added: float = 0.0

    @property
    def is_exceeded(self) -> bool:
        """Whether the gap is too large."""
        return abs(self.gap) > max(self.limit * self.work, self.least)

    @property
    def adds_too_much(self) -> bool:
        """Whether the last increment added too much: no increment may use up the allowance of others."""
        own = max(OWN_SHARE * abs(self.done), EARLY_SHARE * self.work)
        return abs(self.added) > max(self.limit * own, self.least_added)


def expected_work(done: float, before: float, force: float, moved: float, left: float) -> float:
    """Return the work done, and the work that a force will do on the way that is left [J].

    The force has come from another one over the way `moved`; it is taken to go on growing like that, and not to fall.

    Examples
    --------
    >>> expected_work(done=1.0, before=1.0, force=2.0, moved=1.0, left=2.0)  # 2 N and 4 N at the ends
    7.0
    """
    slope = max(force - before, 0.0) / moved if moved > 0 else 0.0
    return done + left * (force + 0.5 * slope * left)


def worth_halving(errors: list[float]) -> bool:
    """Return whether to halve an increment again, by the errors of it and of those that it is a part of.

    Examples
    --------
    >>> worth_halving([8.0, 4.0]), worth_halving([8.0, 4.0, 1.0]), worth_halving([8.0, 8.0, 8.0])
    (True, True, False)
    """
    return len(errors) < 3 or errors[-1] <= WORTHWHILE * errors[-3]


def balanced(
    past: Increment,  # with which the path begins
    increments: Generator[Increment, str | None, None],
    drive: Callable[[Increment], Floats],  # forces (size,) from outside in an increment, prescribed or dead
    limit: float,  # largest gap over the work
) -> Iterator[tuple[Increment, float, float]]:
    """Yield increments of a path that are short enough for the balance of energies, with work so far and gap [J].

    An increment that adds too much to the gap is rejected as long as shorter ones add less. Where shorter ones add no
    less, as where a structure snaps, the increment is yielded with a warning in the log.
    """
    work, gap = 0.0, 0.0
    errors: list[float] = []  # of an increment and of those that it is a part of
    each = next(increments, None)
    while each is not None:
        while (balance := _balance(past, each, drive, limit, work, gap)).adds_too_much:
            errors.append(abs(balance.added))
            reason = (
                f"increment {each.index} does a work of {balance.done:.3g}; its energy balance misses "
                f"{balance.added:.3g}"
            )
            if not worth_halving(errors):
                log.warning(
                    "%s, and shorter increments miss as much: at load factor %.6g the structure snaps, or friction was "
                    "not in equilibrium at the start of the path",
                    reason,
                    each.load,
                )
                break
            each = increments.send(f"{reason} (allowed {limit:.1%} of the work)")
        errors.clear()
        work = work + balance.done
        gap = balance.gap
        past = each
        yield each, work, gap
        each = next(increments, None)


def _balance(
    past: Increment,
    now: Increment,
    drive: Callable[[Increment], Floats],
    limit: float,
    work: float,  # before [J]
    gap: float,  # before [J]
) -> Balance:
    """Return the balance after an increment."""
    change = now.load - past.load
    last = now.rates[0]
    moved = last.step * last.increment
    before, after = (float(drive(each) @ moved) / change for each in (past, now))
    done = 0.5 * (before + after) * change
    stored, stored_before = (sum(each.response.energy.values()) for each in (now, past))
    added = done - (stored - stored_before)
    so_far = max(abs(work), abs(work + done))
    return Balance(
        limit=limit,
        work=expected_work(so_far, before, after, change, 1.0 - now.load),
        done=done,
        gap=gap + added,
        added=added,
        least=now.unbalanced_so_far,
        least_added=now.unbalanced,
    )
