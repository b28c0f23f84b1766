"""Claims about the loop (G1, G2), the size of the knit (S1), sweeps (K9, K10) and principal stress (M1, M2)."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import numpy as np
import xarray as xr

from knitstudy.geometry.fabric import Fabric
from knitstudy.measures.centre_cell import crossing_error, loop_of
from knitstudy.measures.claims.evidence import (
    BEFORE,
    NOT_REPRODUCED,
    NOT_RUN,
    OF_COSTS,
    OPEN,
    REPRODUCED,
    UNRECORDED,
    Evidence,
    Judgement,
    Rule,
    at_full_strain,
    verdict,
)
from knitstudy.measures.cost import memory_growth
from knitstudy.measures.discretisation import HEXAHEDRA, INTERACTIONS, made_of
from knitstudy.measures.domain import SMALLEST, Series, contact_over_ties, series_of
from knitstudy.measures.estimate import Estimate, all_hold
from knitstudy.measures.paper_values import number, numbers
from knitstudy.measures.segments import LEGS, SEGMENT, angle_to_x, angles_to_axes, honeycomb_segments
from knitstudy.measures.sweeps import DIAMETER, HELD, SPACING, Point, Sweep, sweeps_of
from knitstudy.models.joints import contacts_of_crossings
from knitstudy.models.network_2d import heights

# ---- Claims about the geometry: G1 and G2 of ``resources/reference/paper_claims.csv``


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


UNIT_CELL_RULES = {
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


# ---- The claim about the size of the domain: S1 of ``resources/reference/paper_claims.csv``


AS_AN_AREA = 0.1
"""How far exponents of degrees of freedom may be from 2."""

SHARE = 0.9
"""Of the paper's factor that contact costs over ties in degrees of freedom."""


def judge_size(evidence: Evidence) -> Judgement:
    """S1: degrees of freedom grow with the area of the knit, and contact costs more of them than ties do."""
    scenes = {name: evidence.scenes[name] for name in evidence.every}
    series = [each for each in series_of(scenes.values()) if _is_papers(each)]
    kinds = {each.scenes[0].interaction for each in series}
    if not {"tie", "isotropic"} <= kinds:
        return Judgement(
            "", NOT_RUN, "the study has no square knits of rising size with ties and with friction"
        )
    said, grows = [], []
    for each in series:
        histories = [evidence.every[scene.name] for scene in each.scenes]
        dof = each.growth([history.attrs["dof"] for history in histories])
        memory = each.growth([memory_growth(history) for history in histories])
        grows.append(abs(dof.exponent - 2) <= AS_AN_AREA)
        said.append(
            f"{each.interaction} of {', '.join(map(str, each.cells))} cells in a row: exponent {dof.exponent:.2f} of "
            f"degrees of freedom, {memory.exponent:.2f} of memory"
        )
    factors = {
        quantity: next(iter(contact_over_ties(series, evidence.every, quantity).values()))
        for quantity in ("dof", "memory_growth")
    }
    smallest = min(cells for cells in factors["dof"] if cells >= SMALLEST)
    paper = number(evidence.paper, "3", "c3w3", "degrees of freedom") / number(
        evidence.paper, "5", "dns-tie 3x3", "degrees of freedom"
    )
    said.append(
        f"contact over ties at {smallest} x {smallest}: {factors['dof'][smallest]:.2f} in degrees of freedom (paper "
        f"{paper:.2f}), {factors['memory_growth'][smallest]:.2f} in memory"
    )
    holds = all(grows) and factors["dof"][smallest] >= SHARE * paper
    return Judgement("; ".join(said), verdict(holds), "contact by penalties adds no degrees of freedom")


SIZE_RULES = {
    "S1": Rule(
        judge_size,
        f"exponents of degrees of freedom in cells in a row within {AS_AN_AREA:g} of 2, with ties and with friction, "
        f"and contact over ties at the smallest size {SHARE:.0%} of the paper's factor in degrees of freedom or more",
        BEFORE,
        ("fig12_size_and_beams", "table3_domain_size"),
        OF_COSTS,
    )
}


def _is_papers(series: Series) -> bool:
    return series.model.startswith(HEXAHEDRA["one_point"])


# ---- Claims about course spacing and yarn diameter: K9 and K10 of ``resources/reference/paper_claims.csv``
# The rule: the largest |u_z| at 5 % course strain, isotropic friction, goes the way that is claimed (K9: rises with the
# course spacing; K10: falls with the diameter) from each value to the next by more than the sum of both points'
# uncertainties, or at least never goes the other way by more than that; and over the whole range it changes that way
# by more than the sum of the uncertainties of its ends. A reading of what is held fixed goes against the claim where a
# step, or the whole range, goes the other way by more than these sums; else it decides nothing. The claim is
# reproduced where it holds in every reading, and not reproduced where every reading goes against it. Where readings
# differ it is not decidable: it hangs on what is held fixed, which is not printed.


FEWEST = 5
"""Values without which a sweep decides nothing, in the reading that has most."""

HANGS = "hangs on what is held fixed"

SAID = {True: "as claimed", False: "against it", None: "within the uncertainties"}


def judge_sweep(key: str, sign: int, evidence: Evidence) -> Judgement:
    """Judge by the rule of this module.

    Parameters
    ----------
    key : str
        What is swept.
    sign : {1, -1}
        Whether u_z is claimed to rise or to fall with it.
    evidence : Evidence
    """
    found = sweeps_of(key, evidence.sweeps, evidence.scenes, evidence.reference)
    main = [each for each in found if each.main and each.interaction == "isotropic"]
    if max((len(each.points) for each in main), default=0) < FEWEST:
        return Judgement(
            "", NOT_RUN, f"the study has no sweep of {key} with {FEWEST} values and isotropic friction"
        )
    held = {each.keep: goes(each, sign) for each in main}
    lacks = [HELD[keep] for keep in HELD if keep not in held]
    said = [f"{HELD[each.keep]} {_said(key, each)}, {SAID[held[each.keep]]}" for each in main]
    ties = [each for each in found if each.main and each.interaction == "tie"]
    beside = [f"{HELD[each.keep]} {_said(key, each)}, {SAID[goes(each, sign)]}" for each in ties]
    result = next(iter(held.values())) if len(set(held.values())) == 1 else None
    notes = [HANGS if len(set(held.values())) > 1 else "", f"{INTERACTIONS['tie']}: {'; '.join(beside)}"]
    judged = Judgement(f"largest |u_z|: {'; '.join(said)}", verdict(result), "; ".join(filter(None, notes)))
    if lacks:
        judged = Judgement(judged.measured, NOT_RUN, f"without {', '.join(lacks)}; {judged.note}")
    scenes = [point.scene.name for each in main for point in each.points]
    return at_full_strain(evidence, judged, [evidence.sweeps[name] for name in scenes], scenes[0])


def goes(series: Sweep, sign: int) -> bool | None:
    """Whether a series goes the way of a sign; False where it goes the other way, None where that is open."""
    steps = [_change(*pair, sign) for pair in pairwise(series.points)]
    whole, limit = _change(series.points[0], series.points[-1], sign)
    if any(change < -allowed for change, allowed in [*steps, (whole, limit)]):
        return False
    return True if whole > limit and all(change >= -allowed for change, allowed in steps) else None


def _change(one: Point, other: Point, sign: int) -> tuple[float, float]:
    """Return the change of u_z from one point to another, in the sense of a sign, and both uncertainties together."""
    return sign * (other.u_z.value - one.u_z.value), one.u_z.uncertainty + other.u_z.uncertainty


def _said(key: str, series: Sweep) -> str:
    """Say the ends of a series, and how many values it has."""
    form = "{:.2f} c" if key == SPACING else "{:.4g} m"
    ends = ", ".join(
        f"{1e3 * point.u_z.value:.3f} ± {1e3 * point.u_z.uncertainty:.3f} mm at {form.format(point.value)}"
        for point in (series.points[0], series.points[-1])
    )
    return f"{ends} ({len(series.points)} values)"


WORDS = (
    "the largest |u_z| at 5 % strain, isotropic friction, {} from each value to the next by more than both "
    "uncertainties or never {} by more, and by more than both over the whole range; in every reading of what is held "
    "fixed. Where every reading goes against that: not reproduced; where readings differ: not decidable"
)

SWEEP_RULES = {
    "K9": Rule(
        partial(judge_sweep, SPACING, 1),
        WORDS.format("rises", "falls"),
        BEFORE,
        ("fig11_sweeps", "sweeps"),
        "of every value, by the next degree and hexahedra, beside the values",
    ),
    "K10": Rule(
        partial(judge_sweep, DIAMETER, -1),
        WORDS.format("falls", "rises"),
        BEFORE,
        ("fig11_sweeps", "sweeps"),
        "of every value, by the next degree and hexahedra, beside the values",
    ),
}


# ---- Claims about principal stresses: M1 and M2 of ``resources/reference/paper_claims.csv``
# The bars were fixed before any number was known.


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
    lines = honeycomb_segments(contacts_of_crossings(Fabric.from_dataset(evidence.geometry)))
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
    return _stresses_at_full_strain(evidence, judged, found)


def judge_heights(evidence: Evidence) -> Judgement:
    """M2: the honeycomb by principal stress is compressed along the wales for course tension, stretched for wale.

    The height of a row of the course honeycomb over that of the one from geometry is below 1, and that of the wale
    honeycomb above 1, each by more than its uncertainty, for isotropic friction.
    """
    found = _isotropic(evidence)
    if found is None:
        return Judgement("", NOT_RUN, LACKING)
    knit = Fabric.from_dataset(evidence.geometry)
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
    return _stresses_at_full_strain(evidence, judged, found)


def height_ratio(knit: Fabric, stresses: list[xr.Dataset]) -> Estimate:
    """Return the height of a row by principal stress over that of the knit.

    Parameters
    ----------
    knit : Fabric
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
        return heights(knit, contacts, *angles).course / knit.cell[1]

    return Estimate(ratio(0), max(abs(ratio(sign) - ratio(0)) for sign in (-1, 1)))


STRESS_RULES = {
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


def _stresses_at_full_strain(evidence: Evidence, judged: Judgement, found: dict[str, list[str]]) -> Judgement:
    names = [name for each in found.values() for name in each]
    return at_full_strain(evidence, judged, [evidence.every[name] for name in names], found["course"][0])
