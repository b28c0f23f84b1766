"""Gates: what a converged run must satisfy to count."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from knitstudy.errors import CoarseIncrement, ConvergenceError, MeshError

if TYPE_CHECKING:
    from knitstudy.loading.history import Recorder
    from knitstudy.loading.load_path import Motion
    from knitstudy.mechanics.increment import Increment
    from knitstudy.mechanics.model import Response


# ---- How messages put one quantity over another


def times(part: float, whole: float) -> str:
    """Return "12.3% of", or "1.2e+04 times" where it is many times as much."""
    if part < 10 * whole:
        return f"{part / whole:.1%} of"
    return f"{part / whole:.2g} times" if whole > 0 else "any number of times"


# ---- Hourglass modes must not carry the load: one-point elements resist them by a coefficient, not by their material


USUAL = 0.005
"""Hourglass stiffness over shear stiffness as in C3D8R."""

FIRST = 0.1
"""Load factor before which rounding and slack may prevail: a hundredth of the energy of full load."""


def require_small_hourglass(
    energy: dict[str, float], load: float, index: int, coefficient: float, limit: float
) -> None:
    """Refuse a state in which hourglass modes are more than a disturbance.

    Their energy goes with the coefficient: without stiffness they move as they like and cost nothing. Below the usual
    coefficient it is therefore taken at the usual one, so that the gate sees how far they have moved.

    Parameters
    ----------
    energy : dict of str to float
        By form [J].
    load : float
        Load factor, of solids whose forces are more than rounding.
    index : int
        Number of the increment.
    coefficient : float
        ``solver.hourglass``.
    limit : float
        Largest share of the internal energy, ``gates.hourglass``.

    Raises
    ------
    ConvergenceError
        If the share is larger.
    """
    if load < FIRST:
        return
    hourglass = energy["hourglass"] * max(1.0, USUAL / coefficient)
    if hourglass > limit * energy["internal"]:
        at = f", taken at the usual {USUAL}," if coefficient < USUAL else ""
        raise ConvergenceError(
            f"increment {index}: hourglass energy{at} is {times(hourglass, energy['internal'])} the internal energy "
            f"with solver.hourglass = {coefficient:g}; gates.hourglass allows {limit:.1%}. Use {_remedy(coefficient)}; "
            "gates.hourglass raises the limit"
        )


def _remedy(coefficient: float) -> str:
    """Return what helps: never the coefficient that is set."""
    elements = "a smaller mesh.size, or mesh.element 'quadratic'"
    return elements if coefficient == USUAL else f"solver.hourglass {USUAL}, {elements}"


# ---- All gates that every converged increment has to pass


def require_sound(
    scene: Any, loaded: Callable[[Response], bool] | None, increment: Increment, recorder: Recorder
) -> None:
    """Refuse an increment that has converged to something else than what was asked for.

    Parameters
    ----------
    scene : Scene
    loaded : callable or None
        Whether forces are more than rounding, of solids; until then only the ledger is looked at.
    increment : Increment
    recorder : Recorder
        With the increment as its last one.

    Raises
    ------
    ConvergenceError
        Naming the increment, what is wrong and by how much, and the key that raises its limit.
    """
    allowed, energy, index = scene.gates, increment.response.energy, increment.index
    judged = loaded is not None and loaded(increment.response)
    if judged and energy.get("hourglass"):
        require_small_hourglass(energy, increment.load, index, scene.solver.hourglass, allowed.hourglass)
    if judged and scene.solver.stabilisation > 0:
        require_small_stabilisation(
            energy,
            increment.response.viscous_force,
            float(np.linalg.norm(recorder.columns["reaction"][-1])),
            increment.load,
            index,
            scene.solver.stabilisation,
            allowed.stabilisation,
            allowed.viscous_force,
        )
    unloaded = UNLOADED * scene.yarn.youngs_modulus * scene.yarn.diameter**3
    require_closed_ledger(recorder, index, allowed.ledger, unloaded)


# ---- The ledger of energies must close: external work = the sum of all other forms
# What is missing there was made or lost by the computation: work of a rule that is too coarse for how the force changes
# within an increment (the external work is a trapezoidal sum over increments, the work of friction takes the mean
# pressure of each), or forces that no form accounts for.


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


# ---- Elements must be small against the yarn


ELEMENTS_ACROSS: Mapping[str, float] = {"knit": 3.0, "pair": 7.0}
"""Fewest elements across a yarn by specimen: a knit bends, a pair that is pressed together is only indented."""


def fewest_across(specimen: str, refinement: float) -> float:
    """Return how many elements must lie across a yarn: of a pair fewer where they are smaller at the crossing.

    Parameters
    ----------
    specimen : str
    refinement : float
        ``mesh.refinement``.
    """
    return max(ELEMENTS_ACROSS["knit"], ELEMENTS_ACROSS[specimen] / refinement)


def require_elements_across(diameter: float, size: float, fewest: float) -> None:
    """Refuse elements that are too large for the yarn: sections deform, and yarns touch, in too few places.

    Parameters
    ----------
    diameter, size : float
        ``yarn.diameter`` and ``mesh.size`` [m].
    fewest : float
        Elements of that size across the yarn that are allowed, ``gates.elements_across``.

    Raises
    ------
    MeshError
        If there are fewer.
    """
    across = diameter / size
    # Rounded: a yarn of five elements is one in whatever unit of length.
    if round(across, 6) < fewest:
        raise MeshError(
            f"mesh.size is {size:g} m, {across:.2g} elements across a yarn.diameter of {diameter:g} m; "
            f"gates.elements_across asks for {fewest:g}: use {diameter / fewest:.3g} m or less, or ask for fewer"
        )


# ---- Where solids and beams meet there is no jump in force: what either side resists adds up to zero


def require_no_jump(scene: Any, increment: Increment, recorder: Recorder) -> None:
    """Refuse an increment after which solid and beam disagree on the force between them.

    Raises
    ------
    ConvergenceError
        If the jump is larger than the scene allows of the largest force at a seam.
    """
    jump, limit = recorder.columns["seam_jump"][-1], scene.gates.jump
    largest = float(np.linalg.norm(recorder.columns["seam_force"][-1], axis=-1).max(initial=0.0))
    if jump > limit * largest:
        raise ConvergenceError(
            f"increment {increment.index}: force jumps by {jump:.3g} N where solid yarns and beams meet; the "
            f"largest force there is {largest:.3g} N; gates.jump allows {limit:.0e} of it: use a smaller "
            "solver.residual_tolerance"
        )


# ---- Stabilisation must not carry the load: neither by what it dissipates nor by its forces at an increment


"""Load factor before which nothing may hold the yarns but stabilisation: that is what it is for."""


def require_small_stabilisation(
    energy: dict[str, float],
    viscous_force: float,
    reaction: float,
    load: float,
    index: int,
    coefficient: float,
    limit: float,
    force_limit: float,
) -> None:
    """Refuse a state in which viscous forces are more than a help.

    Parameters
    ----------
    energy : dict of str to float
        By form [J].
    viscous_force : float
        Sum of the magnitudes of all viscous forces [N].
    reaction : float
        Magnitude of the driven side's reaction [N].
    load : float
        Load factor, of solids whose forces are more than rounding.
    index : int
        Number of the increment.
    coefficient : float
        ``solver.stabilisation``.
    limit, force_limit : float
        Largest share of the internal energy, and of the reaction: ``gates.stabilisation``, ``gates.viscous_force``.

    Raises
    ------
    ConvergenceError
        If a share is larger.
    """
    if load < FIRST:
        return
    what = f"increment {index}: with solver.stabilisation = {coefficient:g}"
    remedy = "Use a smaller solver.stabilisation, or none"
    if energy["stabilisation"] > limit * energy["internal"]:
        raise ConvergenceError(
            f"{what} viscous forces have dissipated {times(energy['stabilisation'], energy['internal'])} the "
            f"internal energy; gates.stabilisation allows {limit:.1%}. {remedy}; gates.stabilisation raises the limit"
        )
    if viscous_force > force_limit * reaction:
        raise ConvergenceError(
            f"{what} viscous forces are {times(viscous_force, reaction)} the reaction, {reaction:.3g} N; "
            f"gates.viscous_force allows {force_limit:.1%}. {remedy}; gates.viscous_force raises the limit"
        )
