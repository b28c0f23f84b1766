"""The claim about local kinematics: K8 of ``resources/reference/paper_claims.csv``."""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.measures.centre_cell import centre_cell, closest_neighbour, rotation_angle
from knitstudy.measures.claims.evidence import NOT_RUN, Evidence, Judgement, at_full_strain, lacking, verdict
from knitstudy.measures.claims.rule import AFTER, AGAIN, Rule
from knitstudy.measures.names import INTERACTIONS

TURNS = np.radians(1.0)
"""Least rotation of a section that counts as one [rad]."""

SLIDES = 0.02
"""Least sliding that counts as such, over the yarn's diameter: more than surfaces give way that stick."""

SPINS = np.radians(3.0)
"""Least angle of a contact area about the yarn that counts as spin [rad]: facets are 15 degrees wide, and the
centroid of few points moves by a degree or two where they come into contact or open."""


def judge_kinematics(evidence: Evidence) -> Judgement:
    """K8: at every crossing of the centre cell each yarn turns, contracts and slides, and its contact area spins."""
    contacts = evidence.contacts.get("isotropic")
    if contacts is None:
        return lacking(INTERACTIONS["isotropic"])
    if "section_rotation" not in contacts:
        return Judgement("", NOT_RUN, "the history holds no motion of the sections")
    crossings = centre_cell(contacts)
    turned, closer, slid, spun = (
        values[:, crossings]
        for values in (
            rotation_angle(contacts),
            closest_neighbour(contacts),
            # Of a crossing: along that yarn which it slides along.
            np.abs(contacts["sliding"].to_numpy()).max(axis=-1),
            np.abs(contacts["contact_spin"].to_numpy()),
        )
    )
    diameter = 2 * float(evidence.geometry["radius"])
    measured = (
        f"centre cell: sections turn by {_range(np.degrees(turned[-1]), '.2g')} degrees, crossings come "
        f"{_range(100 * closer[-1], '.2g')} % of the chord closer to a neighbour on the yarn, surfaces slide "
        f"{_range(1e3 * slid[-1], '.2g')} mm, contact areas spin by {_range(np.degrees(spun[-1]), '.2g')} degrees "
        f"about the yarns; half of the rotation at {_half(contacts, turned):.2%} strain, half of the sliding at "
        f"{_half(contacts, slid):.2%}"
    )
    # A crossing that is open has slid nowhere: comparisons with nan do not hold.
    holds = (
        (turned[-1] >= TURNS).all()
        and (closer[-1] > 0).all()
        and (slid[-1] >= SLIDES * diameter).all()
        and (spun[-1] >= SPINS).all()
    )
    judged = Judgement(
        measured,
        verdict(bool(holds)),
        f"rotation from {np.degrees(TURNS):g} degree on, sliding from {SLIDES:g} d, spin from {np.degrees(SPINS):g} "
        "degrees; contraction by its sign; the order of the states does not judge",
    )
    return at_full_strain(evidence, judged, [contacts], "isotropic")


RULES = {
    "K8": Rule(
        judge_kinematics,
        "at every crossing of the centre cell, at full strain: sections turn by "
        f"{np.degrees(TURNS):g} degree or more, the crossing comes closer to a neighbour on the yarn, surfaces slide "
        f"by {SLIDES:g} d or more, and contact areas spin by {np.degrees(SPINS):g} degrees or more",
        AFTER,
        ("fig10_kinematics",),
        AGAIN,
    )
}


def _range(values: np.ndarray, form: str) -> str:
    """Name the smallest and the largest of some values."""
    return f"{values.min():{form}} to {values.max():{form}}"


def _half(contacts: xr.Dataset, values: np.ndarray) -> float:
    """Return the first strain at which the mean of values (I, ...) over all places is half of the last one."""
    mean = np.nan_to_num(values.reshape(len(values), -1)).mean(axis=1)
    return float(contacts["strain"][int(np.argmax(mean >= 0.5 * mean[-1]))])
