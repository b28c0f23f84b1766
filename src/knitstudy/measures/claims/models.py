"""Claims about reduced models, their springs and beams in contact: R1 to R8 and B1 of ``paper_claims.csv``."""

from __future__ import annotations

import fnmatch
from collections.abc import Callable, Iterable

import numpy as np

from knitstudy.measures import response
from knitstudy.measures.cases import Case, Simulation, is_plain
from knitstudy.measures.catalogue import CASES
from knitstudy.measures.claims.evidence import NOT_RUN, Evidence, Judgement, Measured, NotRun, verdict
from knitstudy.measures.cost import MEGABYTE, memory_growth
from knitstudy.measures.discretisation import made_of
from knitstudy.measures.estimate import UNKNOWN, Estimate, all_hold
from knitstudy.measures.paper_values import REPORTED
from knitstudy.measures.reference import transferred_uncertainty
from knitstudy.models.joints import springs

MUCH_CLOSER = 0.25  # Claim R1: "much closer" is at most a quarter of the distance
GOOD, COMPARABLE = 0.1, 0.25  # Claims R7, R8: largest distance of F(strain)
SAME_SHAPE, SAME_SIZE = 0.8, 2.0  # Claim R2: least correlation of u_z, largest factor of amplitudes
NONE_AT_ALL = 0.01  # Claim R2: share of the reference's largest |u_z| that counts as no out-of-plane motion
BY_FAR = 2.0  # Claim R4: kz over the larger of kx and ky; the paper's least is 2.6
PENALTIES = "dns-isotropic-{}-penalty*"  # Claim R4: scenes with penalties alone, by direction
AS_MUCH = 0.9  # Claims R5, R6: share of the savings
LITTLE, SAME_COUNT = 2.0, 0.03  # Claim R5: factor of the paper's share of memory; distance of unknowns
SAVINGS = ("DOF", "memory growth", "time")


def judge_forces(evidence: Evidence) -> Judgement:
    """R1: the force of the 3D model is much closer to the reference than that of the 2D model, in all four cases."""

    def judge(case: Case) -> tuple[list[Measured], bool | None]:
        near, far = (case.main[name].history for name in ("rom3d", "rom2d"))
        distance = case.reference.force_distance
        ratio = distance(near).value / distance(far).value
        said = [Measured("distance, 3D over 2D ROM", f"{ratio:.2f}", "much closer")]
        said += [Measured("3D ROM", f"{distance(near)}"), Measured("2D ROM", f"{distance(far)}")]
        for direct in (case.dns, *case.others):
            said.append(Measured(f"DNS of {made_of(direct.scene)}", f"{distance(direct.history)}"))
        return said, case.reference.nearer(near, far, MUCH_CLOSER)

    note = f"much closer: {MUCH_CLOSER:g} times the distance or less"
    return _in_cases(evidence, judge, note)


def judge_agreement(bar: float, evidence: Evidence) -> Judgement:
    """R7, R8: the force of the 3D model is within a distance of the reference, in all four cases."""

    def judge(case: Case) -> tuple[list[Measured], bool | None]:
        distance = case.reference.force_distance(case.main["rom3d"].history)
        agrees = "good agreement" if bar == GOOD else "comparable"
        return [Measured("distance of the 3D ROM", f"{distance}", agrees)], distance.below(bar)

    return _in_cases(evidence, judge, f"at most {bar:g}")


def judge_out_of_plane(evidence: Evidence) -> Judgement:
    """R2: in course tension u_z of the 3D model has the reference's size and the DNS's shape; the 2D model has none."""

    def judge(case: Case) -> tuple[list[Measured], bool | None]:
        dns, rom3d, rom2d = (model.history for model in (case.dns, case.main["rom3d"], case.main["rom2d"]))
        shape = response.out_of_plane_correlation(rom3d, dns)
        size = case.reference.ratio(rom3d, response.RMS_U_Z, response.rms_out_of_plane(rom3d))
        flat = case.reference.ratio(rom2d, response.LARGEST_U_Z, response.out_of_plane(rom2d))
        said = [
            Measured("correlation of u_z", f"{shape:.2f}", "captured"),
            Measured("amplitude of u_z over the reference's", f"{size}"),
            Measured("largest |u_z| over the reference's, 2D ROM", f"{flat}", "none"),
        ]
        bounds = (size.above(1 / SAME_SIZE), size.below(SAME_SIZE), flat.below(NONE_AT_ALL))
        return said, all_hold((shape >= SAME_SHAPE, *bounds))

    note = (
        f"2D ROM: its largest |u_z| over the reference's; correlation with DNS from {SAME_SHAPE:g}, amplitude within a "
        f"factor of {SAME_SIZE:g} of the reference's"
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
    true = _over_ties(*cases)
    return Judgement(
        (
            Measured("largest |u_z|, friction over ties, 3D ROM", f"{rom[0] / rom[1]:.2f}", "> 1"),
            Measured("the same, DNS", f"{dns[0] / dns[1]:.2f}", "> 1"),
            Measured("the same, reference", f"{true}"),
        ),
        verdict(all_hold((rom[0] > rom[1], true.above(1.0)))),
        "",
        _names([case.dns for case in cases] + [case.main["rom3d"] for case in cases]),
    )


def _over_ties(slides: Case, tie: Case) -> Estimate:
    """Return the reference's largest |u_z| with friction over that with ties, at the largest strain with both."""
    u_z, references = response.LARGEST_U_Z, (slides.reference, tie.reference)
    strains = set.intersection(*(set(each.strains(u_z)) for each in references))
    if not strains:
        return UNKNOWN
    one, other = (each.at(u_z, max(strains)) for each in references)
    off = one.uncertainty / one.value + other.uncertainty / other.value
    return Estimate(one.value / other.value, off * one.value / other.value)


def judge_springs(evidence: Evidence) -> Judgement:
    """R4: of the averaged springs kz is the largest by far; kx > ky in course tension, ky > kx in wale tension."""
    cases = [case for case in evidence.cases if case.interaction == "isotropic"]
    cases = [case for case in cases if case.dns.scene.name in evidence.contacts]
    if not cases:
        raise NotRun("the study has no direct simulation with isotropic friction")
    said, holds = [], []
    for case in cases:
        way = case.direction
        (kx, ky, kz), along_knit = _springs(evidence, case.dns.scene.name)
        larger = kx > ky if way == "course" else ky > kx
        holds.append(min(kx, ky, kz) > 0 and larger and kz >= BY_FAR * max(kx, ky))
        printed = [1e-3 * evidence.printed("2", way, f"spring stiffness k{each}") for each in "xyz"]
        ratio = f"{kx / ky:.2f}", f"{printed[0] / printed[1]:.2f}"
        said.append(Measured(f"kx over ky, {way} tension", *ratio))
        ratio = f"{kz / max(kx, ky):.1f}", f"{printed[2] / max(printed[:2]):.1f}"
        said.append(Measured(f"kz over kx and ky, {way} tension", *ratio))
        for each, ours, theirs, other in zip("xyz", (kx, ky, kz), printed, along_knit, strict=True):
            said.append(Measured(f"k{each}, {way} tension", f"{ours:.3g} kN/m", f"{theirs:g} kN/m"))
            said.append(Measured(f"k{each} along the knit's axes, {way} tension", f"{other:.3g} kN/m"))
        said += _by_penalty(evidence, way)
    of_one = all(holds) and len(cases) < 2
    return Judgement(
        tuple(said),
        NOT_RUN if of_one else verdict(all(holds)),
        f"averaged secants of interfaces along {evidence.axes} axes; by far: {BY_FAR:g} times the others"
        f"{'; of one direction only' if of_one else ''}",
        _names(case.dns for case in cases),
    )


def _by_penalty(evidence: Evidence, direction: str) -> list[Measured]:
    """Return kz with penalties alone, along local axes, by the contact stiffness."""
    found = {
        evidence.scenes[name].contact.normal_stiffness: _springs(evidence, name)[0][2]
        for name in fnmatch.filter(evidence.contacts, PENALTIES.format(direction))
    }
    about = f"kz, {direction} tension, penalties alone, E / h times"
    return [Measured(f"{about} {stiffness:g}", f"{kz:.3g} kN/m") for stiffness, kz in sorted(found.items())]


def _springs(evidence: Evidence, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return averaged springs of interfaces [kN/m] along the axes of the reading, and along those of the knit."""
    contacts = evidence.contacts[name]
    return tuple(
        springs(contacts, "interface", axes, evidence.normal).averaged / 1e3
        for axes in (evidence.axes, "global")
    )


def judge_cost(evidence: Evidence) -> Judgement:
    """R5: savings of the reduced models with ties, at the paper's mesh size."""
    case = _case(evidence, "tie", ("rom3d", "rom2d"))
    if case is None or case.by_hexahedra is None:
        raise NotRun("the study has not all models of ties in course tension, the paper's element among them")
    direct = case.by_hexahedra
    unknowns, memory, time = _savings(direct, case)
    counts, grew, close, grown, printed = [], [], [], {}, {}
    for name, model in {"dns": direct, "rom3d": case.main["rom3d"], "rom2d": case.main["rom2d"]}.items():
        label = model.scene.kind.fidelity.label
        ours, theirs = model.history.attrs["dof"], _reported(evidence, name, "degrees of freedom")
        counts.append(Measured(f"degrees of freedom, {label}", f"{ours:,}", f"{theirs:,.0f}"))
        if name != "rom2d":  # The sentence gives the counts of DNS and 3D network.
            close.append(abs(ours / theirs - 1) <= SAME_COUNT)
        grown[name] = model.history.attrs["memory_growth"] / MEGABYTE
        printed[name] = _reported(evidence, name, "memory")
        grew.append(Measured(f"memory growth, {label}", f"{grown[name]:.1f} MB", f"{printed[name]:g} MB"))
    fewer, less = (
        _reported(evidence, "dns", of) / _reported(evidence, "rom3d", of)
        for of in ("degrees of freedom", "memory")
    )
    measured = [
        *reversed(counts),
        Measured("degrees of freedom, DNS over 3D ROM", f"{unknowns:.0f}", f"{fewer:.0f}"),
        Measured("memory growth, DNS over 3D ROM", f"{memory:.0f}", f"{less:.1f}"),
        Measured("time, DNS over 3D ROM", f"{time:.0f}"),
        *grew,
    ]
    extra, extra_of_paper = ((of["rom3d"] - of["rom2d"]) / of["dns"] for of in (grown, printed))
    reproduced = all(close) and memory >= AS_MUCH * less and extra <= LITTLE * extra_of_paper
    note = (
        "the yarn's length and diameter were inferred from the printed DOF: that part was used in calibration"
    )
    size, wanted = direct.scene.metres("mesh.size"), _reported(evidence, "dns", "mesh size")
    if not np.isclose(size, wanted):
        raise NotRun(f"elements of {1e3 * size:g} mm, the paper's of {1e3 * wanted:g} mm; {note}", *measured)
    return Judgement(tuple(measured), verdict(reproduced), note)


def judge_cost_with_friction(evidence: Evidence) -> Judgement:
    """R6: with isotropic friction the 3D model saves as much as with ties; over the paper's element if both have it."""
    tie, slides = (_case(evidence, kind, ("rom3d",)) for kind in ("tie", "isotropic"))
    if tie is None or slides is None:
        raise NotRun("the study has no 3D ROM with ties and with isotropic friction in course tension")
    direct = [slides.by_hexahedra, tie.by_hexahedra]
    if None in direct or made_of(direct[0].scene) != made_of(direct[1].scene):
        direct = [slides.dns, tie.dns]
    rows = list(zip(SAVINGS, _savings(direct[0], slides), _savings(direct[1], tie), strict=True))
    ratios = sorted((mine / theirs, name) for name, mine, theirs in rows)
    said = [
        Measured(f"{name} saved, over that with ties", f"{ratio:.2f}", "similar") for ratio, name in ratios
    ]
    said += [Measured(f"{name}, DNS over 3D ROM, friction", f"{mine:,.4g}") for name, mine, _ in rows]
    return Judgement(
        tuple(said),
        verdict(all(mine >= AS_MUCH * theirs for _, mine, theirs in rows)),
        f"DNS: {made_of(direct[0].scene)}; as much: {AS_MUCH:.0%} of each or more",
        _names([slides.dns, *direct, tie.main["rom3d"], slides.main["rom3d"]]),
    )


def _savings(direct: Simulation, case: Case) -> tuple[float, float, float]:
    """Return `SAVINGS` of a direct simulation over those of the 3D model."""
    dns, rom = (model.history.attrs for model in (direct, case.main["rom3d"]))
    memory = dns["memory_growth"] / memory_growth(case.main["rom3d"].history)
    return dns["dof"] / rom["dof"], memory, dns["wall_seconds"] / rom["wall_seconds"]


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
        said = [Measured("the same, DNS", f"{known.force_ratio(case.dns.history)}")]
    elif "untied" in evidence.direct:
        solids = evidence.history("untied")
        known = evidence.reference_of("untied")
        if not known.known:
            known = transferred_uncertainty(case.reference, case.dns.history, solids)
        alike, said = [each for each in case.beams if each.scene.value("contact.tied_edges") == ties], []
    else:
        raise NotRun("the study has no solids whose rows are tied as those of the beams")
    ratio = known.force_ratio(beams.history)
    if not ratio.known:
        raise NotRun("there is no reference at a strain that beams and solids reach")
    said += [Measured(f"the same, {model.label}", f"{known.force_ratio(model.history)}") for model in alike]
    return Judgement(
        (Measured("stiffness over that of solids", f"{ratio}", "< 1"), *said),
        verdict(ratio.below(1.0)),
        f"judged by {beams.label}; rows that are tied: {ties}",
        _names([case.dns, *alike] if known is case.reference else [case.dns]),
    )


def _in_cases(
    evidence: Evidence,
    judge: Callable[[Case], tuple[Iterable[Measured], bool | None]],
    note: str,
    directions: tuple[str, ...] = ("course", "wale"),
) -> Judgement:
    """Judge every case with both reduced models; what holds in some cases only is not reproduced."""
    cases = [case for case in _with_models(evidence, ("rom3d", "rom2d")) if case.direction in directions]
    if not cases:
        raise NotRun("the study has no direct simulation with both reduced models")
    _require_reference(cases)
    said, held = zip(*map(judge, cases), strict=True)
    rows = sorted(zip(held, cases, said, strict=True), key=lambda row: row[0] is True)  # failures first
    by_case = [(f"{each.quantity}; {case.label}", *each[1:]) for _, case, words in rows for each in words]
    notes = f"the main models hold in {held.count(True)} of {len(cases)} cases"
    if None in held:
        notes += f", and {held.count(None)} cannot be decided"
    lacking = all_hold(held) and len(cases) < sum(case.endswith(directions) for case in CASES)
    return Judgement(
        tuple(Measured(*each) for each in by_case),
        NOT_RUN if lacking else verdict(all_hold(held)),
        f"{notes}; {note}",
        _names(model for case in cases for model in (case.dns, *case.main.values())),
    )


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
