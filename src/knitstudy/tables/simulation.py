"""What a direct simulation stands on: ties, contact, convergence and its ledger of energies, with bars."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.study.scene import Scene

Row = tuple[str, str, float, float]
"""Quantity, unit, value and bar."""

OF_FINAL = 0.01
"""Energies are compared wherever the internal energy is this share of its final value or more."""

LEDGER = 0.01
"""Largest gap of the ledger over the largest external work."""


STABILISATION, STABILISATION_AT_END = 0.05, 0.01
"""Largest share of what stabilisation dissipates in internal energy, on the way and at full load."""


def build(dns: xr.Dataset, scenes: dict[str, Scene]) -> pd.DataFrame:
    """Return one quantity a row, with its unit and its bar where it has one.

    Parameters
    ----------
    dns : Dataset
        History of a direct simulation (see docs/architecture.md).
    scenes : dict of str to Scene
        By fidelity; "dns" is read.
    """
    scene = scenes["dns"]
    rows = [*_ties(dns), *_solution(dns, scene), *(_contact(dns, scene) if "smallest_gap" in dns else ())]
    return pd.DataFrame(
        [(name, unit, float(value), bar) for name, unit, value, bar in rows],
        columns=["quantity", "unit", "value", "bar"],
    )


def _ties(dns: xr.Dataset) -> list[Row]:
    area = dns["tied_area"]
    return [
        ("tolerance of the ties beyond the clearance", "m", dns.attrs["tie_tolerance"], np.nan),
        ("tied nodes", "1", dns.attrs["tie_nodes"], np.nan),
        ("tied area of a crossing, smallest", "m2", area.min(), np.nan),
        ("tied area of a crossing, largest", "m2", area.max(), np.nan),
        ("largest adjustment of a tied node", "m", dns.attrs["tie_largest_adjustment"], np.nan),
    ]


def _solution(dns: xr.Dataset, scene: Scene) -> list[Row]:
    residual, correction = scene.solver.residual_tolerance, scene.solver.correction_tolerance
    return [
        ("largest residual over mean internal force", "1", dns["residual"].max(), residual),
        ("largest last correction over element size", "1", dns["correction"].max(), correction),
        ("Newton iterations", "1", dns["newton_iterations"].sum(), np.nan),
        ("Krylov iterations", "1", dns["krylov_iterations"].sum(), np.nan),
        ("set-ups of the preconditioner", "1", dns.attrs["linear_setups"], np.nan),
        ("largest gap of the energy ledger over external work", "1", ledger_gap(dns), LEDGER),
        ("largest hourglass over internal energy", "1", hourglass_share(dns), scene.gates.hourglass),
    ]


def _contact(dns: xr.Dataset, scene: Scene) -> list[Row]:
    energy, deepest = dns["energy"].isel(increment=-1), penetration(dns) / scene.mesh.size
    friction = energy.sel(form="friction") / energy.sel(form="external")
    viscous = energy.sel(form="stabilisation") / energy.sel(form="internal")
    return [
        ("largest penetration over element size", "1", deepest, scene.contact.penetration),
        ("augmentations", "1", dns["augmentations"].sum(), np.nan),
        ("friction over external work at full load", "1", friction, np.nan),
        ("largest stabilisation over internal energy", "1", stabilisation_share(dns), STABILISATION),
        ("stabilisation over internal energy at full load", "1", viscous, STABILISATION_AT_END),
    ]


def penetration(history: xr.Dataset) -> float:
    """Return the deepest penetration of a history, 0 where yarns only ever approach [m]."""
    return -float(np.fmin.reduce(history["smallest_gap"].to_numpy(), initial=0.0))  # nan: nothing is near


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
