"""Claims about the geometry: G1 and G2 of ``resources/reference/paper_claims.csv``."""

from __future__ import annotations

import numpy as np

from knitstudy.measures.centre_cell import crossing_error, loop_of
from knitstudy.measures.claims.evidence import Evidence, Judgement, verdict
from knitstudy.measures.claims.rule import UNRECORDED, Rule

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


RULES = {
    "G1": Rule(
        judge_penetration,
        "yarns penetrate each other before the optimisation and not after it, when |D - 2R - c0| at every crossing is "
        f"at most {CONTACT_BAR:g} R",
        UNRECORDED,
        ("fig01_unit_cell", "geometry"),
        "geometry alone: none of a discretisation",
    ),
    "G2": Rule(
        judge_length,
        f"arc lengths of the loop and of every Bezier curve change by {LENGTH_BAR:.0%} at most",
        UNRECORDED,
        ("geometry",),
        "geometry alone: none of a discretisation",
    ),
}
