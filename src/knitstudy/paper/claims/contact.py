"""Claims about contact with friction: K1 to K8, K11 to K15, K18 to K20 and E1 of ``paper_claims.csv``."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import xarray as xr

from knitstudy.measures import centre_cell, response
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.reference import reference_of, transferred_uncertainty
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.paper.claims import (
    CLAIMS,
    COMPARABLE,
    GOOD,
    MUCH,
    NotRun,
    Remark,
    Row,
    at_least,
    at_most,
    holds,
    trend,
)
from knitstudy.paper.claims.evidence import NO_DIRECT, Evidence
from knitstudy.paper.columns import CONTRACTION, FRICTION_SHARE, STABILISED, STRAIN, U_Z
from knitstudy.paper.scene_names import INTERACTIONS
from knitstudy.paper.sweeps import FRICTION

# Claim K3: strain interval before and after a point over which the mean slope of the force is taken; largest strain
# between the first symmetric contact and the bend of the force that counts as "right after".
SPAN, JUST_AFTER = 1e-3, 5e-3
PRONOUNCED, SYMMETRIC = 0.1, 0.2  # Claim K4: least |u_z| over d; largest difference of envelopes
CONTRACTS = 0.01  # Claim K8: least contraction of the chord to a neighbour over the strain of the knit
NAMED = {"tie": "ties", "rough": "rough contact", "isotropic": "friction"}
# Solids with other coefficients of friction (K7)
FRICTION_SWEEP = re.compile(r"inputs-friction\d+-isotropic-course")


@CLAIMS.add("K1")
def no_contact(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield no zone in the centre cell at point 1 of Fig. 7."""
    yield from _at_snapshot(evidence, 1, lambda zones, at, printed: zones[at] == printed)


@CLAIMS.add("K2")
def zones(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield four zones in the centre cell from point 4 of Fig. 7 to the end, never more."""
    yield from _at_snapshot(
        evidence, 4, lambda zones, at, printed: (zones[at:] == printed).all() and zones.max() == printed
    )
    yield Remark(scenes=(evidence.direct["isotropic"],))


def _at_snapshot(
    evidence: Evidence, number: int, test: Callable[[Floats, int, float], bool]
) -> Iterator[Row]:
    """Yield the zones of the centre cell at a point of Fig. 7; withhold the verdict where no increment ends there."""
    contacts = evidence.contact("isotropic")
    zones, points = centre_cell.zones_of_cell(contacts), centre_cell.snapshots(contacts)
    rows = [Row(f"zones at {point.strain:.2%} strain", str(zones[point.increment])) for point in points]
    rows.append(Row(f"zones at the end, {float(contacts['strain'][-1]):.2%}", str(zones[-1])))
    point = next((point for point in points if point.number == number), None)
    if point is None or not point.exact:
        yield from rows
        raise NotRun(f"no increment ends at the strain of point {number} of Fig. 7")
    place = f"contact zones in the centre cell at {100 * centre_cell.SNAPSHOTS[number - 1]:g}% strain"
    printed = evidence.printed("fig7", "course isotropic", place)
    decisive = rows.pop(points.index(point))
    passed = bool(test(zones, point.increment, printed))
    yield holds(decisive.quantity, decisive.ours, f"{printed:g}", passed)
    yield from rows


@CLAIMS.add("K3")
def slope(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the force bends most just after zones come into symmetric contact."""
    history = evidence.row("isotropic").history
    contacts = evidence.contact("isotropic")
    strain = history["strain"].to_numpy()
    bends = largest_bend(history)
    first = centre_cell.first_symmetric_contact(contacts)
    # Contact began after the increment before.
    after = first is not None and strain[max(first - 1, 0)] <= bends <= strain[first] + JUST_AFTER
    bent = f"{bends:.2%}" if bends > 0 else "none"
    yield holds("force bends most at strain", bent, "just after contact", bool(after))
    met = "none" if first is None else f"{strain[first]:.2%}"
    yield Row("first symmetric contact at strain", met, f"by {centre_cell.SNAPSHOTS[2]:.2%}")
    note = f"slopes over {SPAN:.1%} before and after; {JUST_AFTER:.1%} counts as just after"
    yield Remark(note, (evidence.direct["isotropic"],))


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


@CLAIMS.add("K4")
def motion(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the knit contracts and moves out of its plane, symmetrically about its mid line."""
    row = evidence.row("isotropic")
    arcs = evidence.fabric.arcs
    largest = row[U_Z] / evidence.diameter
    yield at_least("largest |u_z|", largest, "pronounced", PRONOUNCED, sense=0.0, text=f"{largest:.2f} d")
    skew = asymmetry(row.history, None if arcs is None else arcs.yarn)
    yield at_most("mirrored envelopes of u_z differ by", skew, "symmetric", SYMMETRIC, text=f"{skew:.0%}")
    yield holds("transverse contraction", f"{row[CONTRACTION]:.2%}", "> 0", row[CONTRACTION] > 0)
    note = f"pronounced: {PRONOUNCED:g} d or more; symmetric: up to {SYMMETRIC:.0%}"
    yield Remark(note, (evidence.direct["isotropic"],))


def asymmetry(history: xr.Dataset, whole: Ints | None = None) -> float:
    """Return the difference of the envelopes of u_z of yarns mirrored about the mid line, over the largest |u_z|.

    `whole` (Y,) holds for every piece in the history the number of its yarn.
    """
    u_z = response.motion(history)[-1, :, response.Z]
    yarn = history["yarn"].to_numpy()
    yarn = yarn if whole is None else whole[yarn]
    envelope = np.array([(u_z[yarn == i].min(), u_z[yarn == i].max()) for i in np.unique(yarn)])
    largest = np.abs(u_z).max()
    return float(np.abs(envelope - envelope[::-1]).max() / largest) if largest > 0 else 0.0


@CLAIMS.add("K8")
def kinematics(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that at every crossing of the centre cell both yarns turn, contract and slide, and contact areas spin."""
    contacts = _with_motions(evidence)
    here = centre_cell.centre_cell(contacts)
    strain = float(contacts["strain"][-1])
    angle = np.degrees(np.arctan(strain))
    slide = 1e3 * strain * evidence.diameter
    shorter = 100 * CONTRACTS * strain
    travel = 1e3 * np.abs(contacts["contact_travel"].to_numpy())[-1, here]
    sliding = 1e3 * np.abs(contacts["sliding"].to_numpy())[-1, here]
    spin = np.degrees(np.abs(contacts["contact_spin"].to_numpy()))[-1, here]
    turned = np.degrees(centre_cell.rotation_angle(contacts))[-1, here]
    closer = 100 * centre_cell.closest_neighbour(contacts)[-1, here]
    rows = [
        # The contact of an open crossing has no place: nan counts as no motion.
        at_least(
            quantity, float(np.nan_to_num(values).min()), paper, bar, sense=0.0, text=_range(values, unit)
        )
        for quantity, unit, paper, values, bar in (
            ("slide of the contact along the yarns", "mm", "slides", travel, slide),
            ("spin of the contact areas", "degrees", "spin", spin, angle),
            ("rotation of the sections", "degrees", "rotates", turned, angle),
            ("contraction of the chord to a neighbour", "%", "contracts", closer, shorter),
        )
    ]
    yield from sorted(rows, key=lambda row: row.margin)
    yield Row("slip of the yarns past each other, along the one and the other", _range(sliding, "mm"))
    yield Remark(
        f"rotation and spin from {angle:.2g} degrees on, sliding from {slide:.2g} mm, contraction from "
        f"{shorter:.2g} %",
        (evidence.direct["isotropic"],),
    )


def _range(values: Floats, unit: str) -> str:
    return f"{values.min():.2g} to {values.max():.2g} {unit}"


def _with_motions(evidence: Evidence) -> xr.Dataset:
    """Return the contacts with friction; raise `NotRun` if their history holds no motion of sections."""
    contacts = evidence.contact("isotropic")
    if "section_rotation" not in contacts:
        raise NotRun("the history holds no motion of the sections")
    return contacts


@CLAIMS.add("K12")
def order_of_motions(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that yarns of the centre cell rotate before they slide."""
    contacts = _with_motions(evidence)
    here = centre_cell.centre_cell(contacts)
    sliding = np.abs(contacts["sliding"].to_numpy()).max(axis=-1)
    turned = _half(contacts, centre_cell.rotation_angle(contacts)[:, here])
    slid = _half(contacts, sliding[:, here])
    later = slid[0] - turned[0]
    step = max(turned[1], slid[1])
    first = bool(later > 0) if abs(later) > step else None
    yield holds("half of the rotation after half of the sliding", f"{-later:+.2%}", "before", first)
    yield Row("strain at half of the rotation", f"{turned[0]:.2%}")
    yield Row("strain at half of the sliding", f"{slid[0]:.2%}")
    yield Remark(f"increments there take {step:.2%} strain", (evidence.direct["isotropic"],))


def _half(contacts: xr.Dataset, values: Floats) -> tuple[float, float]:
    """Return the first strain at which the mean of values (I, ...) is half of the last one, and its increment."""
    strain = contacts["strain"].to_numpy()
    mean = np.nan_to_num(values.reshape(len(values), -1)).mean(axis=1)
    last = max(int(np.argmax(mean >= 0.5 * mean[-1])), 1)
    step = slice(last - 1, last + 1)
    return float(np.interp(0.5 * mean[-1], mean[step], strain[step])), float(np.ptp(strain[step]))


@CLAIMS.add("K14")
def first_contact(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the centre cell first touches after point 1 of Fig. 7, and at or before point 3."""
    contacts = evidence.contact("isotropic")
    first = centre_cell.first_symmetric_contact(contacts)
    strain = np.nan if first is None else float(contacts["strain"][first])
    after, _, until, *_ = centre_cell.SNAPSHOTS
    printed = f"above {after:.2%}, by {until:.2%}"
    met = "none" if first is None else f"{strain:.2%}"
    yield holds("first symmetric contact at strain", met, printed, after < strain <= until)
    yield Remark(scenes=(evidence.direct["isotropic"],))


@CLAIMS.add("K18")
def growing_area(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the area under pressure in the centre cell grows, and so does that of a zone."""
    contacts = evidence.contact("isotropic")
    history = evidence.row("isotropic").history
    if "contact_pressure" not in history:
        raise NotRun("the history holds no points of contact")
    points = centre_cell.snapshots(contacts)
    increments = [*(point.increment for point in points), contacts.sizes["increment"] - 1]
    strain = contacts["strain"].to_numpy()[increments]
    pressed = centre_cell.pressed_area_of_cell(history, contacts)[increments]
    zones = centre_cell.zones_of_cell(contacts)[increments]
    touching = zones > 0
    if touching.sum() < 2:
        raise NotRun("the centre cell touches at fewer than two points of Fig. 7")
    of_zone = pressed[touching] / zones[touching]
    for name, values in (("area under pressure", pressed), ("mean area of a zone", of_zone)):
        estimates = [Estimate(float(value), 0.0) for value in values]
        yield trend(f"{name} grows over the points of Fig. 7 and the end", estimates, 1, "grows", half=False)
    for at, area, count in zip(strain, pressed, zones, strict=True):
        yield Row(f"area under pressure at {at:.2%} strain; zones", f"{1e6 * area:.4f} mm2; {count}")
    hertz = centre_cell.area_of_cell(contacts)[-1]
    yield Row("area of the contacts table at the end", f"{1e6 * hertz:.4f} mm2")
    yield Remark("area where pressure acts, the mean of both sides", (evidence.direct["isotropic"],))


@CLAIMS.add("K19")
def either_is_master(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that force and motion are the same whichever of two yarns is the slave, in a contact of one pass."""
    names = [f"slave-{slave}-isotropic-course" for slave in ("lower", "upper")]
    if not all(map(evidence.has, names)):
        raise NotRun("the study has no knits in contact of one pass with exchanged slaves")
    lower, upper = (evidence.rows[name].history for name in names)
    strain = response.common_strain((lower, upper))
    for quantity in (response.FORCE, response.LARGEST_U_Z):
        _, values = response.QUANTITIES[quantity]
        one, other = (response.at_strain(each, strain, values(each, each)) for each in (lower, upper))
        off = max(one / other, other / one) - 1
        name = f"{quantity}, one slave over the other, less 1"
        yield at_most(name, off, "0", GOOD, sense=COMPARABLE - 1, text=f"{off:.3f}")
    yield Remark("hexahedra of 0.30 mm, friction, course tension", tuple(names))


@CLAIMS.add("K20")
def locking(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that one integration point is much closer to the reference than eight, on the same meshes."""
    names = []
    for size, millimetres in (("045", "0.45 mm"), ("030", "0.30 mm")):
        pair = [f"elements-{element}-{size}-tie-course" for element in ("one-point", "eight-point")]
        if not all(map(evidence.has, pair)):
            raise NotRun(
                "the study has no tied knits of hexahedra with one and with eight integration points"
            )
        one, eight = (evidence.rows[name] for name in pair)
        known = reference_of(evidence.reference, one.scene)
        closer, much = (known.nearer(one.history, eight.history, share) for share in (1.0, 1 / MUCH))
        far = [known.force_distance(row.history) for row in (one, eight)]
        name = f"distance to the reference, one point over eight, {millimetres}"
        ratio = far[0].value / far[1].value
        yield holds(name, f"{ratio:.2f}", "avoids", closer, much, 1 / (MUCH * ratio) if ratio > 0 else np.inf)
        yield Row(f"distance of one point; of eight, {millimetres}", f"{far[0]}; {far[1]}")
        names += pair
    yield Remark("ties, course tension", tuple(names))


@CLAIMS.add("K5", quantity=response.FORCE, order=("tie", "rough", "isotropic"))
@CLAIMS.add("K6", quantity=response.LARGEST_U_Z, order=("isotropic", "tie"))
@CLAIMS.add("K15", quantity=response.FORCE, order=("tie", "rough", "isotropic"), direction="wale")
def order(
    evidence: Evidence, quantity: str, order: tuple[str, ...], direction: str = "course"
) -> Iterator[Row | Remark]:
    """Yield that the reference's values of a quantity fall along interactions, each by more than both uncertainties."""
    evidence = evidence.pulled_in(direction)
    histories = {kind: evidence.row(kind).history for kind in INTERACTIONS}
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
        yield from shown
        raise NotRun("there is no reference of all of these")
    known = {
        kind: reference.at(quantity, max(common)).of(lambda value: scale * value)
        for kind, reference in references.items()
    }
    for one, other in pairwise(order):
        yield _larger(quantity, one, other, known)
    for kind, estimate in known.items():
        yield Row(f"{quantity} of the reference, {INTERACTIONS[kind]}", f"{estimate} {unit}")
    for less in sorted(common)[:-1]:
        earlier = {kind: reference.at(quantity, less) for kind, reference in references.items()}
        for one, other in pairwise(order):
            yield _larger(f"{quantity} at {less:.0%} strain", one, other, earlier).shown
    yield from shown
    yield Remark(scenes=_three(evidence))


def _larger(quantity: str, one: str, other: str, values: dict[str, Estimate]) -> Row:
    """Return the row of a value that must exceed another by more than both uncertainties."""
    ratio = values[one].value / values[other].value
    name = f"{quantity}, {NAMED.get(one, one)} over {NAMED.get(other, other)}"
    return holds(name, f"{ratio:.2f}", "> 1", values[one].larger_than(values[other]), margin=ratio)


def _coefficients(evidence: Evidence) -> dict[str, float]:
    """Return the coefficient of friction and smaller ones than Table 1's by scene, the largest first."""
    names = [name for name in evidence.rows if FRICTION_SWEEP.fullmatch(name) and evidence.has(name)]
    friction = {name: evidence.rows[name].scene.value("contact.friction") for name in names}
    smaller = {name: value for name, value in friction.items() if value <= FRICTION}
    if not smaller or not set(INTERACTIONS) <= set(evidence.direct):
        raise NotRun(
            f"{NO_DIRECT} ties, rough contact and several coefficients of friction, all else the same"
        )
    main = evidence.direct["isotropic"]
    smaller[main] = evidence.rows[main].scene.value("contact.friction")
    return dict(sorted(smaller.items(), key=lambda each: each[1], reverse=True))


def _force(evidence: Evidence, name: str) -> Estimate:
    """Return the force of the reference, or else of the scene, as uncertain as its discretisation is for the base."""
    base = evidence.direct[evidence.rows[name].scene.interaction]
    reference = evidence.reference_for(name)
    if not reference.known:
        histories = (evidence.rows[each].history for each in (base, name))
        reference = transferred_uncertainty(evidence.reference_for(base), *histories)
    if not reference.known:
        raise NotRun("there is no reference of all three interactions")
    return reference.at(response.FORCE, max(reference.strains(response.FORCE), default=0.0))


@CLAIMS.add("K7")
def smaller_friction(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that rough contact is stiffer than friction with every smaller coefficient; K5 tests ties over it."""
    slides = _coefficients(evidence)
    _, tie, rough = _three(evidence)
    called = {tie: "ties", rough: "rough contact"} | {
        name: f"mu = {value:g}" for name, value in slides.items()
    }
    forces = {label: _force(evidence, name) for name, label in called.items()}
    tests = [_larger("force", "rough contact", called[name], forces) for name in slides]
    yield from sorted(tests, key=lambda row: row.margin)
    yield _larger("force", "ties", "rough contact", forces).shown
    for label, known in forces.items():
        yield Row(f"force, {label}", f"{known} N")
    yield Remark(
        "the reference where it knows the problem; else uncertain by how much this discretisation is off where it does",
        (tie, rough, *slides),
    )


@CLAIMS.add("K13")
def softened(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that of knits that differ in friction alone the one that dissipates more in friction is softer."""
    named = {f"mu = {value:g}": name for name, value in _coefficients(evidence).items() if value <= FRICTION}
    if len(named) < 2:
        raise NotRun(f"{NO_DIRECT} two coefficients of friction up to {FRICTION:g}")
    called = {"rough contact": evidence.direct["rough"]} | named
    forces = {label: _force(evidence, name) for label, name in called.items()}
    share = {label: evidence.rows[name][FRICTION_SHARE] for label, name in called.items()}
    by_share = [forces[label] for label in sorted(named, key=share.__getitem__)]
    yield trend("force falls as the dissipated share grows", by_share, -1, "less stiff", half=False)
    for label, known in forces.items():
        yield Row(f"{label}: force; dissipated share of the work", f"{known} N; {share[label]:.1%}")
    yield Remark(scenes=tuple(called.values()))


@CLAIMS.add("K11")
def untied_rows(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that without ties the outer rows slide, load is not transferred, and convergence suffers.

    Outer yarns slide off: how far yarns move past each other counts, not the slip of friction where they still touch.
    """
    both = [evidence.row(kind) for kind in ("untied", "isotropic")]
    untied, tied = (row.history for row in both)
    strain = response.common_strain([untied, tied])
    contacts = evidence.contact("untied")
    force = response.stiffness_at(untied, strain) / response.stiffness_at(tied, strain)
    yield at_most("force over that with tied outer rows", force, "less", 1 / COMPARABLE, sense=1.0)
    contacts = contacts.isel(increment=int(np.abs(contacts["strain"].to_numpy() - strain).argmin()))
    row = contacts["row"].to_numpy()
    slip = 1e3 * np.nan_to_num(contacts["slip"].to_numpy())
    outer = (row == 0) | (row == row.max())
    moved = 1e3 * np.linalg.norm(contacts["relative_displacement"].to_numpy(), axis=-1)
    slides = moved[outer].mean()
    others = moved[~outer].mean()
    name = "motion past each other, outer over other rows"
    yield at_least(name, slides / others, "slide", COMPARABLE, sense=1.0)
    iterations, usual = (int(history["newton_iterations"].sum()) for history in (untied, tied))
    damping = [row.scene.value("solver.stabilisation") for row in both]
    damped = damping[0] > 0 == damping[1]
    ended = both[0][STRAIN] < 0.999 * both[0].scene.value("load.strain")
    name = "Newton iterations over those with tied rows"
    slower = at_least(name, iterations / usual, "more", COMPARABLE, sense=1.0)
    if damped or ended:
        why = "needs stabilisation" if damped else f"ended at {strain:.2%} strain"
        slower = holds(name, f"{slower.ours}; {why}", "more", True)
    yield slower
    yield Row("motion past each other, outer rows", f"{slides:.3g} mm")
    yield Row("motion past each other, other rows", f"{others:.3g} mm")
    yield Row("mean slip of friction, outer rows", f"{slip[outer].mean():.3g} mm")
    yield Row("mean slip of friction, other rows", f"{slip[~outer].mean():.3g} mm")
    yield Remark(scenes=(evidence.direct["isotropic"],))


@CLAIMS.add("E1")
def stabilisation(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that stabilisation dissipates little at full load in the runs of the paper, with tied outer rows."""
    allowed = evidence.printed("sec2.2", "stabilisation", "largest share of strain energy") / 100
    names = tuple(evidence.direct[kind] for kind in ("isotropic", "rough") if kind in evidence.direct)
    if not names:
        raise NotRun("the study has no direct simulation with contact")
    for name in names:
        share = evidence.rows[name][STABILISED]
        quantity = f"share of the strain energy, {name}"
        yield at_most(quantity, share, f"{allowed:.0%}", allowed, text=f"{share:.2%}")
    if evidence.has(name := evidence.direct.get("untied", "")):
        yield Row(f"the same, {name}", f"{evidence.rows[name][STABILISED]:.2%}")
    yield Remark("the sentence is of a setting of the solver", names)


def _three(evidence: Evidence) -> tuple[str, ...]:
    """Return the scenes of isotropic friction, ties and rough contact."""
    return tuple(evidence.direct[kind] for kind in ("isotropic", "tie", "rough"))
