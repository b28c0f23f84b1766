"""Contacts of a window: those of the cells that it is asked for, in the format of whole knits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from knitstudy.contacts.contacts import extract
from knitstudy.errors import DataFileError
from knitstudy.geometry.crossings import Crossings
from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.spline import Centreline
from knitstudy.study.scene import Scene

UNKNOWN = ("segment_contraction",)
"""Variables that need the crossings next to those of a window."""


@dataclass(frozen=True, eq=False)
class Shown:
    """Some crossings of a knit, as a specimen.

    Attributes
    ----------
    knit : Fabric
    chosen : ndarray of int, shape (W,)
        Crossings of the knit.
    """

    knit: Fabric
    chosen: np.ndarray

    @property
    def radius(self) -> float:
        """Radius of the yarn [m]."""
        return self.knit.radius

    @property
    def centrelines(self) -> tuple[Centreline, ...]:
        """Of all yarns of the knit."""
        return self.knit.centrelines

    @cached_property
    def crossings(self) -> Crossings:
        """The chosen ones."""
        every = self.knit.crossings
        return Crossings(
            **{name: getattr(every, name)[self.chosen] for name in Crossings.__dataclass_fields__}
        )


def contacts(scene: Scene, geometry: xr.Dataset, history: xr.Dataset) -> xr.Dataset:
    """Return the contacts of a scene's window from its geometry and its history; see `shown_contacts`."""
    return shown_contacts(Fabric.from_dataset(geometry), history)


def shown_contacts(knit: Fabric, history: xr.Dataset) -> xr.Dataset:
    """Return the contacts (W,) of the cells that a window is asked for, by row, column and zone.

    Parameters
    ----------
    knit : Fabric
    history : Dataset
        Of a window in it.

    Raises
    ------
    DataFileError
        If the history is not of a window.
    """
    if "window_crossing" not in history:
        raise DataFileError(
            "the history holds no window_crossing: contacts of a window come from a scene with fidelity 'window'"
        )
    chosen = np.flatnonzero(history["window_crossing"].to_numpy())
    place = np.full(history.sizes["crossing"] + 1, -1)  # the last one: away from all crossings
    place[chosen] = np.arange(len(chosen))
    part = history.isel(crossing=chosen)
    if "contact_crossing" in history:
        part = part.assign(contact_crossing=("point", place[history["contact_crossing"].to_numpy()]))
    return extract(Shown(knit, chosen), part).drop_vars(UNKNOWN, errors="ignore")
