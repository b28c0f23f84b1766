"""The paper's claims with the computed verdicts, all claims under every reading, and combinations of readings."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from knitstudy.errors import ConfigurationError
from knitstudy.measures.reference import INTERACTIONS
from knitstudy.measures.response import FORCE, LARGEST_U_Z, QUANTITIES
from knitstudy.paper.claims.combinations import OPEN, Combination, combinations_of, exclusive
from knitstudy.paper.claims.evidence import SOURCES
from knitstudy.paper.claims.scale import (
    CONTRADICTED,
    DIRECTION,
    NOT_RUN,
    REPRODUCED,
    UNDECIDABLE,
    Row,
    margin_of,
)
from knitstudy.paper.claims.verdicts import RULES, Finding, conclude, findings
from knitstudy.run.catalogue import TABLES

COLUMNS = [
    *(
        "id",
        "where",
        "short",
        "claim",
        "verdict",
        "margin",
        "readings",
        "quantity",
        "paper",
        "ours",
        "sentence",
    ),
    *("rule", "rule fixed", "reason", "older rule", "older verdict", "measured", "uncertainty", "depends on"),
    *("note", "explanation", "see"),
]
MOST = 12  # Combinations that the table shows


@TABLES.add("verdicts", "Claims of the paper and verdicts", **SOURCES, order=15)
def tabulate(claims: pd.DataFrame, readings: pd.DataFrame, **sources: Any) -> pd.DataFrame:
    """Return every claim of the paper with its rule, the measured rows, and the verdict, which is computed.

    The columns `quantity`, `ours` and `paper` hold the first row of the claim. The column `measured` holds all rows,
    one row a line: quantity, value of this study, value of the paper, grade.

    Raises ConfigurationError when a claim has no rule.
    """
    if lacking := [claim for claim in claims["id"] if claim not in RULES]:
        raise ConfigurationError(
            f"claim {lacking[0]!r} has no rule by which it is judged; known are {', '.join(RULES)}: take it out of "
            "resources/reference/paper_claims.csv, or give it one in knitstudy.paper.claims"
        )
    under_readings = findings(readings, **sources)
    concluded = [conclude(claim.id, claim.uncertainty, under_readings) for claim in claims.itertuples()]
    first = [judged.rows[0] if judged.rows else Row("") for judged in concluded]
    lines = [[(row.quantity, row.ours, row.paper, row.grade) for row in judged.rows] for judged in concluded]
    columns = {
        "verdict": [judged.verdict for judged in concluded],
        "margin": ["" if judged.verdict == NOT_RUN else margin_of(judged.rows) for judged in concluded],
        "readings": [judged.under for judged in concluded],
        "uncertainty": [judged.uncertainty for judged in concluded],
        "depends on": [judged.depends_on for judged in concluded],
        "note": [judged.note for judged in concluded],
        "quantity": [row.quantity for row in first],
        "paper": [row.paper for row in first],
        "ours": [row.ours for row in first],
        "measured": ["\n".join(" | ".join(line) for line in table) for table in lines],
    }
    return claims.rename(columns={"fixed": "rule fixed"}).assign(**columns)[COLUMNS]


@TABLES.add("readings", "Claims under every reading of the paper", **SOURCES, order=16)
def tabulate_readings(readings: pd.DataFrame, **sources: Any) -> pd.DataFrame:
    """Return one row a reading, the base first: force, motion, verdicts, and the claims that depend on the reading."""
    return pd.DataFrame([_row(reading) for reading in findings(readings, **sources) if reading.evidence])


def _row(finding: Finding) -> dict[str, object]:
    reading, evidence = finding.reading, finding.evidence
    row = {of: getattr(reading, of) for of in ("name", "choice", "reading", "base", "against")}
    for quantity, kind in product((FORCE, LARGEST_U_Z), INTERACTIONS):
        unit, values = QUANTITIES[quantity]
        history = evidence.histories.get(evidence.direct.get(kind))
        value = np.nan if history is None else float(values(history, history)[-1])
        row[f"{quantity}, {INTERACTIONS[kind]} [{unit}]"] = value
    row |= {claim: judged.verdict for claim, judged in finding.judged.items()}
    return row | {"claims that depend on the reading": ", ".join(finding.turned)}


@TABLES.add("combinations", "Readings under which most claims hold together", **SOURCES, order=17)
def tabulate_combinations(readings: pd.DataFrame, **sources: Any) -> pd.DataFrame:
    """Return the combinations of readings under which most claims hold, and the base, with gained and lost claims.

    The last column holds, in the first row, the pairs of claims that no combination reproduces together.
    """
    combined = combinations_of(findings(readings, **sources))
    base = next(combination for combination in combined if not combination.findings)
    rows = [_combination(combination, base) for combination in [*combined[:MOST], base]]
    rows[0]["claims that exclude each other"] = ", ".join(" and ".join(pair) for pair in exclusive(combined))
    return pd.DataFrame(rows).fillna("")


def _combination(combined: Combination, base: Combination) -> dict[str, object]:
    words = [f"{finding.reading.choice}: {finding.reading.reading}" for finding in combined.findings]
    counts = combined.counts
    return {
        "combination": "; ".join(words) or "base",
        **{f"{grade} [1]": counts[grade] for grade in (REPRODUCED, DIRECTION, CONTRADICTED, UNDECIDABLE)},
        "open [1]": counts[OPEN] + counts[NOT_RUN],
        "gained": ", ".join(sorted(combined.holding - base.holding)),
        "lost": ", ".join(sorted(base.holding - combined.holding)),
        "against": "; ".join(filter(None, (finding.reading.against for finding in combined.findings))),
    }
