"""Claims about reduced models, their springs and beams in contact: R1 to R9 and B1 of ``paper_claims.csv``."""

from __future__ import annotations

import fnmatch
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from knitstudy.knit.yarns.joints import springs
from knitstudy.measures import response
from knitstudy.measures.cost import MEGABYTE, memory_growth
from knitstudy.measures.estimate import UNKNOWN, Estimate
from knitstudy.measures.reference import made_of, transferred_uncertainty
from knitstudy.paper.cases import Case, Simulation, is_plain
from knitstudy.paper.claims.evidence import Evidence, Judgement, NotRun
from knitstudy.paper.claims.scale import (
    COMPARABLE,
    GOOD,
    MUCH,
    NOT_RUN,
    REPRODUCED,
    Row,
    at_least,
    at_most,
    comparable,
    holds,
)
from knitstudy.paper.paper_values import REPORTED
from knitstudy.run.catalogue import CASES

SAME_SHAPE = 0.8  # Claim R2: least correlation of u_z
NONE_AT_ALL = 0.01  # Claim R2: share of the reference's largest |u_z| that counts as no out-of-plane motion
PENALTIES = "dns-isotropic-{}-penalty*"  # Claim R4: scenes with penalties alone, by direction
SAVINGS = ("DOF", "memory growth", "processor time")


def judge_forces(evidence: Evidence) -> Judgement:
    """R1: the force of the 3D model is much closer to the reference than that of the 2D model, in all four cases."""

    def judge(case: Case) -> list[Row]:
        near, far = (case.main[name].history for name in ("rom3d", "rom2d"))
        distance = case.reference.force_distance
        ratio = distance(near).value / distance(far).value
        margin = 1 / (MUCH * ratio) if ratio > 0 else np.inf
        closer, much = (case.reference.nearer(near, far, share) for share in (1.0, 1 / MUCH))
        return [
            holds("distance, 3D over 2D ROM", f"{ratio:.2f}", "much closer", closer, much, margin),
            Row("3D ROM", f"{distance(near)}"),
            Row("2D ROM", f"{distance(far)}"),
            *(
                Row(f"DNS of {made_of(direct.scene)}", f"{distance(direct.history)}")
                for direct in (case.dns, *case.others)
            ),
        ]

    return _in_cases(evidence, judge, f"much closer: {1 / MUCH:g} times the distance or less")


def judge_agreement(word: str, evidence: Evidence) -> Judgement:
    """R7, R8: the force of the 3D model is comparable (R8) to the reference, or in good agreement (R7)."""
    bars = {"good agreement": GOOD, "comparable": COMPARABLE - 1}

    def judge(case: Case) -> list[Row]:
        distance = case.reference.force_distance(case.main["rom3d"].history)
        return [at_most("distance of the 3D ROM", distance, word, bars[word], sense=COMPARABLE - 1)]

    return _in_cases(evidence, judge, f"{word}: a relative distance of F(strain) of at most {bars[word]:g}")


def judge_out_of_plane(evidence: Evidence) -> Judgement:
    """R2: in course tension u_z of the 3D model has the reference's size and the DNS's shape; the 2D model has none."""

    def judge(case: Case) -> list[Row]:
        dns, rom3d, rom2d = (model.history for model in (case.dns, case.main["rom3d"], case.main["rom2d"]))
        shape = response.out_of_plane_correlation(rom3d, dns)
        size = case.reference.ratio(rom3d, response.RMS_U_Z, response.rms_out_of_plane(rom3d))
        flat = case.reference.ratio(rom2d, response.LARGEST_U_Z, response.out_of_plane(rom2d))
        amplitude = "amplitude of u_z over the reference's"
        return [
            at_least("correlation of u_z", shape, "captured", SAME_SHAPE, sense=0.0, text=f"{shape:.2f}"),
            comparable(amplitude, size, 1.0, f"{size}", "captured", direction=size.above(0.0)),
            at_most("largest |u_z| over the reference's, 2D ROM", flat, "none", NONE_AT_ALL),
        ]

    note = (
        f"captured: a correlation of {SAME_SHAPE:g} or more, an amplitude within a factor of {COMPARABLE:g}"
    )
    return _in_cases(evidence, judge, note, ("course",))


def judge_motion_order(evidence: Evidence) -> Judgement:
    """R3: the 3D model moves further out of its plane with friction than with ties, and so does the reference."""
    cases = [_case(evidence, kind, ("rom3d",)) for kind in ("isotropic", "tie")]
    if None in cases:
        raise NotRun("the study has no 3D ROM with ties and with isotropic friction in course tension")
    _require_reference(cases)
    rom = [response.largest_out_of_plane(case.main["rom3d"].history) for case in cases]
    dns = [response.largest_out_of_plane(case.dns.history) for case in cases]
    name = "largest |u_z|, friction over ties"
    return Judgement(
        (
            at_least(f"{name}, 3D ROM", rom[0] / rom[1], "> 1", 1.0),
            at_least(f"{name}, reference", _over_ties(*cases), "> 1", 1.0),
            Row(f"{name}, DNS", f"{dns[0] / dns[1]:.2f}", "> 1"),
        ),
        scenes=_names([case.dns for case in cases] + [case.main["rom3d"] for case in cases]),
    )


def _over_ties(slides: Case, tie: Case) -> Estimate:
    """Return the reference's largest |u_z| with friction over that with ties, at the largest strain with both."""
    u_z, references = response.LARGEST_U_Z, (slides.reference, tie.reference)
    strains = set.intersection(*(set(reference.strains(u_z)) for reference in references))
    if not strains:
        return UNKNOWN
    one, other = (reference.at(u_z, max(strains)) for reference in references)
    off = one.uncertainty / one.value + other.uncertainty / other.value
    return Estimate(one.value / other.value, off * one.value / other.value)


def judge_springs(evidence: Evidence) -> Judgement:
    """R4: of the averaged springs kz is the largest by far; kx > ky in course tension, ky > kx in wale tension."""
    tests, shown = [], []
    for case in (cases := _with_contacts(evidence)):
        way, (kx, ky, kz) = case.direction, _springs(evidence, case.dns.scene.name)
        printed = _printed_springs(evidence, way)
        ratio = kz / max(kx, ky)
        name, theirs = f"kz over kx and ky, {way} tension", f"{printed[2] / max(printed[:2]):.1f}"
        tests.append(at_least(name, ratio, theirs, MUCH, sense=1.0, text=f"{ratio:.1f}"))
        smallest = min(kx, ky, kz)
        tests.append(
            at_least(f"smallest spring, {way} tension", smallest, "> 0", 0.0, text=f"{smallest:.3g} kN/m")
        )
        one, other = ("kx", "ky") if way == "course" else ("ky", "kx")
        ratio, theirs = (of[0] / of[1] if one == "kx" else of[1] / of[0] for of in ((kx, ky), printed))
        # Only the order of kz is a sentence of the paper; that of kx and ky is of Table 2.
        row = at_least(f"{one} over {other}, {way} tension", ratio, f"{theirs:.2f}", 1.0, sense=-np.inf)
        tests.append(row)
        shown += _by_penalty(evidence, way)
    return _of_both_directions(
        cases, tests, shown, f"averaged secants of interfaces along {evidence.axes} axes"
    )


def judge_spring_values(evidence: Evidence) -> Judgement:
    """R9: the averaged springs have the values of Table 2."""
    tests, shown = [], []
    for case in (cases := _with_contacts(evidence)):
        way, name = case.direction, case.dns.scene.name
        pairs = zip("xyz", _springs(evidence, name), _printed_springs(evidence, way), strict=True)
        for axis, ours, theirs in pairs:
            row = comparable(f"k{axis}, {way} tension", ours, theirs, f"{ours:.3g} kN/m", f"{theirs:g} kN/m")
            tests.append(row)
        for axis, ours in zip("xyz", _springs(evidence, name, "global"), strict=True):
            shown.append(Row(f"k{axis} along the knit's axes, {way} tension", f"{ours:.3g} kN/m"))
    return _of_both_directions(cases, tests, shown, "averaged secants of interfaces; Table 2")


def _with_contacts(evidence: Evidence) -> list[Case]:
    """Return the cases of isotropic friction whose contacts are known."""
    cases = [case for case in evidence.cases if case.interaction == "isotropic"]
    cases = [case for case in cases if case.dns.scene.name in evidence.contacts]
    if not cases:
        raise NotRun("the study has no direct simulation with isotropic friction")
    return cases


def _of_both_directions(cases: list[Case], tests: list[Row], shown: list[Row], note: str) -> Judgement:
    if len(cases) < 2:
        raise NotRun(f"{note}; of one direction only", *tests, *shown)
    return Judgement((*_failures_first(tests), *shown), note, _names(case.dns for case in cases))


def _failures_first(tests: Iterable[Row]) -> list[Row]:
    return sorted(tests, key=lambda row: (row.grade == REPRODUCED, row.margin))


def _printed_springs(evidence: Evidence, direction: str) -> list[float]:
    """Return the springs of Table 2 [kN/m]."""
    return [1e-3 * evidence.printed("2", direction, f"spring stiffness k{axis}") for axis in "xyz"]


def _by_penalty(evidence: Evidence, direction: str) -> list[Row]:
    """Return kz with penalties alone, along local axes, by the contact stiffness."""
    stiffness_of = {
        evidence.scenes[name].contact.normal_stiffness: _springs(evidence, name)[2]
        for name in fnmatch.filter(evidence.contacts, PENALTIES.format(direction))
    }
    about = f"kz, {direction} tension, penalties alone, E / h times"
    return [Row(f"{about} {stiffness:g}", f"{kz:.3g} kN/m") for stiffness, kz in sorted(stiffness_of.items())]


def _springs(evidence: Evidence, name: str, axes: str | None = None) -> np.ndarray:
    """Return averaged springs of interfaces (3,) [kN/m] along axes, by default along the axes of the reading."""
    return (
        springs(evidence.contacts[name], "interface", axes or evidence.axes, evidence.normal).averaged / 1e3
    )


def judge_cost(evidence: Evidence) -> Judgement:
    """R5: savings of the reduced models with ties, at the paper's mesh size."""
    case = _case(evidence, "tie", ("rom3d", "rom2d"))
    if case is None or case.by_hexahedra is None:
        raise NotRun("the study has not all models of ties in course tension, the paper's element among them")
    models = {"dns": case.by_hexahedra, "rom3d": case.main["rom3d"], "rom2d": case.main["rom2d"]}
    tests, shown, ours, theirs = [], [], {}, {}
    for name, model in models.items():
        label, dof = model.scene.kind.fidelity.label, model.history.attrs["dof"]
        printed = _reported(evidence, name, "degrees of freedom")
        row = comparable(f"degrees of freedom, {label}", dof, printed, f"{dof:,}", f"{printed:,.0f}")
        if name == "rom2d":  # the sentence gives the counts of DNS and 3D network
            shown.append(replace(row, grade=""))
        else:
            tests.append(row)
        ours[name] = model.history.attrs["memory_growth"] / MEGABYTE
        theirs[name] = _reported(evidence, name, "memory")
        shown.append(Row(f"memory growth, {label}", f"{ours[name]:.1f} MB", f"{theirs[name]:g} MB"))
    unknowns, memory, time = _savings(models["dns"], case)
    printed = theirs["dns"] / theirs["rom3d"]
    bar = printed / COMPARABLE
    tests.append(
        at_least(
            "memory growth, DNS over 3D ROM", memory, f"{printed:.1f}", bar, sense=1.0, text=f"{memory:.0f}"
        )
    )
    extra, usual = ((of["rom3d"] - of["rom2d"]) / of["dns"] for of in (ours, theirs))
    name = "memory growth, 3D ROM less 2D ROM over DNS"
    tests.append(at_most(name, extra, f"{usual:.1%}", MUCH * usual, sense=1.0, text=f"{extra:.1%}"))
    fewer = _reported(evidence, "dns", "degrees of freedom") / _reported(
        evidence, "rom3d", "degrees of freedom"
    )
    shown.append(Row("degrees of freedom, DNS over 3D ROM", f"{unknowns:.0f}", f"{fewer:.0f}"))
    shown.append(Row("processor time, DNS over 3D ROM", f"{time:.0f}"))
    note = (
        "the yarn's length and diameter were inferred from the printed DOF: that part was used in calibration"
    )
    size, wanted = models["dns"].scene.metres("mesh.size"), _reported(evidence, "dns", "mesh size")
    if not np.isclose(size, wanted):
        raise NotRun(
            f"elements of {1e3 * size:g} mm, the paper's of {1e3 * wanted:g} mm; {note}", *tests, *shown
        )
    return Judgement((*_failures_first(tests), *shown), note)


def judge_cost_with_friction(evidence: Evidence) -> Judgement:
    """R6: with isotropic friction the 3D model saves as much as with ties; over the paper's element if both have it."""
    tie, slides = (_case(evidence, kind, ("rom3d",)) for kind in ("tie", "isotropic"))
    if tie is None or slides is None:
        raise NotRun("the study has no 3D ROM with ties and with isotropic friction in course tension")
    direct = [slides.by_hexahedra, tie.by_hexahedra]
    if None in direct or made_of(direct[0].scene) != made_of(direct[1].scene):
        direct = [slides.dns, tie.dns]
    saved = list(zip(SAVINGS, _savings(direct[0], slides), _savings(direct[1], tie), strict=True))
    tests = [
        at_least(f"{name} saved, over that with ties", ours / theirs, "similar", 1 / COMPARABLE, sense=0.0)
        for name, ours, theirs in saved
    ]
    shown = [Row(f"{name}, DNS over 3D ROM, friction", f"{ours:,.4g}") for name, ours, _ in saved]
    return Judgement(
        (*_failures_first(tests), *shown),
        f"DNS: {made_of(direct[0].scene)}",
        _names([slides.dns, *direct, tie.main["rom3d"], slides.main["rom3d"]]),
    )


def _savings(direct: Simulation, case: Case) -> tuple[float, float, float]:
    """Return the ratios `SAVINGS` of a direct simulation to the 3D model: unknowns, memory, processor time."""
    dns, rom = (model.history.attrs for model in (direct, case.main["rom3d"]))
    memory = dns["memory_growth"] / memory_growth(case.main["rom3d"].history)
    return dns["dof"] / rom["dof"], memory, dns["processor_seconds"] / rom["processor_seconds"]


def _reported(evidence: Evidence, fidelity: str, quantity: str) -> float:
    return evidence.printed("5", REPORTED[fidelity], quantity)


def judge_beams(evidence: Evidence) -> Judgement:
    """B1: beams in contact at one point of a crossing, with rigid sections, are softer than solids."""
    case = _case(evidence, "isotropic", ())
    plain = [model for model in case.beams if is_plain(model.scene)] if case else []
    if not plain:
        raise NotRun("the study has no beams in contact beside solids in course tension")
    beams, ties = plain[0], plain[0].scene.value("contact.tied_edges")
    if ties == case.dns.scene.value("contact.tied_edges"):
        _require_reference([case])
        known, alike = case.reference, case.beams
        rows = [Row("the same, DNS", f"{known.force_ratio(case.dns.history)}")]
    elif "untied" in evidence.direct:
        solids = evidence.history("untied")
        known = evidence.reference_of("untied")
        if not known.known:
            known = transferred_uncertainty(case.reference, case.dns.history, solids)
        alike, rows = [beam for beam in case.beams if beam.scene.value("contact.tied_edges") == ties], []
    else:
        raise NotRun("the study has no solids whose rows are tied as those of the beams")
    ratio = known.force_ratio(beams.history)
    if not ratio.known:
        raise NotRun("there is no reference at a strain that beams and solids reach")
    rows += [Row(f"the same, {model.label}", f"{known.force_ratio(model.history)}") for model in alike]
    return Judgement(
        (at_most("stiffness over that of solids", ratio, "< 1", 1.0), *rows),
        f"judged by {beams.label}; rows that are tied: {ties}",
        _names([case.dns, *alike] if known is case.reference else [case.dns]),
    )


def _in_cases(
    evidence: Evidence,
    judge: Callable[[Case], list[Row]],
    note: str,
    directions: tuple[str, ...] = ("course", "wale"),
) -> Judgement:
    """Judge every case with both reduced models."""
    cases = [case for case in _with_models(evidence, ("rom3d", "rom2d")) if case.direction in directions]
    if not cases:
        raise NotRun("the study has no direct simulation with both reduced models")
    _require_reference(cases)
    rows = [replace(row, quantity=f"{row.quantity}; {case.label}") for case in cases for row in judge(case)]
    judged = Judgement(
        (*_failures_first(row for row in rows if row.grade), *(row for row in rows if not row.grade)),
        note,
        _names(model for case in cases for model in (case.dns, *case.main.values())),
    )
    lacking = len(cases) < sum(case.endswith(directions) for case in CASES)
    return replace(judged, verdict=NOT_RUN) if lacking and judged.verdict == REPRODUCED else judged


def _require_reference(cases: Iterable[Case]) -> None:
    if lacking := [case.label for case in cases if not case.reference.known]:
        raise NotRun(f"there is no reference of {', '.join(lacking)}")


def _with_models(evidence: Evidence, fidelities: Iterable[str]) -> list[Case]:
    """Return the cases that have reduced models of some fidelities."""
    return [case for case in evidence.cases if set(fidelities) <= set(case.main)]


def _case(evidence: Evidence, interaction: str, fidelities: Iterable[str]) -> Case | None:
    """Return the case of an interaction in course tension with some reduced models, None where a study lacks it."""
    wanted = (interaction, "course")
    cases = (
        case for case in _with_models(evidence, fidelities) if (case.interaction, case.direction) == wanted
    )
    return next(cases, None)


def _names(models: Iterable[Simulation]) -> tuple[str, ...]:
    return tuple(model.scene.name for model in models)
