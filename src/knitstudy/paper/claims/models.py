"""Claims about reduced models, their springs and beams in contact: R1 to R11 and B1 of ``paper_claims.csv``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from knitstudy.knit.yarns.joints import MAIN, contact_normals, partners, springs
from knitstudy.measures import response
from knitstudy.measures.centre_cell import centre_cell
from knitstudy.measures.estimate import UNKNOWN, Estimate
from knitstudy.measures.reference import made_of
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.paper.cases import REPORTED, Case, label_of
from knitstudy.paper.claims import (
    CLAIMS,
    COMPARABLE,
    GOOD,
    MUCH,
    UNDECIDABLE,
    NotRun,
    Remark,
    Row,
    at_least,
    at_most,
    by_meanings,
    comparable,
    holds,
)
from knitstudy.paper.claims.evidence import Evidence
from knitstudy.paper.columns import DOF, MEMORY, U_Z, Simulation
from knitstudy.paper.scene_names import CASES, model_name
from knitstudy.paper.square_knits import FACTOR, FRONT, PLANAR, SIZES, SPATIAL, TIED

SAME_SHAPE = 0.8  # Claim R2: least correlation of u_z
NONE_AT_ALL = 0.01  # Claim R2: share of the reference's largest |u_z| that counts as no out-of-plane motion
# Claim R10: largest angle of normals that are the same, a tenth of a right angle [deg]; meanings of a normal
SAME_NORMAL = 9.0
MEANINGS = {"of the pressure": MAIN, "of pressure and friction": "resultant"}
TURNS = {(0, 1, 2): "turn", (2,): "turn in the plane"}  # Claim R11: axes of turns that count
SAVINGS = ("DOF", "memory growth", "processor time")
NO_3D = "the study has no 3D ROM with ties and with isotropic friction in course tension"


@CLAIMS.add("R1", worst_first=True)
def forces(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the force of the 3D model is much closer to the reference than that of the 2D model, in all cases."""

    def judge(case: Case) -> Iterator[Row]:
        near, far = (case.main[name] for name in ("rom3d", "rom2d"))
        ratio = case.distance(near).value / case.distance(far).value
        margin = 1 / (MUCH * ratio) if ratio > 0 else np.inf
        histories = near.history, far.history
        closer, much = (case.reference.nearer(*histories, share) for share in (1.0, 1 / MUCH))
        yield holds("distance, 3D over 2D ROM", f"{ratio:.2f}", "much closer", closer, much, margin)
        yield Row("3D ROM", f"{case.distance(near)}")
        yield Row("2D ROM", f"{case.distance(far)}")
        for direct in (case.dns, *case.others):
            yield Row(f"DNS of {made_of(direct.scene)}", f"{case.distance(direct)}")

    yield from _in_cases(evidence, judge, f"much closer: {1 / MUCH:g} times the distance or less")


@CLAIMS.add("R7", worst_first=True, word="good agreement", bar=GOOD)
@CLAIMS.add("R8", worst_first=True, word="comparable", bar=COMPARABLE - 1)
def agreement(evidence: Evidence, word: str, bar: float) -> Iterator[Row | Remark]:
    """Yield that the force of the 3D model is comparable (R8) to the reference, or in good agreement (R7)."""

    def judge(case: Case) -> Iterator[Row]:
        yield at_most(
            "distance of the 3D ROM", case.distance(case.main["rom3d"]), word, bar, sense=COMPARABLE - 1
        )

    yield from _in_cases(evidence, judge, f"{word}: a relative distance of F(strain) of at most {bar:g}")


@CLAIMS.add("R2", worst_first=True)
def out_of_plane(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that in course tension the 3D model's u_z has the reference's size and the DNS's shape; 2D has none."""

    def judge(case: Case) -> Iterator[Row]:
        spatial = case.main["rom3d"]
        planar = case.main["rom2d"].history
        shape = case.shape(spatial)
        yield at_least("correlation of u_z", shape, "captured", SAME_SHAPE, sense=0.0, text=f"{shape:.2f}")
        size = case.amplitude(spatial)
        name = "amplitude of u_z over the reference's"
        yield comparable(name, size, 1.0, f"{size}", "captured", direction=size.above(0.0))
        flat = case.reference.ratio(planar, response.LARGEST_U_Z, response.out_of_plane(planar))
        yield at_most("largest |u_z| over the reference's, 2D ROM", flat, "none", NONE_AT_ALL)

    note = (
        f"captured: a correlation of {SAME_SHAPE:g} or more, an amplitude within a factor of {COMPARABLE:g}"
    )
    yield from _in_cases(evidence, judge, note, ("course",))


def _in_cases(
    evidence: Evidence,
    judge: Callable[[Case], Iterator[Row]],
    note: str,
    directions: tuple[str, ...] = ("course", "wale"),
) -> Iterator[Row | Remark]:
    """Yield the rows of every case with both reduced models."""
    cases = [
        case
        for case in evidence.cases
        if {"rom3d", "rom2d"} <= set(case.main) and case.direction in directions
    ]
    if not cases:
        raise NotRun("the study has no direct simulation with both reduced models")
    _require_reference(*cases)
    for case in cases:
        for row in judge(case):
            yield replace(row, quantity=f"{row.quantity}; {case.label}")
    scenes = _names(*(model for case in cases for model in (case.dns, *case.main.values())))
    yield Remark(note, scenes, len(cases) == sum(case.endswith(directions) for case in CASES))


@CLAIMS.add("R3")
def order_of_motion(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the 3D model, like the reference, moves further out of its plane with friction than with ties."""
    cases = [_case(NO_3D, evidence, kind, "rom3d") for kind in ("isotropic", "tie")]
    _require_reference(*cases)
    models = [case.main["rom3d"] for case in cases]
    direct = [case.dns for case in cases]
    name = "largest |u_z|, friction over ties"
    yield at_least(f"{name}, 3D ROM", models[0][U_Z] / models[1][U_Z], "> 1", 1.0)
    yield at_least(f"{name}, reference", _over_ties(*cases), "> 1", 1.0)
    yield Row(f"{name}, DNS", f"{direct[0][U_Z] / direct[1][U_Z]:.2f}", "> 1")
    yield Remark(scenes=_names(*direct, *models))


def _over_ties(slides: Case, tie: Case) -> Estimate:
    """Return the reference's largest |u_z| with friction over that with ties, at the largest strain with both."""
    u_z = response.LARGEST_U_Z
    references = (slides.reference, tie.reference)
    strains = set.intersection(*(set(reference.strains(u_z)) for reference in references))
    if not strains:
        return UNKNOWN
    one, other = (reference.at(u_z, max(strains)) for reference in references)
    return one.over(other)


@CLAIMS.add("R4", worst_first=True)
def order_of_springs(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that of the averaged springs kz is the largest by far; kx > ky in course tension, ky > kx in wale."""
    for case in (cases := _with_contacts(evidence)):
        way = case.direction
        ours = _springs(evidence, case.dns.scene.name)
        printed = _printed_springs(evidence, way)
        ratio, theirs = (of[2] / max(of[:2]) for of in (ours, printed))
        name = f"kz over kx and ky, {way} tension"
        yield at_least(name, ratio, f"{theirs:.1f}", MUCH, sense=1.0, text=f"{ratio:.1f}")
        smallest = min(ours)
        text = f"{smallest:.3g} kN/m"
        yield at_least(f"smallest spring, {way} tension", smallest, "> 0", 0.0, text=text)
        one, other = (0, 1) if way == "course" else (1, 0)
        ratio, theirs = (of[one] / of[other] for of in (ours, printed))
        # Only the order of kz is a sentence of the paper; that of kx and ky is of Table 2.
        name = f"k{'xy'[one]} over k{'xy'[other]}, {way} tension"
        yield at_least(name, ratio, f"{theirs:.2f}", 1.0, sense=-np.inf).uncounted("nothing contradicts it")
    yield _of_both_directions(cases, f"averaged secants of interfaces along {evidence.axes} axes")


@CLAIMS.add("R9", worst_first=True)
def values_of_springs(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that the averaged springs have the values of Table 2."""
    for case in (cases := _with_contacts(evidence)):
        way = case.direction
        name = case.dns.scene.name
        pairs = zip("xyz", _springs(evidence, name), _printed_springs(evidence, way), strict=True)
        for axis, ours, theirs in pairs:
            quantity = f"k{axis}, {way} tension"
            yield comparable(quantity, ours, theirs, f"{ours:.3g} kN/m", f"{theirs:g} kN/m")
        for axis, ours in zip("xyz", _springs(evidence, name, "global"), strict=True):
            yield Row(f"k{axis} along the knit's axes, {way} tension", f"{ours:.3g} kN/m")
    yield _of_both_directions(cases, "averaged secants of interfaces; Table 2")


def _with_contacts(evidence: Evidence) -> list[Case]:
    """Return the cases of isotropic friction whose contacts are known."""
    cases = [case for case in evidence.cases if case.interaction == "isotropic"]
    cases = [case for case in cases if "contacts" in case.dns.results]
    if not cases:
        raise NotRun("the study has no direct simulation with isotropic friction")
    return cases


def _of_both_directions(cases: list[Case], note: str) -> Remark:
    if len(cases) < 2:
        raise NotRun(f"{note}; of one direction only")
    return Remark(note, _names(*(case.dns for case in cases)))


def _printed_springs(evidence: Evidence, direction: str) -> list[float]:
    """Return the springs of Table 2 [kN/m]."""
    return [1e-3 * evidence.printed("2", direction, f"spring stiffness k{axis}") for axis in "xyz"]


def _springs(evidence: Evidence, name: str, axes: str | None = None) -> Floats:
    """Return averaged springs of interfaces (3,) [kN/m] along axes, by default along the axes of the reading."""
    contacts = evidence.rows[name].results["contacts"]
    return springs(contacts, "interface", axes or evidence.axes, evidence.normal).averaged / 1e3


@CLAIMS.add("R10")
def same_normals(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that both contacts on a side of an interlock, P1 and P2, have one normal, of the kind that joints take."""
    if not (angles := _between_normals(evidence)):
        raise NotRun("at no free interlock do both contacts of a side touch")
    pressure, resultant = MEANINGS
    deciding = resultant if evidence.normal == MEANINGS[resultant] else pressure
    mean, largest = angles[deciding].mean(), angles[deciding].max()
    name, text = "angle between the normals at P1 and P2, mean; largest", "{:.0f}°; {:.0f}°"
    size = largest <= SAME_NORMAL
    margin = SAME_NORMAL / largest if largest else np.inf
    yield holds(f"{name}, {deciding}", text.format(mean, largest), "0°", mean < 45, size, margin)
    for meaning, other in angles.items():
        if meaning != deciding:
            yield Row(f"the same, {meaning}", text.format(other.mean(), other.max()))
    wale = evidence.pulled_in("wale")
    if wale.has(wale.direct.get("isotropic", ""), "contacts"):
        for meaning, other in _between_normals(wale).items():
            yield Row(f"the same, {meaning}, wale tension", text.format(other.mean(), other.max()))
    yield Remark(scenes=(evidence.direct["isotropic"],))


def _between_normals(evidence: Evidence) -> dict[str, Floats]:
    """Return angles between the normals at P1 and P2 of free interlocks in contact [deg] by the meaning of a normal."""
    contacts = evidence.contact("isotropic")
    both = partners(contacts)
    free = ~contacts["tied"].to_numpy().astype(bool) & (contacts["zones"].to_numpy()[-1] > 0)
    free &= free[both]
    angles = {}
    for meaning, reading in MEANINGS.items() if free.any() else ():
        normal = contact_normals(contacts, reading)[free], contact_normals(contacts, reading)[both[free]]
        angles[meaning] = np.degrees(np.arccos(np.clip(np.abs(np.sum(np.multiply(*normal), axis=1)), 0, 1)))
    return angles


@CLAIMS.add("R11", worst_first=True)
def shared_nodes(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that both yarns of a tied crossing turn as one, as beams do that share a node."""
    scenes, found, shown = [], [], []
    for way in ("course", "wale"):
        pulled = evidence.pulled_in(way)
        tests = []
        for axes, words in TURNS.items():
            apart, turned = _turns(pulled, "tie", axes)
            share = apart / turned if turned > 0 else np.inf
            name = f"turn of tied yarns against each other over their own {words}, {way} tension"
            text = f"{share:.2f} ({apart:.1f}° over {turned:.1f}°)"
            tests.append(at_most(name, share, "0", GOOD, sense=1.0, text=text))
        found += by_meanings(tests)
        scenes.append(pulled.direct["tie"])
        if pulled.has(pulled.direct.get("isotropic", ""), "contacts"):
            texts = ["{:.1f}° over {:.1f}°".format(*_turns(pulled, "isotropic", axes)) for axes in TURNS]
            shown.append(Row(f"the same with friction, {way} tension", "; ".join(texts)))
    yield from (*found, *shown)
    for case in evidence.cases:
        if case.interaction == "tie" and "rom2d" in case.main:
            force = f"{case.ratio(case.main['rom2d'])}"
            yield Row(f"force of the 2D ROM over the reference, {case.label}", force)
    undecided = any(row.grade == UNDECIDABLE for row in found)
    note = "missing is whether turns out of the plane count, which a plane network does not have"
    yield Remark(note if undecided else "", tuple(scenes))


def _turns(evidence: Evidence, kind: str, axes: tuple[int, ...]) -> tuple[float, float]:
    """Return the mean angles at crossings of the centre cell by which sections turn, against each other and at all.

    Turns about some axes of the knit count [deg].
    """
    contacts = evidence.contact(kind)
    if "section_rotation" not in contacts:
        raise NotRun("the history holds no motion of the sections")
    here = centre_cell(contacts)
    turns = (contacts[name].to_numpy()[-1, here] for name in ("relative_rotation", "section_rotation"))
    apart, turned = (np.degrees(np.linalg.norm(turn[..., axes], axis=-1)).mean() for turn in turns)
    return float(apart), float(turned)


@CLAIMS.add("R5", worst_first=True)
def cost(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield savings of the reduced models with ties and the paper's elements, counted without a solution."""
    models = {"DNS": ("dns", TIED), "3D ROM": ("rom3d", SPATIAL), "2D ROM": ("rom2d", PLANAR)}
    printed = {
        name: [evidence.printed("5", REPORTED[of], what) for what in ("degrees of freedom", "memory")]
        for name, (of, _) in models.items()
    }
    ours = {
        name: [evidence.counted(model, SIZES[0], column) for column in (DOF.head, FRONT, FACTOR)]
        for name, (_, model) in models.items()
    }
    for name, (unknowns, front, factor) in ours.items():
        size, memory = printed[name]
        row = comparable(f"degrees of freedom, {name}", unknowns, size, f"{unknowns:,.0f}", f"{size:,.0f}")
        # The sentence gives the counts of DNS and 3D network.
        yield row.uncounted("true by construction") if name != "2D ROM" else row.shown
        yield Row(f"largest front; factor, {name}", f"{front:,.3g}; {factor:,.3g} MB", f"{memory:g} MB")
    unknowns, front, factor = (one / other for one, other in zip(ours["DNS"], ours["3D ROM"], strict=True))
    fewer, more = (one / other for one, other in zip(printed["DNS"], printed["3D ROM"], strict=True))
    name = "largest front, DNS over 3D ROM"
    yield at_least(name, front, f"{more:.1f}", more / COMPARABLE, sense=1.0, text=f"{front:.0f}")
    (_, *less), (_, usual) = (_difference(each) for each in (ours, printed))
    name = "largest front, 3D ROM less 2D ROM over DNS"
    yield at_most(name, less[0], f"{usual:.1%}", MUCH * usual, sense=1.0, text=f"{less[0]:.2%}")
    yield Row("factor, DNS over 3D ROM", f"{factor:.0f}", f"{more:.1f}")
    yield Row("factor, 3D ROM less 2D ROM over DNS", f"{less[1]:.2%}", f"{usual:.1%}")
    yield Row("degrees of freedom, DNS over 3D ROM", f"{unknowns:.0f}", f"{fewer:.0f}")
    yield from _runs(evidence)
    yield Remark(
        "the yarn's length and diameter were inferred from the printed DOF: that part was used in calibration; the "
        "printed memory holds the program's own beside the matrix"
    )


def _difference(of: Mapping[str, Sequence[float]]) -> list[float]:
    """Return by how much quantities of the 3D network exceed those of the 2D network, over those of the DNS."""
    return [(spatial - planar) / dns for dns, spatial, planar in zip(*of.values(), strict=True)]


def _runs(evidence: Evidence) -> Iterator[Row]:
    """Yield the memory and the processor time of runs with ties, where the study has all three models."""
    for case in evidence.cases:
        direct = case.by_hexahedra
        with_ties = (case.interaction, case.direction) == ("tie", "course")
        if direct is None or not with_ties or not {"rom3d", "rom2d"} <= {*case.main}:
            continue
        for model in (direct, case.main["rom3d"], case.main["rom2d"]):
            label = model_name(model.scene.kind.fidelity)
            yield Row(f"memory growth of a run, {label}", f"{model[MEMORY]:.1f} MB")
        time = _savings(direct, case)[-1]
        yield Row("processor time of runs, DNS over 3D ROM", f"{time:.0f}")


@CLAIMS.add("R6")
def cost_with_friction(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that by the paper's tables the 3D model saves as many unknowns with friction as with ties."""
    counts = [
        evidence.printed(table, case, "degrees of freedom")
        for table, case in (("3", "c3w3"), ("5", REPORTED["dns"]), ("5", REPORTED["rom3d"]))
    ]
    friction, ties = (solids / counts[-1] for solids in counts[:2])
    share = friction / ties
    name = "degrees of freedom saved with friction, over those with ties, Tables 3 and 5"
    yield comparable(name, share, 1.0, f"{share:.2f}", "similar", direction=friction > 1)
    yield Row("degrees of freedom, DNS over 3D ROM, friction; ties", f"{friction:.0f}; {ties:.0f}")
    yield from _measured_savings(evidence)
    yield Remark(
        "Tables 3 and 5 are the paper's own; penalties add no degrees of freedom to this study's DNS"
    )


def _measured_savings(evidence: Evidence) -> Iterator[Row]:
    """Yield what the 3D model of this study saves with friction; over the paper's element if both cases have it."""
    try:
        cases = [_case(NO_3D, evidence, kind, "rom3d") for kind in ("isotropic", "tie")]
    except NotRun:
        return
    direct = [case.by_hexahedra for case in cases if case.by_hexahedra]
    if len({made_of(model.scene) for model in direct}) != 1 or len(direct) < 2:
        direct = [case.dns for case in cases]
    for name, friction, ties in zip(SAVINGS, *map(_savings, direct, cases), strict=True):
        yield Row(f"{name} of this study, DNS over 3D ROM, friction; ties", f"{friction:,.4g}; {ties:,.4g}")


def _savings(direct: Simulation, case: Case) -> tuple[float, float, float]:
    """Return the ratios `SAVINGS` of a direct simulation to the 3D model: unknowns, memory, processor time."""
    dns, rom = (model.history.attrs for model in (direct, case.main["rom3d"]))
    memory = dns["memory_growth"] / response.memory_growth(case.main["rom3d"].history)
    return dns["dof"] / rom["dof"], memory, dns["processor_seconds"] / rom["processor_seconds"]


@CLAIMS.add("B1")
def beams(evidence: Evidence) -> Iterator[Row | Remark]:
    """Yield that beams in contact at one point of a crossing, with rigid sections, are softer than solids."""
    lacking = "the study has no beams in contact beside solids in course tension"
    case = _case(lacking, evidence, "isotropic")
    beams = next((row for row in case.beams if row.scene.value("beam.section") == "rigid"), None)
    if beams is None:
        raise NotRun(lacking)
    ties = beams.scene.value("contact.tied_edges")
    if ties != case.dns.scene.value("contact.tied_edges"):
        raise NotRun("the study has no solids whose rows are tied as those of the beams")
    _require_reference(case)
    if not (ratio := case.ratio(beams)).known:
        raise NotRun("there is no reference at a strain that beams and solids reach")
    yield at_most("stiffness over that of solids", ratio, "< 1", 1.0)
    yield Row("the same, DNS", f"{case.ratio(case.dns)}")
    for model in case.beams:
        yield Row(f"the same, {label_of(model.scene)}", f"{case.ratio(model)}")
    note = f"judged by {label_of(beams.scene)}; rows that are tied: {ties}"
    yield Remark(note, _names(case.dns, *case.beams))


def _require_reference(*cases: Case) -> None:
    if lacking := [case.label for case in cases if not case.reference.known]:
        raise NotRun(f"there is no reference of {', '.join(lacking)}")


def _case(lacking: str, evidence: Evidence, interaction: str, *fidelities: str) -> Case:
    """Return the case of an interaction in course tension with reduced models; raise `NotRun` where there is none."""
    for case in evidence.cases:
        if (case.interaction, case.direction) == (interaction, "course") and {*fidelities} <= set(case.main):
            return case
    raise NotRun(lacking)


def _names(*models: Simulation) -> tuple[str, ...]:
    return tuple(model.scene.name for model in models)
