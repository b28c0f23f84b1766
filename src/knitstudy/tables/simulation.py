"""What a direct simulation stands on: ties, contact, convergence and its ledger of energies, with bars."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.energy_balance import (
    allowed_penetration,
    hourglass_share,
    ledger_gap,
    penetration,
    stabilisation_share,
)
from knitstudy.measures.selection import ISOTROPIC_COURSE, ISOTROPIC_WALE, TIED_COURSE, TIED_WALE
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

Row = tuple[str, str, float, float]
"""Quantity, unit, value and bar."""


LEDGER = 0.01
"""Largest gap of the ledger over the largest external work."""

HOURGLASS = 0.05
"""Largest share of hourglass energy in the internal energy."""


STABILISATION, STABILISATION_AT_END = 0.05, 0.01
"""Largest share of what stabilisation dissipates in internal energy, on the way and at full load."""


@TABLES.add(
    "simulation",
    "What the direct simulations stand on: ties, course tension",
    needs=("dns", "scenes"),
    of=TIED_COURSE,
    order=10,
)
@TABLES.add(
    "simulation_contact",
    "What they stand on: friction, course tension",
    needs=("dns", "scenes"),
    of=ISOTROPIC_COURSE,
    order=11,
)
@TABLES.add(
    "simulation_wale",
    "What they stand on: ties, wale tension",
    needs=("dns", "scenes"),
    of=TIED_WALE,
    order=12,
)
@TABLES.add(
    "simulation_contact_wale",
    "What they stand on: friction, wale tension",
    needs=("dns", "scenes"),
    of=ISOTROPIC_WALE,
    order=13,
)
def tabulate(dns: xr.Dataset, scenes: dict[str, Scene]) -> pd.DataFrame:
    """Return one quantity a row, with its unit and its bar where it has one.

    Parameters
    ----------
    dns : Dataset
        History of a direct simulation (see docs/architecture.md).
    scenes : dict of str to Scene
        By fidelity; "dns" is read.
    """
    scene = scenes["dns"]
    rows = [*_ties(dns), *_solution(dns, scene), *(_contact(dns) if "smallest_gap" in dns else ())]
    return pd.DataFrame(
        [(name, unit, float(value), bar) for name, unit, value, bar in rows],
        columns=["quantity", "unit", "value", "bar"],
    )


def _ties(dns: xr.Dataset) -> list[Row]:
    area = dns["tied_area"]
    said = (  # by the rule of the ties, one or the other
        ("radius of the ties", "m", "tie_radius"),
        ("least stiffness of a tie", "N/m", "tie_least_stiffness"),
        ("tied nodes", "1", "tie_nodes"),
    )
    return [
        *((name, unit, dns.attrs[key], np.nan) for name, unit, key in said if key in dns.attrs),
        ("tied area of a crossing, smallest", "m2", area.min(), np.nan),
        ("tied area of a crossing, largest", "m2", area.max(), np.nan),
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
        ("largest hourglass over internal energy", "1", hourglass_share(dns), HOURGLASS),
    ]


def _contact(dns: xr.Dataset) -> list[Row]:
    energy = dns["energy"].isel(increment=-1)
    friction = energy.sel(form="friction") / energy.sel(form="external")
    viscous = energy.sel(form="stabilisation") / energy.sel(form="internal")
    return [
        _deepest(dns),
        ("augmentations", "1", dns["augmentations"].sum(), np.nan),
        ("friction over external work at full load", "1", friction, np.nan),
        ("largest stabilisation over internal energy", "1", stabilisation_share(dns), STABILISATION),
        ("stabilisation over internal energy at full load", "1", viscous, STABILISATION_AT_END),
    ]


def _deepest(dns: xr.Dataset) -> Row:
    """Return how deep yarns are in each other, with what contact allows: by penalties, or as a local indentation."""
    what = "local indentation" if "indentation_deepest" in dns.attrs else "penetration"
    return f"deepest {what}", "m", penetration(dns), allowed_penetration(dns)
