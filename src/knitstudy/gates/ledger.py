"""The ledger of energies must close: external work = the sum of all other forms.

What is missing there was made or lost by the computation: work of a rule that is too coarse for how the force changes
within an increment (the external work is a trapezoidal sum over increments, the work of friction takes the mean
pressure of each), or forces that no form accounts for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from knitstudy.errors import CoarseIncrement, ConvergenceError
from knitstudy.gates.wording import times

if TYPE_CHECKING:
    from knitstudy.loading.history import Recorder
    from knitstudy.loading.load_path import Motion


UNLOADED = 1e-12
"""Energy over E d^3 up to which yarns of diameter d count as unloaded: a cell at 0.1 % stores 100,000 times as much."""

ONE, BEGINNING = 0.5, 0.2
"""Shares of what is allowed that one increment may add: of its own work, and of all while hardly any is done."""


def require_closed_ledger(recorder: Recorder, index: int, limit: float, unloaded: float = 0.0) -> None:
    """Refuse an increment after which the ledger is open.

    What an increment adds to the gap is held against half of the work that is done in it, so that none uses up what is
    allowed to others. Where contact has only begun hardly any work is done, and the first increment's share in it is as
    good as arbitrary: there, and of the whole gap, the work counts that will have been done at full load if the force
    goes on as it does now (`expected_work`); at full load that is the external work itself.

    Parameters
    ----------
    recorder : Recorder
        With the increment as its last one.
    index : int
        Number of the increment.
    limit : float
        Largest gap over that work, ``gates.ledger``.
    unloaded : float
        Energy up to which nothing counts as loaded [J]: the ledger of rounding is open.

    Raises
    ------
    CoarseIncrement
        If this increment adds too much.
    ConvergenceError
        If the gap is too large though none did: the work that was expected has not been done.
    """
    energy = np.array(recorder.columns["energy"][-2:])
    if len(energy) < 2:
        return  # at rest no work is done
    missing, work = 2 * energy[:, 0] - energy.sum(axis=1), expected_work(recorder)
    gap, allowed = abs(missing[1]), max(limit * work, unloaded)
    added, done = abs(missing[1] - missing[0]), abs(energy[1, 0] - energy[0, 0])
    if added > max(limit * max(ONE * done, BEGINNING * work), unloaded):
        how = f"opens further by {added:.3g} J, {times(added, done)} the work that is done in it"
        said = _said(index, how, f"allows {limit:.1%}, and one increment half of that")
        raise CoarseIncrement(said, added, bearable=gap <= allowed)
    if gap > allowed:
        how = f"is open by {gap:.3g} J, {times(gap, work)} the external work"
        raise ConvergenceError(_said(index, how, f"allows {limit:.1%}"))


def _said(index: int, how: str, allowed: str) -> str:
    return (
        f"increment {index}: the ledger of energies {how}; gates.ledger {allowed}. Sums over increments are too coarse "
        "for how the force changes: use more solver.increments, then a smaller solver.stabilisation; gates.ledger "
        "raises the limit"
    )


def expected_work(recorder: Recorder) -> float:
    """Return the largest external work so far, and what the force will do on the rest of the path [J].

    The force is taken to go on growing as in the last increment, and not to fall.
    """
    columns, motion = recorder.columns, recorder.motion
    done = max(abs(energy[0]) for energy in columns["energy"])
    left = _way(motion, columns["load"][-1], 1.0)
    if len(columns["load"]) < 2 or left == 0.0:
        return done
    force, before = (float(np.linalg.norm(columns["reaction"][i])) for i in (-1, -2))
    went = _way(motion, columns["load"][-2], columns["load"][-1])
    slope = max(force - before, 0.0) / went if went > 0 else 0.0
    return done + left * (force + 0.5 * slope * left)


def _way(motion: Motion, start: float, end: float) -> float:
    """Return the length of the driven side's path between two load factors [m]."""
    loads = [start, *(corner for corner in motion.corners if start < corner < end), end]
    places = np.array([motion.at(load) for load in loads])
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
