"""The limits of all gates, with the keys of a scene that raise them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Limits:
    """Defaults of the section ``gates``; docs/gates.md says what each was chosen by.

    Attributes
    ----------
    ledger : float
        Largest gap of the ledger of energies, over the external work.
    hourglass : float
        Largest share of hourglass energy in the internal energy.
    stabilisation : float
        Largest share of what stabilisation has dissipated in the internal energy.
    viscous_force : float
        Largest sum of viscous forces, over the reaction.
    elements_across : float or None
        Fewest elements of ``mesh.size`` across a yarn; None for `ELEMENTS_ACROSS` of the specimen.
    """

    ledger: float = 0.05
    hourglass: float = 0.05
    stabilisation: float = 0.05
    viscous_force: float = 0.05
    elements_across: float | None = None


ELEMENTS_ACROSS: Mapping[str, float] = {"knit": 3.0, "pair": 8.0}
"""Fewest elements across a yarn by specimen: a knit bends, a pair that is pressed together is only indented."""


def limits(scene: Any) -> Limits:
    """Return the limits that a scene asks for."""
    return getattr(scene, "gates", None) or Limits()
