"""What claims are judged by, and how a judgement is made."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import pandas as pd
import xarray as xr

from knitstudy.measures.cases import Case, cases_of
from knitstudy.measures.discretisation import made_of
from knitstudy.measures.paper_values import number
from knitstudy.measures.reference import Reference, reference_of
from knitstudy.study.scene import Scene

# ---- What claims are judged by, and how a judgement is made: bars decide, and what was not run decides nothing


REPRODUCED, NOT_REPRODUCED, OPEN = "reproduced", "not reproduced", "not decidable"
CALIBRATED, NOT_RUN = "used in calibration", "not yet run"


@dataclass(frozen=True)
class Evidence:
    """All results that claims are judged by.

    Attributes
    ----------
    geometry : Dataset
        Result of the geometry stage.
    scenes : mapping of str to Scene
        Of all histories: by interaction for `direct`, else by name.
    paper : DataFrame
        The paper's numbers.
    reference : DataFrame
        ``resources/reference/reference.csv``: what models are measured against.
    every : mapping of str to Dataset
        Histories of all simulations of knits, by scene.
    direct : mapping of str to Dataset
        Histories of direct simulations by interaction, "tie", "rough", "isotropic", and "untied" for isotropic
        friction in all rows, as far as there are any.
    contacts : mapping of str to Dataset
        What happens at their crossings, likewise.
    frictions : mapping of str to Dataset
        Histories of a sweep of the coefficient of friction, ties and rough contact among them, by scene.
    sprung : mapping of str to Dataset
        Contacts of all direct simulations that give springs, by scene.
    stresses : mapping of str to Dataset
        Stresses of the direct simulations that keep their fields, by scene, in the order of the families.
    sweeps : mapping of str to Dataset
        Histories of sweeps of course spacing and yarn diameter, by scene.
    again : mapping of str to Evidence
        The same with `direct` and `contacts` of another discretisation, by what that is made of.
    estimates : mapping of str to Reference
        What stands for the reference, by the names of `direct`, where this does not know their problems.
    """

    geometry: xr.Dataset
    scenes: Mapping[str, Scene]
    paper: pd.DataFrame
    reference: pd.DataFrame
    every: Mapping[str, xr.Dataset] = field(default_factory=dict)
    direct: Mapping[str, xr.Dataset] = field(default_factory=dict)
    contacts: Mapping[str, xr.Dataset] = field(default_factory=dict)
    frictions: Mapping[str, xr.Dataset] = field(default_factory=dict)
    sprung: Mapping[str, xr.Dataset] = field(default_factory=dict)
    stresses: Mapping[str, xr.Dataset] = field(default_factory=dict)
    sweeps: Mapping[str, xr.Dataset] = field(default_factory=dict)
    again: Mapping[str, Evidence] = field(default_factory=dict)
    estimates: Mapping[str, Reference] = field(default_factory=dict)

    def reference_of(self, name: str) -> Reference:
        """Return what is known of the problem of a scene; nothing where nothing is."""
        return self.estimates.get(name) or reference_of(self.reference, self.scenes[name])

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """Direct simulations with the models that are compared with them, in course and wale tension."""
        return tuple(cases_of(self.every, self.scenes, self.reference))


@dataclass(frozen=True)
class Judgement:
    """What was measured, the verdict, what limits it, and its uncertainty in words."""

    measured: str
    verdict: str
    note: str = ""
    uncertainty: str = ""


def verdict(holds: bool | None) -> str:
    """Return the verdict on a claim that was measured; None where less decides than is certain."""
    if holds is None:
        return OPEN
    return REPRODUCED if holds else NOT_REPRODUCED


def lacking(what: str) -> Judgement:
    """Return the judgement on a claim for which a study has no results of some kind."""
    return Judgement("", NOT_RUN, f"the study has no direct simulation with {what}")


def at_full_strain(
    evidence: Evidence, judgement: Judgement, histories: Iterable[xr.Dataset], scene: str
) -> Judgement:
    """Withhold the verdict where histories were not pulled as far as the paper's; name the mesh of a scene."""
    wanted = number(evidence.paper, "fig7", "course isotropic", "strain at the end") / 100
    reached = min(float(history["strain"][-1]) for history in histories)
    notes = [judgement.note, f"DNS of {made_of(evidence.scenes[scene])}"]
    if reached < 0.999 * wanted:
        judgement = replace(judgement, verdict=NOT_RUN)
        notes.insert(0, f"pulled to {reached:.2%}, the paper to {wanted:.0%}")
    return replace(judgement, note="; ".join(filter(None, notes)))


# ---- By what a claim is judged: the rule in words, when it was fixed, and where to look


BEFORE, AFTER, UNRECORDED = "before its numbers", "after its numbers", "not on record"
"""When a rule was fixed."""

AGAIN = "by other discretisations"
"""The uncertainty of a claim that no reference decides: whether it would be decided likewise."""

OF_REFERENCE = "of the reference, beside the values"

OF_COSTS = "unknowns are exact; memory and time are of one run each, on one machine"


@dataclass(frozen=True)
class Rule:
    """How a claim is judged.

    Attributes
    ----------
    judge : callable
        From all evidence to what was measured, and the verdict.
    words : str
        What has to hold for "reproduced".
    fixed : str
        When it was: `BEFORE`, `AFTER` or `UNRECORDED`.
    see : tuple of str
        Figures and tables that show it.
    uncertainty : str
        Where that of the verdict comes from: `AGAIN`, `OF_REFERENCE`, `OF_COSTS`, or in other words.
    """

    judge: Callable[[Evidence], Judgement]
    words: str
    fixed: str
    see: tuple[str, ...]
    uncertainty: str

    def decide(self, evidence: Evidence) -> Judgement:
        """Judge, by other discretisations too where their difference is the uncertainty: they have to agree."""
        judged = self.judge(evidence)
        if judged.verdict not in (REPRODUCED, NOT_REPRODUCED):
            return judged
        if self.uncertainty != AGAIN:
            return replace(judged, uncertainty=self.uncertainty)
        others = {made: self.judge(other) for made, other in evidence.again.items()}
        others = {made: other for made, other in others.items() if other.verdict != NOT_RUN}
        if not others:
            return replace(judged, uncertainty="not known: one discretisation alone")
        said = "; ".join(f"{made}: {other.verdict}, {other.measured}" for made, other in others.items())
        agreed = all(other.verdict == judged.verdict for other in others.values())
        return replace(judged, verdict=judged.verdict if agreed else OPEN, uncertainty=said)
