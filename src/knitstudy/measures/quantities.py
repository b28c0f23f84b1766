"""What the reference speaks of: scalars of a history and its contacts at a strain, with their units."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from knitstudy.measures.centre_cell import centre_cell
from knitstudy.measures.response import Z, out_of_plane

STRAINS = (0.01, 0.02, 0.05)
"""Strains that the reference speaks of."""

SAME_STRAIN = 1e-3
"""Relative difference up to which an increment is at one of them."""

FORCE, LARGEST_U_Z, RMS_U_Z = "force", "largest |u_z|", "root mean square of u_z"
NORMAL, LARGEST_NORMAL, TANGENTIAL, SLIP = (
    "mean normal force of a crossing",
    "largest normal force of a crossing",
    "mean tangential force of a crossing",
    "mean slip of a crossing",
)

Values = Callable[[xr.Dataset, xr.Dataset], np.ndarray]


def rms_out_of_plane(history: xr.Dataset) -> np.ndarray:
    """Return the root mean square of u_z over the arc length of all centrelines, at every increment (I,) [m].

    However the stations are spaced, each stands for the yarn around it.
    """
    s, yarn = history["arc_length"].to_numpy(), history["yarn"].to_numpy()
    share = np.zeros(len(s))
    for number in np.unique(yarn):
        here = np.flatnonzero(yarn == number)
        step = np.diff(s[here])
        share[here[:-1]] += 0.5 * step
        share[here[1:]] += 0.5 * step
    u_z = history["centreline_displacement"].to_numpy()[:, :, Z]
    return np.sqrt(u_z**2 @ share / share.sum())


def _at_crossings(name: str, statistic: Callable) -> Values:
    """Return the function of a statistic (I,) of the size of a resultant over the crossings of the centre cell."""

    def values(history: xr.Dataset, contacts: xr.Dataset) -> np.ndarray:
        found = contacts[name].to_numpy()[:, centre_cell(contacts)]
        return statistic(np.linalg.norm(found, axis=-1), axis=1)

    return values


def _slip(history: xr.Dataset, contacts: xr.Dataset) -> np.ndarray:
    slip = contacts["slip"].to_numpy()[:, centre_cell(contacts)]
    return np.nan_to_num(slip).mean(axis=1)


QUANTITIES: dict[str, tuple[str, Values]] = {
    FORCE: ("N", lambda history, contacts: history["force"].to_numpy()),
    LARGEST_U_Z: ("m", lambda history, contacts: out_of_plane(history)),
    RMS_U_Z: ("m", lambda history, contacts: rms_out_of_plane(history)),
    NORMAL: ("N", _at_crossings("normal_resultant", np.mean)),
    LARGEST_NORMAL: ("N", _at_crossings("normal_resultant", np.max)),
    TANGENTIAL: ("N", _at_crossings("tangential_resultant", np.mean)),
    SLIP: ("m", _slip),
}
"""Unit and values (I,) at the increments, by name. Those of crossings are of the four of the centre cell."""


def increment_at(history: xr.Dataset, strain: float) -> int | None:
    """Return the increment that ends at a strain, if there is one."""
    off = np.abs(history["strain"].to_numpy() - strain)
    nearest = int(off.argmin())
    return nearest if off[nearest] <= SAME_STRAIN * strain else None
