"""Claims about reduced models, their springs and beams in contact: R1 to R6 and B1 of ``paper_claims.csv``."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from knitstudy.measures.cases import Case, Simulation, is_plain
from knitstudy.measures.catalogue import CASES
from knitstudy.measures.claims.evidence import (
    NOT_RUN,
    REPRODUCED,
    Evidence,
    Judgement,
    NotRun,
    at_full_strain,
    verdict,
)
from knitstudy.measures.cost import MEGABYTE, memory_growth
from knitstudy.measures.discretisation import made_of
from knitstudy.measures.estimate import UNKNOWN, Estimate, all_hold
from knitstudy.measures.paper_values import REPORTED, number
from knitstudy.measures.response import (
    LARGEST_U_Z,
    RMS_U_Z,
    largest_out_of_plane,
    out_of_plane,
    out_of_plane_correlation,
    rms_out_of_plane,
)
from knitstudy.models.joints import springs

MUCH_CLOSER = 0.5  # Claim R1: "much closer" is at most half the distance

# Claim R2: least correlation of u_z, and the factor by which amplitudes may differ.
SAME_SHAPE, SAME_SIZE = 0.8, 2.0
NONE_AT_ALL = 0.01  # Claim R2: share of the reference's largest |u_z| that counts as no out-of-plane motion

# Claim R4: kz over the larger of kx and ky from which on it is the largest by far; the paper's least is 2.6.
BY_FAR = 2.0

# Claim R4: names of simulations with penalties alone, of several contact stiffnesses, by direction.
PENALTIES = "dns-isotropic-{}-penalty*"

# Claims R5 and R6: share of the savings to be reached; share of the DNS's memory that is little.
AS_MUCH, LITTLE = 0.9, 0.05

IN_WORDS = {True: "holds", False: "does not hold", None: "cannot be decided"}


def judge_forces(evidence: Evidence) -> Judgement:
    """R1: the force of the 3D model is much closer to the reference than that of the 2D model, in all four cases."""

    def judge(case: Case) -> tuple[str, bool | None]:
        near, far = (case.main[name].history for name in ("rom3d", "rom2d"))
        distance = case.reference.force_distance
        said = f"3D ROM {distance(near)}, 2D ROM {distance(far)}"
        for direct in (case.dns, *case.others):
            said += f", DNS of {made_of(direct.scene)} {distance(direct.history)}"
        return said, case.reference.nearer(near, far, MUCH_CLOSER)

    judged = _in_cases(evidence, judge, "relative L2 distance of F(strain) to the reference: ")
    return _noted(judged, f"much closer: {MUCH_CLOSER:g} times the distance or less")


def judge_out_of_plane(evidence: Evidence) -> Judgement:
    """R2: u_z of the 3D model has the reference's size and the DNS's shape; the 2D model has none, in all cases."""

    def judge(case: Case) -> tuple[str, bool | None]:
        dns, rom3d, rom2d = (model.history for model in (case.dns, case.main["rom3d"], case.main["rom2d"]))
        shape = out_of_plane_correlation(rom3d, dns)
        size = case.reference.ratio(rom3d, RMS_U_Z, rms_out_of_plane(rom3d))
        flat = case.reference.ratio(rom2d, LARGEST_U_Z, out_of_plane(rom2d))
        said = f"correlation {shape:.3f}, amplitude ratio {size}, 2D ROM {flat}"
        holds = (
            shape >= SAME_SHAPE,
            size.above(1 / SAME_SIZE),
            size.below(SAME_SIZE),
            flat.below(NONE_AT_ALL),
        )
        return said, all_hold(holds)

    judged = _in_cases(evidence, judge, "u_z along the centrelines, 3D ROM: ")
    bars = f"correlation with DNS from {SAME_SHAPE:g}, amplitude within a factor of {SAME_SIZE:g} of the reference's"
    return _noted(judged, f"2D ROM: its largest |u_z| over the reference's; {bars}")


def judge_motion_order(evidence: Evidence) -> Judgement:
    """R3: the 3D model moves further out of its plane with friction than with ties, and so does the reference."""
    cases = {(case.interaction, case.direction): case for case in _with_models(evidence, ("rom3d",))}
    directions = [way for way in ("course", "wale") if ("tie", way) in cases and ("isotropic", way) in cases]
    if "course" not in directions:
        raise NotRun("the study has no 3D ROM with ties and with isotropic friction in course tension")
    compared = [cases[kind, way] for way in directions for kind in ("tie", "isotropic")]
    _require_reference(compared)
    said, more = [], {}
    for way in directions:
        tie, slides = cases["tie", way], cases["isotropic", way]
        of_rom, of_dns = (
            largest_out_of_plane(one.history) / largest_out_of_plane(other.history)
            for one, other in ((slides.main["rom3d"], tie.main["rom3d"]), (slides.dns, tie.dns))
        )
        true = _over_ties(slides, tie)
        said.append(f"{way} {of_rom:.2f} in the 3D ROM, {of_dns:.2f} in the DNS, {true} in the reference")
        more[way] = all_hold((of_rom > 1, true.above(1.0)))
    judged = Judgement(
        f"largest |u_z| with isotropic friction over that with ties: {'; '.join(said)}",
        verdict(more["course"]),
        "Fig. 16 is of course tension, which decides"
        + (f"; in wale tension it {IN_WORDS[more['wale']]}" if "wale" in more else ""),
    )
    models = [model for case in compared for model in (case.dns, case.main["rom3d"])]
    return _at_full_strain(evidence, judged, models, cases["isotropic", directions[0]].dns)


def _over_ties(slides: Case, tie: Case) -> Estimate:
    """Return the reference's largest |u_z| with friction over that with ties, at the largest strain with both."""
    strains = set(slides.reference.strains(LARGEST_U_Z)) & set(tie.reference.strains(LARGEST_U_Z))
    if not strains:
        return UNKNOWN
    one, other = (case.reference.at(LARGEST_U_Z, max(strains)) for case in (slides, tie))
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
        contacts, way = evidence.contacts[case.dns.scene.name], case.direction
        kx, ky, kz = springs(contacts, "interface").averaged
        normal, tangential = springs(contacts, "interface", "contact").averaged / 1e3
        larger = kx > ky if way == "course" else ky > kx
        holds.append(min(kx, ky, kz) > 0 and larger and kz >= BY_FAR * max(kx, ky))
        said.append(
            f"{way} kx {kx / 1e3:.3g}, ky {ky / 1e3:.3g}, kz {kz / 1e3:.3g} kN/m, normal to contact {normal:.3g} and "
            f"along it {tangential:.3g} kN/m{_by_penalty(evidence, way)}"
        )
    judged = Judgement(
        "averaged secants of interfaces: " + "; ".join(said),
        verdict(all(holds)),
        f"by far: {BY_FAR:g} times the others",
    )
    if all(holds) and len(cases) < 2:
        judged = replace(judged, verdict=NOT_RUN, note=f"{judged.note}; of one direction only")
    return _at_full_strain(evidence, judged, [case.dns for case in cases], cases[0].dns)


def _by_penalty(evidence: Evidence, direction: str) -> str:
    """Return kz and the stiffness normal to contact with penalties alone, by the contact stiffness, in words."""
    found = {}
    for name, contacts in evidence.contacts.items():
        if fnmatchcase(name, PENALTIES.format(direction)):
            kz = springs(contacts, "interface").averaged[2]
            normal = springs(contacts, "interface", "contact").averaged[0]
            stiffness = evidence.scenes[name].contact.normal_stiffness
            found[stiffness] = f"{kz / 1e3:.3g} and {normal / 1e3:.3g}"
    listed = ", ".join(f"{found[stiffness]} with {stiffness:g} E / h" for stiffness in sorted(found))
    return f" (penalties alone, kz and normal: {listed})" if listed else ""


def judge_cost(evidence: Evidence) -> Judgement:
    """R5: savings of the reduced models with ties, at the paper's mesh size."""
    case = _case(evidence, "tie", ("rom3d", "rom2d"))
    if case is None or case.by_hexahedra is None:
        raise NotRun("the study has not all models of ties in course tension, the paper's element among them")
    direct = case.by_hexahedra
    printed = {
        quantity: _reported(evidence, "dns", quantity) / _reported(evidence, "rom3d", quantity)
        for quantity in ("degrees of freedom", "memory")
    }
    dof, memory, seconds = _savings(direct, case)
    grown = {
        name: model.history.attrs["memory_growth"] for name, model in (("dns", direct), *case.main.items())
    }
    measured = (
        f"3D ROM: {dof:.1f} times fewer DOF (paper {printed['degrees of freedom']:.1f}), memory growth "
        f"{grown['rom3d'] / MEGABYTE:.1f} MB against {grown['dns'] / MEGABYTE:.0f} MB of DNS (paper "
        f"{printed['memory']:.1f} times less), {seconds:.0f} times faster; 2D ROM {grown['rom2d'] / MEGABYTE:.1f} MB"
    )
    reproduced = (
        dof >= AS_MUCH * printed["degrees of freedom"]
        and memory >= AS_MUCH * printed["memory"]
        and abs(grown["rom3d"] - grown["rom2d"]) <= LITTLE * grown["dns"]
    )
    note = (
        "the yarn's length and diameter were inferred from the printed DOF: that part was used in calibration"
    )
    size, wanted = direct.scene.mesh.size, _reported(evidence, "dns", "mesh size")
    if not np.isclose(size, wanted):
        raise NotRun(f"elements of {1e3 * size:g} mm, the paper's of {1e3 * wanted:g} mm; {note}", measured)
    return Judgement(measured, verdict(reproduced), note)


def judge_cost_with_friction(evidence: Evidence) -> Judgement:
    """R6: with isotropic friction the 3D model saves as much as with ties; over the paper's element if both have it."""
    tie, slides = (_case(evidence, kind, ("rom3d",)) for kind in ("tie", "isotropic"))
    if tie is None or slides is None:
        raise NotRun("the study has no 3D ROM with ties and with isotropic friction in course tension")
    direct = [slides.by_hexahedra, tie.by_hexahedra]
    if None in direct or made_of(direct[0].scene) != made_of(direct[1].scene):
        direct = [slides.dns, tie.dns]
    saved, with_ties = _savings(direct[0], slides), _savings(direct[1], tie)
    names = ("DOF", "memory growth", "time")
    measured = f"DNS ({made_of(direct[0].scene)}) over 3D ROM: " + ", ".join(
        f"{name} {mine:,.4g} (ties {theirs:,.4g})"
        for name, mine, theirs in zip(names, saved, with_ties, strict=True)
    )
    holds = all(mine >= AS_MUCH * theirs for mine, theirs in zip(saved, with_ties, strict=True))
    judged = Judgement(measured, verdict(holds), f"as much: {AS_MUCH:.0%} of each or more")
    models = [*direct, tie.main["rom3d"], slides.main["rom3d"]]
    return _at_full_strain(evidence, judged, models, slides.dns)


def _savings(direct: Simulation, case: Case) -> tuple[float, float, float]:
    """Return degrees of freedom, growth of memory and time of a direct simulation over those of the 3D model."""
    dns, rom = (model.history.attrs for model in (direct, case.main["rom3d"]))
    memory = dns["memory_growth"] / memory_growth(case.main["rom3d"].history)
    return dns["dof"] / rom["dof"], memory, dns["wall_seconds"] / rom["wall_seconds"]


def _reported(evidence: Evidence, fidelity: str, quantity: str) -> float:
    return number(evidence.paper, "5", REPORTED[fidelity], quantity)


def judge_beams(evidence: Evidence) -> Judgement:
    """B1: beams in contact at one point of a crossing, with rigid sections, are softer than solids."""
    case = _case(evidence, "isotropic", ())
    plain = [model for model in case.beams if is_plain(model.scene)] if case else []
    if not plain:
        raise NotRun("the study has no beams in contact beside solids in course tension")
    _require_reference([case])
    models = {"DNS": case.dns} | {model.label: model for model in case.beams}
    ratios = {label: case.reference.force_ratio(model.history) for label, model in models.items()}
    judged = Judgement(
        "secant stiffness over the reference's: "
        + ", ".join(f"{label} {ratio}" for label, ratio in ratios.items()),
        verdict(ratios[plain[0].label].below(1.0)),
        f"judged by {plain[0].label}",
    )
    return _at_full_strain(evidence, judged, [case.dns, *case.beams], case.dns)


def _in_cases(evidence: Evidence, judge: Callable[[Case], tuple[str, bool | None]], begin: str) -> Judgement:
    """Judge every case with both reduced models; what holds in some cases only is not reproduced."""
    cases = _with_models(evidence, ("rom3d", "rom2d"))
    if not cases:
        raise NotRun("the study has no direct simulation with both reduced models")
    _require_reference(cases)
    judged = [judge(case) for case in cases]
    measured = begin + "; ".join(
        f"{case.label}: {said}" for case, (said, _) in zip(cases, judged, strict=True)
    )
    held = [holds for _, holds in judged]
    note = f"the main models hold in {held.count(True)} of {len(cases)} cases"
    if None in held:
        note += f", and {held.count(None)} cannot be decided"
    result = Judgement(measured, verdict(all_hold(held)), note)
    if result.verdict == REPRODUCED and len(cases) < len(CASES):
        result = replace(result, verdict=NOT_RUN)
    models = [model for case in cases for model in (case.dns, *case.main.values())]
    return _at_full_strain(evidence, result, models, cases[0].dns)


def _require_reference(cases: Iterable[Case]) -> None:
    if lacking := [case.label for case in cases if not case.reference.known]:
        raise NotRun(f"there is no reference of {', '.join(lacking)}")


def _with_models(evidence: Evidence, fidelities: Iterable[str]) -> list[Case]:
    """Return the cases that have reduced models of some fidelities."""
    return [case for case in evidence.cases if set(fidelities) <= set(case.main)]


def _case(evidence: Evidence, interaction: str, fidelities: Iterable[str]) -> Case | None:
    """Return the case of an interaction in course tension with some reduced models, None where a study lacks it."""
    cases = _with_models(evidence, fidelities)
    return next(
        (case for case in cases if (case.interaction, case.direction) == (interaction, "course")), None
    )


def _noted(judgement: Judgement, note: str) -> Judgement:
    return replace(judgement, note="; ".join(filter(None, [judgement.note, note])))


def _at_full_strain(
    evidence: Evidence, judged: Judgement, models: Iterable[Simulation], direct: Simulation
) -> Judgement:
    return at_full_strain(evidence, judged, [model.scene.name for model in models], direct.scene.name)
