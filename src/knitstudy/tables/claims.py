"""The paper's claims, and what this study finds of each: verdicts are computed, never written down."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.catalogue import VARIANTS
from knitstudy.scene import Scene
from knitstudy.tables import contact_claims
from knitstudy.tables.evidence import NOT_RUN, Evidence, Judgement, at_full_strain, verdict
from knitstudy.tables.geometry import crossing_error, loop_of
from knitstudy.tables.reference import number
from knitstudy.tables.response import force_distance, largest_out_of_plane, out_of_plane_agreement
from knitstudy.tables.table5_cost import CASES, MEGABYTE


def build(
    geometry: xr.Dataset,
    dns: xr.Dataset,
    rom3d: xr.Dataset,
    rom2d: xr.Dataset,
    paper: pd.DataFrame,
    claims: pd.DataFrame,
    scenes: Mapping[str, Scene],
    **contact: Any,
) -> pd.DataFrame:
    """Return every claim of the paper with a verdict.

    Parameters
    ----------
    geometry, dns, rom3d, rom2d : Dataset
        Results with ties in course tension (see docs/architecture.md).
    paper, claims : DataFrame
        ``resources/reference/paper_tables.csv`` and ``paper_claims.csv``.
    scenes : mapping of str to Scene
        The scenes of the histories (see `report.selection`).
    **contact : Dataset or mapping of str to Dataset
        As far as a study has them: histories "tie", "rough", "isotropic" and "untied", the contacts
        "isotropic_contacts" and "untied_contacts", and "frictions", histories of a sweep by scene.
    """
    evidence = Evidence(
        geometry,
        {"dns": dns, "rom3d": rom3d, "rom2d": rom2d},
        scenes,
        paper,
        direct={name: contact[name] for name in VARIANTS if name in contact},
        contacts={name: contact[f"{name}_contacts"] for name in VARIANTS if f"{name}_contacts" in contact},
        frictions=contact.get("frictions", {}),
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

MUCH_CLOSER = 0.5
"""Claim R1: "much closer" is at most half the distance."""

SAME_SHAPE, SAME_SIZE = 0.8, 2.0
"""Claim R2: least correlation of u_z, and the factor that amplitudes may differ by."""

NONE_AT_ALL = 0.01
"""Claim R2: share of the DNS's largest |u_z| that counts as no out-of-plane motion."""

AS_MUCH, LITTLE = 0.9, 0.05
"""Claim R5: share of the printed savings to be reached; share of the DNS's memory that is little."""


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


def judge_forces(evidence: Evidence) -> Judgement:
    """R1: the force curve of the 3D model is much closer to the DNS than that of the 2D model."""
    dns, rom3d, rom2d = (evidence.histories[name] for name in ("dns", "rom3d", "rom2d"))
    near, far = force_distance(rom3d, dns), force_distance(rom2d, dns)
    measured = f"relative L2 distance of F(strain) to DNS: 3D ROM {near:.3f}, 2D ROM {far:.3f}"
    judged = Judgement(measured, verdict(near <= MUCH_CLOSER * far), "1 of 4 cases: ties, course tension")
    return at_full_strain(evidence, judged, evidence.histories.values(), "dns")


def judge_out_of_plane(evidence: Evidence) -> Judgement:
    """R2: u_z of the 3D model is that of the DNS; the 2D model has none."""
    dns, rom3d, rom2d = (evidence.histories[name] for name in ("dns", "rom3d", "rom2d"))
    alike = out_of_plane_agreement(rom3d, dns)
    flat = largest_out_of_plane(rom2d) / largest_out_of_plane(dns)
    captured = alike.correlation >= SAME_SHAPE and 1 / SAME_SIZE <= alike.amplitude <= SAME_SIZE
    measured = (
        f"u_z along the centrelines: correlation of 3D ROM and DNS {alike.correlation:.3f}, amplitude ratio "
        f"{alike.amplitude:.2f}; largest |u_z| of the 2D ROM over DNS's {flat:.1g}"
    )
    judged = Judgement(measured, verdict(captured and flat <= NONE_AT_ALL), "ties only")
    return at_full_strain(evidence, judged, evidence.histories.values(), "dns")


def judge_cost(evidence: Evidence) -> Judgement:
    """R5: what the reduced models save, at the paper's mesh size."""
    dof = {name: history.attrs["dof"] for name, history in evidence.histories.items()}
    memory = {name: history.attrs["memory_growth"] / MEGABYTE for name, history in evidence.histories.items()}
    printed = {
        quantity: _printed(evidence, "dns", quantity) / _printed(evidence, "rom3d", quantity)
        for quantity in ("degrees of freedom", "memory")
    }
    saved_dof, saved_memory = dof["dns"] / dof["rom3d"], memory["dns"] / max(memory["rom3d"], 1e-3)
    measured = (
        f"3D ROM: {saved_dof:.1f} times fewer DOF (paper {printed['degrees of freedom']:.1f}), memory growth "
        f"{memory['rom3d']:.1f} MB against {memory['dns']:.0f} MB of DNS (paper {printed['memory']:.1f} times less); "
        f"2D ROM {memory['rom2d']:.1f} MB"
    )
    reproduced = (
        saved_dof >= AS_MUCH * printed["degrees of freedom"]
        and saved_memory >= AS_MUCH * printed["memory"]
        and abs(memory["rom3d"] - memory["rom2d"]) <= LITTLE * memory["dns"]
    )
    note = (
        "the yarn's length and diameter were inferred from the printed DOF: that part was used in calibration"
    )
    size, wanted = evidence.scenes["dns"].mesh.size, _printed(evidence, "dns", "mesh size")
    if not np.isclose(size, wanted):
        return Judgement(
            measured, NOT_RUN, f"elements of {1e3 * size:g} mm, the paper's of {1e3 * wanted:g} mm; {note}"
        )
    return Judgement(measured, verdict(reproduced), note)


JUDGES: dict[str, Callable[[Evidence], Judgement]] = {
    "G1": judge_penetration,
    "G2": judge_length,
    "R1": judge_forces,
    "R2": judge_out_of_plane,
    "R5": judge_cost,
    **contact_claims.JUDGES,
}
"""By the claim's id; claims without a judge are not yet run."""


def _printed(evidence: Evidence, fidelity: str, quantity: str) -> float:
    return number(evidence.paper, "5", CASES[fidelity], quantity)
