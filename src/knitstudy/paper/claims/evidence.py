"""Evidence for the paper's claims, by the names of scenes, and the judgement of one claim.

``resources/reference/paper_claims.csv`` holds for every claim the sentence of the paper, the rule, the day on which the
rule was fixed, the origin of the uncertainty, and the figures and tables that show the claim. A simulation that the
study lacks, or that ends below the paper's strain, decides nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import pandas as pd
import xarray as xr

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.measures.reference import (
    Reference,
    made_of,
    reference_by,
    reference_of,
    transferred_uncertainty,
)
from knitstudy.paper.cases import MODELS, Case, cases_of, number
from knitstudy.paper.claims import CLAIMS, NOT_RUN, REPRODUCED, UNDECIDABLE, NotRun, Remark, Row, worst
from knitstudy.paper.columns import STRAIN, Rows, Simulation, rows_of
from knitstudy.paper.scene_names import CASES, INTERACTIONS, KNIT, OTHER_SOLIDS, SOLIDS, of_cases
from knitstudy.paper.square_knits import CELLS, COUNTED
from knitstudy.run.catalogue import Datasets, Scenes, several

# Scenes of isotropic friction in all rows, by the names of the scenes with tied outer rows.
UNTIED = {"yarns-{case}": "inputs-untied-isotropic-course", "yarns-{case}-p3": "yarns-untied-course-p3"}
AGAIN = ("yarns-{case}-p3", "dns-{case}", "yarns-{case}-coarse")  # Judged again by these
_SOLIDS = of_cases((*CASES, "rough-course", "rough-wale"), (*SOLIDS, *OTHER_SOLIDS))
_VARIED = ("yarns-untied-course-p3", "inputs-*", "inertia-*", "reading-*")
_NUMERICS = ("elements-*", "slave-*")
_SQUARES = ("domain-hexahedra-*", "domain-yarns-tie-course-*")
_STRESSED = [name for name in _SOLIDS if name.startswith(("yarns-isotropic", "dns-isotropic"))]
# Sources of figures and tables of findings (`run.catalogue.Display`), of which `evidence_of` makes the evidence
SOURCES = {
    "results": {
        "geometry": KNIT,
        "histories": several("simulation", *MODELS, *_SOLIDS, *_VARIED, "sweep-*", *_SQUARES, *_NUMERICS),
        "contacts": several("contacts", *_SOLIDS, *_VARIED, optional=True),
        "stresses": several("stress", *_STRESSED, "reading-*-yarns-isotropic-*", optional=True),
        "geometries": several("geometry", "reading-*-yarns-tie-course", "inputs-*-tie-course", optional=True),
    },
    "tables": (COUNTED,),
    "files": ("paper", "reference", "mechanisms"),
    "scenes": True,
}

NO_DIRECT = "the study has no direct simulation with"


@dataclass(frozen=True)
class Evidence:
    """Results that claims are judged by."""

    rows: Rows
    geometry: xr.Dataset  # result of the geometry stage
    paper: pd.DataFrame  # ``resources/reference/paper_tables.csv``
    reference: pd.DataFrame  # ``resources/reference/reference.csv``
    # Scenes in course tension that are compared: "tie", "rough", "isotropic", and "untied" for isotropic
    # friction in all rows
    direct: Mapping[str, str] = field(default_factory=dict)
    # The same with `direct` of another discretisation, by the discretisation in words
    again: Mapping[str, Evidence] = field(default_factory=dict)
    # Of other knits than the base's, by their names
    geometries: Mapping[str, xr.Dataset] = field(default_factory=dict)
    held: str = "shape"  # quantity that sweeps hold fixed (``pattern.keep``)
    axes: str = "local"  # of springs (``rom.axes``)
    normal: str = "normal_resultant"  # of contacts (``rom.normal``)
    # ``resources/reference/mechanisms.csv``: networks of beams in which one thing at a time is changed
    mechanisms: pd.DataFrame | None = None
    # Table of unknowns and memory of the base's knit and of larger ones, which no simulation and no reading changes
    counted_unknowns: pd.DataFrame | None = None
    base: Evidence | None = None  # evidence of the base, which has the reference; None for the base
    # Whether it is of the paper's own discretisation, whose direct simulations are all that models are compared with
    as_printed: bool = False

    def named(self) -> Evidence:
        """Return the evidence with `direct` by the names of `SOLIDS`, and `again` by the names of `AGAIN`."""
        direct = {name: self._direct(name) for name in (*SOLIDS, *AGAIN)}
        main = next((name for name in SOLIDS if direct[name]), SOLIDS[0])
        others = [direct[name] for name in AGAIN if name != main and direct[name]]
        again = {
            made_of(self.rows[next(iter(other.values()))].scene): replace(self, direct=other)
            for other in others
        }
        return replace(self, direct=direct[main], again=again)

    def _direct(self, name: str) -> dict[str, str]:
        names = {kind: name.format(case=f"{kind}-course") for kind in INTERACTIONS}
        names |= {"untied": UNTIED[name]} if name in UNTIED else {}
        return {kind: scene for kind, scene in names.items() if self.has(scene)}

    def pulled_in(self, direction: str) -> Evidence:
        """Return the evidence with `direct` in course or wale tension; scenes go by their names."""
        names = {kind: name.replace("-course", f"-{direction}") for kind, name in self.direct.items()}
        return replace(self, direct={kind: name for kind, name in names.items() if self.has(name)})

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

    def counted(self, model: str, cells: int, column: str) -> float:
        """Return a count of a model of square knits (`square_knits`); raises `NotRun` where there is none."""
        if self.counted_unknowns is None:
            raise NotRun(f"the study has no table {COUNTED}")
        table = self.counted_unknowns
        return float(table.loc[(table["model"] == model) & (table[CELLS] == cells), column].item())

    def has(self, name: str, stage: str = "simulation") -> bool:
        """Whether there is a result of a scene."""
        return name in self.rows and stage in self.rows[name].results

    def row(self, kind: str, stage: str = "simulation") -> Simulation:
        """Return one of `direct` with a result; raise `NotRun` without it."""
        if not self.has(self.direct.get(kind, ""), stage):
            wanted = INTERACTIONS.get(kind, "isotropic friction in all rows, and with ties in the outer ones")
            raise NotRun(f"{NO_DIRECT} {wanted}")
        return self.rows[self.direct[kind]]

    def contact(self, kind: str) -> xr.Dataset:
        """Return the contacts of one of `direct`; raise `NotRun` without them."""
        return self.row(kind, "contacts").results["contacts"]

    def reference_of(self, kind: str) -> Reference:
        """Return the reference of the problem of one of `direct`; empty where there is none."""
        return self.reference_for(self.direct[kind])

    def reference_for(self, name: str) -> Reference:
        """Return the reference of the problem of a scene.

        Where it knows the base alone, the scene's own history stands for it, as uncertain as its discretisation is at
        the base.
        """
        if self.as_printed:
            return reference_by(self.rows[name].history)
        known = reference_of(self.reference, self.rows[name].scene)
        if known.known or self.base is None or not self.base.has(name):
            return known
        histories = (each.rows[name].history for each in (self.base, self))
        return transferred_uncertainty(self.base.reference_for(name), *histories)

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """Direct simulations with the models that are compared with them, in course and wale tension."""
        cases = cases_of(self.rows, self.reference)
        return tuple(replace(case, reference=self.reference_for(case.dns.scene.name)) for case in cases)


def evidence_of(
    histories: Datasets,
    scenes: Scenes,
    contacts: Datasets | None = None,
    stresses: Datasets | None = None,
    geometries: Datasets | None = None,
    **others: Any,
) -> Evidence:
    """Return evidence from sources of displays (`SOURCES`); other keywords are attributes of `Evidence`."""
    rows = rows_of(scenes, histories, contacts=contacts or {}, stress=stresses or {})
    drawn = [geometry for geometry in (geometries or {}).values() if geometry.attrs["scene"] in scenes]
    by_knit = {scenes[geometry.attrs["scene"]].knit: geometry for geometry in drawn}
    return Evidence(rows, geometries=by_knit, **others)


@dataclass(frozen=True)
class Judgement:
    """The rows of a claim, its remark, and the grade, which is the worst one of the rows unless it is given.

    The first of the rows stands for all of them where there is room for one only.
    """

    rows: tuple[Row, ...]
    note: str = ""
    scenes: tuple[str, ...] = ()  # that must reach the paper's strain
    verdict: str = ""

    def __post_init__(self) -> None:
        if not self.verdict:
            object.__setattr__(self, "verdict", worst(self.rows))

    def noted(self, note: str, verdict: str = "") -> Judgement:
        """Return the judgement with a further remark, and another verdict."""
        return replace(self, note=joined(self.note, note), verdict=verdict or self.verdict)


def joined(*notes: str) -> str:
    """Return notes as one."""
    return "; ".join(filter(None, notes))


def judge(claim: str, evidence: Evidence) -> Judgement:
    """Judge a claim, or withhold the verdict without results up to the paper's strain."""
    asked = CLAIMS.find(claim)
    rows = []
    remark = Remark()
    try:
        for found in asked.judge(evidence):
            if isinstance(found, Remark):
                remark = found
            else:
                rows.append(found)
    except NotRun as error:
        rows.sort(key=lambda row: asked.worst_first and not row.grade)
        return Judgement(tuple(row.shown for row in rows), str(error), verdict=NOT_RUN)
    if asked.worst_first:
        rows.sort(key=lambda row: (row.grade == REPRODUCED, row.margin) if row.tested else (2, 0.0))
    judged = Judgement(tuple(rows), remark.note, remark.scenes)
    if judged.verdict == REPRODUCED and not remark.complete:
        judged = replace(judged, verdict=NOT_RUN)
    if judged.verdict == UNDECIDABLE and not judged.note:
        judged = judged.noted("missing is a smaller uncertainty")
    if not remark.scenes:
        return judged
    wanted = evidence.printed("fig7", "course isotropic", "strain at the end") / 100
    reached = min(evidence.rows[name][STRAIN] for name in remark.scenes)
    if reached < 0.999 * wanted:
        judged = judged.noted(f"pulled to {reached:.2%}, the paper to {wanted:.0%}", verdict=NOT_RUN)
    return judged.noted(f"DNS of {made_of(evidence.rows[remark.scenes[0]].scene)}")
