"""Springs that stand for contact, from a direct simulation (Table 2 and section 2.6 of the paper).

At every crossing that is not tied, the net force F on the lower row's yarn over the displacement d of the upper row's
side to the lower row's, both at the last increment and d from first contact on: k = F / d, along x, y and z apart.

The paper averages, but not whether ratios or something else. The mean of the ratios is ruled by whichever crossing
moves least along an axis, and has no bound as that d goes to zero; the average here is the one stiffness that comes
nearest to all forces, sum(F d) / sum(d^2), in which such a crossing has no weight. The mean, with its spread, is kept
beside it. Either may be negative: contact at a normal askew to the axes couples them, and then a force along an axis
need not point along the displacement. What the data say is left as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.errors import ConfigurationError, DataFileError

MEASURES = {
    "interface": "relative_displacement",
    "centreline": "centreline_relative_displacement",
}
"""Variables of the contacts by what is displaced: the facets that face each other, or the yarns' centrelines."""


@dataclass(frozen=True)
class Springs:
    """Secants of K crossings; rows of nan where there is none.

    Attributes
    ----------
    tied : ndarray of bool, shape (K,)
        Crossings that are tied instead.
    open : ndarray of bool, shape (K,)
        Crossings that are neither tied nor in contact at the last increment.
    force : ndarray, shape (K, 3)
        Net force on the lower row's yarn at the last increment [N].
    displacement : ndarray, shape (K, 3)
        Of the upper row's side to the lower row's since first contact [m].
    """

    tied: np.ndarray
    open: np.ndarray
    force: np.ndarray
    displacement: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """Secants F / d (K, 3) [N/m]; nan as well where the displacement is zero."""
        moved = np.where(self.displacement == 0, np.nan, self.displacement)
        return self.force / moved

    @property
    def averaged(self) -> np.ndarray:
        """The stiffness (3,) [N/m] of all crossings that comes nearest to their forces: sum(F d) / sum(d^2)."""
        with np.errstate(invalid="ignore"):  # 0 / 0 where nothing is in contact
            return np.nansum(self.force * self.displacement, axis=0) / np.nansum(self.displacement**2, axis=0)

    @property
    def used(self) -> np.ndarray:
        """Number (3,) of crossings with a secant."""
        return np.isfinite(self.stiffness).sum(axis=0)

    @property
    def negative(self) -> np.ndarray:
        """Number (3,) of crossings whose secant is negative."""
        return (self.stiffness < 0).sum(axis=0)

    @property
    def undefined(self) -> np.ndarray:
        """Number (3,) of crossings in contact without a secant."""
        return np.count_nonzero(~self.tied & ~self.open) - self.used


def springs(contacts: xr.Dataset, measure: str) -> Springs:
    """Return the springs of a direct simulation.

    Parameters
    ----------
    contacts : Dataset
        Contacts in the format of docs/architecture.md, of a simulation with contact.
    measure : {"interface", "centreline"}
        What is displaced.

    Raises
    ------
    ConfigurationError
        If the measure is unknown.
    DataFileError
        If the contacts hold no forces or not these displacements.
    """
    if measure not in MEASURES:
        raise ConfigurationError(f"rom.displacement is {measure!r}: allowed are {', '.join(MEASURES)}")
    needed = ("tied", "zones", "force", MEASURES[measure])
    missing = [name for name in needed if name not in contacts]
    if missing:
        raise DataFileError(
            f"the contacts hold no {missing[0]}: springs come from the contacts of a dns scene with contact"
        )
    tied = contacts["tied"].to_numpy().astype(bool)
    in_contact = contacts["zones"].to_numpy() > 0
    opened = ~tied & ~in_contact[-1]
    displacement = contacts[MEASURES[measure]].to_numpy()
    first = np.argmax(in_contact, axis=0)
    since = displacement[-1] - displacement[first, np.arange(len(first))]
    none = (tied | opened)[:, None]
    force = contacts["force"].to_numpy()[-1]
    return Springs(tied, opened, np.where(none, np.nan, force), np.where(none, np.nan, since))
