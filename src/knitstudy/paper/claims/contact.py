"""Claims about contact with friction: K1 to K8, K11, K12 and E1 of ``resources/reference/paper_claims.csv``."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import xarray as xr

from knitstudy.measures import centre_cell, response
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import INTERACTIONS, transferred_uncertainty
from knitstudy.paper.claims.evidence import NO_DIRECT, Evidence, Judgement, NotRun
from knitstudy.paper.claims.scale import COMPARABLE, Row, at_least, at_most, holds
from knitstudy.paper.sweeps import FRICTION

FIRST, LAST = 1, 4  # Points of Fig. 7 that claims K1 and K2 are about
# Claim K3: strain interval before and after a point over which the mean slope of the force is taken; largest strain
# between the first symmetric contact and the bend of the force that counts as "right after".
SPAN, JUST_AFTER = 1e-3, 5e-3
PRONOUNCED, SYMMETRIC = 0.1, 0.2  # Claim K4: least |u_z| over d; largest difference of envelopes
CONTRACTS = 0.01  # Claim K8: least contraction of the chord to a neighbour over the strain of the knit
NAMED = {"tie": "ties", "rough": "rough contact", "isotropic": "friction"}
FRICTION_SWEEP = "inputs-friction"  # Claim K7: scenes with other coefficients of friction


def judge_no_contact(evidence: Evidence) -> Judgement:
    """K1: no zone in the centre cell at point 1."""
    return _at_snapshot(evidence, FIRST, lambda zones, at, printed: zones[at] == printed)


def judge_zones(evidence: Evidence) -> Judgement:
    """K2: four zones in the centre cell from point 4 to the end, never more."""
    return _at_snapshot(
        evidence,
        LAST,
        lambda zones, at, printed: (zones[at:] == printed).all() and zones.max() == printed,
        (evidence.direct.get("isotropic", ""),),
    )


def _at_snapshot(
    evidence: Evidence,
    number: int,
    test: Callable[[np.ndarray, int, float], bool],
    scenes: tuple[str, ...] = (),
) -> Judgement:
    """Judge the zones of the centre cell at a point of Fig. 7; withhold the verdict where no increment ends there."""
    contacts = evidence.contact("isotropic")
    zones, points = centre_cell.zones_of_cell(contacts), centre_cell.snapshots(contacts)
    point = next((point for point in points if point.number == number), None)
    rows = [Row(f"zones at {other.strain:.2%} strain", str(zones[other.increment])) for other in points]
    rows.append(Row(f"zones at the end, {float(contacts['strain'][-1]):.2%}", str(zones[-1])))
    if point is None or not point.exact:
        raise NotRun(f"no increment ends at the strain of point {number} of Fig. 7", *rows)
    strain = f"{100 * centre_cell.SNAPSHOTS[number - 1]:g}%"
    printed = evidence.printed(
        "fig7", "course isotropic", f"contact zones in the centre cell at {strain} strain"
    )
    decisive = rows.pop(points.index(point))
    passed = bool(test(zones, point.increment, printed))
    return Judgement((holds(decisive.quantity, decisive.ours, f"{printed:g}", passed), *rows), scenes=scenes)


def judge_slope(evidence: Evidence) -> Judgement:
    """K3: the force bends most just after zones come into symmetric contact."""
    history, contacts = evidence.history("isotropic"), evidence.contact("isotropic")
    strain, bends = history["strain"].to_numpy(), largest_bend(history)
    first, scenes = centre_cell.first_symmetric_contact(contacts), (evidence.direct["isotropic"],)
    bent = f"{bends:.2%}" if bends > 0 else "none"
    met = "none" if first is None else f"{strain[first]:.2%}"
    # Contact began after the increment before.
    after = first is not None and strain[max(first - 1, 0)] <= bends <= strain[first] + JUST_AFTER
    return Judgement(
        (
            holds("force bends most at strain", bent, "just after contact", bool(after)),
            Row("first symmetric contact at strain", met, f"by {centre_cell.SNAPSHOTS[2]:.2%}"),
        ),
        f"slopes over {SPAN:.1%} before and after; {JUST_AFTER:.1%} counts as just after",
        scenes,
    )


def largest_bend(history: xr.Dataset) -> float:
    """Return the strain at which the mean slopes of force over `SPAN` before and after an increment differ most.

    nan if the history is too short.
    """
    strain, force = history["strain"].to_numpy(), history["force"].to_numpy()
    at = strain[(strain >= SPAN) & (strain <= strain[-1] - SPAN)]
    if not len(at):
        return np.nan
    before, here, after = (np.interp(at + step, strain, force) for step in (-SPAN, 0.0, SPAN))
    return float(at[np.argmax(np.abs(after - 2 * here + before))])


def judge_motion(evidence: Evidence) -> Judgement:
    """K4: the knit contracts and moves out of its plane, symmetrically about its mid line."""
    history = evidence.history("isotropic")
    arcs = evidence.fabric.arcs
    skew = asymmetry(history, None if arcs is None else arcs.yarn)
    contraction = response.transverse_contraction(history)
    largest = response.largest_out_of_plane(history) / evidence.diameter
    return Judgement(
        (
            at_least("largest |u_z|", largest, "pronounced", PRONOUNCED, sense=0.0, text=f"{largest:.2f} d"),
            at_most("mirrored envelopes of u_z differ by", skew, "symmetric", SYMMETRIC, text=f"{skew:.0%}"),
            holds("transverse contraction", f"{contraction:.2%}", "> 0", contraction > 0),
        ),
        f"pronounced: {PRONOUNCED:g} d or more; symmetric: up to {SYMMETRIC:.0%}",
        (evidence.direct["isotropic"],),
    )


def asymmetry(history: xr.Dataset, whole: np.ndarray | None = None) -> float:
    """Return the difference of the envelopes of u_z of yarns mirrored about the mid line, over the largest |u_z|.

    `whole` (Y,) holds for every piece in the history the number of its yarn.
    """
    u_z, yarn = response.motion(history)[-1, :, response.Z], history["yarn"].to_numpy()
    yarn = yarn if whole is None else whole[yarn]
    envelope = np.array([(u_z[yarn == i].min(), u_z[yarn == i].max()) for i in np.unique(yarn)])
    largest = np.abs(u_z).max()
    return float(np.abs(envelope - envelope[::-1]).max() / largest) if largest > 0 else 0.0


def judge_kinematics(evidence: Evidence) -> Judgement:
    """K8: at every crossing of the centre cell each yarn turns and contracts, surfaces slide, and contact areas spin.

    A slide is of one surface past the other: of both sides of a crossing the larger one counts, as in K12.
    """
    contacts = _with_motions(evidence)
    here, strain = centre_cell.centre_cell(contacts), float(contacts["strain"][-1])
    angle, slide = np.degrees(np.arctan(strain)), 1e3 * strain * evidence.diameter
    sliding = 1e3 * np.abs(contacts["sliding"].to_numpy())[-1, here]
    motions = (
        ("slide along the yarns", "mm", "slides", sliding.max(axis=-1), slide),
        (
            "spin of the contact areas",
            "degrees",
            "spin",
            np.degrees(np.abs(contacts["contact_spin"].to_numpy()))[-1, here],
            angle,
        ),
        (
            "rotation of the sections",
            "degrees",
            "rotates",
            np.degrees(centre_cell.rotation_angle(contacts))[-1, here],
            angle,
        ),
        (
            "contraction of the chord to a neighbour",
            "%",
            "contracts",
            100 * centre_cell.closest_neighbour(contacts)[-1, here],
            100 * CONTRACTS * strain,
        ),
    )
    rows = []
    for quantity, unit, paper, values, bar in motions:
        # An open crossing has no sliding: nan counts as no motion.
        least = float(np.nan_to_num(values).min())
        text = f"{values.min():.2g} to {values.max():.2g} {unit}"
        rows.append(at_least(quantity, least, paper, bar, sense=0.0, text=text))
    rows.append(Row("slide of both sides", f"{sliding.min():.2g} to {sliding.max():.2g} mm"))
    return Judgement(
        tuple(sorted(rows, key=lambda row: row.margin)),
        f"rotation and spin from {angle:.2g} degrees on, sliding from {slide:.2g} mm, contraction from "
        f"{100 * CONTRACTS * strain:.2g} %",
        (evidence.direct["isotropic"],),
    )


def _with_motions(evidence: Evidence) -> xr.Dataset:
    """Return the contacts with friction; raise `NotRun` if their history holds no motion of sections."""
    contacts = evidence.contact("isotropic")
    if "section_rotation" not in contacts:
        raise NotRun("the history holds no motion of the sections")
    return contacts


def judge_order_of_motions(evidence: Evidence) -> Judgement:
    """K12: yarns of the centre cell rotate before they slide."""
    contacts = _with_motions(evidence)
    here, sliding = centre_cell.centre_cell(contacts), np.abs(contacts["sliding"].to_numpy()).max(axis=-1)
    turned = _half(contacts, centre_cell.rotation_angle(contacts)[:, here])
    slid = _half(contacts, sliding[:, here])
    later, step = slid[0] - turned[0], max(turned[1], slid[1])
    first = bool(later > 0) if abs(later) > step else None
    return Judgement(
        (
            holds("half of the rotation after half of the sliding", f"{-later:+.2%}", "before", first),
            Row("strain at half of the rotation", f"{turned[0]:.2%}"),
            Row("strain at half of the sliding", f"{slid[0]:.2%}"),
        ),
        f"increments there take {step:.2%} strain",
        (evidence.direct["isotropic"],),
    )


def _half(contacts: xr.Dataset, values: np.ndarray) -> tuple[float, float]:
    """Return the first strain at which the mean of values (I, ...) is half of the last one, and its increment."""
    strain, mean = contacts["strain"].to_numpy(), np.nan_to_num(values.reshape(len(values), -1)).mean(axis=1)
    last = max(int(np.argmax(mean >= 0.5 * mean[-1])), 1)
    step = slice(last - 1, last + 1)
    return float(np.interp(0.5 * mean[-1], mean[step], strain[step])), float(np.ptp(strain[step]))


def judge_order(quantity: str, order: tuple[str, ...], evidence: Evidence) -> Judgement:
    """K5, K6: the reference's values of a quantity fall along interactions, each by more than both uncertainties."""
    histories = {kind: evidence.history(kind) for kind in INTERACTIONS}
    unit, values = response.QUANTITIES[quantity]
    unit, scale = ("mm", 1e3) if unit == "m" else (unit, 1.0)
    strain = response.common_strain(histories.values())
    shown = []
    for kind, history in histories.items():
        value = scale * response.at_strain(history, strain, values(history, history))
        shown.append(Row(f"{quantity} of DNS, {INTERACTIONS[kind]}", f"{value:.3g} {unit}"))
    references = {kind: evidence.reference_of(kind) for kind in order}
    common = set.intersection(
        *(set(reference.strains(quantity, strain)) for reference in references.values())
    )
    if not common:
        raise NotRun("there is no reference of all of these", *shown)
    known = {
        kind: reference.at(quantity, max(common)).of(lambda value: scale * value)
        for kind, reference in references.items()
    }
    tests = [_larger(quantity, *pair, known) for pair in pairwise(order)]
    shown = [
        *(
            Row(f"{quantity} of the reference, {INTERACTIONS[kind]}", f"{value} {unit}")
            for kind, value in known.items()
        ),
        *shown,
    ]
    return Judgement((*tests, *shown), scenes=_three(evidence))


def _larger(quantity: str, one: str, other: str, values: dict[str, Estimate]) -> Row:
    """Return the row of a value that must exceed another by more than both uncertainties."""
    ratio = values[one].value / values[other].value
    name = f"{quantity}, {NAMED.get(one, one)} over {NAMED.get(other, other)}"
    return holds(name, f"{ratio:.2f}", "> 1", values[one].larger_than(values[other]), margin=ratio)


def judge_smaller_friction(evidence: Evidence) -> Judgement:
    """K7: ties > rough > isotropic with every smaller coefficient of friction."""
    smaller = [
        name
        for name in evidence.histories
        if name.startswith(FRICTION_SWEEP) and evidence.scenes[name].contact.friction <= FRICTION
    ]
    if not smaller or not set(INTERACTIONS) <= set(evidence.direct):
        raise NotRun(
            f"{NO_DIRECT} ties, rough contact and several coefficients of friction, all else the same"
        )
    isotropic, tie, rough = _three(evidence)
    friction = {name: evidence.scenes[name].contact.friction for name in (isotropic, *smaller)}
    slides = sorted(friction, key=friction.__getitem__, reverse=True)
    called = {tie: "ties", rough: "rough contact"} | {name: f"mu = {friction[name]:g}" for name in slides}
    forces: dict[str, Estimate] = {}
    for name, label in called.items():
        base, reference = evidence.direct[evidence.scenes[name].interaction], evidence.reference_for(name)
        if not reference.known:
            reference = transferred_uncertainty(
                evidence.reference_for(base), evidence.histories[base], evidence.histories[name]
            )
        if not reference.known:
            raise NotRun("there is no reference of all three interactions")
        forces[label] = reference.at(response.FORCE, max(reference.strains(response.FORCE), default=0.0))
    tests = [_larger("force", "rough contact", called[name], forces) for name in slides]
    tests.append(_larger("force", "ties", "rough contact", forces))
    tests.sort(key=lambda row: row.margin)
    return Judgement(
        (*tests, *(Row(f"force, {label}", f"{force} N") for label, force in forces.items())),
        "the reference where it knows the problem; else uncertain by how much this discretisation is off where it does",
        (tie, rough, *slides),
    )


def judge_untied_rows(evidence: Evidence) -> Judgement:
    """K11: without ties the outer rows slide, load is not transferred, and convergence suffers.

    Outer yarns slide off: how far yarns move past each other counts, not the slip of friction where they still touch.
    """
    untied, tied = evidence.history("untied"), evidence.history("isotropic")
    strain = response.common_strain([untied, tied])
    contacts = evidence.contact("untied")
    contacts = contacts.isel(increment=int(np.abs(contacts["strain"].to_numpy() - strain).argmin()))
    row, slip = contacts["row"].to_numpy(), 1e3 * np.nan_to_num(contacts["slip"].to_numpy())
    outer = (row == 0) | (row == row.max())
    moved = 1e3 * np.linalg.norm(contacts["relative_displacement"].to_numpy(), axis=-1)
    slides, others = moved[outer].mean(), moved[~outer].mean()
    force = response.stiffness_at(untied, strain) / response.stiffness_at(tied, strain)
    iterations, usual = (int(history["newton_iterations"].sum()) for history in (untied, tied))
    scenes = [evidence.scenes[evidence.direct[kind]] for kind in ("untied", "isotropic")]
    damped = scenes[0].solver.stabilisation > 0 == scenes[1].solver.stabilisation
    ended = float(untied["strain"][-1]) < 0.999 * scenes[0].load.strain
    slower = at_least(
        "Newton iterations over those with tied rows", iterations / usual, "more", COMPARABLE, sense=1.0
    )
    if damped or ended:
        why = "needs stabilisation" if damped else f"ended at {strain:.2%} strain"
        slower = holds(slower.quantity, f"{slower.ours}; {why}", "more", True)
    return Judgement(
        (
            at_most("force over that with tied outer rows", force, "less", 1 / COMPARABLE, sense=1.0),
            at_least(
                "motion past each other, outer over other rows",
                slides / others,
                "slide",
                COMPARABLE,
                sense=1.0,
            ),
            slower,
            Row("motion past each other, outer rows", f"{slides:.3g} mm"),
            Row("motion past each other, other rows", f"{others:.3g} mm"),
            Row("mean slip of friction, outer rows", f"{slip[outer].mean():.3g} mm"),
            Row("mean slip of friction, other rows", f"{slip[~outer].mean():.3g} mm"),
        ),
        scenes=(evidence.direct["isotropic"],),
    )


def judge_stabilisation(evidence: Evidence) -> Judgement:
    """E1: in the runs that the paper reports, with tied outer rows, stabilisation dissipates little at full load."""
    allowed = evidence.printed("sec2.2", "stabilisation", "largest share of strain energy") / 100
    names = [evidence.direct[kind] for kind in ("isotropic", "rough") if kind in evidence.direct]
    if not names:
        raise NotRun("the study has no direct simulation with contact")
    rows = []
    for name in names:
        share = _stabilised(evidence.histories[name])
        rows.append(
            at_most(
                f"share of the strain energy, {name}", share, f"{allowed:.0%}", allowed, text=f"{share:.2%}"
            )
        )
    if (name := evidence.direct.get("untied")) in evidence.histories:
        rows.append(Row(f"the same, {name}", f"{_stabilised(evidence.histories[name]):.2%}"))
    return Judgement(tuple(rows), "the sentence is of a setting of the solver", tuple(names))


def _stabilised(history: xr.Dataset) -> float:
    """Return the energy that stabilisation has dissipated over the strain energy, at full load."""
    energy = history["energy"].isel(increment=-1)
    return float(energy.sel(form="stabilisation") / energy.sel(form="internal"))


def _three(evidence: Evidence) -> tuple[str, ...]:
    """Return the scenes of isotropic friction, ties and rough contact."""
    return tuple(evidence.direct[kind] for kind in ("isotropic", "tie", "rough"))
