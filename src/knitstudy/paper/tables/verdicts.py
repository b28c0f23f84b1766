"""The findings, and what follows from them: verdicts on claims, verdicts under readings, combinations of readings."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pandas as pd

from knitstudy.errors import ConfigurationError
from knitstudy.paper.claims import CONTRADICTED, DIRECTION, NOT_RUN, REPRODUCED, UNDECIDABLE
from knitstudy.paper.claims import verdicts as found
from knitstudy.paper.claims.evidence import SOURCES, evidence_of
from knitstudy.run.catalogue import TABLES

COLUMNS = [
    *("id", "where", "short", "claim", "verdict", "margin", "readings", "quantity", "paper", "ours"),
    *("sentence", "rule", "rule fixed", "reason", "older rule", "older verdict", "measured", "uncertainty"),
    *("depends on", "note", "explanation", "see"),
]
MOST = 12  # Combinations that the table shows
FINDINGS = ("findings",)  # The table that others, and a figure, are made from


@TABLES.add("findings", "Every claim under every reading, with its numbers", **SOURCES, order=18)
def tabulate_findings(readings: pd.DataFrame, **sources: Any) -> pd.DataFrame:
    """Return one row a claim, reading and discretisation (`claims.verdicts.findings`)."""
    return found.findings(evidence_of(**sources).named(), readings)


@TABLES.add("verdicts", "Claims of the paper and verdicts", tables=FINDINGS, order=15)
def tabulate(claims: pd.DataFrame, readings: pd.DataFrame, findings: pd.DataFrame) -> pd.DataFrame:
    """Return every claim of the paper with its rule, the measured rows, and the verdict, which is computed.

    The columns `quantity`, `ours` and `paper` hold the first row of the claim. The column `measured` holds all rows,
    one row a line: quantity, value of this study, value of the paper, grade. Columns that rows of the rules have beside
    those named here come last.

    Raises ConfigurationError when a claim has no rule.
    """
    under = found.under_readings(findings, readings)
    known = under[0].verdicts
    if lacking := [claim for claim in claims["id"] if claim not in known]:
        raise ConfigurationError(
            f"claim {lacking[0]!r} has no rule by which it is judged; known are {', '.join(known)}: take it out of "
            "resources/reference/paper_claims.csv, or give it one in knitstudy.paper.claims"
        )
    rules = zip(claims["id"], claims["uncertainty"], strict=True)
    concluded = [found.conclude(claim, uncertainty, findings, under) for claim, uncertainty in rules]
    columns = pd.DataFrame(concluded, index=claims.index).to_dict("series")
    table = claims.rename(columns={"fixed": "rule fixed"}).assign(**columns)
    return table[[*COLUMNS, *(name for name in table if name not in COLUMNS)]]


@TABLES.add("readings", "Claims under every reading of the paper", tables=FINDINGS, order=16)
def tabulate_readings(readings: pd.DataFrame, findings: pd.DataFrame) -> pd.DataFrame:
    """Return one row a reading, the base first: force, motion, verdicts, and the claims that depend on the reading."""
    return pd.DataFrame(
        {name: getattr(each.reading, name) for name in ("name", "choice", "reading", "base", "against")}
        | {**each.values, **each.verdicts, "claims that depend on the reading": ", ".join(each.turned)}
        for each in found.under_readings(findings, readings)
        if each.known
    )


@TABLES.add("combinations", "Readings under which most claims hold together", tables=FINDINGS, order=17)
def tabulate_combinations(readings: pd.DataFrame, findings: pd.DataFrame) -> pd.DataFrame:
    """Return the combinations of readings under which most claims hold, and the base, with gained and lost claims.

    The last column holds, in the first row, the pairs of claims that no combination reproduces together.
    """
    combined = found.combinations_of(found.under_readings(findings, readings))
    base = next(combination for combination in combined if not combination.findings)
    rows = [_combination(combination, base) for combination in [*combined[:MOST], base]]
    exclusive = found.exclusive(combined)
    rows[0]["claims that exclude each other"] = ", ".join(" and ".join(pair) for pair in exclusive)
    return pd.DataFrame(rows).fillna("")


def _combination(combined: found.Combination, base: found.Combination) -> dict[str, object]:
    words = [f"{finding.reading.choice}: {finding.reading.reading}" for finding in combined.findings]
    counts = Counter(combined.verdicts.values())
    return {
        "combination": "; ".join(words) or "base",
        **{f"{grade} [1]": counts[grade] for grade in (REPRODUCED, DIRECTION, CONTRADICTED, UNDECIDABLE)},
        "open [1]": counts[found.OPEN] + counts[NOT_RUN],
        "gained": ", ".join(sorted(combined.holding - base.holding)),
        "lost": ", ".join(sorted(base.holding - combined.holding)),
        "against": "; ".join(filter(None, (finding.reading.against for finding in combined.findings))),
    }
