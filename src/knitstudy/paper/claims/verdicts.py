"""Readings of the paper, the verdicts under every reading, and how many claims are reproduced by which rules.

A reading is a row of ``resources/reference/readings.csv``: a meaning of the paper where the base takes another one
(kind "reading"), or another value of an input (kind "input"), and which scenes judge a claim in place of the base's.
Readings of one choice (for example of the joints) exclude each other.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import product
from math import nan
from typing import Any

import pandas as pd
import xarray as xr

from knitstudy.errors import DataFileError
from knitstudy.paper.claims import (
    CLAIMS,
    CONTRADICTED,
    DECIDED,
    DIRECTION,
    GRADES,
    NOT_RUN,
    REPRODUCED,
    UNDECIDABLE,
    disagree,
    margin_of,
)
from knitstudy.paper.claims.evidence import Evidence, Judgement, joined, judge
from knitstudy.paper.columns import FORCE, U_Z
from knitstudy.paper.scene_names import CASES, INTERACTIONS, SOLIDS, of_cases

# Kinds of readings: of one choice, of one input, and of everything as the paper prints it
READING, INPUT, PRINTED = "reading", "input", "as printed"
OF_ELEMENTS = "elements-"  # Scenes of the paper's own elements, which are alike as printed and resolved
DIRECT = of_cases(CASES, SOLIDS)  # Scenes whose knit is the one that is judged


@dataclass(frozen=True)
class Reading:
    """A possible meaning of the paper, or value of an input, that differs from the base.

    A scene whose name matches the expression `changes` gives way to the scene with `becomes` in place of the match;
    without an expression, all scenes are those of the base.
    """

    name: str = "base"
    kind: str = READING
    choice: str = ""  # Choice that the reading decides: readings of one choice exclude each other
    reading: str = "base"  # in words
    base: str = ""  # the choice of the base, in words
    against: str = ""  # what the paper prints for the base, and so against the reading
    changes: str = ""
    becomes: str = ""
    held: str = "shape"  # as in `Evidence`, like the next two
    axes: str = "local"
    normal: str = "normal_resultant"
    favour: str = ""  # what the paper prints for the reading
    within: str = ""  # another reading, which is taken as well and changes names of scenes first
    outer: Reading | None = None  # that of the name `within`

    @property
    def left_open(self) -> bool:
        """Whether the paper prints nothing for the reading and nothing for the base."""
        return self.kind != PRINTED and not (self.favour or self.against)

    def scene_of(self, name: str) -> str:
        """Return the name of the scene that judges in place of one of the base."""
        if self.outer:
            name = self.outer.scene_of(name)
        return re.sub(self.changes, self.becomes, name, count=1) if self.changes else name

    def evidence(self, base: Evidence) -> Evidence | None:
        """Return the evidence under the reading: rows under the names of the base; None without scenes or geometry."""
        instead = {name: self.scene_of(name) for name in base.rows}
        own = {name: getattr(self, name) for name in ("held", "axes", "normal")}
        touches = any(new != name and base.has(new) for name, new in instead.items())
        if not touches and own == {name: getattr(base, name) for name in own}:
            return None
        if self.kind == INPUT:
            instead = _of_other_inputs(instead)
        if self.kind == PRINTED:
            alike = {name: name for name in base.rows if name.startswith(OF_ELEMENTS)}
            instead = {name: new for name, new in instead.items() if new != name} | alike
        rows = {name: base.rows[new].named(name) for name, new in instead.items() if new in base.rows}
        knits = {base.rows[instead[name]].scene.knit for name in DIRECT if name in rows}
        geometry = _geometry_of(knits, base)
        if geometry is None:
            return None
        printed = self.kind == PRINTED
        return replace(
            base, rows=rows, geometry=geometry, base=None if printed else base, as_printed=printed, **own
        ).named()


def _of_other_inputs(instead: Mapping[str, str]) -> dict[str, str]:
    """Return the scenes that other inputs replace, and those of cases that have the same inputs as before."""
    solids = {f"yarns-{case}": case for case in (*CASES, "rough-course", "rough-wale")}
    changed = {case for name, case in solids.items() if instead.get(name, name) != name}
    return {
        name: new for name, new in instead.items() if new != name or not any(case in name for case in changed)
    }


def _geometry_of(knits: set[str], base: Evidence) -> xr.Dataset | None:
    """Return the geometry of a knit, that of the base for no knit; None where one of the knits has none."""
    geometries = {base.rows[name].scene.knit: base.geometry for name in DIRECT if name in base.rows}
    geometries |= base.geometries
    if not knits <= geometries.keys():
        return None
    return geometries[knits.pop()] if knits else base.geometry


def readings_of(table: pd.DataFrame) -> list[Reading]:
    """Return the base and all readings of a table; DataFileError when a column is missing."""
    names = [field.name for field in fields(Reading) if field.name != "outer"]
    if missing := [name for name in names if name not in table]:
        raise DataFileError(
            f"the table of readings has no column {missing[0]!r}; needed are {', '.join(names)}"
        )
    found = {"": Reading()}
    for row in table[names].fillna("").to_dict("records"):
        if row["within"] not in found:
            raise DataFileError(
                f"reading {row['name']!r} is within {row['within']!r}, which no row before it has as its name"
            )
        found[row["name"]] = Reading(**row, outer=found[row["within"]] if row["within"] else None)
    return list(found.values())


# ---- Findings: every claim judged under every reading, once

BASE = Reading().name
OF_DIRECT = (FORCE, U_Z)  # Shown of the direct simulations of a reading
VALUES = "values"  # In the column of claims: rows hold these quantities and are no claim
BETWEEN = " | "  # the cells of a row


def findings(evidence: Evidence, readings: pd.DataFrame) -> pd.DataFrame:
    """Return one row a claim under the base, whose evidence it is, and every reading of a table.

    A reading without reference values is judged by its own histories (`Evidence.reference_for`); one of which the study
    has no scenes has no rows. The base is judged by each of its discretisations; the deciding one has no name.
    `touched` says whether the reading judges the claim by other numbers than the base. `measured` holds the rows of the
    claim, one a line: quantity, value of this study, value of the paper, grade.
    """
    judged_by = [(BASE, "", evidence), *((BASE, made, other) for made, other in evidence.again.items())]
    for reading in readings_of(readings)[1:]:
        if own := reading.evidence(evidence):
            judged_by.append((reading.name, "", own))
    rows: list[dict[str, Any]] = []
    usual: dict[str, Judgement] = {}
    for name, made, each in judged_by:
        head = {"reading": name, "discretisation": made}
        for claim in CLAIMS.names():
            judged = judge(claim, each)
            row = {
                "claim": claim,
                "verdict": judged.verdict,
                "touched": judged != usual.setdefault(claim, judged),
                "margin": "" if judged.verdict == NOT_RUN else margin_of(judged.rows),
                "note": judged.note,
                "measured": _lines((row.quantity, row.ours, row.paper, row.grade) for row in judged.rows),
            }
            rows.append(head | row)
        rows.append(head | {"claim": VALUES, "touched": False, "measured": _lines(_values(each))})
    return pd.DataFrame(rows)


def _values(evidence: Evidence) -> Iterator[tuple[str, str]]:
    """Yield the quantities `OF_DIRECT` of the direct simulations, by column."""
    for column, kind in product(OF_DIRECT, INTERACTIONS):
        value = evidence.row(kind)[column] if kind in evidence.direct else nan
        yield f"{column.name}, {INTERACTIONS[kind]} [{column.unit}]", str(value)


def _lines(rows: Iterable[tuple[str, ...]]) -> str:
    return "\n".join(map(BETWEEN.join, rows))


def cells_of(measured: str) -> list[list[str]]:
    """Return quantity, value of this study, value of the paper and grade of every row of a claim."""
    return [line.rsplit(BETWEEN, 3) for line in measured.splitlines()]


@dataclass(frozen=True)
class Finding:
    """Verdicts under one reading by claim, with the claims that it touches, and whether the study has scenes of it.

    `turned` are the touched claims that it decides otherwise than the base.
    """

    reading: Reading
    verdicts: Mapping[str, str]
    touched: frozenset[str] = frozenset()
    turned: tuple[str, ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)

    @property
    def known(self) -> bool:
        """Whether the study has scenes of the reading."""
        return bool(self.values)


def under_readings(
    findings: pd.DataFrame, readings: pd.DataFrame, kinds: Sequence[str] = (READING, INPUT)
) -> list[Finding]:
    """Return the findings under the base, which comes first, and every reading of some kinds of a table."""
    deciding = findings[findings["discretisation"].isin(["", nan])]  # nan: read from a file
    by_reading = {name: rows.set_index("claim") for name, rows in deciding.groupby("reading")}
    usual = by_reading[BASE]["verdict"].drop(VALUES).to_dict()
    found = []
    for reading in readings_of(readings):
        if reading.name != BASE and reading.kind not in kinds:
            continue
        if reading.name not in by_reading:
            found.append(Finding(reading, dict.fromkeys(usual, NOT_RUN), frozenset(usual)))
            continue
        rows = by_reading[reading.name]
        verdicts = rows["verdict"].drop(VALUES).to_dict()
        touched = rows.index[rows["touched"].astype(bool)]
        both = {claim: {usual[claim], verdict} for claim, verdict in verdicts.items()}
        turned = tuple(claim for claim, pair in both.items() if len(pair) == 2 and pair <= DECIDED)
        lines = (line.rsplit(BETWEEN, 1) for line in rows.loc[VALUES, "measured"].splitlines())
        values = {name: float(value) for name, value in lines}
        found.append(Finding(reading, verdicts, frozenset(touched), turned, values))
    return found


def as_printed(findings: pd.DataFrame, readings: pd.DataFrame) -> list[Finding]:
    """Return the findings of everything as the paper prints it, the main one first.

    Others differ from it where the paper prints two things, or nothing.
    """
    return under_readings(findings, readings, (PRINTED,))[1:]


# Uncertainty of a claim without reference values: whether other discretisations decide it likewise.
BY_OTHERS = "by other discretisations"


def conclude(
    claim: str,
    uncertainty: str,
    findings: pd.DataFrame,
    under: Sequence[Finding],
    printed: Sequence[Finding] = (),
) -> dict[str, str]:
    """Return the verdict on a claim under the base with the uncertainty of its rule, by column of the table of claims.

    `under` are the findings under the base, which comes first, and all readings; `printed` are those of everything as
    the paper prints it (`as_printed`). Where an input that is not printed turns the direction, both verdicts are
    undecidable.
    """
    of_claim = findings[(findings["reading"] == BASE) & (findings["claim"] == claim)]
    deciding, *others = of_claim.astype(object).fillna("").to_dict("records")
    quantity, ours, paper, _ = next(iter(cells_of(deciding["measured"])), 4 * [""])
    row = {name: deciding[name] for name in ("verdict", "margin", "note", "measured")}
    row |= {"quantity": quantity, "ours": ours, "paper": paper}
    row |= {"uncertainty": "", "readings": "", "depends on": ""}
    if row["verdict"] in DECIDED:
        row |= _sure(row, uncertainty, [other for other in others if other["verdict"] != NOT_RUN])
    if row["verdict"] != NOT_RUN:
        row |= _under_readings(claim, row["verdict"], under[1:])
    open_readings = [other for other in under[1:] if claim in other.touched and other.reading.left_open]
    turning = _turning(claim, row["verdict"], open_readings)
    if turning:
        row |= {
            "verdict": UNDECIDABLE,
            "note": joined(row["note"], f"{LEFT_OPEN} {_in_words(claim, turning)}"),
        }
    return row | _as_printed(claim, row["verdict"], findings, printed, turning)


LEFT_OPEN = "the paper does not print an input that turns the direction:"


def _turning(claim: str, verdict: str, others: Sequence[Finding]) -> list[Finding]:
    """Return those findings whose direction is not that of a verdict on a claim."""
    return [other for other in others if disagree((verdict, other.verdicts[claim]))]


def _in_words(claim: str, findings: Iterable[Finding]) -> str:
    return "; ".join(f"{other.reading.reading}: {other.verdicts[claim]}" for other in findings)


ALIKE = {
    REPRODUCED: "holds in both",
    DIRECTION: "direction holds in both, size in neither",
    CONTRADICTED: "holds in neither",
}
ALONE = {
    "as printed": "as printed alone: an artefact of its mesh, penalty or joints",
    "resolved": "resolved alone: missed by the paper's own model",
}


def both_of(printed: str, resolved: str) -> str:
    """Return what the verdicts on a claim as printed and resolved say together; nothing where one decides nothing."""
    if not {printed, resolved} <= DECIDED:
        return ""
    if printed == resolved:
        return ALIKE[resolved]
    worse, better = sorted((printed, resolved), key=GRADES.index)
    if better == DIRECTION:
        what = "direction holds"
    elif worse == DIRECTION:
        what = "direction holds in both, size"
    else:
        what = "holds"
    return f"{what} {ALONE['as printed' if printed == better else 'resolved']}"


def _as_printed(
    claim: str,
    resolved: str,
    findings: pd.DataFrame,
    printed: Sequence[Finding],
    left_open: Sequence[Finding],
) -> dict[str, str]:
    """Return the verdict on a claim as printed, its first value, what it depends on, and what both verdicts say."""
    row = {"as printed": NOT_RUN, "ours as printed": "", "as printed depends on": "", "both": ""}
    if not printed:
        return row
    main, *others = printed
    verdict = main.verdicts[claim]
    of_claim = (findings["reading"] == main.reading.name) & (findings["claim"] == claim)
    measured = "".join(findings.loc[of_claim, "measured"].fillna(""))
    row["ours as printed"] = next((ours for _, ours, _, _ in cells_of(measured)), "")
    if verdict in DECIDED:
        differing = [other for other in others if other.verdicts[claim] in DECIDED - {verdict}]
        row["as printed depends on"] = _in_words(claim, differing)
        if left_open or _turning(claim, verdict, differing):
            verdict = UNDECIDABLE
    return row | {"as printed": verdict, "both": both_of(verdict, resolved)}


def _under_readings(claim: str, verdict: str, readings: Sequence[Finding]) -> dict[str, str]:
    """Return how many readings decide a claim alike, and which do not; nothing where none decides it."""
    touching = [other for other in readings if claim in other.touched]
    decided = [other for other in touching if other.verdicts[claim] in DECIDED]
    if not decided:
        return {}
    alike = sum(other.verdicts[claim] == verdict for other in decided)
    turned = [other for other in decided if claim in other.turned]
    left_open = sum(other.verdicts[claim] == UNDECIDABLE for other in touching)
    text = f"{alike} of {len(decided)}"
    return {
        "readings": f"{text}; {left_open} undecidable" if left_open else text,
        "depends on": _in_words(claim, turned),
    }


def _sure(row: Mapping[str, str], uncertainty: str, others: Sequence[Mapping[str, str]]) -> dict[str, str]:
    """Return the uncertainty; no verdict where other discretisations have to agree and do not."""
    if uncertainty != BY_OTHERS:
        return {"uncertainty": uncertainty}
    if not others:
        return {"uncertainty": "not known: one discretisation alone"}
    texts = [
        f"{other['discretisation']}: {other['verdict']}, {cells_of(other['measured'])[0][1]}"
        for other in others
    ]
    added = {"uncertainty": "; ".join(texts)}
    if all(other["verdict"] == row["verdict"] for other in others):
        return added
    note = joined(row["note"], "missing is agreement of the discretisations")
    return added | {"verdict": UNDECIDABLE, "note": note}


# ---- Texts of rules, whose numbers are those of the study

TEXTS = ("explanation", "holds if")  # Columns of the rules in which {quantity} is a value of this study
QUANTITY = re.compile(r"\{([^{}]+)\}")
NOT_MEASURED = "[not measured in this study]"


def with_values(text: str, concluded: Mapping[str, str]) -> str:
    """Return a text of a rule with the values of the quantities that it names in braces (`quantities_of`).

    >>> with_values("it grows ({pairs})", {"measured": "pairs | 97% of 15 pairs | grows | reproduced"})
    'it grows (97% of 15 pairs)'
    """
    values = quantities_of(concluded)
    return QUANTITY.sub(lambda named: values.get(named[1]) or NOT_MEASURED, text)


def quantities_of(concluded: Mapping[str, str]) -> dict[str, str]:
    """Return the values of this study by quantity: all that is measured for a claim, and its ``readings``."""
    values = {quantity: ours for quantity, ours, *_ in cells_of(concluded["measured"])}
    return values | {"readings": concluded.get("readings", "")}


def require_measured(verdicts: pd.DataFrame, rules: pd.DataFrame) -> None:
    """Refuse verdicts whose rules name quantities that are not measured: a committed page has all its numbers.

    Raises DataFileError, which names the claim, the quantity, and those that are measured.
    """
    known = {row["id"]: quantities_of(row) for row in verdicts.fillna("").to_dict("records")}
    decided = verdicts.loc[verdicts["verdict"] != NOT_RUN, "id"]
    for rule in rules[rules["id"].isin(decided)].fillna("").to_dict("records"):
        values = known[rule["id"]]
        named = [(column, name) for column in TEXTS for name in QUANTITY.findall(rule[column])]
        for column, name in named:
            if not values.get(name):
                raise DataFileError(
                    f"paper_claims.csv: {column!r} of {rule['id']} names {name!r}, which is not measured; "
                    f"write one of these in braces: {'; '.join(filter(values.get, values))}"
                )


# ---- How many claims are reproduced, and by which rules

COUNTS = "yes"  # In the column of that name; others say why they do not count


def counted(verdicts: pd.DataFrame, rules: pd.DataFrame) -> str:
    """Return in words how many claims hold, do not, and cannot be decided; verdicts may be older than rules."""
    known = verdicts.set_index("id").reindex(rules["id"])
    verdict = known["verdict"].fillna(NOT_RUN).to_numpy()
    counts = (rules["counts"] == COUNTS).to_numpy()
    number = {grade: int((counts & (verdict == grade)).sum()) for grade in GRADES}
    holds = counts & (verdict == REPRODUCED)
    later = int((holds & (rules["dated"] == "after").to_numpy()).sum())
    text = (
        f"Of {len(rules)} claims of the paper, {number[REPRODUCED]} hold in our converged simulations; of "
        f"{number[DIRECTION]} the direction holds and the size does not, {number[CONTRADICTED]} do not hold, and "
        f"{number[UNDECIDABLE]} cannot be decided, since the paper does not print what they depend on or the "
        f"uncertainty is too large. {int((~counts).sum())} do not count: they are true by construction, or no claim of "
        f"the paper. For {later} of the {number[REPRODUCED]} that hold the test was written after the numbers."
    )
    if "as printed" in known:
        printed = counts & (known["as printed"] == REPRODUCED).to_numpy()
        text += (
            f" With the elements, the penalty, the beams and the joints that the paper prints {int(printed.sum())} "
            f"hold; {int((printed & holds).sum())} hold in both."
        )
    missing = rules.loc[verdict == NOT_RUN, "id"]
    return f"{text} No verdict yet (run `make verdicts`): {', '.join(missing)}." if len(missing) else text
