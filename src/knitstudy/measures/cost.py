"""What models cost, and how large their elements are."""

from __future__ import annotations

import numpy as np
import xarray as xr

MEGABYTE = 1e6

NO_GROWTH = 1e3
"""Growth of memory below which there is none [bytes]; ratios and logarithms take this."""


def memory_growth(history: xr.Dataset) -> float:
    """Return how much memory a simulation took above that of its process, at least `NO_GROWTH` [bytes]."""
    return max(float(history.attrs["memory_growth"]), NO_GROWTH)


def element_length(history: xr.Dataset) -> float:
    """Return the mean length of the beams of a reduced model, whose stations are their nodes [m]."""
    step = np.linalg.norm(np.diff(history["centreline"].to_numpy(), axis=0), axis=1)
    same_yarn = np.diff(history["yarn"].to_numpy()) == 0
    return float(step[same_yarn].mean())
