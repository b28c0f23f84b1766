"""Readings of the paper, the verdicts under every reading, and combinations of readings.

A reading is a row of ``resources/reference/readings.csv``: a meaning of the paper where the base takes another one
(kind "reading"), or another value of an input (kind "input"), and which scenes judge a claim in place of the base's.

Readings of one choice (for example of the joints) exclude each other; a combination takes the base or one reading of
every choice. A claim that no reading of the combination touches has the verdict of the base. A claim that one reading
touches has the verdict under that reading. A claim that several readings touch needs a simulation with all of them and
stays open.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import combinations, product
from typing import Any

import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.paper.claims import CLAIMS, DECIDED, NOT_RUN, REPRODUCED
from knitstudy.paper.claims.evidence import Evidence, Judgement, decide, evidence_of, judge
from knitstudy.paper.scene_names import CASES, SOLIDS, of_cases

READING, INPUT = "reading", "input"  # Kinds of readings
DIRECT = of_cases(CASES, SOLIDS)  # Scenes whose knit is the one that is judged


@dataclass(frozen=True)
class Reading:
    """A possible meaning of the paper, or value of an input, that differs from the base.

    A scene whose name matches the expression `changes` gives way to the scene with `becomes` in place of the match;
    without an expression, all scenes are those of the base. Where the paper speaks for the base, `against` says how.
    """

    name: str = "base"
    kind: str = READING
    choice: str = ""  # Choice that the reading decides: readings of one choice exclude each other
    reading: str = "base"  # in words
    base: str = ""  # the choice of the base, in words
    against: str = ""
    changes: str = ""
    becomes: str = ""
    held: str = "shape"  # as in `Evidence`, like the next two
    axes: str = "local"
    normal: str = "normal_resultant"

    def scene_of(self, name: str) -> str:
        """Return the name of the scene that judges in place of one of the base."""
        return re.sub(self.changes, self.becomes, name, count=1) if self.changes else name

    def evidence(self, base: Evidence) -> Evidence | None:
        """Return the evidence under the reading: rows under the names of the base; None without scenes or geometry."""
        instead = {name: self.scene_of(name) for name in base.rows}
        own = {name: getattr(self, name) for name in ("held", "axes", "normal")}
        touches = any(new != name and base.has(new) for name, new in instead.items())
        if not touches and own == {name: getattr(base, name) for name in own}:
            return None
        if self.kind == INPUT:  # other models have the base's inputs
            instead = {name: new for name, new in instead.items() if new != name or name.startswith("yarns-")}
        rows = {name: base.rows[new].named(name) for name, new in instead.items() if new in base.rows}
        geometries = {base.rows[name].scene.knit: base.geometry for name in DIRECT if name in base.rows}
        geometries |= base.geometries
        knits = {base.rows[instead[name]].scene.knit for name in DIRECT if name in rows}
        if not knits <= geometries.keys():
            return None
        geometry = geometries[knits.pop()] if knits else base.geometry
        return replace(base, rows=rows, geometry=geometry, base=base, **own).named()


def readings_of(table: pd.DataFrame) -> list[Reading]:
    """Return the base and all readings of a table; DataFileError when a column is missing."""
    names = [field.name for field in fields(Reading)]
    if missing := [name for name in names if name not in table]:
        raise DataFileError(
            f"the table of readings has no column {missing[0]!r}; needed are {', '.join(names)}"
        )
    return [Reading(), *(Reading(*row) for row in table[names].fillna("").itertuples(index=False))]


@dataclass(frozen=True)
class Finding:
    """Judgements under one reading by claim, and the evidence.

    `touched` are the claims that the reading judges by other numbers than the base, `turned` the touched claims that it
    decides otherwise.
    """

    reading: Reading
    evidence: Evidence | None
    judged: Mapping[str, Judgement]
    touched: frozenset[str] = frozenset()
    turned: tuple[str, ...] = ()


def findings(table: pd.DataFrame, **sources: Any) -> list[Finding]:
    """Return the findings under the base and every reading of a table, from sources of displays (`SOURCES`).

    A reading without reference values is judged by its own histories (`Evidence.reference_for`).
    """
    evidence, (base, *others) = evidence_of(**sources).named(), readings_of(table)
    usual = {claim: judge(claim, evidence) for claim in CLAIMS.names()}
    under_readings = [Finding(base, evidence, usual)]
    for reading in others:
        if (own := reading.evidence(evidence)) is None:
            none = Judgement((), f"the study has no scenes of {reading.name!r}", verdict=NOT_RUN)
            under_readings.append(Finding(reading, None, dict.fromkeys(usual, none), frozenset(usual)))
            continue
        judged = {claim: judge(claim, own) for claim in usual}
        touched = frozenset(claim for claim in usual if judged[claim] != usual[claim])
        verdicts = {claim: {usual[claim].verdict, judged[claim].verdict} for claim in usual}
        turned = tuple(claim for claim, both in verdicts.items() if len(both) == 2 and both <= DECIDED)
        under_readings.append(Finding(reading, own, judged, touched, turned))
    return under_readings


def conclude(claim: str, uncertainty: str, under_readings: Sequence[Finding]) -> Judgement:
    """Return the verdict on a claim under the base, which comes first, and how many readings share the verdict."""
    first, *others = under_readings
    assert first.evidence is not None, "the base has evidence"
    judged = decide(claim, first.evidence, uncertainty)
    decided = [other for other in others if claim in other.touched and other.judged[claim].verdict in DECIDED]
    if judged.verdict == NOT_RUN or not decided:
        return judged
    alike = sum(other.judged[claim].verdict == judged.verdict for other in decided)
    turned = [other for other in decided if claim in other.turned]
    return replace(
        judged,
        under=f"{alike} of {len(decided)}",
        depends_on="; ".join(f"{other.reading.reading}: {other.judged[claim].verdict}" for other in turned),
    )


# ---- Combinations of readings

OPEN = "open: several readings of the combination touch the claim"


@dataclass(frozen=True)
class Combination:
    """Findings of one reading of every choice, of which the base is none, and the verdict of every claim."""

    findings: tuple[Finding, ...]
    verdicts: Mapping[str, str]

    @cached_property
    def holding(self) -> frozenset[str]:
        """Claims that are reproduced."""
        return frozenset(claim for claim, verdict in self.verdicts.items() if verdict == REPRODUCED)


def combinations_of(findings: Sequence[Finding]) -> list[Combination]:
    """Return the combinations of all readings that a study has, those under which most claims hold first."""
    base, *others = findings
    choices: dict[str, list[tuple[Finding, ...]]] = {}
    for finding in others:
        if finding.reading.kind == READING and finding.evidence is not None:
            choices.setdefault(finding.reading.choice, [()]).append((finding,))
    combined = [_combined(base, sum(chosen, ())) for chosen in product(*choices.values())]
    return sorted(combined, key=lambda combination: (-len(combination.holding), len(combination.findings)))


def _combined(base: Finding, chosen: tuple[Finding, ...]) -> Combination:
    verdicts = {}
    for claim, usual in base.judged.items():
        touching = [finding.judged[claim] for finding in chosen if claim in finding.touched]
        verdicts[claim] = OPEN if len(touching) > 1 else (touching or [usual])[0].verdict
    return Combination(chosen, verdicts)


def exclusive(combined: Sequence[Combination]) -> Iterator[tuple[str, str]]:
    """Yield the pairs of claims that both hold under some combination, but under none together."""
    together = {combination.holding for combination in combined}
    for pair in combinations(combined[0].verdicts, 2):
        if all(any(claim in holding for holding in together) for claim in pair) and not any(
            {*pair} <= holding for holding in together
        ):
            yield pair
