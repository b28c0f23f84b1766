"""Hourglass modes must not carry the load: one-point elements resist them by a coefficient, not by their material."""

from __future__ import annotations

from knitstudy.errors import ConvergenceError
from knitstudy.gates.wording import times

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
