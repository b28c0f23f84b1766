"""Stabilisation must not carry the load: neither by what it dissipates nor by its forces at an increment."""

from __future__ import annotations

from knitstudy.errors import ConvergenceError
from knitstudy.gates.wording import times

FIRST = 0.1
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
