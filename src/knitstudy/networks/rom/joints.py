"""What joins the two yarns at each crossing of a reduced model: a tie, a spring, or nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.networks.rom.springs import Springs, springs


@dataclass(frozen=True)
class Joints:
    """Joints of K crossings; what has no spring and is not open is tied.

    Attributes
    ----------
    open : ndarray of bool, shape (K,)
        Crossings without a joint.
    stiffness : ndarray, shape (K, 3, 3)
        Symmetric matrices of the springs [N/m]; nan where there is none.
    """

    open: np.ndarray
    stiffness: np.ndarray

    @property
    def sprung(self) -> np.ndarray:
        """Crossings with a spring (K,)."""
        return np.isfinite(self.stiffness[:, 0, 0])

    @property
    def tied(self) -> np.ndarray:
        """Crossings that are tied (K,)."""
        return ~self.sprung & ~self.open

    def pinned(self, stiffness: float | np.ndarray) -> Joints:
        """Return these joints with pins for ties: they hold the two points together and leave sections free to turn.

        Parameters
        ----------
        stiffness : float or ndarray, shape (K, 3, 3)
            Of the pins: in all directions, or a matrix each [N/m].
        """
        matrices = stiffness * np.eye(3) if np.ndim(stiffness) == 0 else stiffness
        pins = np.where(self.tied[:, None, None], matrices, self.stiffness)
        return Joints(self.open, pins)

    @classmethod
    def all_tied(cls, count: int) -> Joints:
        """Return the joints of a knit whose crossings are all tied."""
        return cls(np.zeros(count, dtype=bool), np.full((count, 3, 3), np.nan))


def spring_joints(
    contacts: xr.Dataset,
    measure: str,
    axes: str = "global",
    each: bool = False,
    springs_from: xr.Dataset | None = None,
    given: tuple[float, ...] = (),
) -> Joints:
    """Return the joints of a knit in contact: ties where it is tied, springs where yarns touch at full load.

    Parameters
    ----------
    contacts : Dataset
        Contacts in the format of docs/architecture.md, of a simulation with contact.
    measure : {"interface", "centreline"}
        Which relative displacement the springs are secants of.
    axes : {"global", "contact"}
        Along what they are measured and act.
    each : bool
        Whether every crossing has its own springs, or all have the average.
    springs_from : Dataset, optional
        Contacts of another simulation whose averaged springs are taken.
    given : tuple of float
        Stiffness along every axis [N/m] that all springs have; empty where they are measured.

    Raises
    ------
    ConfigurationError
        If the average is not positive along all axes, or a crossing has no secant of its own.
    DataFileError
        If the contacts are not of a simulation with contact.
    """
    own = springs(contacts, measure, axes)
    if given:
        stiffness = np.array(given)
    elif each:
        stiffness = _of_each(own, contacts)
    elif springs_from is None:
        stiffness = _averaged(own, contacts)
    else:
        stiffness = _averaged(springs(springs_from, measure, axes), springs_from)
    return Joints(own.open, np.where(own.bridged[:, None, None], own.matrices(stiffness), np.nan))


def _averaged(measured: Springs, contacts: xr.Dataset) -> np.ndarray:
    averaged = measured.averaged
    if not np.all(averaged > 0):
        axis = int(np.argmin(np.nan_to_num(averaged, nan=-np.inf)))
        scene = contacts.attrs.get("scene", "the contacts")
        raise ConfigurationError(
            f"the averaged spring of {scene} along {measured.axes[axis]} is {averaged[axis]:.4g} N/m "
            f"({measured.negative[axis]} of {measured.used[axis]} crossings have a negative secant) but must be "
            "positive; rom.axes contact, the other rom.displacement or rom.springs_from another dns scene may do"
        )
    return averaged


def _of_each(measured: Springs, contacts: xr.Dataset) -> np.ndarray:
    stiffness = measured.stiffness
    lost = measured.bridged & ~np.isfinite(stiffness).all(axis=1)
    if np.any(lost):
        k = int(np.argmax(lost))
        row, column, zone = (int(contacts[name][k]) for name in ("row", "column", "zone"))
        axis = measured.axes[int(np.argmin(np.isfinite(stiffness[k])))]
        raise ConfigurationError(
            f"rom.springs is 'zones': the crossing of row {row}, column {column}, zone {zone} has not moved along "
            f"{axis} since first contact, so that it has no spring there; rom.springs averaged is defined"
        )
    return stiffness
