"""Evidence for the paper's claims, by the names of scenes, and the judgement of one claim.

``resources/reference/paper_claims.csv`` holds for every claim the sentence of the paper, the rule, the day on which the
rule was fixed, the origin of the uncertainty, and the figures and tables that show the claim. A simulation that the
study lacks, or that ends below the paper's strain, decides nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import pandas as pd
import xarray as xr

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.measures.reference import (
    INTERACTIONS,
    Reference,
    made_of,
    reference_of,
    transferred_uncertainty,
)
from knitstudy.paper.cases import MODELS, Case, cases_of
from knitstudy.paper.claims.scale import DECIDED, NOT_RUN, UNDECIDABLE, Row, worst
from knitstudy.paper.paper_values import number
from knitstudy.run.catalogue import CASES, OTHER_SOLIDS, SOLIDS, Datasets, Scenes, of_cases, one, several

# Scenes of isotropic friction in all rows, by the names of the scenes with tied outer rows.
UNTIED = {"yarns-{case}": "inputs-untied-isotropic-course", "yarns-{case}-p3": "yarns-untied-course-p3"}
AGAIN = ("yarns-{case}-p3", "dns-{case}", "yarns-{case}-coarse")  # Judged again by these
_SOLIDS = of_cases((*CASES, "rough-course"), (*SOLIDS, *OTHER_SOLIDS))
# Names of the scenes whose histories, contacts and stresses claims are judged by.
_VARIED = ("yarns-untied-course-p3", "inputs-*", "reading-*")
SIMULATIONS = (*MODELS, *_SOLIDS, *_VARIED, "sweep-*", "domain-hexahedra-*")
CONTACTS = (*_SOLIDS, *_VARIED, "dns-isotropic-*-penalty*")
STRESSES = (
    *(name for name in _SOLIDS if name.startswith(("yarns-isotropic", "dns-isotropic"))),
    "reading-*-yarns-isotropic-*",
)
# Evidence of claims, for their tables and figures.
RESULTS = {
    "geometry": one("geometry", *of_cases(("tie-course", "isotropic-course"), SOLIDS)),
    "histories": several("simulation", *SIMULATIONS),
    "contacts": several("contacts", *CONTACTS, optional=True),
    "stresses": several("stress", *STRESSES, optional=True),
    "geometries": several("geometry", "reading-*-yarns-tie-course", "inputs-*-tie-course", optional=True),
}

# Sources of figures and tables of findings (`run.catalogue.Display`), the sources of `Evidence`
SOURCES = {"results": RESULTS, "files": ("paper", "reference"), "scenes": True}

NO_DIRECT = "the study has no direct simulation with"


class NotRun(Exception):
    """The study cannot decide a claim: the reason, and the rows that were measured nevertheless."""

    def __init__(self, reason: str, *rows: Row) -> None:
        super().__init__(reason)
        self.judgement = Judgement(tuple(replace(row, grade="") for row in rows), reason, verdict=NOT_RUN)


@dataclass(frozen=True)
class Evidence:
    """Results that claims are judged by, by the names of scenes."""

    geometry: xr.Dataset  # result of the geometry stage
    paper: pd.DataFrame  # ``resources/reference/paper_tables.csv``
    reference: pd.DataFrame  # ``resources/reference/reference.csv``
    scenes: Scenes
    histories: Datasets = field(default_factory=dict)
    contacts: Datasets = field(default_factory=dict)
    stresses: Datasets = field(default_factory=dict)
    # Scenes in course tension that are compared: "tie", "rough", "isotropic", and "untied" for isotropic
    # friction in all rows
    direct: Mapping[str, str] = field(default_factory=dict)
    # The same with `direct` of another discretisation, by the discretisation in words
    again: Mapping[str, Evidence] = field(default_factory=dict)
    geometries: Datasets = field(default_factory=dict)  # of other knits than the base's
    held: str = "shape"  # quantity that sweeps hold fixed (``pattern.keep``)
    axes: str = "local"  # of springs (``rom.axes``)
    normal: str = "normal_resultant"  # of contacts (``rom.normal``)
    base: Evidence | None = None  # evidence of the base, which has the reference; None for the base

    def named(self) -> Evidence:
        """Return the evidence with `direct` by the names of `SOLIDS`, and `again` by the names of `AGAIN`."""
        direct = {name: self._direct(name) for name in (*SOLIDS, *AGAIN)}
        main = next((name for name in SOLIDS if direct[name]), SOLIDS[0])
        others = [direct[name] for name in AGAIN if name != main and direct[name]]
        again = {
            made_of(self.scenes[next(iter(other.values()))]): replace(self, direct=other) for other in others
        }
        return replace(self, direct=direct[main], again=again)

    def _direct(self, name: str) -> dict[str, str]:
        names = {kind: name.format(case=f"{kind}-course") for kind in INTERACTIONS}
        names |= {"untied": UNTIED[name]} if name in UNTIED else {}
        return {kind: scene for kind, scene in names.items() if scene in self.histories}

    @cached_property
    def fabric(self) -> Fabric:
        """The knit as it is laid out."""
        return fabric_of(self.geometry)

    @property
    def diameter(self) -> float:
        """Diameter of the yarn [m]."""
        return 2 * float(self.geometry["radius"])

    def printed(self, table: str, case: str, quantity: str) -> float:
        """Return a number that the paper prints."""
        return number(self.paper, table, case, quantity)

    def history(self, kind: str) -> xr.Dataset:
        """Return the history of one of `direct`; raise `NotRun` without it."""
        return self._result(self.histories, kind)

    def contact(self, kind: str) -> xr.Dataset:
        """Return the contacts of one of `direct`; raise `NotRun` without them."""
        return self._result(self.contacts, kind)

    def _result(self, results: Datasets, kind: str) -> xr.Dataset:
        if self.direct.get(kind) not in results:
            wanted = INTERACTIONS.get(kind, "isotropic friction in all rows, and with ties in the outer ones")
            raise NotRun(f"{NO_DIRECT} {wanted}")
        return results[self.direct[kind]]

    def reference_of(self, kind: str) -> Reference:
        """Return the reference of the problem of one of `direct`; empty where there is none."""
        return self.reference_for(self.direct[kind])

    def reference_for(self, name: str) -> Reference:
        """Return the reference of the problem of a scene.

        Where it knows the base alone, the scene's own history stands for it, as uncertain as its discretisation is at
        the base.
        """
        known = reference_of(self.reference, self.scenes[name])
        if known.known or self.base is None or name not in self.base.histories:
            return known
        return transferred_uncertainty(
            self.base.reference_for(name), self.base.histories[name], self.histories[name]
        )

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """Direct simulations with the models that are compared with them, in course and wale tension."""
        cases = cases_of(self.histories, self.scenes, self.reference)
        return tuple(replace(case, reference=self.reference_for(case.dns.scene.name)) for case in cases)


@dataclass(frozen=True)
class Judgement:
    """The rows of a claim, a remark, the scenes that must reach the paper's strain, and the grade.

    The first of the rows stands for all of them where there is room for one only. Without a `verdict` of its own the
    judgement has the worst grade of its rows.
    """

    rows: tuple[Row, ...]
    note: str = ""
    scenes: tuple[str, ...] = ()  # Direct simulations, the main one first
    verdict: str = ""
    uncertainty: str = ""
    depends_on: str = ""  # Readings and inputs under which the claim is decided otherwise
    under: str = ""  # Number of readings with the same grade

    def __post_init__(self) -> None:
        if not self.verdict:
            object.__setattr__(self, "verdict", worst(self.rows))


# Uncertainty of a claim without reference values: whether other discretisations decide it likewise.
BY_OTHERS = "by other discretisations"

Judge = Callable[[Evidence], Judgement]  # Compares the evidence with the rule of a claim


def withholding(judge: Judge) -> Judge:
    """Return a function that judges a claim, or withholds the verdict without results up to the paper's strain."""

    def judged(evidence: Evidence) -> Judgement:
        try:
            judgement = judge(evidence)
        except NotRun as error:
            return error.judgement
        if judgement.verdict == UNDECIDABLE and not judgement.note:
            judgement = replace(judgement, note="missing is a smaller uncertainty")
        return _at_full_strain(evidence, judgement) if judgement.scenes else judgement

    return judged


def _noted(judged: Judgement, note: str) -> Judgement:
    return replace(judged, note="; ".join(filter(None, [judged.note, note])))


def _at_full_strain(evidence: Evidence, judged: Judgement) -> Judgement:
    wanted = evidence.printed("fig7", "course isotropic", "strain at the end") / 100
    reached = min(float(evidence.histories[name]["strain"][-1]) for name in judged.scenes)
    if reached < 0.999 * wanted:
        judged = _noted(
            replace(judged, verdict=NOT_RUN), f"pulled to {reached:.2%}, the paper to {wanted:.0%}"
        )
    return _noted(judged, f"DNS of {made_of(evidence.scenes[judged.scenes[0]])}")


def decide(judge: Judge, evidence: Evidence, uncertainty: str) -> Judgement:
    """Judge a claim with the uncertainty of its rule; other discretisations have to agree if that is `BY_OTHERS`."""
    judged = judge(evidence)
    if judged.verdict not in DECIDED:
        return judged
    if uncertainty != BY_OTHERS:
        return replace(judged, uncertainty=uncertainty)
    others = {made: judge(other) for made, other in evidence.again.items()}
    others = {made: other for made, other in others.items() if other.verdict != NOT_RUN}
    if not others:
        return replace(judged, uncertainty="not known: one discretisation alone")
    text = "; ".join(f"{made}: {other.verdict}, {other.rows[0].ours}" for made, other in others.items())
    judged = replace(judged, uncertainty=text)
    if all(other.verdict == judged.verdict for other in others.values()):
        return judged
    return _noted(replace(judged, verdict=UNDECIDABLE), "missing is agreement of the discretisations")
