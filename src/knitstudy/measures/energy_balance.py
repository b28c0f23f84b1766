"""The ledger of energies of a history, and shares of what is no energy of the yarns."""

from __future__ import annotations

import numpy as np
import xarray as xr

OF_FINAL = 0.01
"""Energies are compared wherever the internal energy is this share of its final value or more."""


def ledger_gap(history: xr.Dataset) -> float:
    """Return the largest difference of external work and all stored energies, over the largest external work."""
    energy = history["energy"]
    external = energy.sel(form="external")
    return float(np.abs(2 * external - energy.sum("form")).max() / np.abs(external).max())


def hourglass_share(history: xr.Dataset) -> float:
    """Return the largest share of hourglass energy wherever internal energy is 1% of its final value or more."""
    return _largest_share(history, "hourglass")


def stabilisation_share(history: xr.Dataset) -> float:
    """Return the same of what stabilisation has dissipated so far."""
    return _largest_share(history, "stabilisation")


def _largest_share(history: xr.Dataset, form: str) -> float:
    internal, other = (history["energy"].sel(form=each) for each in ("internal", form))
    return float((other / internal.where(internal >= OF_FINAL * internal[-1])).max())
