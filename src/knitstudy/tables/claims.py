"""The paper's claims, and what this study finds of each: verdicts are computed, never written down."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.catalogue import VARIANTS
from knitstudy.study.scene import Scene
from knitstudy.tables import contact_claims, kinematics_claims, model_claims
from knitstudy.tables.evidence import NOT_RUN, Evidence, Judgement, verdict
from knitstudy.tables.geometry import crossing_error, loop_of


def build(
    geometry: xr.Dataset,
    paper: pd.DataFrame,
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
    paper, claims : DataFrame
        ``resources/reference/paper_tables.csv`` and ``paper_claims.csv``.
    scenes : mapping of str to Scene
        The scenes of the histories (see `report.selection`).
    every : mapping of str to Dataset
        Histories of all simulations of knits, by scene.
    **contact : Dataset or mapping of str to Dataset
        As far as a study has them: histories "tie", "rough", "isotropic" and "untied" in course tension, the contacts
        "isotropic_contacts" and "untied_contacts", "frictions", histories of a sweep by scene, and "sprung_contacts",
        contacts that give springs, by scene.
    """
    evidence = Evidence(
        geometry,
        scenes,
        paper,
        every,
        direct={name: contact[name] for name in VARIANTS if name in contact},
        contacts={name: contact[f"{name}_contacts"] for name in VARIANTS if f"{name}_contacts" in contact},
        frictions=contact.get("frictions", {}),
        sprung=contact.get("sprung_contacts", {}),
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


CONTACT_BAR = 1e-3
"""Claim G1: largest |D - 2R - c0| over R at which yarns count as touching at points."""

LENGTH_BAR = 0.02
"""Claim G2: relative change of length that counts as hardly any."""


def judge_penetration(evidence: Evidence) -> Judgement:
    """G1: the yarns penetrate each other before the optimisation, and only touch after it."""
    geometry, radius = evidence.geometry, float(evidence.geometry["radius"])
    before, after = (
        float(geometry["penetration"].sel(state=state)) / radius for state in ("before", "after")
    )
    error = float(crossing_error(geometry).sel(state="after")) / radius
    return Judgement(
        f"deepest penetration {before:.3f} R before and {after:.3f} R after; largest |D - 2R - c0| at a crossing "
        f"{error:.1e} R",
        verdict(before > 0 and after == 0 and error <= CONTACT_BAR),
        f"with a clearance c0 of {float(geometry['clearance']):g} R; the initial loop is not printed, so its "
        "penetration is this study's own",
    )


def judge_length(evidence: Evidence) -> Judgement:
    """G2: no Bezier curve of the yarn changes its length."""
    before, after = (
        loop_of(evidence.geometry, state).curve.segment_lengths() for state in ("before", "after")
    )
    change = after / before - 1
    total = after.sum() / before.sum() - 1
    return Judgement(
        f"length of a loop {total:+.2%}; of a Bezier curve {change.min():+.2%} to {change.max():+.2%}",
        verdict(abs(total) <= LENGTH_BAR and np.abs(change).max() <= LENGTH_BAR),
        f"arc lengths; a change of up to {LENGTH_BAR:.0%} of the loop and of every Bezier curve counts as hardly any",
    )


JUDGES: dict[str, Callable[[Evidence], Judgement]] = {
    "G1": judge_penetration,
    "G2": judge_length,
    **contact_claims.JUDGES,
    **kinematics_claims.JUDGES,
    **model_claims.JUDGES,
}
"""By the claim's id; claims without a judge are not yet run."""
