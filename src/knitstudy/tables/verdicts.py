"""The paper's claims, and what this study finds of each by which rule: verdicts are computed, never written down."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.measures.claims.evidence import Evidence
from knitstudy.measures.claims.rules import RULES
from knitstudy.measures.selection import COURSE, VARIANTS
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
        "isotropic_contacts" and "untied_contacts", "frictions", histories of a sweep by scene, and "sprung_contacts",
        contacts that give springs, by scene.

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
    )
    return pd.DataFrame([_row(claim, evidence) for claim in claims.itertuples()])


def _row(claim: Any, evidence: Evidence) -> dict[str, str]:
    rule = RULES.get(claim.id)
    if rule is None:
        raise ConfigurationError(
            f"claim {claim.id!r} has no rule by which it is judged; known are {', '.join(RULES)}: take it out of "
            "resources/reference/paper_claims.csv, or give it one in knitstudy.measures.claims"
        )
    judged = rule.judge(evidence)
    return {
        "id": claim.id,
        "where": claim.where,
        "claim": claim.claim,
        "rule": rule.words,
        "rule fixed": rule.fixed,
        "measured": judged.measured,
        "verdict": judged.verdict,
        "note": judged.note,
        "see": ", ".join(rule.see),
    }
