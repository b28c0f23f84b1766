"""Claims about principal stresses: M1 and M2 of ``resources/reference/paper_claims.csv``.

The bars were fixed before any number was known.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from knitstudy.geometry.pattern import Knit
from knitstudy.measures.claims.evidence import (
    NOT_REPRODUCED,
    NOT_RUN,
    OPEN,
    REPRODUCED,
    Evidence,
    Judgement,
    at_full_strain,
    verdict,
)
from knitstudy.measures.claims.rule import BEFORE, Rule
from knitstudy.measures.discretisation import made_of
from knitstudy.measures.estimate import Estimate, all_hold
from knitstudy.measures.printed import numbers
from knitstudy.measures.segment_angles import LEGS, SEGMENT, angle_to_x, angles_to_axes, honeycomb_segments
from knitstudy.models.honeycomb import heights
from knitstudy.models.joints import contacts_of_crossings

NEAR = 10.0
"""Claim M1: angle up to which a leg counts as being about where the paper has it [deg]."""

DIRECTIONS = ("course", "wale")

LACKING = "the study has no stresses with isotropic friction in course and in wale tension"


def judge_directions(evidence: Evidence) -> Judgement:
    """M1: the maximum principal stress tends to align with the yarn loops and with the load.

    The strong reading: averaged over equivalent segments, the legs (segments 2 to 5) lie within 10 degrees of the
    printed 31 to 36 degrees to x in course tension, and of 82 in wale tension, for isotropic friction. The weak one,
    that it tends to align with the loops and the load: in course tension the direction of each leg is turned from the
    geometric one (66 and 80 degrees to x) towards x by more than its uncertainty, in wale tension towards y.
    Reproduced if both hold; in tendency only, which does not decide, if the weak one alone does; not reproduced if
    neither does.
    """
    found = _isotropic(evidence)
    if found is None:
        return Judgement("", NOT_RUN, LACKING)
    lines = honeycomb_segments(contacts_of_crossings(Knit.from_dataset(evidence.geometry)))
    near, turned, said = [], [], []
    for direction, names in found.items():
        printed = numbers(evidence.paper, "4", f"mps-{direction}", "segments 1..6 angle to x")
        legs = printed[[SEGMENT[kind] - 1 for kind in LEGS]]
        words = []
        for kind in LEGS:
            angle = angle_to_x([evidence.stresses[name] for name in names], kind)
            line = float(angles_to_axes(lines[kind])[:, 0].mean())
            near.append(legs.min() - NEAR <= angle.value <= legs.max() + NEAR)
            turned.append(angle.below(line) if direction == "course" else angle.above(line))
            words.append(f"{SEGMENT[kind]} {angle} ({line:.0f} by geometry)")
        span = " to ".join(f"{each:g}" for each in sorted({legs.min(), legs.max()}))
        said.append(f"{direction} tension {', '.join(words)}, paper {span}")
    strong, weak = all(near), all(each is True for each in turned)
    kinds = {
        (True, True): REPRODUCED,
        (False, True): OPEN,
        (True, False): OPEN,
        (False, False): NOT_REPRODUCED,
    }
    notes = {
        (False, True): "in tendency only",
        (True, False): "near the printed angles, but not surely turned",
    }
    judged = Judgement(
        f"angle to x of the maximum principal stress in segments 2 to 5 [deg]: {'; '.join(said)}",
        kinds[strong, weak],
        "; ".join(
            filter(None, [notes.get((strong, weak)), f"near: {NEAR:g} degrees", _compared(evidence, found)])
        ),
    )
    return _at_full_strain(evidence, judged, found)


def judge_heights(evidence: Evidence) -> Judgement:
    """M2: the honeycomb by principal stress is compressed along the wales for course tension, stretched for wale.

    The height of a row of the course honeycomb over that of the one from geometry is below 1, and that of the wale
    honeycomb above 1, each by more than its uncertainty, for isotropic friction.
    """
    found = _isotropic(evidence)
    if found is None:
        return Judgement("", NOT_RUN, LACKING)
    knit = Knit.from_dataset(evidence.geometry)
    ratio = {
        direction: height_ratio(knit, [evidence.stresses[name] for name in names])
        for direction, names in found.items()
    }
    judged = Judgement(
        "height of a row over that of the honeycomb by geometry: "
        + ", ".join(f"{direction} {each}" for direction, each in ratio.items()),
        verdict(all_hold((ratio["course"].below(1.0), ratio["wale"].above(1.0)))),
        f"distances along x are kept; {_compared(evidence, found)}",
    )
    return _at_full_strain(evidence, judged, found)


def height_ratio(knit: Knit, stresses: list[xr.Dataset]) -> Estimate:
    """Return the height of a row by principal stress over that of the knit.

    Parameters
    ----------
    knit : Knit
    stresses : list of Dataset
        Of one problem by several discretisations, the one that decides first.
    """
    contacts = contacts_of_crossings(knit)
    pairs = [[angle_to_x(stresses, kind) for kind in LEGS[i : i + 2]] for i in (0, 2)]
    value = [float(np.mean([each.value for each in pair])) for pair in pairs]
    off = [max(each.uncertainty for each in pair) for pair in pairs]

    def ratio(sign: float) -> float:
        # Nothing is steeper than upright.
        angles = (min(angle + sign * each, 90 - 1e-6) for angle, each in zip(value, off, strict=True))
        return heights(knit, contacts, *angles).course / knit.loop.course_spacing

    return Estimate(ratio(0), max(abs(ratio(sign) - ratio(0)) for sign in (-1, 1)))


RULES = {
    "M1": Rule(
        judge_directions,
        f"segments 2 to 5, averaged over equivalent ones, lie within {NEAR:g} degrees of the printed 31 to 36 degrees "
        "to x in course tension and of 82 in wale tension, with isotropic friction; and each is turned from its "
        "direction by geometry towards x in course tension, towards y in wale tension, by more than its uncertainty; "
        "the latter alone is a tendency, which does not decide",
        BEFORE,
        ("table4_angles", "fig13_principal_stress", "fig14_segments"),
        "of equivalent segments and other discretisations, beside the values",
    ),
    "M2": Rule(
        judge_heights,
        "a row of the honeycomb along the principal stress is lower than that by geometry for course tension and "
        "higher for wale tension, each by more than its uncertainty, with isotropic friction",
        BEFORE,
        ("fig14_segments", "table4_angles"),
        "of equivalent segments and other discretisations, beside the values",
    ),
}


def _isotropic(evidence: Evidence) -> dict[str, list[str]] | None:
    """Return the scenes of isotropic friction that have stresses, by direction; None where one lacks."""
    scenes = [evidence.scenes[name] for name in evidence.stresses]
    found = {
        direction: [
            scene.name
            for scene in scenes
            if scene.interaction == "isotropic" and scene.load.direction == direction
        ]
        for direction in DIRECTIONS
    }
    return found if all(found.values()) else None


def _compared(evidence: Evidence, found: dict[str, list[str]]) -> str:
    """Say what the uncertainty is made of."""
    others = {made_of(evidence.scenes[name]) for names in found.values() for name in names[1:]}
    beside = f", {', '.join(sorted(others))} beside it" if others else ""
    return f"uncertainty by equivalent segments{beside}"


def _at_full_strain(evidence: Evidence, judged: Judgement, found: dict[str, list[str]]) -> Judgement:
    names = [name for each in found.values() for name in each]
    return at_full_strain(evidence, judged, [evidence.every[name] for name in names], found["course"][0])
