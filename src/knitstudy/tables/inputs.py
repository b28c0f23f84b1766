"""One input at a time changed: force, out-of-plane motion, verdicts, and the claims that hang on an input."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.carried import CARRIED
from knitstudy.measures.claims.inputs import CLAIMS, Finding, findings, hanging
from knitstudy.measures.names import INTERACTIONS
from knitstudy.measures.response import QUANTITIES
from knitstudy.measures.selection import COURSE
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

PERCENT = 100.0

BASE = "none"
"""What stands for the key of the base."""


@TABLES.add(
    "inputs",
    "One input at a time at another value",
    needs=("variations", "variations_contacts", "geometry", "scenes", "paper", "reference"),
    of=COURSE,
    order=16,
)
def tabulate(
    variations: Mapping[str, xr.Dataset],
    variations_contacts: Mapping[str, xr.Dataset],
    geometry: xr.Dataset,
    scenes: Mapping[str, Scene],
    paper: pd.DataFrame,
    reference: pd.DataFrame,
) -> pd.DataFrame:
    """Return one row a value of an input, the base first; cells are empty where the input is of no effect.

    Parameters
    ----------
    variations, variations_contacts : mapping of str to Dataset
        Histories and contacts of direct simulations that differ in one input each, by scene (see
        docs/architecture.md).
    geometry : Dataset
        Result of the geometry stage.
    scenes : mapping of str to Scene
        Their scenes.
    paper, reference : DataFrame
        ``resources/reference/paper_tables.csv`` and ``reference.csv``.
    """
    varied = [scenes[name] for name in variations]
    found = findings(varied, variations, variations_contacts, geometry, paper, reference)
    claims = [claim for claim in CLAIMS if any(claim in each.judged for each in found)]
    hang = hanging(found)
    return pd.DataFrame([_row(each, claims, hang) for each in found])


def _row(finding: Finding, claims: list[str], hang: Mapping[str, tuple[str, ...]]) -> dict[str, object]:
    variation = finding.variation
    described = variation.described if variation.key else None
    row: dict[str, object] = {
        "input": variation.key or BASE,
        "value": "" if variation.value is None else f"{variation.value}",
        "unit": described.unit if described else "",
        "standing": described.standing if described else "",
    }
    for quantity in CARRIED:
        unit, _ = QUANTITIES[quantity]
        for kind, name in INTERACTIONS.items():
            row[f"{quantity}, {name} [{unit}]"] = finding.values.get((quantity, kind), np.nan)
    for quantity in CARRIED:
        for kind, name in INTERACTIONS.items():
            row[f"change of {quantity}, {name} [%]"] = PERCENT * finding.changes.get((quantity, kind), np.nan)
    row |= {claim: finding.judged[claim].verdict if claim in finding.judged else "" for claim in claims}
    return row | {"claims that hang on the input": ", ".join(hang.get(variation.key, ()))}
