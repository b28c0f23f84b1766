"""The paper's claims with the computed verdicts, and the claims that hang on an input."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.measures.catalogue import SOLIDS, VARIED, Datasets, Scenes, of_case, one, several, solid
from knitstudy.measures.claims.evidence import CONTACTS, OPEN, SIMULATIONS, STRESSES, Evidence, decide
from knitstudy.measures.claims.verdicts import CLAIMS, INPUTS, RULES, Finding, findings, hanging
from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.measures.reference import TRANSFERRED
from knitstudy.measures.response import QUANTITIES
from knitstudy.tables.catalogue import TABLES

PERCENT = 100.0
JUDGED = ["measured", "verdict", "uncertainty", "note"]
COLUMNS = ["id", "where", "claim", "rule", "rule fixed", *JUDGED[:3], "hangs on inputs", "note", "see"]
BASE = "none"  # Text in place of the key of the base


@TABLES.add(
    "verdicts",
    "Claims of the paper and verdicts",
    results={
        "geometry": one("geometry", *of_case("tie-course", SOLIDS), *of_case("isotropic-course", SOLIDS)),
        "histories": several("simulation", *SIMULATIONS),
        "contacts": several("contacts", *CONTACTS, optional=True),
        "stresses": several("stress", *STRESSES, optional=True),
    },
    order=15,
)
def tabulate(
    geometry: xr.Dataset,
    histories: Datasets,
    paper: pd.DataFrame,
    reference: pd.DataFrame,
    claims: pd.DataFrame,
    scenes: Scenes,
    contacts: Datasets | None = None,
    stresses: Datasets | None = None,
) -> pd.DataFrame:
    """Return every claim of the paper with its rule, what was measured, and the verdict, which is computed.

    Raises ConfigurationError when a claim has no rule.
    """
    if lacking := [claim for claim in claims["id"] if claim not in RULES]:
        raise ConfigurationError(
            f"claim {lacking[0]!r} has no rule by which it is judged; known are {', '.join(RULES)}: take it out of "
            "resources/reference/paper_claims.csv, or give it one in knitstudy.measures.claims"
        )
    evidence = Evidence(geometry, paper, reference, scenes, histories, contacts or {}, stresses or {}).named()
    judged = [decide(RULES[claim.id], evidence, claim.uncertainty) for claim in claims.itertuples()]
    said = {name: [getattr(each, name) for each in judged] for name in JUDGED}
    said["hangs on inputs"] = claims["id"].map(_hanging(evidence)).fillna("")
    return claims.rename(columns={"fixed": "rule fixed"}).assign(**said)[COLUMNS]


def _hanging(evidence: Evidence) -> dict[str, str]:
    """Return in words the inputs on which claims hang, by claim, as far as inputs are varied."""
    results = findings(evidence)
    inputs = hanging(results)
    said = {}
    for claim in (claim for claim in CLAIMS if any(claim in each.judged for each in results)):
        base = results[0].judged.get(claim)
        if base is None or base.verdict == OPEN:
            said[claim] = "not known: these simulations do not decide it at the base"
        else:
            names = [INPUTS[key] for key, claims in inputs.items() if claim in claims]
            said[claim] = ", ".join(names) or f"none of {len(inputs)}"
    return said


@TABLES.add(
    "inputs",
    "One input at a time at another value",
    results={
        "variations": several("simulation", *VARIED, fewest=4),
        "variations_contacts": several("contacts", *VARIED, fewest=4),
        "geometry": solid("geometry", "isotropic-course"),
    },
    order=16,
)
def tabulate_inputs(
    variations: Datasets,
    variations_contacts: Datasets,
    geometry: xr.Dataset,
    scenes: Scenes,
    paper: pd.DataFrame,
    reference: pd.DataFrame,
) -> pd.DataFrame:
    """Return one row a value of an input, the base first: force, motion, verdicts, and the claims that hang on it.

    Cells are empty where the input has no effect.
    """
    found = findings(Evidence(geometry, paper, reference, scenes, variations, variations_contacts))
    claims = [claim for claim in CLAIMS if any(claim in each.judged for each in found)]
    hang = hanging(found)
    return pd.DataFrame([_row_of_input(each, claims, hang) for each in found])


def _row_of_input(
    finding: Finding, claims: list[str], hang: Mapping[str, tuple[str, ...]]
) -> dict[str, object]:
    variation = finding.variation
    described = variation.described if variation.key else None
    row: dict[str, object] = {
        "input": variation.key or BASE,
        "value": "" if variation.value is None else f"{variation.value}",
        "unit": described.unit if described else "",
        "standing": described.standing if described else "",
    }
    for quantity, kind in product(TRANSFERRED, INTERACTIONS):
        column = f"{quantity}, {INTERACTIONS[kind]} [{QUANTITIES[quantity][0]}]"
        row[column] = finding.values.get((quantity, kind), np.nan)
    for quantity, kind in product(TRANSFERRED, INTERACTIONS):
        change = PERCENT * finding.changes.get((quantity, kind), np.nan)
        row[f"change of {quantity}, {INTERACTIONS[kind]} [%]"] = change
    row |= {claim: finding.judged[claim].verdict if claim in finding.judged else "" for claim in claims}
    return row | {"claims that hang on the input": ", ".join(hang.get(variation.key, ()))}
