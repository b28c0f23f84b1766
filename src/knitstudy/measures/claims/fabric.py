"""Claims about the loop (G1, G2), the size of the knit (S1), sweeps (K9, K10) and principal stress (M1, M2)."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import xarray as xr

from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.catalogue import OTHER_SOLIDS, SOLIDS, Datasets, of_case
from knitstudy.measures.centre_cell import (
    LEGS,
    SEGMENT,
    angle_to_x,
    angles_to_axes,
    crossing_error,
    honeycomb_segments,
    loop_of,
)
from knitstudy.measures.claims.evidence import NOT_RUN, Evidence, Judgement, NotRun, verdict
from knitstudy.measures.cost import SMALLEST, contact_over_ties, memory_growth, series_of
from knitstudy.measures.discretisation import HEXAHEDRA, INTERACTIONS, made_of
from knitstudy.measures.estimate import Estimate, all_hold
from knitstudy.measures.paper_values import numbers
from knitstudy.measures.sweeps import HELD, SPACING, Point, Sweep, sweeps_of
from knitstudy.models.joints import contacts_of_crossings
from knitstudy.models.network_2d import heights

CONTACT_BAR = 1e-3  # Claim G1: largest |D - 2R - c0| over R at which yarns count as touching at points
LENGTH_BAR = 0.02  # Claim G2: relative change of length that counts as hardly any
AS_AN_AREA = 0.1  # Claim S1: largest distance of the exponents of degrees of freedom from 2
SHARE = 0.9  # Claim S1: share of the paper's ratio of degrees of freedom of contact to ties
FEWEST = 5  # Claims K9 and K10: least number of values of a sweep, in the reading that has most
NEAR = 10.0  # Claim M1: angle up to which a leg counts as being about where the paper has it [deg]


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


def judge_size(evidence: Evidence) -> Judgement:
    """S1: degrees of freedom grow with the area of the knit, and contact costs more of them than ties do."""
    series = series_of(evidence.scenes[name] for name in evidence.histories)
    series = [each for each in series if each.model.startswith(HEXAHEDRA["one_point"])]
    if not {"tie", "isotropic"} <= {each.scenes[0].interaction for each in series}:
        raise NotRun("the study has no square knits of rising size with ties and with friction")
    said, grows = [], []
    for each in series:
        histories = [evidence.histories[scene.name] for scene in each.scenes]
        dof = each.growth([history.attrs["dof"] for history in histories])
        memory = each.growth([memory_growth(history) for history in histories])
        grows.append(abs(dof - 2) <= AS_AN_AREA)
        said.append(
            f"{each.interaction} of {', '.join(map(str, each.cells))} cells in a row: exponent {dof:.2f} of "
            f"degrees of freedom, {memory:.2f} of memory"
        )
    dof, memory = (
        next(iter(contact_over_ties(series, evidence.histories, quantity).values()))
        for quantity in ("dof", "memory_growth")
    )
    smallest = min(cells for cells in dof if cells >= SMALLEST)
    contact, ties = (
        evidence.printed(*place, "degrees of freedom") for place in (("3", "c3w3"), ("5", "dns-tie 3x3"))
    )
    said.append(
        f"contact over ties at {smallest} x {smallest}: {dof[smallest]:.2f} in degrees of freedom (paper "
        f"{contact / ties:.2f}), {memory[smallest]:.2f} in memory"
    )
    holds = all(grows) and dof[smallest] >= SHARE * contact / ties
    return Judgement("; ".join(said), verdict(holds), "contact by penalties adds no degrees of freedom")


# What is held fixed is not printed: readings of it that differ leave the claims open.

HANGS = "hangs on what is held fixed"

SAID = {True: "as claimed", False: "against it", None: "within the uncertainties"}


def judge_sweep(key: str, sign: int, evidence: Evidence) -> Judgement:
    """K9, K10: u_z rises (sign 1) with course spacing, falls (-1) with the diameter of the yarn."""
    found = sweeps_of(key, evidence.histories, evidence.scenes, evidence.reference)
    main = [each for each in found if each.main and each.interaction == "isotropic"]
    if max((len(each.points) for each in main), default=0) < FEWEST:
        raise NotRun(f"the study has no sweep of {key} with {FEWEST} values and isotropic friction")
    ties = [each for each in found if each.main and each.interaction == "tie"]
    said, beside = (
        "; ".join(f"{HELD[each.keep]} {_said(key, each)}, {SAID[goes(each, sign)]}" for each in sweeps)
        for sweeps in (main, ties)
    )
    held = {each.keep: goes(each, sign) for each in main}
    lacks = [HELD[keep] for keep in HELD if keep not in held]
    results = set(held.values())
    notes = [f"without {', '.join(lacks)}"] if lacks else []
    notes += [HANGS] if len(results) > 1 else []
    return Judgement(
        f"largest |u_z|: {said}",
        NOT_RUN if lacks else verdict(results.pop() if len(results) == 1 else None),
        "; ".join([*notes, f"{INTERACTIONS['tie']}: {beside}"]),
        tuple(point.scene.name for each in main for point in each.points),
    )


def goes(sweep: Sweep, sign: int) -> bool | None:
    """Whether a sweep goes the way of a sign; False where it goes the other way, None where that is open."""
    steps = [_change(*pair, sign) for pair in pairwise(sweep.points)]
    whole, limit = _change(sweep.points[0], sweep.points[-1], sign)
    if any(change < -allowed for change, allowed in [*steps, (whole, limit)]):
        return False
    return True if whole > limit and all(change >= -allowed for change, allowed in steps) else None


def _change(one: Point, other: Point, sign: int) -> tuple[float, float]:
    """Return the change of u_z between points, in the sense of a sign, and the sum of both uncertainties."""
    return sign * (other.u_z.value - one.u_z.value), one.u_z.uncertainty + other.u_z.uncertainty


def _said(key: str, sweep: Sweep) -> str:
    """Return the ends of a sweep and the number of its values in words."""
    form = "{:.2f} c" if key == SPACING else "{:.4g} m"
    ends = ", ".join(
        f"{1e3 * point.u_z.value:.3f} ± {1e3 * point.u_z.uncertainty:.3f} mm at {form.format(point.value)}"
        for point in (sweep.points[0], sweep.points[-1])
    )
    return f"{ends} ({len(sweep.points)} values)"


# The bars were fixed before any number was known.

DIRECTIONS = ("course", "wale")


def judge_directions(evidence: Evidence) -> Judgement:
    """M1: the maximum principal stress tends to align with the yarn loops and with the load.

    Reproduced if the legs lie near the printed angles and are turned that way from their direction by geometry, not
    decidable if one of both holds.
    """
    found = _isotropic(evidence)
    lines = honeycomb_segments(contacts_of_crossings(Fabric.from_dataset(evidence.geometry)))
    near, turned, said = [], [], []
    for direction, stresses in found.items():
        printed = numbers(evidence.paper, "4", f"mps-{direction}", "segments 1..6 angle to x")
        legs = printed[[SEGMENT[kind] - 1 for kind in LEGS]]
        words = []
        for kind in LEGS:
            angle = angle_to_x(list(stresses.values()), kind)
            line = float(angles_to_axes(lines[kind])[:, 0].mean())
            near.append(legs.min() - NEAR <= angle.value <= legs.max() + NEAR)
            turned.append(angle.below(line) if direction == "course" else angle.above(line))
            words.append(f"{SEGMENT[kind]} {angle} ({line:.0f} by geometry)")
        span = " to ".join(f"{each:g}" for each in sorted({legs.min(), legs.max()}))
        said.append(f"{direction} tension {', '.join(words)}, paper {span}")
    notes = {
        (False, True): "in tendency only",
        (True, False): "near the printed angles, but not surely turned",
    }
    both = (all(near), all(each is True for each in turned))
    note = [notes.get(both), f"near: {NEAR:g} degrees", _compared(evidence, found)]
    return Judgement(
        f"angle to x of the maximum principal stress in segments 2 to 5 [deg]: {'; '.join(said)}",
        verdict(both[0] if both[0] == both[1] else None),
        "; ".join(filter(None, note)),
        tuple(name for each in found.values() for name in each),
    )


def judge_heights(evidence: Evidence) -> Judgement:
    """M2: the honeycomb by principal stress is compressed along the wales for course tension, stretched for wale."""
    found = _isotropic(evidence)
    knit = Fabric.from_dataset(evidence.geometry)
    ratio = {direction: height_ratio(knit, list(each.values())) for direction, each in found.items()}
    said = ", ".join(f"{direction} {each}" for direction, each in ratio.items())
    return Judgement(
        f"height of a row over that of the honeycomb by geometry: {said}",
        verdict(all_hold((ratio["course"].below(1.0), ratio["wale"].above(1.0)))),
        f"distances along x are kept; {_compared(evidence, found)}",
        tuple(name for each in found.values() for name in each),
    )


def height_ratio(knit: Fabric, stresses: list[xr.Dataset]) -> Estimate:
    """Return the height of a row by principal stress over that of the knit; the first discretisation decides."""
    contacts = contacts_of_crossings(knit)
    pairs = [[angle_to_x(stresses, kind) for kind in LEGS[i : i + 2]] for i in (0, 2)]
    value = [float(np.mean([each.value for each in pair])) for pair in pairs]
    off = [max(each.uncertainty for each in pair) for pair in pairs]

    def ratio(sign: float) -> float:
        # No line is steeper than 90 degrees.
        angles = (min(angle + sign * each, 90 - 1e-6) for angle, each in zip(value, off, strict=True))
        return heights(knit, contacts, *angles).course / knit.cell[1]

    return Estimate(ratio(0), max(abs(ratio(sign) - ratio(0)) for sign in (-1, 1)))


def _isotropic(evidence: Evidence) -> dict[str, dict[str, xr.Dataset]]:
    """Return the stresses with isotropic friction by direction and scene, the deciding one first."""
    found = {
        direction: {
            name: evidence.stresses[name]
            for name in of_case(f"isotropic-{direction}", (*SOLIDS, *OTHER_SOLIDS))
            if name in evidence.stresses
        }
        for direction in DIRECTIONS
    }
    if not all(found.values()):
        raise NotRun("the study has no stresses with isotropic friction in course and in wale tension")
    return found


def _compared(evidence: Evidence, found: Mapping[str, Datasets]) -> str:
    """Return the origins of the uncertainty in words."""
    others = {made_of(evidence.scenes[name]) for stresses in found.values() for name in list(stresses)[1:]}
    beside = f", {', '.join(sorted(others))} beside it" if others else ""
    return f"uncertainty by equivalent segments{beside}"
