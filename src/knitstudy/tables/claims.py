"""The paper's claims, and what this study finds of each: verdicts are computed, never written down."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
import xarray as xr

from knitstudy.measures.claims.evidence import NOT_RUN, Evidence, Judgement
from knitstudy.measures.claims.judges import JUDGES
from knitstudy.measures.selection import COURSE, VARIANTS
from knitstudy.study.scene import Scene
from knitstudy.tables.catalogue import TABLES


@TABLES.add(
    "claims",
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
    """Return every claim of the paper with a verdict.

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
        contacts that give springs, by scene, and "fields_stress", stresses by scene.
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
    )
    rows = []
    for claim in claims.itertuples():
        judge = JUDGES.get(claim.id)
        judged = judge(evidence) if judge else Judgement("", NOT_RUN)
        rows.append(
            {
                "id": claim.id,
                "where": claim.where,
                "claim": claim.claim,
                "measured": judged.measured,
                "verdict": judged.verdict,
                "note": judged.note,
            }
        )
    return pd.DataFrame(rows)
