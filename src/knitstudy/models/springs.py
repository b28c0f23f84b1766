"""Springs that stand for contact, from a direct simulation (Table 2 and section 2.6 of the paper).

At every crossing that is not tied, the net force F on the lower row's yarn over the displacement d of the upper row's
side to the lower row's, both at the last increment and d from first contact on. They are set against each other part
by part: with the projections P of the axes asked for,

    k = F . P d / d . P d

Along x, y and z, the paper's axes, that is the ratio of the components. In the axes of the contact the parts are the
component along the contact normal and the component in the tangent plane.

A contact resists along its normal far more than across it. Where the normal is askew to x, y and z, as it is by some
45 degrees where loops hold each other, this couples the axes: a crossing slides down its tangent plane and moves
against the force along one of them. Secants along x, y and z then are negative, and say nothing of a stiffness;
those in the axes of the contact are positive, and alike at all crossings.

The paper averages, but does not say how. The mean of the ratios is ruled by whichever crossing moves least and has no
bound as that d goes to zero; the average here is the one stiffness that comes nearest to all forces,
sum(F . P d) / sum(d . P d), in which such a crossing has no weight. Negative values are reported as they are.
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
"""Displacement variables of the contacts: of the facets that face each other, or of the yarns' centrelines."""

AXES = {"global": ("x", "y", "z"), "contact": ("normal", "tangential")}
"""The a parts that force and displacement are divided into."""


@dataclass(frozen=True)
class Springs:
    """Secants of K crossings in a axes; nan where there is none.

    Attributes
    ----------
    axes : tuple of a str
        Names of the axes.
    projection : ndarray, shape (K, a, 3, 3)
        Onto every axis.
    tied : ndarray of bool, shape (K,)
        Crossings that are tied instead.
    open : ndarray of bool, shape (K,)
        Crossings that are neither tied nor in contact at the last increment.
    force : ndarray, shape (K, 3)
        Net force on the lower row's yarn at the last increment [N].
    displacement : ndarray, shape (K, 3)
        Of the upper row's side to the lower row's since first contact [m].
    """

    axes: tuple[str, ...]
    projection: np.ndarray
    tied: np.ndarray
    open: np.ndarray
    force: np.ndarray
    displacement: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """Secants (K, a) [N/m]; nan as well where the displacement along an axis is zero."""
        return self._along(self.force) / np.where(self._square == 0, np.nan, self._square)

    @property
    def averaged(self) -> np.ndarray:
        """The stiffness (a,) [N/m] of all crossings that comes nearest to their forces."""
        with np.errstate(invalid="ignore"):  # 0 / 0 where nothing is in contact
            return np.nansum(self._along(self.force), axis=0) / np.nansum(self._square, axis=0)

    @property
    def bridged(self) -> np.ndarray:
        """Crossings (K,) in contact without a tie."""
        return ~self.tied & ~self.open

    @property
    def used(self) -> np.ndarray:
        """Number (a,) of crossings with a secant."""
        return np.isfinite(self.stiffness).sum(axis=0)

    @property
    def negative(self) -> np.ndarray:
        """Number (a,) of crossings whose secant is negative."""
        return (self.stiffness < 0).sum(axis=0)

    @property
    def undefined(self) -> np.ndarray:
        """Number (a,) of crossings in contact without a secant."""
        return np.count_nonzero(self.bridged) - self.used

    def matrices(self, stiffness: np.ndarray) -> np.ndarray:
        """Return stiffness matrices (K, 3, 3) of stiffnesses along the axes, (K, a) or (a,) [N/m]."""
        along = np.broadcast_to(stiffness, self.projection.shape[:2])
        return np.einsum("ka,kaij->kij", along, self.projection)

    @property
    def _square(self) -> np.ndarray:
        return self._along(self.displacement)

    def _along(self, vector: np.ndarray) -> np.ndarray:
        """Products v . P d (K, a) of vectors v (K, 3)."""
        return np.einsum("ki,kaij,kj->ka", vector, self.projection, self.displacement)


def springs(contacts: xr.Dataset, measure: str, axes: str = "global") -> Springs:
    """Return the springs of a direct simulation.

    Parameters
    ----------
    contacts : Dataset
        Contacts in the format of docs/files.md, of a simulation with contact.
    measure : {"interface", "centreline"}
        Whose displacement is taken.
    axes : {"global", "contact"}
        Of the springs; those of the contact are along the undeformed normal and across it.

    Raises
    ------
    ConfigurationError
        If the measure or the axes are unknown.
    DataFileError
        If the contacts hold no forces or not these displacements.
    """
    if measure not in MEASURES:
        raise ConfigurationError(f"rom.displacement is {measure!r}: allowed are {', '.join(MEASURES)}")
    if axes not in AXES:
        raise ConfigurationError(f"rom.axes is {axes!r}: allowed are {', '.join(AXES)}")
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
    return Springs(
        axes=AXES[axes],
        projection=_projections(axes, contacts["normal"].to_numpy()),
        tied=tied,
        open=opened,
        force=np.where(none, np.nan, contacts["force"].to_numpy()[-1]),
        displacement=np.where(none, np.nan, since),
    )


def _projections(axes: str, normal: np.ndarray) -> np.ndarray:
    """Projections (K, a, 3, 3) for unit normals (K, 3)."""
    if axes == "global":
        unit = np.eye(3)
        return np.broadcast_to(unit[:, :, None] * unit[:, None, :], (len(normal), 3, 3, 3))
    along = normal[:, :, None] * normal[:, None, :]
    return np.stack([along, np.eye(3) - along], axis=1)
