"""The paper's claims with the computed verdicts, and all claims under every reading of the paper."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from knitstudy.errors import ConfigurationError
from knitstudy.measures.claims.evidence import SOURCES, Measured
from knitstudy.measures.claims.verdicts import RULES, Finding, conclude, findings
from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.measures.response import FORCE, LARGEST_U_Z, QUANTITIES
from knitstudy.tables.catalogue import TABLES

JUDGED = ["verdict", "condition", "uncertainty", "hangs_on", "note"]
COLUMNS = [
    *("id", "where", "short", "claim", "verdict", "condition", "quantity", "paper", "ours", "sentence"),
    *("rule", "rule fixed", "measured", "uncertainty", "hangs on", "note", "see"),
]


@TABLES.add("verdicts", "Claims of the paper and verdicts", **SOURCES, order=15)
def tabulate(claims: pd.DataFrame, readings: pd.DataFrame, **sources: Any) -> pd.DataFrame:
    """Return every claim of the paper with its rule, what was measured, and the verdict, which is computed.

    One quantity stands in columns of its own; `measured` has all, a line each: quantity, the value here, the paper's.

    Raises ConfigurationError when a claim has no rule.
    """
    if lacking := [claim for claim in claims["id"] if claim not in RULES]:
        raise ConfigurationError(
            f"claim {lacking[0]!r} has no rule by which it is judged; known are {', '.join(RULES)}: take it out of "
            "resources/reference/paper_claims.csv, or give it one in knitstudy.measures.claims"
        )
    found = findings(readings, **sources)
    concluded = [conclude(claim.id, claim.uncertainty, found) for claim in claims.itertuples()]
    said = {name.replace("_", " "): [getattr(each, name) for each in concluded] for name in JUDGED}
    first = [each.measured[0] if each.measured else Measured("") for each in concluded]
    said |= {name: [getattr(each, name) for each in first] for name in Measured._fields}
    said["measured"] = ["\n".join(" | ".join(row) for row in each.measured) for each in concluded]
    return claims.rename(columns={"fixed": "rule fixed"}).assign(**said)[COLUMNS]


@TABLES.add("readings", "Claims under every reading of the paper", **SOURCES, order=16)
def tabulate_readings(readings: pd.DataFrame, **sources: Any) -> pd.DataFrame:
    """Return one row a reading, the base first: force, motion, verdicts, and the claims that hang on it."""
    found = findings(readings, **sources)
    return pd.DataFrame([_row(each) for each in found if each.evidence])


def _row(finding: Finding) -> dict[str, object]:
    reading, evidence = finding.reading, finding.evidence
    row = {"name": reading.name, "reading": reading.reading, "base": reading.base, "against": reading.against}
    for quantity, kind in product((FORCE, LARGEST_U_Z), INTERACTIONS):
        unit, values = QUANTITIES[quantity]
        history = evidence.histories.get(evidence.direct.get(kind))
        value = np.nan if history is None else float(values(history, history)[-1])
        row[f"{quantity}, {INTERACTIONS[kind]} [{unit}]"] = value
    row |= {claim: judged.verdict for claim, judged in finding.judged.items()}
    return row | {"claims that hang on the reading": ", ".join(finding.turned)}
