"""The findings, and what follows from them: verdicts on claims, and verdicts under readings."""

from __future__ import annotations

from typing import Any

import pandas as pd

from knitstudy.errors import ConfigurationError
from knitstudy.paper.claims import DECIDED, REPRODUCED
from knitstudy.paper.claims import verdicts as found
from knitstudy.paper.claims.evidence import SOURCES, evidence_of
from knitstudy.run.catalogue import TABLES

COLUMNS = [
    *("id", "where", "short", "claim", "verdict", "counts", "dated", "holds if", "margin", "readings"),
    *("as printed", "both"),
    *("quantity", "paper", "ours", "ours as printed"),
    *("sentence", "rule", "rule fixed", "reason", "older rule", "older verdict", "measured", "uncertainty"),
    *("depends on", "as printed depends on", "note", "explanation", "see"),
]
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
    printed = found.as_printed(findings, readings)
    concluded = [found.conclude(claim, uncertainty, findings, under, printed) for claim, uncertainty in rules]
    columns = pd.DataFrame(concluded, index=claims.index).to_dict("series")
    table = claims.rename(columns={"fixed": "rule fixed"}).assign(**columns)
    return table[[*COLUMNS, *(name for name in table if name not in COLUMNS)]]


@TABLES.add("readings", "Claims under every reading of the paper", tables=FINDINGS, order=16)
def tabulate_readings(claims: pd.DataFrame, readings: pd.DataFrame, findings: pd.DataFrame) -> pd.DataFrame:
    """Return one row a reading, the base first: force, motion, verdicts, and the claims that depend on the reading.

    Claims that are true by construction have verdicts, and are not counted. A reading gains or loses a claim where
    that is decided under the base as well.
    """
    counting = [*claims.loc[claims["counts"] == found.COUNTS, "id"]]
    known = [each for each in found.under_readings(findings, readings) if each.known]
    decided = [{claim for claim in counting if each.verdicts[claim] in DECIDED} for each in known]
    held = [{claim for claim in counting if each.verdicts[claim] == REPRODUCED} for each in known]
    return pd.DataFrame(
        {
            name: getattr(each.reading, name)
            for name in ("name", "choice", "reading", "base", "favour", "against")
        }
        | {"reproduced [1]": len(own)}
        | {"gained": ", ".join(sorted((own - held[0]) & decided[0]))}
        | {"lost": ", ".join(sorted((held[0] - own) & here))}
        | {**each.values, **each.verdicts, "claims that depend on the reading": ", ".join(each.turned)}
        for each, own, here in zip(known, held, decided, strict=True)
    )
