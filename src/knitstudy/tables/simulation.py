"""What the direct simulation stands on: its ties, its convergence and its ledger of energies, with bars."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.dns import HOURGLASS_SHARE
from knitstudy.scene import Scene

LEDGER = 0.01
"""Largest gap of the ledger over the largest external work."""


def build(dns: xr.Dataset, scenes: dict[str, Scene]) -> pd.DataFrame:
    """Return one quantity a row, with its unit and its bar where it has one.

    Parameters
    ----------
    dns : Dataset
        History of a direct simulation (see docs/architecture.md).
    scenes : dict of str to Scene
        By fidelity; "dns" is read.
    """
    solver = scenes["dns"].solver
    area = dns["tied_area"].to_numpy()
    rows = [
        ("tolerance of the ties beyond the clearance", "m", dns.attrs["tie_tolerance"], np.nan),
        ("tied nodes", "1", dns.attrs["tie_nodes"], np.nan),
        ("tied area of a crossing, smallest", "m2", area.min(), np.nan),
        ("tied area of a crossing, largest", "m2", area.max(), np.nan),
        ("largest adjustment of a tied node", "m", dns.attrs["tie_largest_adjustment"], np.nan),
        ("largest residual over mean internal force", "1", dns["residual"].max(), solver.residual_tolerance),
        (
            "largest last correction over element size",
            "1",
            dns["correction"].max(),
            solver.correction_tolerance,
        ),
        ("Newton iterations", "1", dns["newton_iterations"].sum(), np.nan),
        ("Krylov iterations", "1", dns["krylov_iterations"].sum(), np.nan),
        ("set-ups of the preconditioner", "1", dns.attrs["linear_setups"], np.nan),
        ("largest gap of the energy ledger over external work", "1", ledger_gap(dns), LEDGER),
        ("largest hourglass over internal energy", "1", hourglass_share(dns), HOURGLASS_SHARE),
    ]
    return pd.DataFrame(
        [(name, unit, float(value), bar) for name, unit, value, bar in rows],
        columns=["quantity", "unit", "value", "bar"],
    )


def ledger_gap(history: xr.Dataset) -> float:
    """Return the largest difference of external work and all stored energies, over the largest external work."""
    energy = history["energy"]
    external = energy.sel(form="external")
    return float(np.abs(2 * external - energy.sum("form")).max() / np.abs(external).max())


def hourglass_share(history: xr.Dataset) -> float:
    """Return the largest share of hourglass energy wherever internal energy is 1% of its final value or more."""
    internal, hourglass = (history["energy"].sel(form=form) for form in ("internal", "hourglass"))
    return float((hourglass / internal.where(internal >= 0.01 * internal[-1])).max())
