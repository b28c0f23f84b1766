"""How deep yarns are in each other."""

from __future__ import annotations

import numpy as np
import xarray as xr


def penetration(history: xr.Dataset) -> float:
    """Return the deepest penetration of a history, 0 where yarns only ever approach [m]."""
    return -float(np.fmin.reduce(history["smallest_gap"].to_numpy(), initial=0.0))  # nan: nothing is near


def allowed_penetration(history: xr.Dataset) -> float:
    """Return how deep contact lets yarns be in each other: by a penalty, or where its law of indentation ends [m]."""
    law = "indentation_deepest" if "indentation_deepest" in history.attrs else "penetration_limit"
    return float(history.attrs[law])
