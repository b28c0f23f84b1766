"""Claims about the loop (G1, G2), the size of the knit (S1 to S3), sweeps (K9, K10), principal stress (M1 to M3)."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import xarray as xr

from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.fabric_file import fabric_of
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
from knitstudy.measures.claims.evidence import Evidence, Judgement, Measured, NotRun, verdict
from knitstudy.measures.cost import Series, memory_growth, series_of
from knitstudy.measures.discretisation import HEXAHEDRA, INTERACTIONS, made_of
from knitstudy.measures.estimate import Estimate, all_hold
from knitstudy.measures.paper_values import numbers
from knitstudy.measures.sweeps import HELD, SPACING, Point, Sweep, sweeps_of
from knitstudy.measures.unknowns import counted_solids
from knitstudy.models.joints import contacts_of_crossings
from knitstudy.models.network_2d import heights

CONTACT_BAR = 1e-3  # Claim G1: largest |D - 2R - c0| over R at which yarns count as touching at points
LENGTH_BAR = 0.02  # Claim G2: relative change of length that counts as hardly any
SAME_GROWTH, SAME_COUNT = 0.1, 0.03  # Claims S1, S2: distance of exponents, relative distance of unknowns
# Claims S1, S3: scenes with hexahedra of the paper's size
PAPERS_MESH, IN_CONTACT = "dns-tie-course", "dns-isotropic-course"
SHARE = 0.9  # Claim S3: share of the paper's ratio of degrees of freedom of contact to ties
FEWEST = 5  # Claims K9 and K10: least number of values of a sweep, in the reading that has most
NEAR = 10.0  # Claim M1: angle up to which a segment counts as being about where the paper has it [deg]
FACTOR = 2.0  # Claim M2: largest factor of the logarithm of a height to that by the paper's angles
ALONG = 20.0  # Claim M3: angle up to which a ligament lies along the principal stress [deg]


def judge_penetration(evidence: Evidence) -> Judgement:
    """G1: the yarns penetrate each other before the optimisation, and only touch after it."""
    geometry, radius = evidence.geometry, float(evidence.geometry["radius"])
    before, after = (
        float(geometry["penetration"].sel(state=state)) / radius for state in ("before", "after")
    )
    error = float(crossing_error(geometry).sel(state="after")) / radius
    return Judgement(
        (
            Measured("deepest penetration after", f"{after:.3f} R", "none"),
            Measured("deepest penetration before", f"{before:.3f} R", "severe"),
            Measured("largest |D - 2R - c0| at a crossing", f"{error:.1e} R"),
        ),
        verdict(before > 0 and after == 0 and error <= CONTACT_BAR),
        f"with a clearance c0 of {float(geometry['clearance']):g} R; the initial loop is not printed, so its "
        "penetration is this study's own",
    )


def judge_length(evidence: Evidence) -> Judgement:
    """G2: the yarn of a loop hardly changes its length; its Bezier curves stand beside it."""
    before, after = (
        loop_of(evidence.geometry, state).curve.segment_lengths() for state in ("before", "after")
    )
    change = after / before - 1
    total = after.sum() / before.sum() - 1
    return Judgement(
        (
            Measured("largest change of a Bezier curve", f"{max(change, key=abs):+.2%}"),
            Measured("least change of a Bezier curve", f"{min(change, key=abs):+.2%}"),
            Measured("change of a loop", f"{total:+.2%}", "hardly any"),
        ),
        verdict(abs(total) <= LENGTH_BAR),
        f"arc lengths; a change of up to {LENGTH_BAR:.0%} of the loop counts as hardly any",
    )


def judge_ties_growth(evidence: Evidence) -> Judgement:
    """S1: degrees of freedom of tied knits are the paper's at 3 x 3 cells and grow as the paper's do."""
    scene = (evidence.base or evidence).scenes.get(PAPERS_MESH)
    if scene is None:
        raise NotRun(f"the study has no {PAPERS_MESH}, whose mesh is the paper's")
    knit = fabric_of(evidence.geometry)
    law = counted_solids(knit, scene, evidence.paper)[0].unknowns
    three, thirty = (
        evidence.printed(*place, "degrees of freedom")
        for place in (("5", "dns-tie 3x3"), ("fig12a", "c30w30 tie"))
    )
    grows, wanted = (float(np.log10(many / few)) for few, many in ((law(3), law(30)), (three, thirty)))
    return Judgement(
        (
            Measured("exponent in cells in a row", f"{grows:.2f}", f"{wanted:.2f}"),
            Measured("degrees of freedom, 3 x 3 cells", f"{law(3):,.0f}", f"{three:,.0f}"),
            Measured("degrees of freedom, 30 x 30 cells", f"{law(30):,.0f}", f"some {thirty:,.0f}"),
        ),
        verdict(abs(grows - wanted) <= SAME_GROWTH and abs(law(3) / three - 1) <= SAME_COUNT),
        "counted without a solution",
    )


def judge_contact_memory(evidence: Evidence) -> Judgement:
    """S2: memory of knits in contact grows as Table 3 says."""
    series = _series(evidence, "isotropic")
    grows = series.growth([memory_growth(evidence.histories[scene.name]) for scene in series.scenes])
    sizes = (3, 6, 8, 20, 30)
    printed = [evidence.printed("3", f"c{n}w{n}", "memory") for n in sizes]
    wanted = float(np.polyfit(np.log(sizes), np.log(printed), 1)[0])
    said = f"exponent of {', '.join(map(str, series.cells))} cells in a row"
    return Judgement(
        (Measured(said, f"{grows}", f"{wanted:.2f}"),),
        verdict(_apart(grows, wanted).below(SAME_GROWTH)),
    )


def judge_contact_unknowns(evidence: Evidence) -> Judgement:
    """S3: contact takes more degrees of freedom than ties."""
    try:
        dof = [evidence.histories[name].attrs["dof"] for name in (PAPERS_MESH, IN_CONTACT)]
    except KeyError as missing:
        raise NotRun(f"the study has no {missing.args[0]}") from None
    contact, ties = (
        evidence.printed(*place, "degrees of freedom") for place in (("3", "c3w3"), ("5", "dns-tie 3x3"))
    )
    ratio = dof[1] / dof[0]
    return Judgement(
        (Measured("degrees of freedom, contact over ties", f"{ratio:.2f}", f"{contact / ties:.2f}"),),
        verdict(None if ratio == 1 else ratio >= SHARE * contact / ties),
        "contact by penalties adds no degrees of freedom: missing is what the paper's solver counts",
    )


def _series(evidence: Evidence, interaction: str) -> Series:
    """Return the square knits of one-point hexahedra with an interaction."""
    for each in series_of(evidence.scenes[name] for name in evidence.histories):
        if each.model.startswith(HEXAHEDRA["one_point"]) and each.scenes[0].interaction == interaction:
            return each
    raise NotRun(
        f"the study has no square knits of hexahedra of rising size with {INTERACTIONS[interaction]}"
    )


SAID = {True: "as claimed", False: "against it", None: "within the uncertainties"}


def judge_sweep(key: str, sign: int, evidence: Evidence) -> Judgement:
    """K9, K10: u_z rises (sign 1) with course spacing, falls (-1) with the diameter of the yarn."""
    found = sweeps_of(key, evidence.histories, evidence.scenes, evidence.reference)
    held = {
        each.interaction: each
        for each in found
        if each.main and each.keep == evidence.held and len(each.points) >= FEWEST
    }
    if "isotropic" not in held:
        raise NotRun(
            f"the study has no sweep of {key} with {FEWEST} values, {HELD[evidence.held]} and friction"
        )
    first, *_, last = held["isotropic"].points
    ends = f"{1e3 * first.u_z.value:.3f} to {1e3 * last.u_z.value:.3f} mm"
    whole = Measured(f"largest |u_z|, {HELD[evidence.held]}", ends, "grows" if sign > 0 else "falls")
    return Judgement(
        (whole, *(row for kind in sorted(held) for row in _values(key, held[kind]))),
        verdict(goes(held["isotropic"], sign)),
        "; ".join(f"{INTERACTIONS[kind]}: {SAID[goes(held[kind], sign)]}" for kind in sorted(held)),
        tuple(point.scene.name for point in held["isotropic"].points),
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


def _values(key: str, sweep: Sweep) -> list[Measured]:
    """Return the values of a sweep."""
    form, scale, unit = (".2f", 1.0, "c") if key == SPACING else (".4g", 1e3, "mm")
    kind = INTERACTIONS[sweep.interaction]
    known = max(point.u_z.uncertainty / point.u_z.value for point in sweep.points)
    values = [
        Measured(f"at {scale * point.value:{form}} {unit}, {kind}", f"{1e3 * point.u_z.value:.3f} mm")
        for point in sweep.points
    ]
    return [*values, Measured(f"uncertainty, {kind}", f"{known:.1%}")]


# The bars were fixed before any number was known.

DIRECTIONS = ("course", "wale")


def judge_directions(evidence: Evidence) -> Judgement:
    """M1: the maximum principal stress tends to align with the yarn loops and with the load.

    Reproduced if every segment lies near its printed angle and is turned that way from its direction by geometry; the
    latter alone does not decide.
    """
    found = _isotropic(evidence)
    lines = honeycomb_segments(contacts_of_crossings(fabric_of(evidence.geometry)))
    near, turned, said = [], [], []
    for direction, stresses in found.items():
        printed = numbers(evidence.paper, "4", f"mps-{direction}", "segments 1..6 angle to x")
        for kind in LEGS:
            angle, wanted = angle_to_x(list(stresses.values()), kind), printed[SEGMENT[kind] - 1]
            line = float(angles_to_axes(lines[kind])[:, 0].mean())
            near.append(_apart(angle, wanted).below(NEAR))
            turned.append(angle.below(line) if direction == "course" else angle.above(line))
            place = f"segment {SEGMENT[kind]}, {direction} tension ({line:.0f}° by geometry)"
            said.append(Measured(place, f"{angle}°", f"{wanted:g}°"))
    tends = (all_hold(near), all_hold(turned)) == (False, True)
    missing = "in tendency only: missing is how far the tendency goes" if tends else ""
    note = [missing, f"near: {NEAR:g} degrees", _compared(evidence, found)]
    return Judgement(
        tuple(said),
        verdict(None if tends else all_hold([*near, *turned])),
        "; ".join(filter(None, note)),
        tuple(name for each in found.values() for name in each),
    )


def _apart(found: Estimate, other: float) -> Estimate:
    """Return the distance of an angle [deg] or an exponent to another."""
    return found.of(lambda value: abs(value - other))


def judge_ligaments(evidence: Evidence) -> Judgement:
    """M3: segments by geometry lie along the maximum principal stress, in both tensions."""
    found = _isotropic(evidence)
    lines = honeycomb_segments(contacts_of_crossings(fabric_of(evidence.geometry)))
    places = ("segment 1", *["segment 2 and 3"] * 2, *["segment 4 and 5"] * 2, "segment 6")
    drawn = [numbers(evidence.paper, "4", "rom2d", f"{each} angles to x y z")[0] for each in places]
    near, said = [], []
    for direction, stresses in found.items():
        apart = {
            SEGMENT[kind]: _apart(
                angle_to_x(list(stresses.values()), kind), float(angles_to_axes(line)[:, 0].mean())
            )
            for kind, line in lines.items()
        }
        near += [each.below(ALONG) for each in apart.values()]
        printed = numbers(evidence.paper, "4", f"mps-{direction}", "segments 1..6 angle to x")
        for number, each in apart.items():
            wanted = f"{abs(printed[number - 1] - drawn[number - 1]):.0f}°"
            row = Measured(f"segment {number} to the stress, {direction} tension", f"{each}°", wanted)
            said.append((each.value, row))
    return Judgement(
        tuple(row for _, row in sorted(said, reverse=True)),
        verdict(all_hold(near)),
        f"along: {ALONG:g} degrees; {_compared(evidence, found)}",
        tuple(name for each in found.values() for name in each),
    )


def judge_heights(evidence: Evidence) -> Judgement:
    """M2: the honeycomb by principal stress is compressed along the wales for course tension, stretched for wale."""
    found = _isotropic(evidence)
    knit = fabric_of(evidence.geometry)
    ratio = {direction: height_ratio(knit, list(each.values())) for direction, each in found.items()}
    printed = {direction: _printed_ratio(evidence, knit, direction) for direction in ratio}
    said = tuple(
        Measured(f"height over that by geometry, {way} tension", f"{each}", f"{printed[way]:.2f}")
        for way, each in ratio.items()
    )
    holds = [ratio["course"].below(1.0), ratio["wale"].above(1.0)]
    for direction, each in ratio.items():
        scale = np.log(printed[direction])
        share = each.of(lambda value, scale=scale: float(np.log(value) / scale))
        holds += [share.above(1 / FACTOR), share.below(FACTOR)]
    return Judgement(
        said,
        verdict(all_hold(holds)),
        f"distances along x are kept; {_compared(evidence, found)}",
        tuple(name for each in found.values() for name in each),
    )


def _printed_ratio(evidence: Evidence, knit: Fabric, direction: str) -> float:
    """Return the ratio of heights by the angles of Table 4, through the same formula."""
    angles = numbers(evidence.paper, "4", f"mps-{direction}", "segments 1..6 angle to x")
    pairs = angles[1:3].mean(), angles[3:5].mean()
    return heights(knit, contacts_of_crossings(knit), *pairs).course / knit.cell[1]


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
