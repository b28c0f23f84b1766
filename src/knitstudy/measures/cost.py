"""What models cost, and how large their elements are."""

from __future__ import annotations

import numpy as np
import xarray as xr

MEGABYTE = 1e6


def element_length(history: xr.Dataset) -> float:
    """Return the mean length of the beams of a reduced model, whose stations are their nodes [m]."""
    step = np.linalg.norm(np.diff(history["centreline"].to_numpy(), axis=0), axis=1)
    same_yarn = np.diff(history["yarn"].to_numpy()) == 0
    return float(step[same_yarn].mean())
