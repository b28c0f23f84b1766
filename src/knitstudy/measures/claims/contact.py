"""Claims about contact with friction: K1 to K7, K11 and E1 of ``resources/reference/paper_claims.csv``."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr

from knitstudy.measures.centre_cell import (
    Snapshot,
    centre_cell,
    closest_neighbour,
    first_symmetric_contact,
    rotation_angle,
    snapshots,
    zones_of_cell,
)
from knitstudy.measures.claims.evidence import (
    AFTER,
    AGAIN,
    NOT_RUN,
    OF_REFERENCE,
    UNRECORDED,
    Evidence,
    Judgement,
    Rule,
    at_full_strain,
    lacking,
    verdict,
)
from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.measures.estimate import Estimate, all_hold
from knitstudy.measures.history_checks import stabilisation_share
from knitstudy.measures.paper_values import number
from knitstudy.measures.reference import transferred_uncertainty
from knitstudy.measures.response import (
    FORCE,
    LARGEST_U_Z,
    Z,
    at_strain,
    common_strain,
    out_of_plane,
    stiffness_at,
    transverse_contraction,
)

FIRST, LAST = 1, 4
"""Numbers of the points of Fig. 7 that claims K1 and K2 speak of."""

SPAN = 1e-3
"""Claim K3: strain before and after a point over which slopes of the force are compared."""

JUST_AFTER = 5e-3
"""Claim K3: strain within which "just after" is."""

PRONOUNCED = 0.1
"""Claim K4: largest |u_z| over the yarn's diameter that counts as a pronounced out-of-plane motion."""

SYMMETRIC = 0.2
"""Claim K4: difference of mirrored envelopes of u_z over the largest |u_z| that still counts as symmetric."""

SLIDE, TRANSFERRED, HARDER = 1.5, 0.9, 1.2
"""Claim K11: slip of the outer rows over that of the others; share of the force below which load is not transferred;
and factor of iterations that counts as worse convergence."""


def judge_no_contact(evidence: Evidence) -> Judgement:
    """K1: no zone in the centre cell at point 1."""
    contacts = evidence.contacts.get("isotropic")
    if contacts is None:
        return lacking(INTERACTIONS["isotropic"])
    wanted = number(
        evidence.paper, "fig7", "course isotropic", "contact zones in the centre cell at 0.05% strain"
    )
    return _at_snapshot(contacts, FIRST, lambda zones, at: zones[at] == wanted)


def judge_zones(evidence: Evidence) -> Judgement:
    """K2: four zones in the centre cell from point 4 to the end, never more."""
    contacts = evidence.contacts.get("isotropic")
    if contacts is None:
        return lacking(INTERACTIONS["isotropic"])
    wanted = number(
        evidence.paper, "fig7", "course isotropic", "contact zones in the centre cell at 1.95% strain"
    )
    judged = _at_snapshot(
        contacts, LAST, lambda zones, at: (zones[at:] == wanted).all() and zones.max() == wanted
    )
    return at_full_strain(evidence, judged, [contacts], "isotropic")


def judge_slope(evidence: Evidence) -> Judgement:
    """K3: the force bends most just after zones come into symmetric contact."""
    history, contacts = evidence.direct.get("isotropic"), evidence.contacts.get("isotropic")
    if history is None or contacts is None:
        return lacking(INTERACTIONS["isotropic"])
    strain, bends = history["strain"].to_numpy(), largest_bend(history)
    first = first_symmetric_contact(contacts)
    bend = (
        "the force is not followed far enough to bend"
        if np.isnan(bends)
        else f"the force bends most at {bends:.2%}"
    )
    if first is None:
        return at_full_strain(
            evidence,
            Judgement(f"no symmetric contact in the centre cell; {bend}", verdict(False)),
            [history],
            "isotropic",
        )
    # It came about after the increment before.
    after = strain[max(first - 1, 0)] <= bends <= strain[first] + JUST_AFTER
    judged = Judgement(
        f"first symmetric contact in the centre cell at {strain[first]:.2%} strain; {bend}",
        verdict(bool(after)),
        f"slopes over {SPAN:.1%} before and after; {JUST_AFTER:.1%} counts as just after",
    )
    return at_full_strain(evidence, judged, [history], "isotropic")


def judge_motion(evidence: Evidence) -> Judgement:
    """K4: the knit contracts and moves out of its plane, symmetrically about its mid line."""
    history = evidence.direct.get("isotropic")
    if history is None:
        return lacking(INTERACTIONS["isotropic"])
    contraction, largest = transverse_contraction(history), float(out_of_plane(history)[-1])
    diameter = 2 * float(evidence.geometry["radius"])
    skew = asymmetry(history)
    judged = Judgement(
        f"transverse contraction {contraction:.2%}; largest |u_z| {largest / diameter:.2f} d; mirrored envelopes of "
        f"u_z differ by {skew:.0%} of it",
        verdict(contraction > 0 and largest >= PRONOUNCED * diameter and skew <= SYMMETRIC),
        f"pronounced from {PRONOUNCED:g} d on, symmetric up to {SYMMETRIC:.0%}",
    )
    return at_full_strain(evidence, judged, [history], "isotropic")


def judge_stiffness_order(evidence: Evidence) -> Judgement:
    """K5: ties are stiffer than rough contact, and that is stiffer than isotropic friction."""
    stiffness = _compared(evidence, lambda history, strain: 1e-3 * stiffness_at(history, strain))
    if stiffness is None:
        return lacking("ties, rough contact and isotropic friction on one mesh")
    measured = "secant stiffness of DNS: " + _listed(stiffness, "{:.4g} kN/m")
    forces = _references(evidence, FORCE)
    if forces is None:
        return Judgement(measured, NOT_RUN, "there is no reference of all three")
    said = ", ".join(f"{INTERACTIONS[name]} {force} N" for name, force in forces.items())
    ordered = all_hold(
        (_larger(forces["tie"], forces["rough"]), _larger(forces["rough"], forces["isotropic"]))
    )
    judged = Judgement(f"{measured}; force of the reference: {said}", verdict(ordered))
    return at_full_strain(evidence, judged, _three(evidence), "isotropic")


def judge_motion_order(evidence: Evidence) -> Judgement:
    """K6: isotropic friction lets yarns move further out of the plane than ties."""
    motion = _compared(
        evidence, lambda history, strain: 1e3 * at_strain(history, strain, out_of_plane(history))
    )
    if motion is None:
        return lacking("ties, rough contact and isotropic friction on one mesh")
    measured = "largest |u_z| of DNS: " + _listed(motion, "{:.3g} mm")
    true = _references(evidence, LARGEST_U_Z)
    if true is None:
        return Judgement(measured, NOT_RUN, "there is no reference of all three")
    in_mm = {name: each.of(lambda value: 1e3 * value) for name, each in true.items()}
    said = ", ".join(f"{INTERACTIONS[name]} {each} mm" for name, each in in_mm.items())
    judged = Judgement(
        f"{measured}; of the reference: {said}",
        verdict(_larger(true["isotropic"], true["tie"])),
        "the place of rough contact is not stated",
    )
    return at_full_strain(evidence, judged, _three(evidence), "isotropic")


def judge_smaller_friction(evidence: Evidence) -> Judgement:
    """K7: ties > rough > isotropic with every smaller coefficient of friction."""
    histories = evidence.frictions
    names = {
        kind: [name for name in histories if evidence.scenes[name].interaction == kind]
        for kind in INTERACTIONS
    }
    if not all(names.values()):
        return lacking("ties, rough contact and several coefficients of friction, all else the same")
    forces: dict[str, Estimate] = {}
    for alike in names.values():
        known = {name: evidence.reference_of(name) for name in alike}
        base = next((name for name in alike if known[name].known), None)
        if base is None:
            return Judgement("", NOT_RUN, "there is no reference of all three interactions")
        for name in alike:
            carried = known[name]
            if not carried.known:
                carried = transferred_uncertainty(known[base], histories[base], histories[name])
            forces[name] = carried.at(FORCE, max(carried.strains(FORCE), default=0.0))
    (tie, *_), (rough, *_), slides = (names[kind] for kind in INTERACTIONS)
    slides = sorted(slides, key=lambda name: evidence.scenes[name].contact.friction, reverse=True)
    measured = f"force: tie {forces[tie]} N, rough {forces[rough]} N" + "".join(
        f", mu = {evidence.scenes[name].contact.friction:g} {forces[name]} N" for name in slides
    )
    pairs = [(tie, rough), *((rough, name) for name in slides)]
    judged = Judgement(
        measured,
        verdict(all_hold(_larger(forces[one], forces[other]) for one, other in pairs)),
        "the reference where it knows the problem; else uncertain by how much this discretisation is off where it does",
    )
    return at_full_strain(evidence, judged, histories.values(), tie)


def judge_untied_rows(evidence: Evidence) -> Judgement:
    """K11: without ties the outer rows slide, load is not transferred, and convergence suffers."""
    untied, contacts = evidence.direct.get("untied"), evidence.contacts.get("untied")
    tied = evidence.direct.get("isotropic")
    if untied is None or contacts is None or tied is None:
        return lacking("isotropic friction in all rows, and with ties in the outer ones")
    row = contacts["row"].to_numpy()
    outer = (row == 0) | (row == row.max())
    slip = np.nan_to_num(contacts["slip"].to_numpy()[-1])
    slips, rest = 1e3 * slip[outer].mean(), 1e3 * slip[~outer].mean()
    strain = common_strain([untied, tied])
    ratio = stiffness_at(untied, strain) / stiffness_at(tied, strain)
    iterations, usual = (int(history["newton_iterations"].sum()) for history in (untied, tied))
    judged = Judgement(
        f"force {ratio:.2f} times that with tied outer rows; mean slip {slips:.3g} mm in the outer rows and {rest:.3g} "
        f"mm in the others; {untied.sizes['increment'] - 1} increments with {iterations} Newton iterations against "
        f"{tied.sizes['increment'] - 1} with {usual}",
        verdict(slips >= SLIDE * rest > 0 and ratio <= TRANSFERRED and iterations >= HARDER * usual),
        f"sliding: {SLIDE:g} times the others' slip; not transferred: {TRANSFERRED:.0%} of the force; suffering: "
        f"{HARDER:g} times the iterations",
    )
    return at_full_strain(evidence, judged, [untied, tied], "untied")


def judge_stabilisation(evidence: Evidence) -> Judgement:
    """E1: what stabilisation dissipates is little beside the internal energy, at every increment."""
    histories = {name: history for name, history in evidence.direct.items() if name != "tie"}
    if not histories:
        return lacking("contact")
    shares = {name: stabilisation_share(history) for name, history in histories.items()}
    allowed = number(evidence.paper, "sec2.2", "stabilisation", "largest share of strain energy") / 100
    used = any(evidence.scenes[name].solver.stabilisation > 0 for name in shares)
    judged = Judgement(
        "largest share of the internal energy: "
        + ", ".join(f"{name} {share:.2%}" for name, share in shares.items()),
        verdict(max(shares.values()) <= allowed),
        "" if used else "no stabilisation was used, so that there is nothing to dissipate",
    )
    return at_full_strain(evidence, judged, histories.values(), next(iter(histories)))


CONTACT_RULES = {
    "K1": Rule(
        judge_no_contact,
        "no zone in the centre cell at 0.05 % strain",
        UNRECORDED,
        ("fig07_contact",),
        AGAIN,
    ),
    "K2": Rule(
        judge_zones,
        "four zones in the centre cell from 1.95 % strain to the end, and never more",
        UNRECORDED,
        ("fig07_contact",),
        AGAIN,
    ),
    "K3": Rule(
        judge_slope,
        "the force bends most between the increment before the first symmetric contact of the centre cell and "
        f"{JUST_AFTER:.1%} strain after it; slopes over {SPAN:.1%} before and after",
        UNRECORDED,
        ("fig07_contact",),
        AGAIN,
    ),
    "K4": Rule(
        judge_motion,
        f"the knit contracts, its largest |u_z| is {PRONOUNCED:g} d or more, and mirrored envelopes of u_z differ by "
        f"{SYMMETRIC:.0%} of it at most",
        UNRECORDED,
        ("fig08_out_of_plane",),
        AGAIN,
    ),
    "K5": Rule(
        judge_stiffness_order,
        "the reference's force at full strain: ties > rough > isotropic, each by more than both uncertainties",
        UNRECORDED,
        ("fig09_interactions", "interactions"),
        OF_REFERENCE,
    ),
    "K6": Rule(
        judge_motion_order,
        "the reference's largest |u_z| at full strain: isotropic > ties, by more than both uncertainties",
        UNRECORDED,
        ("fig09_interactions", "interactions"),
        OF_REFERENCE,
    ),
    "K7": Rule(
        judge_smaller_friction,
        "force at full strain: ties > rough > isotropic with Table 1's coefficient of friction and every smaller one, "
        "each by more than both uncertainties",
        AFTER,
        ("fig_inputs", "inputs"),
        OF_REFERENCE,
    ),
    "K11": Rule(
        judge_untied_rows,
        f"with untied outer rows, these slide {SLIDE:g} times as far as the others or more, the force is "
        f"{TRANSFERRED:.0%} of that with tied ones at most, and Newton's method takes {HARDER:g} times the iterations "
        "or more",
        UNRECORDED,
        ("interactions",),
        AGAIN,
    ),
    "E1": Rule(
        judge_stabilisation,
        "stabilisation dissipates 5 % of the internal energy at most, at every increment",
        UNRECORDED,
        ("interactions",),
        AGAIN,
    ),
}


def largest_bend(history: xr.Dataset) -> float:
    """Return the strain at which the slope of force against strain changes most, nan if it is too short.

    At every increment the mean slopes over `SPAN` before and after it are compared, so that small increments count
    no more than large ones.
    """
    strain, force = history["strain"].to_numpy(), history["force"].to_numpy()
    at = strain[(strain >= SPAN) & (strain <= strain[-1] - SPAN)]
    if not len(at):
        return np.nan
    before, here, after = (np.interp(at + step, strain, force) for step in (-SPAN, 0.0, SPAN))
    return float(at[np.argmax(np.abs(after - 2 * here + before))])


def asymmetry(history: xr.Dataset) -> float:
    """Return how much the envelopes of u_z of mirrored yarns differ at full load, over the largest |u_z|.

    Yarns are mirrored about the mid line between the free edges: the first one into the last.
    """
    u_z, yarn = history["centreline_displacement"].to_numpy()[-1, :, Z], history["yarn"].to_numpy()
    envelope = np.array([(u_z[yarn == i].min(), u_z[yarn == i].max()) for i in np.unique(yarn)])
    largest = np.abs(u_z).max()
    return float(np.abs(envelope - envelope[::-1]).max() / largest) if largest > 0 else 0.0


def _at_snapshot(contacts: xr.Dataset, number: int, holds: Callable[[np.ndarray, int], bool]) -> Judgement:
    """Judge the zones of the centre cell at a point of Fig. 7; withhold the verdict where no increment is there."""
    zones, strain = zones_of_cell(contacts), contacts["strain"].to_numpy()
    points = snapshots(contacts)
    counts = ", ".join(f"{zones[each.increment]} at {each.strain:.2%}" for each in points)
    measured = f"zones in the centre cell: {counts}; {zones[-1]} at the end, {strain[-1]:.2%}"
    point: Snapshot | None = next((each for each in points if each.number == number), None)
    if point is None or not point.exact:
        return Judgement(measured, NOT_RUN, f"no increment ends at the strain of point {number} of Fig. 7")
    return Judgement(measured, verdict(bool(holds(zones, point.increment))))


def _compared(evidence: Evidence, measure: Callable[[xr.Dataset, float], float]) -> dict[str, float] | None:
    """Return a measure of ties, rough contact and isotropic friction at their common strain, None if one lacks."""
    if not set(INTERACTIONS) <= set(evidence.direct):
        return None
    histories = {name: evidence.direct[name] for name in INTERACTIONS}
    strain = common_strain(histories.values())
    return {name: measure(history, strain) for name, history in histories.items()}


def _references(evidence: Evidence, quantity: str) -> dict[str, Estimate] | None:
    """Return a quantity of ties, rough contact and friction at the largest strain that the reference has of all."""
    found = {name: evidence.reference_of(name) for name in INTERACTIONS}
    strain = common_strain(_three(evidence))
    common = set.intersection(*(set(each.strains(quantity, strain)) for each in found.values()))
    return {name: each.at(quantity, max(common)) for name, each in found.items()} if common else None


def _larger(one: Estimate, other: Estimate) -> bool | None:
    """Whether one is larger than another; None where their uncertainties leave that open."""
    difference = Estimate(one.value - other.value, one.uncertainty + other.uncertainty)
    return difference.above(0.0)


def _three(evidence: Evidence) -> list[xr.Dataset]:
    return [evidence.direct[name] for name in INTERACTIONS]


def _listed(values: Mapping[str, float], form: str) -> str:
    """Name values from the largest to the smallest."""
    order = sorted(values, key=values.__getitem__, reverse=True)
    return ", ".join(f"{INTERACTIONS[name]} {form.format(values[name])}" for name in order)


# ---- The claim about local kinematics: K8 of ``resources/reference/paper_claims.csv``


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


KINEMATICS_RULES = {
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
