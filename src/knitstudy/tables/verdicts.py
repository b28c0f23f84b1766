"""The paper's claims, and what this study finds of each by which rule: verdicts are computed, never written down."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pandas as pd
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.measures.claims.evidence import OPEN, Evidence
from knitstudy.measures.claims.inputs import CLAIMS, findings, hanging
from knitstudy.measures.claims.rules import RULES
from knitstudy.measures.discretisation import made_of
from knitstudy.measures.selection import COURSE, VARIANTS, variants_of
from knitstudy.measures.variations import INPUTS
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES


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
    return pd.DataFrame([_row(claim, evidence, hang) for claim in claims.itertuples()])


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


def _row(claim: Any, evidence: Evidence, hang: Mapping[str, str]) -> dict[str, str]:
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
