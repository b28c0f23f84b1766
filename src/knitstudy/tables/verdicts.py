"""The paper's claims with the computed verdicts, and the claims that hang on an input."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.measures.claims.evidence import OPEN, Evidence
from knitstudy.measures.claims.verdicts import CLAIMS, RULES, Finding, findings, hanging
from knitstudy.measures.discretisation import INTERACTIONS, made_of
from knitstudy.measures.reference import TRANSFERRED
from knitstudy.measures.response import QUANTITIES
from knitstudy.measures.selection import COURSE, VARIANTS, variants_of
from knitstudy.measures.variations import INPUTS
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES

# ---- The paper's claims, and what this study finds of each by which rule: verdicts are computed, never written down


@TABLES.add(
    "verdicts",
    "Claims of the paper and verdicts",
    needs=("geometry", "paper", "reference", "claims", "scenes", "every"),
    of=COURSE,
    optional=(
        "tie",
        "rough",
        "isotropic",
        "untied",
        "isotropic_contacts",
        "untied_contacts",
        "frictions",
        "sprung_contacts",
        "fields_stress",
        "sweeps",
        "again",
        "again_contacts",
        "variations",
        "variations_contacts",
    ),
    order=15,
)
def tabulate(
    geometry: xr.Dataset,
    paper: pd.DataFrame,
    reference: pd.DataFrame,
    claims: pd.DataFrame,
    scenes: Mapping[str, Scene],
    every: Mapping[str, xr.Dataset],
    **contact: Any,
) -> pd.DataFrame:
    """Return every claim of the paper with the rule it is judged by, what was measured, and the verdict.

    Parameters
    ----------
    geometry : Dataset
        Result of the geometry stage.
    paper, reference, claims : DataFrame
        ``resources/reference/paper_tables.csv``, ``reference.csv`` and ``paper_claims.csv``.
    scenes : mapping of str to Scene
        The scenes of the histories (see `measures.selection`).
    every : mapping of str to Dataset
        Histories of all simulations of knits, by scene.
    **contact : Dataset or mapping of str to Dataset
        As far as a study has them: histories "tie", "rough", "isotropic" and "untied" in course tension, the contacts
        "isotropic_contacts" and "untied_contacts", "frictions", histories of a sweep by scene, "sprung_contacts",
        contacts that give springs, "fields_stress", stresses, "sweeps", histories of other loops, "again", histories of
        other discretisations, and "variations", those with one input changed, by scene, with their contacts.

    Raises
    ------
    ConfigurationError
        When a claim has no rule.
    """
    evidence = Evidence(
        geometry,
        scenes,
        paper,
        reference,
        every,
        direct={name: contact[name] for name in VARIANTS if name in contact},
        contacts={name: contact[f"{name}_contacts"] for name in VARIANTS if f"{name}_contacts" in contact},
        frictions=contact.get("frictions", {}),
        sprung=contact.get("sprung_contacts", {}),
        stresses=contact.get("fields_stress", {}),
        sweeps=contact.get("sweeps", {}),
    )
    evidence = replace(evidence, again=_again(evidence, contact))
    hang = _hanging(evidence, contact)
    return pd.DataFrame([_row_of_claim(claim, evidence, hang) for claim in claims.itertuples()])


def _again(evidence: Evidence, found: Mapping[str, Any]) -> dict[str, Evidence]:
    """Return what other discretisations have found, by what they are made of."""
    histories, contacts = found.get("again", {}), found.get("again_contacts", {})
    by_making: dict[str, list[Scene]] = {}
    for name in histories:
        by_making.setdefault(made_of(evidence.scenes[name]), []).append(evidence.scenes[name])
    result = {}
    for making, scenes in by_making.items():
        named = variants_of(scenes[0], scenes)
        result[making] = replace(
            evidence,
            scenes={**evidence.scenes, **named},
            direct={kind: histories[scene.name] for kind, scene in named.items()},
            contacts={
                kind: contacts[scene.name] for kind, scene in named.items() if scene.interaction != "tie"
            },
        )
    return result


def _hanging(evidence: Evidence, found: Mapping[str, Any]) -> dict[str, str]:
    """Return which inputs claims hang on, by claim, as far as inputs are varied."""
    histories = found.get("variations", {})
    scenes = [evidence.scenes[name] for name in histories]
    results = findings(
        scenes,
        histories,
        found.get("variations_contacts", {}),
        evidence.geometry,
        evidence.paper,
        evidence.reference,
    )
    inputs = hanging(results)
    said = {}
    for claim in (claim for claim in CLAIMS if any(claim in each.judged for each in results)):
        base = results[0].judged.get(claim)
        if base is None or base.verdict == OPEN:
            said[claim] = "not known: these simulations do not decide it at the base"
        else:
            names = [INPUTS[key] for key, claims in inputs.items() if claim in claims]
            said[claim] = ", ".join(names) or f"none of {len(inputs)}"
    return said


def _row_of_claim(claim: Any, evidence: Evidence, hang: Mapping[str, str]) -> dict[str, str]:
    rule = RULES.get(claim.id)
    if rule is None:
        raise ConfigurationError(
            f"claim {claim.id!r} has no rule by which it is judged; known are {', '.join(RULES)}: take it out of "
            "resources/reference/paper_claims.csv, or give it one in knitstudy.measures.claims"
        )
    judged = rule.decide(evidence)
    return {
        "id": claim.id,
        "where": claim.where,
        "claim": claim.claim,
        "rule": rule.words,
        "rule fixed": rule.fixed,
        "measured": judged.measured,
        "verdict": judged.verdict,
        "uncertainty": judged.uncertainty,
        "hangs on inputs": hang.get(claim.id, ""),
        "note": judged.note,
        "see": ", ".join(rule.see),
    }


# ---- One input at a time changed: force, out-of-plane motion, verdicts, and the claims that hang on an input


PERCENT = 100.0

BASE = "none"
"""What stands for the key of the base."""


@TABLES.add(
    "inputs",
    "One input at a time at another value",
    needs=("variations", "variations_contacts", "geometry", "scenes", "paper", "reference"),
    of=COURSE,
    order=16,
)
def tabulate_inputs(
    variations: Mapping[str, xr.Dataset],
    variations_contacts: Mapping[str, xr.Dataset],
    geometry: xr.Dataset,
    scenes: Mapping[str, Scene],
    paper: pd.DataFrame,
    reference: pd.DataFrame,
) -> pd.DataFrame:
    """Return one row a value of an input, the base first; cells are empty where the input is of no effect.

    Parameters
    ----------
    variations, variations_contacts : mapping of str to Dataset
        Histories and contacts of direct simulations that differ in one input each, by scene (see
        docs/files.md).
    geometry : Dataset
        Result of the geometry stage.
    scenes : mapping of str to Scene
        Their scenes.
    paper, reference : DataFrame
        ``resources/reference/paper_tables.csv`` and ``reference.csv``.
    """
    varied = [scenes[name] for name in variations]
    found = findings(varied, variations, variations_contacts, geometry, paper, reference)
    claims = [claim for claim in CLAIMS if any(claim in each.judged for each in found)]
    hang = hanging(found)
    return pd.DataFrame([_row_of_input(each, claims, hang) for each in found])


def _row_of_input(
    finding: Finding, claims: list[str], hang: Mapping[str, tuple[str, ...]]
) -> dict[str, object]:
    variation = finding.variation
    described = variation.described if variation.key else None
    row: dict[str, object] = {
        "input": variation.key or BASE,
        "value": "" if variation.value is None else f"{variation.value}",
        "unit": described.unit if described else "",
        "standing": described.standing if described else "",
    }
    for quantity in TRANSFERRED:
        unit, _ = QUANTITIES[quantity]
        for kind, name in INTERACTIONS.items():
            row[f"{quantity}, {name} [{unit}]"] = finding.values.get((quantity, kind), np.nan)
    for quantity in TRANSFERRED:
        for kind, name in INTERACTIONS.items():
            row[f"change of {quantity}, {name} [%]"] = PERCENT * finding.changes.get((quantity, kind), np.nan)
    row |= {claim: finding.judged[claim].verdict if claim in finding.judged else "" for claim in claims}
    return row | {"claims that hang on the input": ", ".join(hang.get(variation.key, ()))}
