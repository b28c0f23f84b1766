"""The reference: forces and motions that all models are measured against, each with its uncertainty.

They are the limits of direct simulations by independent discretisations (`knitstudy.tables.reference`), kept in
``resources/reference/reference.csv``. Whoever compares a model with the truth asks `reference_of` and nobody else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.measures.estimate import UNKNOWN, Estimate
from knitstudy.measures.problem import problem_of
from knitstudy.measures.response import FORCE, SAME_STRAIN, distance_of_curves
from knitstudy.study.scene import Scene

NEEDED = ("problem", "quantity", "strain [1]", "value", "uncertainty")
"""Columns that are read."""


@dataclass(frozen=True)
class Reference:
    """What is known of one problem: estimates by quantity and strain; nothing where there is no reference."""

    estimates: Mapping[tuple[str, float], Estimate] = field(default_factory=dict)

    @property
    def known(self) -> bool:
        """Whether there is one."""
        return bool(self.estimates)

    def at(self, quantity: str, strain: float) -> Estimate:
        """Return a quantity at a strain, unknown where the reference does not speak of it."""
        for (name, at), estimate in self.estimates.items():
            if name == quantity and abs(strain - at) <= SAME_STRAIN * at:
                return estimate
        return UNKNOWN

    def strains(self, quantity: str, up_to: float = np.inf) -> list[float]:
        """Return the strains at which a quantity is known, rising, up to a strain."""
        known = {at for name, at in self.estimates if name == quantity}
        return sorted(at for at in known if at <= up_to * (1 + SAME_STRAIN))

    def curve(self, up_to: float = np.inf) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return strains, forces [N] and their uncertainties [N], from the unloaded state on."""
        strains = self.strains(FORCE, up_to)
        found = [Estimate(0.0, 0.0), *(self.at(FORCE, strain) for strain in strains)]
        return (
            np.array([0.0, *strains]),
            np.array([each.value for each in found]),
            np.array([each.uncertainty for each in found]),
        )

    def ratio(self, history: xr.Dataset, quantity: str, values: np.ndarray) -> Estimate:
        """Return values (I,) of a history over the reference's, at the largest strain that both reach."""
        strains = self.strains(quantity, float(history["strain"][-1]))
        if not strains:
            return UNKNOWN
        here = float(np.interp(strains[-1], history["strain"], values))
        return self.at(quantity, strains[-1]).of(lambda value: here / value)

    def force_ratio(self, history: xr.Dataset) -> Estimate:
        """Return the force, and so the secant stiffness, over the reference's."""
        return self.ratio(history, FORCE, history["force"].to_numpy())

    def force_distance(self, history: xr.Dataset) -> Estimate:
        """Return the relative L2 distance of the curve of force against strain.

        Both are polygons through the strains of the reference that the history reaches. The reference may be off by its
        uncertainty at all strains alike: that is what its uncertainty is from.
        """
        bounds = self._bounds(history)
        if not bounds:
            return UNKNOWN
        value, *ends = bounds
        return Estimate(value, max(abs(end - value) for end in ends))

    def nearer(self, one: xr.Dataset, other: xr.Dataset, share: float) -> bool | None:
        """Whether the force of one history is at most this share as far away as another's; None where that is open."""
        pairs = list(zip(self._bounds(one), self._bounds(other), strict=True))
        if not pairs:
            return None
        holds = {near <= share * far for near, far in pairs}
        return holds.pop() if len(holds) == 1 else None

    def _bounds(self, history: xr.Dataset) -> list[float]:
        """Return the distances from the reference, and from it less and more its uncertainty."""
        knots, force, off = self.curve(float(history["strain"][-1]))
        if len(knots) < 2:
            return []
        ours = np.interp(knots, history["strain"], history["force"])
        return [distance_of_curves(knots, ours, force + sign * off) for sign in (0, -1, 1)]


def reference_of(table: pd.DataFrame, scene: Scene) -> Reference:
    """Return what the reference says of the problem that a scene simulates; nothing where it says none.

    Parameters
    ----------
    table : DataFrame
        ``resources/reference/reference.csv``.
    scene : Scene
        A direct simulation.

    Raises
    ------
    DataFileError
        When a column is missing or holds no numbers.
    """
    missing = [name for name in NEEDED if name not in table]
    if missing:
        raise DataFileError(
            f"the reference has no column {missing[0]!r}; make it again with `make reference`"
        )
    rows = table[table["problem"] == problem_of(scene)]
    try:
        return Reference(
            {
                (str(quantity), float(strain)): Estimate(float(value), float(uncertainty))
                for _, quantity, strain, value, uncertainty in rows[list(NEEDED)].itertuples(index=False)
            }
        )
    except ValueError as error:
        raise DataFileError(
            f"the reference holds what is no number ({error}); make it again with `make reference`"
        ) from error
