"""Claims about contact with friction: K1 to K8, K11 and E1 of ``resources/reference/paper_claims.csv``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import xarray as xr

from knitstudy.measures import centre_cell, response
from knitstudy.measures.claims.evidence import NO_DIRECT, Evidence, Judgement, NotRun, verdict
from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.measures.estimate import Estimate, all_hold
from knitstudy.measures.history_checks import stabilisation_share
from knitstudy.measures.reference import reference_of, transferred_uncertainty
from knitstudy.measures.sweeps import FRICTION

FIRST, LAST = 1, 4  # Points of Fig. 7 that claims K1 and K2 are about
# Claim K3: strain interval before and after a point over which the mean slope of the force is taken; largest strain
# between the first symmetric contact and the bend of the force that counts as "right after".
SPAN, JUST_AFTER = 1e-3, 5e-3
PRONOUNCED, SYMMETRIC = 0.1, 0.2  # Claim K4: least |u_z| over d; largest difference of envelopes
# Claim K8: least rotation of a section [degrees]; least sliding over the yarn diameter, more than the elastic
# slip of surfaces that stick; least angle of a contact area about the yarn [degrees]: facets are 15 degrees wide,
# and the centroid of few points moves by a degree or two where these come into contact or open.
TURNS, SLIDES, SPINS = 1.0, 0.02, 3.0
# Claim K11: slip of the outer rows over that of the others; share of the force below which load is not
# transferred; factor of iterations that counts as worse convergence.
SLIDE, TRANSFERRED, HARDER = 1.5, 0.9, 1.2
FRICTION_SWEEP = "inputs-friction"  # Claim K7: scenes with other coefficients of friction


def judge_no_contact(evidence: Evidence) -> Judgement:
    """K1: no zone in the centre cell at point 1."""
    wanted = evidence.printed("fig7", "course isotropic", "contact zones in the centre cell at 0.05% strain")
    return _at_snapshot(evidence, FIRST, lambda zones, at: zones[at] == wanted)


def judge_zones(evidence: Evidence) -> Judgement:
    """K2: four zones in the centre cell from point 4 to the end, never more."""
    wanted = evidence.printed("fig7", "course isotropic", "contact zones in the centre cell at 1.95% strain")
    judged = _at_snapshot(
        evidence, LAST, lambda zones, at: (zones[at:] == wanted).all() and zones.max() == wanted
    )
    return replace(judged, scenes=(evidence.direct["isotropic"],))


def _at_snapshot(evidence: Evidence, number: int, holds: Callable[[np.ndarray, int], bool]) -> Judgement:
    """Judge the zones of the centre cell at a point of Fig. 7; withhold the verdict where no increment is there."""
    contacts = evidence.contact("isotropic")
    zones, points = centre_cell.zones_of_cell(contacts), centre_cell.snapshots(contacts)
    counts = ", ".join(f"{zones[each.increment]} at {each.strain:.2%}" for each in points)
    end = f"{zones[-1]} at the end, {float(contacts['strain'][-1]):.2%}"
    measured = f"zones in the centre cell: {counts}; {end}"
    point = next((each for each in points if each.number == number), None)
    if point is None or not point.exact:
        raise NotRun(f"no increment ends at the strain of point {number} of Fig. 7", measured)
    return Judgement(measured, verdict(bool(holds(zones, point.increment))))


def judge_slope(evidence: Evidence) -> Judgement:
    """K3: the force bends most just after zones come into symmetric contact."""
    history, contacts = evidence.history("isotropic"), evidence.contact("isotropic")
    strain, bends = history["strain"].to_numpy(), largest_bend(history)
    first, scenes = centre_cell.first_symmetric_contact(contacts), (evidence.direct["isotropic"],)
    bend = f"force bends most at {bends:.2%}" if bends > 0 else "force is not followed far enough to bend"
    if first is None:
        return Judgement(
            f"no symmetric contact in the centre cell; the {bend}", verdict(False), scenes=scenes
        )
    # Contact began after the increment before.
    after = strain[max(first - 1, 0)] <= bends <= strain[first] + JUST_AFTER
    return Judgement(
        f"first symmetric contact in the centre cell at {strain[first]:.2%} strain; the {bend}",
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
    contraction, skew = response.transverse_contraction(history), asymmetry(history)
    largest = response.largest_out_of_plane(history) / evidence.diameter
    return Judgement(
        f"transverse contraction {contraction:.2%}; largest |u_z| {largest:.2f} d; mirrored envelopes of "
        f"u_z differ by {skew:.0%} of it",
        verdict(contraction > 0 and largest >= PRONOUNCED and skew <= SYMMETRIC),
        f"pronounced from {PRONOUNCED:g} d on, symmetric up to {SYMMETRIC:.0%}",
        (evidence.direct["isotropic"],),
    )


def asymmetry(history: xr.Dataset) -> float:
    """Return the difference of the envelopes of u_z of yarns mirrored about the mid line, over the largest |u_z|."""
    u_z, yarn = history["centreline_displacement"].to_numpy()[-1, :, response.Z], history["yarn"].to_numpy()
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
        1e3 * np.abs(contacts["sliding"].to_numpy()).max(axis=-1),  # along the yarn along which it is larger
        np.degrees(np.abs(contacts["contact_spin"].to_numpy())),
    )
    turned, closer, slid, spun = (each[:, centre_cell.centre_cell(contacts)] for each in motions)
    said = [f"{each[-1].min():.2g} to {each[-1].max():.2g}" for each in (turned, closer, slid, spun)]
    # An open crossing has no sliding: comparisons with nan do not hold.
    holds = [
        turned[-1] >= TURNS,
        closer[-1] > 0,
        slid[-1] >= 1e3 * SLIDES * evidence.diameter,
        spun[-1] >= SPINS,
    ]
    return Judgement(
        f"centre cell: sections turn by {said[0]} degrees, crossings come {said[1]} % of the chord closer to a "
        f"neighbour on the yarn, surfaces slide {said[2]} mm, contact areas spin by {said[3]} degrees about the yarns; "
        f"half of the rotation at {_half(contacts, turned):.2%} strain, half of the sliding at "
        f"{_half(contacts, slid):.2%}",
        verdict(all(each.all() for each in holds)),
        f"rotation from {TURNS:g} degree on, sliding from {SLIDES:g} d, spin from {SPINS:g} degrees; contraction by "
        "its sign; the order of the states does not judge",
        (evidence.direct["isotropic"],),
    )


def _half(contacts: xr.Dataset, values: np.ndarray) -> float:
    """Return the first strain at which the mean of values (I, ...) over all places is half of the last one."""
    mean = np.nan_to_num(values.reshape(len(values), -1)).mean(axis=1)
    return float(contacts["strain"][int(np.argmax(mean >= 0.5 * mean[-1]))])


def judge_stiffness_order(evidence: Evidence) -> Judgement:
    """K5: ties are stiffer than rough contact, and that is stiffer than isotropic friction."""
    stiffness = _compared(evidence, lambda history, strain: 1e-3 * response.stiffness_at(history, strain))
    measured = f"secant stiffness of DNS: {_listed(stiffness, '{:.4g} kN/m')}"
    forces = _references(evidence, response.FORCE, measured)
    said = ", ".join(f"{INTERACTIONS[kind]} {force} N" for kind, force in forces.items())
    pairs = (("tie", "rough"), ("rough", "isotropic"))
    ordered = all_hold(forces[one].larger_than(forces[other]) for one, other in pairs)
    return Judgement(f"{measured}; force of the reference: {said}", verdict(ordered), "", _three(evidence))


def judge_motion_order(evidence: Evidence) -> Judgement:
    """K6: isotropic friction lets yarns move further out of the plane than ties."""
    motion = _compared(
        evidence, lambda each, strain: 1e3 * response.at_strain(each, strain, response.out_of_plane(each))
    )
    measured = f"largest |u_z| of DNS: {_listed(motion, '{:.3g} mm')}"
    true = _references(evidence, response.LARGEST_U_Z, measured)
    in_mm = {kind: each.of(lambda value: 1e3 * value) for kind, each in true.items()}
    said = ", ".join(f"{INTERACTIONS[kind]} {each} mm" for kind, each in in_mm.items())
    holds = true["isotropic"].larger_than(true["tie"])
    note = "the place of rough contact is not stated"
    return Judgement(f"{measured}; of the reference: {said}", verdict(holds), note, _three(evidence))


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
    for kind in INTERACTIONS:
        base, known = evidence.direct[kind], evidence.reference_of(kind)
        if not known.known:
            raise NotRun("there is no reference of all three interactions")
        for name in (base, *(smaller if kind == "isotropic" else ())):
            of = known if name == base else reference_of(evidence.reference, evidence.scenes[name])
            if not of.known:
                of = transferred_uncertainty(known, evidence.histories[base], evidence.histories[name])
            forces[name] = of.at(response.FORCE, max(of.strains(response.FORCE), default=0.0))
    isotropic, tie, rough = _three(evidence)
    friction = {name: evidence.scenes[name].contact.friction for name in (isotropic, *smaller)}
    slides = sorted(friction, key=friction.__getitem__, reverse=True)
    said = [f"tie {forces[tie]} N", f"rough {forces[rough]} N"]
    said += [f"mu = {friction[name]:g} {forces[name]} N" for name in slides]
    holds = [forces[tie].larger_than(forces[rough])]
    holds += [forces[rough].larger_than(forces[name]) for name in slides]
    return Judgement(
        f"force: {', '.join(said)}",
        verdict(all_hold(holds)),
        "the reference where it knows the problem; else uncertain by how much this discretisation is off where it does",
        (tie, rough, *slides),
    )


def judge_untied_rows(evidence: Evidence) -> Judgement:
    """K11: without ties the outer rows slide, load is not transferred, and convergence suffers."""
    untied, tied = evidence.history("untied"), evidence.history("isotropic")
    contacts = evidence.contact("untied").isel(increment=-1)
    row, slip = contacts["row"].to_numpy(), 1e3 * np.nan_to_num(contacts["slip"].to_numpy())
    outer = (row == 0) | (row == row.max())
    slips, rest = slip[outer].mean(), slip[~outer].mean()
    strain = response.common_strain([untied, tied])
    ratio = response.stiffness_at(untied, strain) / response.stiffness_at(tied, strain)
    iterations, usual = (int(history["newton_iterations"].sum()) for history in (untied, tied))
    return Judgement(
        f"force {ratio:.2f} times that with tied outer rows; mean slip {slips:.3g} mm in the outer rows and {rest:.3g} "
        f"mm in the others; {untied.sizes['increment'] - 1} increments with {iterations} Newton iterations against "
        f"{tied.sizes['increment'] - 1} with {usual}",
        verdict(slips >= SLIDE * rest > 0 and ratio <= TRANSFERRED and iterations >= HARDER * usual),
        f"sliding: {SLIDE:g} times the others' slip; not transferred: {TRANSFERRED:.0%} of the force; suffering: "
        f"{HARDER:g} times the iterations",
        (evidence.direct["untied"], evidence.direct["isotropic"]),
    )


def judge_stabilisation(evidence: Evidence) -> Judgement:
    """E1: the energy that stabilisation dissipates is small beside the internal energy, at every increment."""
    names = {kind: name for kind, name in evidence.direct.items() if kind != "tie"}
    if not names:
        raise NotRun(f"{NO_DIRECT} contact")
    shares = {kind: stabilisation_share(evidence.histories[name]) for kind, name in names.items()}
    allowed = evidence.printed("sec2.2", "stabilisation", "largest share of strain energy") / 100
    used = any(evidence.scenes[name].solver.stabilisation > 0 for name in names.values())
    return Judgement(
        f"largest share of the internal energy: {', '.join(f'{kind} {share:.2%}' for kind, share in shares.items())}",
        verdict(max(shares.values()) <= allowed),
        "" if used else "no stabilisation was used, so that there is nothing to dissipate",
        tuple(names.values()),
    )


def _compared(evidence: Evidence, measure: Callable[[xr.Dataset, float], float]) -> dict[str, float]:
    """Return a measure of ties, rough contact and friction at their common strain."""
    if not set(INTERACTIONS) <= set(evidence.direct):
        raise NotRun(f"{NO_DIRECT} ties, rough contact and isotropic friction on one mesh")
    histories = {kind: evidence.history(kind) for kind in INTERACTIONS}
    strain = response.common_strain(histories.values())
    return {kind: measure(history, strain) for kind, history in histories.items()}


def _references(evidence: Evidence, quantity: str, measured: str) -> dict[str, Estimate]:
    """Return a quantity of ties, rough contact and friction at the largest strain with reference values of all."""
    found = {kind: evidence.reference_of(kind) for kind in INTERACTIONS}
    strain = response.common_strain(evidence.histories[name] for name in _three(evidence))
    common = set.intersection(*(set(each.strains(quantity, strain)) for each in found.values()))
    if not common:
        raise NotRun("there is no reference of all three", measured)
    return {kind: each.at(quantity, max(common)) for kind, each in found.items()}


def _three(evidence: Evidence) -> tuple[str, ...]:
    """Return the scenes of isotropic friction, ties and rough contact."""
    return tuple(evidence.direct[kind] for kind in ("isotropic", "tie", "rough"))


def _listed(values: Mapping[str, float], form: str) -> str:
    """Name values from the largest to the smallest."""
    order = sorted(values, key=values.__getitem__, reverse=True)
    return ", ".join(f"{INTERACTIONS[kind]} {form.format(values[kind])}" for kind in order)
