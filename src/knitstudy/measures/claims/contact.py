"""Claims about contact with friction: K1 to K8, K11, K12 and E1 of ``resources/reference/paper_claims.csv``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import xarray as xr

from knitstudy.geometry.fabric_file import fabric_of
from knitstudy.measures import centre_cell, response
from knitstudy.measures.claims.evidence import NO_DIRECT, Evidence, Judgement, Measured, NotRun, verdict
from knitstudy.measures.discretisation import INTERACTIONS, made_of
from knitstudy.measures.estimate import Estimate, all_hold
from knitstudy.measures.reference import transferred_uncertainty
from knitstudy.measures.sweeps import FRICTION

FIRST, LAST = 1, 4  # Points of Fig. 7 that claims K1 and K2 are about
# Claim K3: strain interval before and after a point over which the mean slope of the force is taken; largest strain
# between the first symmetric contact and the bend of the force that counts as "right after".
SPAN, JUST_AFTER = 1e-3, 5e-3
PRONOUNCED, SYMMETRIC = 0.1, 0.2  # Claim K4: least |u_z| over d; largest difference of envelopes
CONTRACTS = 0.01  # Claim K8: least contraction of the chord to a neighbour over the strain of the knit
# Claim K11: slip of the outer rows over that of the others; share of the force below which load is not
# transferred; factor of iterations that counts as worse convergence.
SLIDE, TRANSFERRED, HARDER = 1.5, 0.9, 1.2
NAMED = {"tie": "ties", "rough": "rough contact", "isotropic": "friction"}
FRICTION_SWEEP = "inputs-friction"  # Claim K7: scenes with other coefficients of friction


def judge_no_contact(evidence: Evidence) -> Judgement:
    """K1: no zone in the centre cell at point 1."""
    wanted = evidence.printed("fig7", "course isotropic", "contact zones in the centre cell at 0.05% strain")
    return _at_snapshot(evidence, FIRST, wanted, lambda zones, at: zones[at] == wanted)


def judge_zones(evidence: Evidence) -> Judgement:
    """K2: four zones in the centre cell from point 4 to the end, never more."""
    wanted = evidence.printed("fig7", "course isotropic", "contact zones in the centre cell at 1.95% strain")
    judged = _at_snapshot(
        evidence, LAST, wanted, lambda zones, at: (zones[at:] == wanted).all() and zones.max() == wanted
    )
    return replace(judged, scenes=(evidence.direct["isotropic"],))


def _at_snapshot(
    evidence: Evidence, number: int, wanted: float, holds: Callable[[np.ndarray, int], bool]
) -> Judgement:
    """Judge the zones of the centre cell at a point of Fig. 7; withhold the verdict where no increment is there."""
    contacts = evidence.contact("isotropic")
    zones, points = centre_cell.zones_of_cell(contacts), centre_cell.snapshots(contacts)
    measured = [Measured(f"zones at {each.strain:.2%} strain", str(zones[each.increment])) for each in points]
    measured.append(Measured(f"zones at the end, {float(contacts['strain'][-1]):.2%}", str(zones[-1])))
    point = next((each for each in points if each.number == number), None)
    if point is not None:  # comes first
        measured.insert(0, measured.pop(points.index(point))._replace(paper=f"{wanted:g}"))
    if point is None or not point.exact:
        raise NotRun(f"no increment ends at the strain of point {number} of Fig. 7", *measured)
    return Judgement(tuple(measured), verdict(bool(holds(zones, point.increment))))


def judge_slope(evidence: Evidence) -> Judgement:
    """K3: the force bends most just after zones come into symmetric contact."""
    history, contacts = evidence.history("isotropic"), evidence.contact("isotropic")
    strain, bends = history["strain"].to_numpy(), largest_bend(history)
    first, scenes = centre_cell.first_symmetric_contact(contacts), (evidence.direct["isotropic"],)
    bent = f"{bends:.2%}" if bends > 0 else "none"
    met = "none" if first is None else f"{strain[first]:.2%}"
    bend = Measured("force bends most at strain", bent, "just after contact")
    begins = Measured("first symmetric contact at strain", met, f"by {centre_cell.SNAPSHOTS[2]:.2%}")
    if first is None:
        return Judgement((begins, bend), verdict(False), scenes=scenes)
    # Contact began after the increment before.
    after = strain[max(first - 1, 0)] <= bends <= strain[first] + JUST_AFTER
    return Judgement(
        (bend, begins),
        verdict(bool(after)),
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
    arcs = fabric_of(evidence.geometry).arcs
    skew = asymmetry(history, None if arcs is None else arcs.yarn)
    contraction = response.transverse_contraction(history)
    largest = response.largest_out_of_plane(history) / evidence.diameter
    return Judgement(
        (
            Measured("largest |u_z|", f"{largest:.2f} d", "pronounced"),
            Measured("mirrored envelopes of u_z differ by", f"{skew:.0%}", "symmetric"),
            Measured("transverse contraction", f"{contraction:.2%}", "> 0"),
        ),
        verdict(contraction > 0 and largest >= PRONOUNCED and skew <= SYMMETRIC),
        f"pronounced from {PRONOUNCED:g} d on, symmetric up to {SYMMETRIC:.0%}",
        (evidence.direct["isotropic"],),
    )


def asymmetry(history: xr.Dataset, whole: np.ndarray | None = None) -> float:
    """Return the difference of the envelopes of u_z of yarns mirrored about the mid line, over the largest |u_z|.

    `whole` (Y,) says of every yarn of the history which one it is a piece of.
    """
    u_z, yarn = history["centreline_displacement"].to_numpy()[-1, :, response.Z], history["yarn"].to_numpy()
    yarn = yarn if whole is None else whole[yarn]
    envelope = np.array([(u_z[yarn == i].min(), u_z[yarn == i].max()) for i in np.unique(yarn)])
    largest = np.abs(u_z).max()
    return float(np.abs(envelope - envelope[::-1]).max() / largest) if largest > 0 else 0.0


def judge_kinematics(evidence: Evidence) -> Judgement:
    """K8: at every crossing of the centre cell each yarn turns, contracts and slides, and its contact area spins."""
    contacts = evidence.contact("isotropic")
    if "section_rotation" not in contacts:
        raise NotRun("the history holds no motion of the sections")
    motions = (
        np.degrees(centre_cell.rotation_angle(contacts)),
        100 * centre_cell.closest_neighbour(contacts),
        1e3 * np.abs(contacts["sliding"].to_numpy()),
        np.degrees(np.abs(contacts["contact_spin"].to_numpy())),
    )
    turned, closer, slid, spun = (each[-1, centre_cell.centre_cell(contacts)] for each in motions)
    said = [f"{each.min():.2g} to {each.max():.2g}" for each in (turned, closer, slid, spun)]
    rows = (
        Measured("rotation of the sections", f"{said[0]} degrees", "rotates"),
        Measured("contraction of the chord to a neighbour", f"{said[1]} %", "contracts"),
        Measured("slide along the yarns", f"{said[2]} mm", "slides"),
        Measured("spin of the contact areas", f"{said[3]} degrees", "spin"),
    )
    strain = float(contacts["strain"][-1])
    angle, way = np.degrees(np.arctan(strain)), 1e3 * strain * evidence.diameter
    # An open crossing has no sliding: comparisons with nan do not hold.
    holds = [turned >= angle, closer >= 100 * CONTRACTS * strain, slid >= way, spun >= angle]
    held = [bool(each.all()) for each in holds]
    return Judgement(
        tuple(sorted(rows, key=dict(zip(rows, held, strict=True)).get)),  # failures first
        verdict(all(held)),
        f"rotation and spin from {angle:.2g} degrees on, sliding from {way:.2g} mm, contraction from "
        f"{100 * CONTRACTS * strain:.2g} %",
        (evidence.direct["isotropic"],),
    )


def judge_order_of_motions(evidence: Evidence) -> Judgement:
    """K12: yarns of the centre cell rotate before they slide."""
    contacts = evidence.contact("isotropic")
    if "section_rotation" not in contacts:
        raise NotRun("the history holds no motion of the sections")
    here, sliding = centre_cell.centre_cell(contacts), np.abs(contacts["sliding"].to_numpy()).max(axis=-1)
    turned = _half(contacts, centre_cell.rotation_angle(contacts)[:, here])
    slid = _half(contacts, sliding[:, here])
    later, step = slid[0] - turned[0], max(turned[1], slid[1])
    return Judgement(
        (
            Measured(
                "half of the rotation after half of the sliding", f"{turned[0] - slid[0]:+.2%}", "before"
            ),
            Measured("strain at half of the rotation", f"{turned[0]:.2%}"),
            Measured("strain at half of the sliding", f"{slid[0]:.2%}"),
        ),
        verdict(bool(later > 0) if abs(later) > step else None),
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
    dns = {
        kind: scale * response.at_strain(each, strain, values(each, each)) for kind, each in histories.items()
    }
    said = [
        Measured(f"{quantity} of DNS, {INTERACTIONS[kind]}", f"{value:.3g} {unit}")
        for kind, value in dns.items()
    ]
    known = {kind: evidence.reference_of(kind) for kind in order}
    common = set.intersection(*(set(each.strains(quantity, strain)) for each in known.values()))
    if not common:
        raise NotRun("there is no reference of all of these", *said)
    true = {
        kind: each.at(quantity, max(common)).of(lambda value: scale * value) for kind, each in known.items()
    }
    told = [
        Measured(f"{quantity} of the reference, {INTERACTIONS[kind]}", f"{each} {unit}")
        for kind, each in true.items()
    ]
    first, last = order[0], order[-1]
    ratio = f"{true[first].value / true[last].value:.2f}"
    whole = Measured(f"{quantity}, {NAMED[first]} over {NAMED[last]}", ratio, "> 1")
    return Judgement(
        (whole, *told, *said),
        verdict(all_hold(true[one].larger_than(true[other]) for one, other in pairwise(order))),
        scenes=_three(evidence),
    )


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
    forces: dict[str, Estimate] = {}
    for name in (*_three(evidence), *smaller):
        base, of = evidence.direct[evidence.scenes[name].interaction], evidence.reference_for(name)
        if not of.known:
            of = transferred_uncertainty(
                evidence.reference_for(base), evidence.histories[base], evidence.histories[name]
            )
        if not of.known:
            raise NotRun("there is no reference of all three interactions")
        forces[name] = of.at(response.FORCE, max(of.strains(response.FORCE), default=0.0))
    isotropic, tie, rough = _three(evidence)
    friction = {name: evidence.scenes[name].contact.friction for name in (isotropic, *smaller)}
    slides = sorted(friction, key=friction.__getitem__, reverse=True)
    largest = max(forces[name].value for name in slides)
    said = [Measured("force, rough contact over friction", f"{forces[rough].value / largest:.2f}", "> 1")]
    said += [Measured("force, tie constraint", f"{forces[tie]} N")]
    said += [Measured("force, rough contact", f"{forces[rough]} N")]
    said += [Measured(f"force, mu = {friction[name]:g}", f"{forces[name]} N") for name in slides]
    holds = [forces[tie].larger_than(forces[rough])]
    holds += [forces[rough].larger_than(forces[name]) for name in slides]
    return Judgement(
        tuple(said),
        verdict(all_hold(holds)),
        "the reference where it knows the problem; else uncertain by how much this discretisation is off where it does",
        (tie, rough, *slides),
    )


def judge_untied_rows(evidence: Evidence) -> Judgement:
    """K11: without ties the outer rows slide, load is not transferred, and convergence suffers."""
    untied, tied = evidence.history("untied"), evidence.history("isotropic")
    strain = response.common_strain([untied, tied])
    contacts = evidence.contact("untied")
    contacts = contacts.isel(increment=int(np.abs(contacts["strain"].to_numpy() - strain).argmin()))
    row, slip = contacts["row"].to_numpy(), 1e3 * np.nan_to_num(contacts["slip"].to_numpy())
    outer = (row == 0) | (row == row.max())
    slips, rest = slip[outer].mean(), slip[~outer].mean()
    moved = 1e3 * np.linalg.norm(contacts["relative_displacement"].to_numpy(), axis=-1)
    ratio = response.stiffness_at(untied, strain) / response.stiffness_at(tied, strain)
    iterations, usual = (int(history["newton_iterations"].sum()) for history in (untied, tied))
    scenes = [evidence.scenes[evidence.direct[kind]] for kind in ("untied", "isotropic")]
    damped = scenes[0].solver.stabilisation > 0 == scenes[1].solver.stabilisation
    ended = float(untied["strain"][-1]) < 0.999 * scenes[0].load.strain
    return Judgement(
        (
            Measured("force over that with tied outer rows", f"{ratio:.2f}", "less"),
            Measured("mean slip of the outer rows over that of the others", f"{slips / rest:.2g}", "slide"),
            Measured("mean slip of the outer rows", f"{slips:.3g} mm"),
            Measured("motion past each other, outer rows", f"{moved[outer].mean():.3g} mm"),
            Measured("motion past each other, other rows", f"{moved[~outer].mean():.3g} mm"),
            Measured(
                "Newton iterations over those with tied outer rows", f"{iterations / usual:.2g}", "more"
            ),
            Measured("stabilisation that tied rows do not need", "yes" if damped else "no"),
            *([Measured("ended at strain", f"{strain:.2%}")] if ended else []),
        ),
        verdict(
            slips >= SLIDE * rest > 0
            and ratio <= TRANSFERRED
            and (damped or ended or iterations >= HARDER * usual)
        ),
        f"sliding: {SLIDE:g} times the others' slip; not transferred: {TRANSFERRED:.0%} of the force; suffering: "
        f"{HARDER:g} times the iterations",
        (evidence.direct["isotropic"],),
    )


def judge_stabilisation(evidence: Evidence) -> Judgement:
    """E1: the energy that stabilisation dissipates is small beside the internal energy, at every increment."""
    alike = made_of(evidence.scenes[next(iter(evidence.direct.values()))])
    names = [
        name
        for name in evidence.histories
        if (evidence.scenes[name].value("solver.stabilisation") or 0) > 0
        and evidence.scenes[name].kind.interaction.touches
        and made_of(evidence.scenes[name]) == alike
    ]
    if not names:
        raise NotRun("the study has no simulation with contact that uses stabilisation")
    allowed = evidence.printed("sec2.2", "stabilisation", "largest share of strain energy") / 100
    said, largest = [], []
    for name in names:
        history = evidence.histories[name]
        energy, strain = history["energy"], history["strain"].to_numpy()
        share = (energy.sel(form="stabilisation") / energy.sel(form="internal")).to_numpy()
        largest.append(float(np.nanmax(share)))
        above = np.flatnonzero(share > allowed)
        said.append(Measured(f"largest share, {name}", f"{largest[-1]:.2%}"))
        if len(above):
            said.append(Measured(f"strain to which it is above {allowed:.0%}", f"{strain[above[-1]]:.2%}"))
        said.append(Measured(f"share at {strain[-1]:.2%} strain", f"{share[-1]:.2%}"))
    holds = max(largest) <= allowed
    return Judgement(
        (Measured("largest share of the energy", f"{max(largest):.1%}", f"at most {allowed:.0%}"), *said),
        verdict(holds),
        scenes=tuple(names) if holds else (),  # one increment above is enough, whatever follows
    )


def _three(evidence: Evidence) -> tuple[str, ...]:
    """Return the scenes of isotropic friction, ties and rough contact."""
    return tuple(evidence.direct[kind] for kind in ("isotropic", "tie", "rough"))
