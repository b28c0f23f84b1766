"""The table of rules: the function that judges, by claim; readings of the paper, and the verdicts under every reading.

A reading is a row of ``resources/reference/readings.csv``: a meaning of the paper where the base takes another one
(kind "reading"), or another value of an input (kind "input"), and which scenes judge a claim in place of the base's.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import pandas as pd

from knitstudy.errors import DataFileError
from knitstudy.measures.response import FORCE, LARGEST_U_Z
from knitstudy.paper.claims import contact, fabric, models, stress
from knitstudy.paper.claims.evidence import Evidence, Judge, Judgement, decide, withholding
from knitstudy.paper.claims.scale import DECIDED, NOT_RUN
from knitstudy.paper.sweeps import DIAMETER, SPACING
from knitstudy.run.catalogue import CASES, SOLIDS, of_cases

_JUDGES: dict[str, Judge] = {
    "G1": fabric.judge_penetration,
    "G2": fabric.judge_length,
    "S1": fabric.judge_ties_growth,
    "S2": fabric.judge_contact_memory,
    "S3": fabric.judge_contact_unknowns,
    "K1": contact.judge_no_contact,
    "K2": contact.judge_zones,
    "K3": contact.judge_slope,
    "K4": contact.judge_motion,
    "K5": partial(contact.judge_order, FORCE, ("tie", "rough", "isotropic")),
    "K6": partial(contact.judge_order, LARGEST_U_Z, ("isotropic", "tie")),
    "K7": contact.judge_smaller_friction,
    "K8": contact.judge_kinematics,
    "K9": partial(fabric.judge_sweep, SPACING, 1),
    "K10": partial(fabric.judge_sweep, DIAMETER, -1),
    "K11": contact.judge_untied_rows,
    "K12": contact.judge_order_of_motions,
    "E1": contact.judge_stabilisation,
    "M1": stress.judge_directions,
    "M2": stress.judge_heights,
    "M3": stress.judge_ligaments,
    "R1": models.judge_forces,
    "R2": models.judge_out_of_plane,
    "R3": models.judge_motion_order,
    "R4": models.judge_springs,
    "R5": models.judge_cost,
    "R6": models.judge_cost_with_friction,
    "R7": partial(models.judge_agreement, "good agreement"),
    "R8": partial(models.judge_agreement, "comparable"),
    "R9": models.judge_spring_values,
    "B1": models.judge_beams,
}

RULES = {claim: withholding(judge) for claim, judge in _JUDGES.items()}  # The function that judges, by claim

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
        """Return the evidence under the reading by the names of the base; None without its scenes or geometry."""
        instead = {name: self.scene_of(name) for name in base.scenes}
        own = {name: getattr(self, name) for name in ("held", "axes", "normal")}
        touches = any(new != name and new in base.histories for name, new in instead.items())
        if not touches and own == {name: getattr(base, name) for name in own}:
            return None
        if self.kind == INPUT:  # other models have the base's inputs
            instead = {name: new for name, new in instead.items() if new != name or name.startswith("yarns-")}
        instead = {name: new for name, new in instead.items() if new in base.scenes}
        knits = {base.scenes[new].knit for name, new in instead.items() if name in DIRECT}
        known = {base.scenes[name].knit: base.geometry for name in DIRECT if name in base.scenes}
        made_by = {drawn.attrs["scene"]: drawn for drawn in base.geometries.values()}
        known |= {base.scenes[name].knit: drawn for name, drawn in made_by.items() if name in base.scenes}
        if not knits <= known.keys():
            return None
        results = {
            stage: {name: datasets[new] for name, new in instead.items() if new in datasets}
            for stage in ("histories", "contacts", "stresses")
            for datasets in [getattr(base, stage)]
        }
        scenes = {
            name: base.scenes[new].replace("name", name) for name, new in instead.items() if new != name
        }
        scenes = {name: scenes.get(name) or base.scenes[name] for name in instead}
        geometry = known[knits.pop()] if knits else base.geometry
        return replace(base, geometry=geometry, scenes=scenes, base=base, **results, **own).named()


def readings_of(table: pd.DataFrame) -> list[Reading]:
    """Return the base and all readings of a table; DataFileError when a column is missing."""
    names = [field.name for field in fields(Reading)]
    if missing := [name for name in names if name not in table]:
        raise DataFileError(
            f"the table of readings has no column {missing[0]!r}; needed are {', '.join(names)}"
        )
    return [Reading(), *(Reading(**row) for row in table[names].fillna("").to_dict("records"))]


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
    """Return the findings under the base and every reading of a table, from attributes of `Evidence`.

    A reading without reference values is judged by its own histories (`Evidence.reference_for`).
    """
    evidence, (base, *others) = Evidence(**sources).named(), readings_of(table)
    usual = {claim: rule(evidence) for claim, rule in RULES.items()}
    under_readings = [Finding(base, evidence, usual)]
    for reading in others:
        if (own := reading.evidence(evidence)) is None:
            none = Judgement((), f"the study has no scenes of {reading.name!r}", verdict=NOT_RUN)
            under_readings.append(Finding(reading, None, dict.fromkeys(RULES, none), frozenset(RULES)))
            continue
        judged = {claim: rule(own) for claim, rule in RULES.items()}
        touched = frozenset(claim for claim in RULES if judged[claim] != usual[claim])
        verdicts = {claim: {usual[claim].verdict, judged[claim].verdict} for claim in RULES}
        turned = tuple(claim for claim, both in verdicts.items() if len(both) == 2 and both <= DECIDED)
        under_readings.append(Finding(reading, own, judged, touched, turned))
    return under_readings


def conclude(claim: str, uncertainty: str, under_readings: Sequence[Finding]) -> Judgement:
    """Return the verdict on a claim under the base, which comes first, and how many readings share the verdict."""
    first, *others = under_readings
    judged = decide(RULES[claim], first.evidence, uncertainty)
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
