"""Evidence for the paper's claims, by the names of scenes, and how a claim is judged.

A rule holds the bar of a claim and the function that compares it with the evidence. What was not simulated, or not to
the paper's strain, decides nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import pandas as pd
import xarray as xr

from knitstudy.measures.cases import MODELS, Case, cases_of
from knitstudy.measures.catalogue import OTHER_SOLIDS, SOLIDS, of_case
from knitstudy.measures.discretisation import INTERACTIONS, made_of
from knitstudy.measures.paper_values import number
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.study.scene import Scene

# ---- scenes ----

UNTIED = {"yarns-{case}": "inputs-untied-isotropic-course", "yarns-{case}-p3": "yarns-untied-course-p3"}
"""Scenes of isotropic friction in all rows, by the names of the scenes with tied outer rows."""

AGAIN = ("yarns-{case}-p3", "dns-{case}", "yarns-{case}-coarse")
"""Other discretisations by which claims are judged again."""

_SOLIDS = tuple(
    name
    for case in ("tie-course", "tie-wale", "rough-course", "isotropic-course", "isotropic-wale")
    for name in of_case(case, (*SOLIDS, *OTHER_SOLIDS))
)

SIMULATIONS = (*MODELS, *_SOLIDS, "yarns-untied-course-p3", "inputs-*", "sweep-*", "domain-hexahedra-*")
CONTACTS = (*_SOLIDS, "yarns-untied-course-p3", "inputs-*", "dns-isotropic-*-penalty*")
STRESSES = tuple(name for name in _SOLIDS if name.startswith(("yarns-isotropic", "dns-isotropic")))
"""Names of the scenes whose histories, contacts and stresses claims are judged by."""


@dataclass(frozen=True)
class Evidence:
    """Results that claims are judged by.

    Attributes
    ----------
    geometry : Dataset
        Result of the geometry stage.
    paper, reference : DataFrame
        ``resources/reference/paper_tables.csv`` and ``reference.csv``.
    scenes : mapping of str to Scene
    histories, contacts, stresses : mapping of str to Dataset
        Results by scene, as far as there are any.
    direct : mapping of str to str
        Scenes in course tension that are compared with each other: "tie", "rough", "isotropic", and "untied" for
        isotropic friction in all rows.
    again : mapping of str to Evidence
        The same with `direct` of another discretisation, by the discretisation in words.
    estimates : mapping of str to Reference
        Values that stand for the reference, by the keys of `direct`.
    """

    geometry: xr.Dataset
    paper: pd.DataFrame
    reference: pd.DataFrame
    scenes: Mapping[str, Scene]
    histories: Mapping[str, xr.Dataset] = field(default_factory=dict)
    contacts: Mapping[str, xr.Dataset] = field(default_factory=dict)
    stresses: Mapping[str, xr.Dataset] = field(default_factory=dict)
    direct: Mapping[str, str] = field(default_factory=dict)
    again: Mapping[str, Evidence] = field(default_factory=dict)
    estimates: Mapping[str, Reference] = field(default_factory=dict)

    def named(self) -> Evidence:
        """Return the evidence with `direct` by the names of `SOLIDS`, and `again` by those of `AGAIN`."""
        found = {name: self._direct(name) for name in (*SOLIDS, *AGAIN)}
        main = next((name for name in SOLIDS if found[name]), SOLIDS[0])
        others = [found[name] for name in AGAIN if name != main and found[name]]
        again = {
            made_of(self.scenes[next(iter(each.values()))]): replace(self, direct=each) for each in others
        }
        return replace(self, direct=found[main], again=again)

    def _direct(self, name: str) -> dict[str, str]:
        names = {kind: name.format(case=f"{kind}-course") for kind in INTERACTIONS}
        names |= {"untied": UNTIED[name]} if name in UNTIED else {}
        return {kind: scene for kind, scene in names.items() if scene in self.histories}

    def history(self, kind: str) -> xr.Dataset | None:
        """Return the history of one of `direct`."""
        return self.histories.get(self.direct.get(kind, ""))

    def contact(self, kind: str) -> xr.Dataset | None:
        """Return the contacts of one of `direct`."""
        return self.contacts.get(self.direct.get(kind, ""))

    def reference_of(self, kind: str) -> Reference:
        """Return the reference of the problem of one of `direct`; empty where there is none."""
        return self.estimates.get(kind) or reference_of(self.reference, self.scenes[self.direct[kind]])

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """Direct simulations with the models that are compared with them, in course and wale tension."""
        return tuple(cases_of(self.histories, self.scenes, self.reference))


# ---- judgements ----

REPRODUCED, NOT_REPRODUCED, OPEN = "reproduced", "not reproduced", "not decidable"
CALIBRATED, NOT_RUN = "used in calibration", "not yet run"


@dataclass(frozen=True)
class Judgement:
    """What was measured, the verdict, its limits, and its uncertainty in words."""

    measured: str
    verdict: str
    note: str = ""
    uncertainty: str = ""


def verdict(holds: bool | None) -> str:
    """Return the verdict on a claim; None where the uncertainty leaves it open."""
    if holds is None:
        return OPEN
    return REPRODUCED if holds else NOT_REPRODUCED


def not_run(why: str, measured: str = "") -> Judgement:
    """Return the judgement on a claim that the study cannot decide."""
    return Judgement(measured, NOT_RUN, why)


def lacking(what: str) -> Judgement:
    """Return the judgement on a claim for which a study has no direct simulation of some kind."""
    return not_run(f"the study has no direct simulation with {what}")


def at_full_strain(
    evidence: Evidence, judgement: Judgement, names: Iterable[str], of: str | None = None
) -> Judgement:
    """Withhold the verdict where scenes do not reach the paper's strain; note the discretisation of a scene.

    The noted scene is `of`, or else the first.
    """
    names = list(names)
    wanted = number(evidence.paper, "fig7", "course isotropic", "strain at the end") / 100
    reached = min(float(evidence.histories[name]["strain"][-1]) for name in names)
    notes = [judgement.note, f"DNS of {made_of(evidence.scenes[of or names[0]])}"]
    if reached < 0.999 * wanted:
        judgement = replace(judgement, verdict=NOT_RUN)
        notes.insert(0, f"pulled to {reached:.2%}, the paper to {wanted:.0%}")
    return replace(judgement, note="; ".join(filter(None, notes)))


# ---- rules ----

BEFORE, AFTER, UNRECORDED = "before its numbers", "after its numbers", "not on record"
"""When a rule was fixed."""

BY_OTHERS = "by other discretisations"
"""The uncertainty of a claim without reference values: whether other discretisations decide it likewise."""

OF_REFERENCE = "of the reference, beside the values"

OF_COSTS = "unknowns are exact; memory and time are of one run each, on one machine"

Judge = Callable[[Evidence], Judgement]


@dataclass(frozen=True)
class Rule:
    """How a claim is judged.

    Attributes
    ----------
    judge : callable
        Function of the evidence.
    words : str
        What has to hold for "reproduced".
    fixed : str
        When the rule was fixed: `BEFORE`, `AFTER` or `UNRECORDED`.
    see : tuple of str
        Figures and tables that show it.
    uncertainty : str
        Origin of the uncertainty of the verdict: `BY_OTHERS`, `OF_REFERENCE`, `OF_COSTS`, or in other words.
    """

    judge: Judge
    words: str
    fixed: str
    see: tuple[str, ...]
    uncertainty: str

    def decide(self, evidence: Evidence) -> Judgement:
        """Judge; where other discretisations are the uncertainty, they have to agree."""
        judged = self.judge(evidence)
        if judged.verdict not in (REPRODUCED, NOT_REPRODUCED):
            return judged
        if self.uncertainty != BY_OTHERS:
            return replace(judged, uncertainty=self.uncertainty)
        others = {made: self.judge(other) for made, other in evidence.again.items()}
        others = {made: other for made, other in others.items() if other.verdict != NOT_RUN}
        if not others:
            return replace(judged, uncertainty="not known: one discretisation alone")
        said = "; ".join(f"{made}: {other.verdict}, {other.measured}" for made, other in others.items())
        agreed = all(other.verdict == judged.verdict for other in others.values())
        return replace(judged, verdict=judged.verdict if agreed else OPEN, uncertainty=said)


def rule(
    rules: dict[str, Rule], claim: str, words: str, fixed: str, see: tuple[str, ...], uncertainty: str
) -> Callable[[Judge], Judge]:
    """Return a decorator that adds the rule of a claim to a dictionary."""

    def added(judge: Judge) -> Judge:
        rules[claim] = Rule(judge, words, fixed, see, uncertainty)
        return judge

    return added
