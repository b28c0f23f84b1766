"""Claims about the maximum principal stress in the segments of a cell: M1 to M3 of ``paper_claims.csv``."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.models.rom2d.build import heights
from knitstudy.knit.yarns.joints import contacts_of_crossings
from knitstudy.measures.centre_cell import (
    LEGS,
    SEGMENT,
    angle_to_x,
    angles_to_axes,
    honeycomb_segments,
)
from knitstudy.measures.estimate import Estimate, all_hold
from knitstudy.measures.reference import made_of
from knitstudy.paper.claims.evidence import Evidence, Judgement, NotRun
from knitstudy.paper.claims.scale import COMPARABLE, Row, comparable, holds
from knitstudy.paper.paper_values import numbers
from knitstudy.run.catalogue import OTHER_SOLIDS, SOLIDS, Datasets, of_case

ALONG = 20.0  # Claim M3: angle up to which a ligament lies along the principal stress [deg]
DIRECTIONS = ("course", "wale")


def judge_directions(evidence: Evidence) -> Judgement:
    """M1: the maximum principal stress of the legs turns from the yarn towards the load, as far as in Table 4."""
    stressed, drawn = _isotropic(evidence), _drawn(evidence)
    tests, shown = [], []
    for direction, stresses in stressed.items():
        printed = numbers(evidence.paper, "4", f"mps-{direction}", "segments 1..6 angle to x")
        towards = -1 if direction == "course" else 1
        turns, theirs = [], []
        for kind in LEGS:
            angle, line, paper = (
                angle_to_x([*stresses.values()], kind),
                drawn[kind],
                printed[SEGMENT[kind] - 1],
            )
            turns.append(angle.of(lambda value, line=line, towards=towards: towards * (value - line)))
            theirs.append(towards * (paper - line))
            place = f"segment {SEGMENT[kind]}, {direction} tension ({line:.0f}° by geometry)"
            shown.append(Row(place, f"{angle}°", f"{paper:g}°"))
        turned = sum(turn.above(0.0) is True for turn in turns)
        tests.append(
            holds(
                f"segments turned to the load, {direction} tension",
                f"{turned} of {len(turns)}",
                f"{len(turns)}",
                all_hold(turn.above(0.0) for turn in turns),
            )
        )
        mean = Estimate(
            *(float(np.mean([getattr(turn, of) for turn in turns])) for of in ("value", "uncertainty"))
        )
        paper = float(np.mean(theirs))
        name = f"mean turn of these, {direction} tension"
        tests.append(comparable(name, mean, paper, f"{mean}°", f"{paper:.0f}°", direction=mean.above(0.0)))
    return Judgement((*tests, *shown), _compared(evidence, stressed), _names(stressed))


def judge_ligaments(evidence: Evidence) -> Judgement:
    """M3: legs by geometry lie between the principal stresses of both tensions, and all segments along these."""
    stressed, drawn = _isotropic(evidence), _drawn(evidence)
    angles = {
        way: {kind: angle_to_x([*stresses.values()], kind) for kind in drawn}
        for way, stresses in stressed.items()
    }
    between = [
        all_hold((angles["course"][kind].below(drawn[kind]), angles["wale"][kind].above(drawn[kind])))
        for kind in LEGS
    ]
    places = ("segment 1", *["segment 2 and 3"] * 2, *["segment 4 and 5"] * 2, "segment 6")
    lines = [numbers(evidence.paper, "4", "rom2d", f"{place} angles to x y z")[0] for place in places]
    near, shown = [], []
    for direction in stressed:
        printed = numbers(evidence.paper, "4", f"mps-{direction}", "segments 1..6 angle to x")
        for kind, line in drawn.items():
            apart = angles[direction][kind].of(lambda value, line=line: abs(value - line))
            number = SEGMENT[kind]
            theirs = f"{abs(printed[number - 1] - lines[number - 1]):.0f}°"
            near.append(apart.below(ALONG))
            row = Row(f"segment {number} to the stress, {direction} tension", f"{apart}°", theirs)
            shown.append((apart.value, row))
    rows = [row for _, row in sorted(shown, key=lambda entry: entry[0], reverse=True)]
    test = holds(
        f"segments within {ALONG:g}° of the stress",
        f"{sum(along is True for along in near)} of {len(near)}",
        "consistent",
        all_hold(between),
        all_hold(near),
    )
    return Judgement((test, *rows), _compared(evidence, stressed), _names(stressed))


def judge_heights(evidence: Evidence) -> Judgement:
    """M2: the honeycomb by principal stress is compressed along the wales for course tension, stretched for wale."""
    stressed, knit = _isotropic(evidence), evidence.fabric
    rows = []
    for direction, stresses in stressed.items():
        ratio, printed = height_ratio(knit, stresses), _printed_ratio(evidence, knit, direction)
        sense = ratio.below(1.0) if direction == "course" else ratio.above(1.0)
        name = f"height over that by geometry, {direction} tension"
        rows.append(comparable(name, ratio, printed, f"{ratio}", f"{printed:.2f}", direction=sense))
    note = (
        f"distances along x are kept; comparable: a factor of {COMPARABLE:g}; {_compared(evidence, stressed)}"
    )
    return Judgement(tuple(rows), note, _names(stressed))


def _printed_ratio(evidence: Evidence, knit: Fabric, direction: str) -> float:
    """Return the ratio of heights by the angles of Table 4, through the same formula."""
    angles = numbers(evidence.paper, "4", f"mps-{direction}", "segments 1..6 angle to x")
    pairs = angles[1:3].mean(), angles[3:5].mean()
    return heights(knit, contacts_of_crossings(knit), *pairs).course / knit.cell[1]


def height_ratio(knit: Fabric, stresses: Datasets) -> Estimate:
    """Return the height of a row by principal stress over that of the knit; the first discretisation decides."""
    contacts = contacts_of_crossings(knit)
    pairs = [[angle_to_x([*stresses.values()], kind) for kind in LEGS[i : i + 2]] for i in (0, 2)]
    value = [float(np.mean([angle.value for angle in pair])) for pair in pairs]
    off = [max(angle.uncertainty for angle in pair) for pair in pairs]

    def ratio(sign: float) -> float:
        # No line is steeper than 90 degrees.
        angles = (min(angle + sign * delta, 90 - 1e-6) for angle, delta in zip(value, off, strict=True))
        return heights(knit, contacts, *angles).course / knit.cell[1]

    return Estimate(ratio(0), max(abs(ratio(sign) - ratio(0)) for sign in (-1, 1)))


def _drawn(evidence: Evidence) -> dict[str, float]:
    """Return the angle to x of every segment by geometry [deg]."""
    lines = honeycomb_segments(contacts_of_crossings(evidence.fabric))
    return {kind: float(angles_to_axes(line)[:, 0].mean()) for kind, line in lines.items()}


def _isotropic(evidence: Evidence) -> dict[str, dict[str, xr.Dataset]]:
    """Return the stresses with isotropic friction by direction and scene, the deciding one first."""
    stressed = {
        direction: {
            name: evidence.stresses[name]
            for name in of_case(f"isotropic-{direction}", (*SOLIDS, *OTHER_SOLIDS))
            if name in evidence.stresses
        }
        for direction in DIRECTIONS
    }
    if not all(stressed.values()):
        raise NotRun("the study has no stresses with isotropic friction in course and in wale tension")
    return stressed


def _names(stressed: Mapping[str, Datasets]) -> tuple[str, ...]:
    return tuple(name for stresses in stressed.values() for name in stresses)


def _compared(evidence: Evidence, stressed: Mapping[str, Datasets]) -> str:
    """Return the origins of the uncertainty in words."""
    others = {made_of(evidence.scenes[name]) for stresses in stressed.values() for name in list(stresses)[1:]}
    beside = f", {', '.join(sorted(others))} beside it" if others else ""
    return f"uncertainty by equivalent segments{beside}"
