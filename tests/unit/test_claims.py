"""Verdicts turn with the numbers, and are withheld where the study is not the paper's."""

import re
from dataclasses import fields, replace
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import study
import synthetic
import xarray as xr
import yaml
from measured_numbers import measured_numbers
from refusals import refusal

from knitstudy.knit.contacts.contacts import extract
from knitstudy.knit.geometry.lay_out import initial_loop
from knitstudy.knit.geometry.specimens import plain_knit
from knitstudy.measures.centre_cell import centre_cell
from knitstudy.measures.reference import problem_of
from knitstudy.paper.claims import CLAIMS, at_least, at_most
from knitstudy.paper.claims.contact import asymmetry
from knitstudy.paper.claims.evidence import evidence_of, judge
from knitstudy.paper.claims.sweeps import STIFFER
from knitstudy.paper.claims.verdicts import (
    BY_OTHERS,
    QUANTITY,
    TEXTS,
    Reading,
    cells_of,
    conclude,
    findings,
    require_measured,
    under_readings,
    with_values,
)
from knitstudy.paper.columns import DOF, Simulation
from knitstudy.paper.square_knits import CELLS, FACTOR, FACTOR_MULTIPLIED, FRONT, MULTIPLIED

SLIPPERY = "inputs-friction010-isotropic-course"

NO_READINGS = pd.DataFrame(columns=[field.name for field in fields(Reading)])

COUNTS = {
    "unknowns": DOF.head,
    "with multipliers": MULTIPLIED,
    "front": FRONT,
    "factor": FACTOR,
    "factor with multipliers": FACTOR_MULTIPLIED,
}
"""Columns of the table of counted unknowns by their names in ``verdicts.yaml``."""

DIRECT = ("tie", "rough", "isotropic", "untied")
"""Simulations that are compared with each other, under their own names here."""


@pytest.fixture(scope="module")
def evidence(plain_scene, knit, contacts, paper, cases):
    """Everything as the paper has it."""
    scenes, swept = cases, study.swept_scenes()
    sizes, grown = study.domain(plain_scene)
    solid = scenes["dns-isotropic-course"].replace("solver.stabilisation", 1e-4)
    compared = {kind: solid.replace("interaction", kind) for kind in ("tie", "rough")}
    compared |= {"isotropic": solid, "untied": solid, SLIPPERY: solid.replace("contact.friction", 0.1)}
    # Knits with the drawn loop would be the main simulations of the four cases.
    swept = {name: scene for name, scene in swept.items() if name.startswith("sweep-")}
    sweeps = study.swept_histories(swept, {"shape": 1.0})
    histories, touching = in_contact(knit)
    return evidence_of(
        geometry=synthetic.geometry(plain_knit(initial_loop(plain_scene), 2, 2), flattened=0.99),
        paper=paper,
        reference=study.reference(scenes),
        scenes=swept | scenes | sizes | compared,
        histories=study.histories(scenes) | grown | sweeps | histories,
        contacts=study.sprung(contacts) | touching,
        stresses=stressed(knit) | {"isotropic": flowing(knit, histories, touching)},
        direct={kind: kind for kind in DIRECT},
        held="length",
        mechanisms=study.mechanisms(),
        counted_unknowns=study.counted(),
    )


def stressed(knit, course=(33, 33), wale=(82, 82)):
    """Stresses with the angles of interlocks and legs to x, as the paper has them."""
    return {
        f"dns-isotropic-{way}": synthetic.stresses(knit, way, *angles)
        for way, angles in (("course", course), ("wale", wale))
    }


def flowing(knit, histories, contacts):
    """Stresses that leave the yarns of a knit at contacts."""
    stresses = synthetic.stresses(knit, "course", 33, 33)
    return synthetic.flowing(stresses, histories["isotropic"], contacts["isotropic"], knit.radius)


def in_contact(knit):
    """Histories of direct simulations, and the contacts of those with friction."""
    base = synthetic.contact_history(knit)
    histories = {kind: study.in_contact(base, kind) for kind in ("tie", "rough", "isotropic")}
    slides = histories["isotropic"]
    slides = slides.assign(contact_area=slides["contact_area"] * (1 + slides["contact_increment"]))
    histories["isotropic"] = dissipating(slides, 0.2)
    histories[SLIPPERY] = dissipating(slides.assign(force=0.9 * slides["force"]), 0.3)
    histories["untied"] = slides.assign(
        force=0.5 * slides["force"], newton_iterations=2 * slides["newton_iterations"]
    )
    contacts = synthetic.with_kinematics(extract(knit, base))
    contacts = jumping(contacts, 2, 5)
    slides = contacts["relative_displacement"] * xr.where(contacts["row"] == 1, 1.0, 3.0)
    untied = contacts.assign(relative_displacement=slides.transpose(*contacts["relative_displacement"].dims))
    return histories, {"tie": contacts, "isotropic": contacts, "untied": untied}


def dissipating(history, share):
    """Return a history in which friction dissipates a share of the work."""
    energy = history["energy"].copy(deep=True)
    energy.loc[{"form": "friction"}] = share * energy.sel(form="external")
    return history.assign(energy=energy)


def jumping(contacts, turned, slid):
    """Return contacts with rotation and sliding that jump to their last values at increments."""
    number = xr.DataArray(np.arange(contacts.sizes["increment"]), dims="increment")
    jumps = {"section_rotation": number >= turned, "sliding": number >= slid}
    after = {name: xr.where(late, contacts[name][-1], 0.0) for name, late in jumps.items()}
    return contacts.assign({name: each.transpose("increment", ...) for name, each in after.items()})


def with_direct(evidence, name, attrs=(), **variables):
    """Return the evidence with other variables and attributes in one history."""
    history = evidence.rows[name].history.assign(**variables).assign_attrs(attrs)
    return with_row(evidence, name, evidence.rows[name].with_results(simulation=history))


def with_row(evidence, name, row):
    """Return the evidence with another row of a scene."""
    return replace(evidence, rows={**evidence.rows, name: row})


def with_contacts(evidence, contacts):
    """Return the evidence with other contacts with friction."""
    return with_row(evidence, "isotropic", evidence.rows["isotropic"].with_results(contacts=contacts))


def with_zones(evidence, zones):
    """Return the evidence with other numbers of zones (increments, 4) in the centre cell."""
    contacts = evidence.rows["isotropic"].results["contacts"].copy(deep=True)
    contacts["zones"][:, centre_cell(contacts)] = np.array(zones)
    return with_contacts(evidence, contacts)


def with_history(evidence, name, **changes):
    """Return the evidence with another history of one scene of the four cases."""
    row = evidence.rows[name]
    changed = study.histories({name: row.scene}, **{name: changes})
    return with_row(evidence, name, row.with_results(simulation=changed[name]))


def with_reference(evidence, name, quantity, factor):
    """Return the evidence with another reference of one direct simulation in course tension."""
    table = evidence.reference.copy()
    here = (table["problem"] == problem_of(evidence.rows[name].scene)) & (table["quantity"] == quantity)
    table.loc[here, ["value", "uncertainty"]] *= factor
    return replace(evidence, reference=table)


def with_geometry(evidence, **values):
    """Return the evidence with other values of variables before and after the optimisation."""
    variables = {name: ("state", each) if isinstance(each, list) else each for name, each in values.items()}
    return replace(evidence, geometry=evidence.geometry.assign(**variables))


def with_a_gap(evidence, radii):
    """Return the evidence in which the yarns of all crossings stand too far apart after the optimisation."""
    distance = evidence.geometry["crossing_distance"].copy(deep=True)
    distance.loc[{"state": "after"}] += radii * float(evidence.geometry["radius"])
    return with_geometry(evidence, crossing_distance=distance)


def with_heights(evidence, diameters):
    """Return the evidence with one contact higher than the others."""
    contacts = evidence.rows["isotropic"].results["contacts"].copy(deep=True)
    contacts["centroid"][0, 2] += diameters * evidence.diameter
    return with_contacts(evidence, contacts)


def with_areas(evidence, factors):
    """Return the evidence with factors of the area under pressure at every increment."""
    history = evidence.rows["isotropic"].history
    number = history["contact_increment"]
    area = history["contact_area"] / (1 + number) * np.array(factors)[number.astype(int)]
    return with_direct(evidence, "isotropic", contact_area=area)


def with_sizes(evidence, force, lift, lateral="fixed"):
    """Return the evidence with knits of 1, 3 and 6 cells: force a row and u_z of the largest over those of 3 cells."""
    scene = evidence.rows["dns-tie-course"].scene
    three = scene.pattern.loops
    assert three == 3
    for cells, more, higher in ((3, 1.0, 1.0), (1, 0.5, 0.5), (6, force, lift)):
        name = "yarns-tie-course" if cells == 3 else f"domain-yarns-tie-course-{cells}x{cells}"
        size = {
            "pattern.loops": cells,
            "pattern.rows": cells,
            "load.lateral": lateral if cells == 6 else "fixed",
        }
        last = study.FORCE["tie"] * more * cells / 3
        history = study.history(force=(0, last / 2, last), lift=higher * study.LIFT["tie"], scene=name)
        evidence = with_row(
            evidence, name, Simulation(scene.vary({"name": name} | size), {"simulation": history})
        )
    return evidence


def with_printed(evidence, table, case, quantity, value):
    """Return the evidence with another printed number."""
    paper = evidence.paper.copy().astype({"value": object})
    here = (paper["table"] == table) & (paper["case"] == case) & (paper["quantity"] == quantity)
    assert here.sum() == 1
    paper.loc[here, "value"] = value
    return replace(evidence, paper=paper)


def with_flow(evidence, **angles):
    """Return the evidence with other angles of the stress to the yarns."""
    row = evidence.rows["isotropic"]
    stress, history, contacts = (row.results[name] for name in ("stress", "simulation", "contacts"))
    other = synthetic.flowing(stress, history, contacts, 0.5 * evidence.diameter, **angles)
    return with_row(evidence, "isotropic", row.with_results(stress=other))


def with_slaves(evidence, force, lift):
    """Return the evidence with knits in contact of one pass, one of which has other force and motion."""
    for slave, more, higher in (("lower", 1.0, 1.0), ("upper", force, lift)):
        name = f"slave-{slave}-isotropic-course"
        last = more * study.FORCE["isotropic"]
        history = study.history(force=(0, last / 2, last), lift=higher * study.LIFT["isotropic"], scene=name)
        scene = evidence.rows["dns-isotropic-course"].scene.replace("name", name)
        evidence = with_row(evidence, name, Simulation(scene, {"simulation": history}))
    return evidence


def with_elements(evidence, one, eight):
    """Return the evidence with tied knits by elements of one point and of eight, so far off in force."""
    for size in ("045", "030"):
        for element, off in (("one", one), ("eight", eight)):
            name = f"elements-{element}-point-{size}-tie-course"
            last = (1 + off) * study.FORCE["tie"]
            history = study.history(force=(0, last / 2, last), scene=name)
            scene = evidence.rows["dns-tie-course"].scene.replace("name", name)
            evidence = with_row(evidence, name, Simulation(scene, {"simulation": history}))
    return evidence


def with_turns(evidence, tilted, in_plane):
    """Return the evidence in which tied yarns turn against each other, over their own turns of 0.1 and 0.08."""
    contacts = evidence.rows["tie"].results["contacts"]
    apart = np.zeros(contacts["relative_rotation"].shape)
    apart[..., 2] = 0.08 * in_plane
    apart[..., 0] = np.sqrt((0.1 * tilted) ** 2 - (0.08 * in_plane) ** 2)
    turned = contacts.assign(relative_rotation=(contacts["relative_rotation"].dims, apart))
    return with_row(evidence, "tie", evidence.rows["tie"].with_results(contacts=turned))


# Neither the paper's angles nor a 3D model that is a fifth stiffer agree so well. Table 3 grows by a power, and normals
# are mirror images. Tables 3 and 5 do not save alike. The evidence has no slaves and no elements to compare (K19, K20),
# and knits of rising size would be the main simulations of the tied case (S5).
UNLIKE_THE_PAPER = {"K19", "K20", "M3", "R6", "R7", "R10", "S4", "S5"}


@pytest.mark.parametrize("claim", sorted(set(CLAIMS.names()) - UNLIKE_THE_PAPER))
def test_values_of_the_paper_are_reproduced(evidence, claim):
    judged = judge(claim, evidence)
    assert judged.verdict == "reproduced", judged.rows
    assert any(row.grade for row in judged.rows)


def test_knits_that_differ_by_more_than_their_size_are_not_compared(evidence):
    judged = judge("S5", with_sizes(evidence, 1.6, 2.0, lateral="free"))
    assert judged.verdict == "not yet run"
    assert judged.note == "the knits differ by more than their number of cells"


def test_discretisations_that_disagree_do_not_decide(evidence):
    """Zones of the centre cell: never more than three by the other one."""
    alike, other = replace(evidence), with_zones(evidence, [(0, 0, 0, 0)] * 3 + [(1, 1, 1, 0)] * 3)

    def decide(**again):
        found = findings(replace(evidence, again=again), NO_READINGS)
        return conclude("K2", BY_OTHERS, found, under_readings(found, NO_READINGS))

    decided = decide(fine=alike)
    assert decided["verdict"] == "reproduced"
    assert decided["uncertainty"].startswith("fine: reproduced, 4")
    judged = decide(fine=alike, finest=other)
    assert judged["verdict"] == "undecidable"
    assert "finest: contradicted" in judged["uncertainty"]
    assert decide()["uncertainty"] == "not known: one discretisation alone"


@pytest.mark.parametrize("case", ["tie-course", "isotropic-wale"])
@pytest.mark.parametrize(
    ("factor", "verdict", "margin"),
    [(1.4, "reproduced", 1.25), (1.6, "direction holds, size does not", 0.833), (2.1, "contradicted", 0.455)],
)
def test_3d_model_must_be_nearer_by_a_factor_of_two_in_every_case(evidence, case, factor, verdict, margin):
    """The 2D model is 1.0 away: 0.4 is much nearer, 0.6 is nearer, and 1.1 is not nearer."""
    full = study.FORCE[case.split("-")[0]]
    changed = with_history(evidence, f"rom3d-{case}", force=(0, factor * full / 2, factor * full))
    judged = judge("R1", changed)
    assert judged.verdict == verdict
    tightest = judged.rows[0]
    assert tightest.quantity.endswith(case.split("-")[1]), "the tightest test comes first"
    assert tightest.margin == pytest.approx(margin, abs=1e-3)


@pytest.mark.parametrize("value", [np.nan, 0.0, -1.0, 1.0])
def test_rows_of_equal_values_are_equal(value):
    """Also without a margin: a reading touches the claims whose rows differ from those of the base."""
    for bounded in (at_least, at_most):
        assert bounded("bend", value, "large", bar=0.5) == bounded("bend", value, "large", bar=0.5)


def test_asymmetry_by_hand():
    """Two yarns bulge by 0.1 and 0.2 mm: the envelopes differ by half of the largest."""
    assert asymmetry(synthetic.history(lift=1e-4)) == pytest.approx(0.5)
    assert asymmetry(synthetic.history(lift=0.0)) == 0
    assert asymmetry(synthetic.history(lift=1e-4, yarns=4), np.array([0, 0, 1, 1])) == pytest.approx(0.5)
    assert asymmetry(synthetic.history(lift=1e-4), np.array([0, 0])) == 0


@pytest.mark.parametrize("claim", ["R1", "R2", "R3", "B1", "K5", "K6", "K7"])
def test_without_a_reference_nothing_is_decided(evidence, claim):
    judged = judge(claim, replace(evidence, reference=study.NO_REFERENCE))
    assert judged.verdict == "not yet run"
    assert "no reference of" in judged.note


@pytest.mark.parametrize(
    ("claim", "scene", "changes"),
    [
        ("R1", "rom3d-tie-wale", {"force": (0, 8.995, 17.99)}),  # 0.5 away, and the 2D model 1.0
        ("R2", "rom3d-tie-course", {"lift": 2.97e-4}),  # 1.48 times the amplitude: 1.5 counts as captured
        ("B1", "beam-isotropic-course", {"force": (0, 4.95, 9.9)}),
    ],
)
def test_a_margin_below_the_uncertainty_is_open(evidence, claim, scene, changes):
    judged = judge(claim, with_history(evidence, scene, **changes))
    assert judged.verdict == "undecidable", judged.rows
    scenes = {name: row.scene for name, row in evidence.rows.items()}
    certain = replace(evidence, reference=study.reference(scenes, uncertainty=1e-4))
    assert judge(claim, with_history(certain, scene, **changes)).verdict == "reproduced"


def test_stabilisation_counts_at_full_load(evidence):
    history = evidence.rows["isotropic"].history
    energy = history["energy"].copy(deep=True)
    energy.loc[{"form": "stabilisation"}] = 0.04 * energy.sel(form="internal")
    energy.loc[{"form": "stabilisation", "increment": 1}] = 0.06 * energy.sel(form="internal")[1]
    assert judge("E1", with_direct(evidence, "isotropic", energy=energy)).verdict == "reproduced"
    energy.loc[{"form": "stabilisation"}] = 0.06 * energy.sel(form="internal")
    assert judge("E1", with_direct(evidence, "isotropic", energy=energy)).verdict == "contradicted"


def with_still(evidence, name, rest=0.0):
    """Return the evidence with one crossing of the centre cell that moves little or not at all."""
    contacts = evidence.rows["isotropic"].results["contacts"]
    values = contacts[name].copy(deep=True)
    values[:, centre_cell(contacts)[2]] = rest
    return with_contacts(evidence, contacts.assign({name: values}))


def with_springs(evidence, direction, *stiffness):
    """Return the evidence with other springs (3,) [N/m] in one direction."""
    name = f"dns-isotropic-{direction}"
    row = evidence.rows[name]
    other = synthetic.contacts_with_springs(row.results["contacts"], np.array(stiffness), "local")
    return with_row(evidence, name, row.with_results(contacts=other))


def with_bend(evidence, at):
    """Return the evidence with a curve of force that bends at a strain."""
    strain = evidence.rows["isotropic"].history["strain"]
    return with_direct(evidence, "isotropic", force=300 * strain + 500 * (strain - at).clip(0))


def with_motion(evidence, factor, yarns=(0, 1, 2, 3)):
    """Return the evidence with the motion of some yarns times a factor."""
    history = evidence.rows["isotropic"].history
    motion = history["centreline_displacement"]
    moved = motion.where(~history["yarn"].isin(yarns), motion * factor)
    return with_direct(evidence, "isotropic", centreline_displacement=moved)


def with_counted(evidence, model, column, factor, cells=None):
    """Return the evidence with a count of a model times a factor, of knits of all sizes or of one."""
    table = evidence.counted_unknowns.copy()
    here = (table["model"] == model) & (table[CELLS].isin([cells]) if cells else True)
    table.loc[here, COUNTS[column]] *= factor
    return replace(evidence, counted_unknowns=table)


def with_half_way(evidence, turned, slid):
    """Return the evidence with rotation and sliding that jump to their last values at increments."""
    return with_contacts(evidence, jumping(evidence.rows["isotropic"].results["contacts"], turned, slid))


def with_damping(evidence, name):
    """Return the evidence in which one scene takes no stabilisation, and iterations are those of untied rows."""
    iterations = evidence.rows["untied"].history["newton_iterations"]
    changed = with_direct(evidence, name, newton_iterations=iterations)
    scene = evidence.rows[name].scene.replace("solver.stabilisation", 0.0)
    return with_row(changed, name, replace(changed.rows[name], scene=scene))


def with_slippery(evidence, factor):
    force = evidence.rows[SLIPPERY].history["force"]
    return with_direct(evidence, SLIPPERY, force=factor * force)


@pytest.mark.parametrize(
    "name", [SLIPPERY.replace("course", "wale"), SLIPPERY.replace("isotropic", "beam-isotropic")]
)
def test_friction_is_varied_in_solids_under_course_tension_alone(evidence, name):
    """Other tensions and other models have scenes with the same coefficients."""
    row = evidence.rows[SLIPPERY]
    other = row.with_results(simulation=row.history.assign(force=10 * row.history["force"])).named(name)
    assert judge("K7", with_row(evidence, name, other)) == judge("K7", evidence)


def with_dissipated(evidence, share):
    """Return the evidence in which friction dissipates another share of the work of the slippery knit."""
    history = dissipating(evidence.rows[SLIPPERY].history, share)
    return with_row(evidence, SLIPPERY, evidence.rows[SLIPPERY].with_results(simulation=history))


def with_normals(evidence, pressure, resultant):
    """Return the evidence with angles between the normals at both contacts of every side [deg]."""
    contacts = evidence.rows["isotropic"].results["contacts"]
    for name, angle in (("contact_normal", pressure), ("resultant_direction", resultant)):
        turned = np.radians(angle) * (contacts["zone"].to_numpy() > 1)
        normal = np.stack([np.sin(turned), 0 * turned, np.cos(turned)], axis=-1)
        whole = np.broadcast_to(normal, contacts[name].shape).copy()
        contacts = contacts.assign({name: (contacts[name].dims, whole)})
    return with_contacts(evidence, contacts)


def with_table_3(evidence, growth):
    """Return the evidence with unknowns of a paper that grow as exp(b n) times a power (n / 3)^(2 - 2 growth)."""
    paper = evidence.paper.copy().astype({"value": object})
    for n in (3, 6, 8, 20, 30):
        here = (paper["table"] == "3") & (paper["case"] == f"c{n}w{n}")
        here &= paper["quantity"] == "degrees of freedom"
        paper.loc[here, "value"] = 3e5 * np.exp(0.2 * growth * (n - 3)) * (n / 3) ** (2 * (1 - growth))
    return replace(evidence, paper=paper)


def with_other_networks(evidence, sweep, column, power):
    """Return the evidence in which a column of one sweep is its power, -1 for the other way round."""
    table = evidence.mechanisms.copy()
    here = table["sweep"] == sweep
    table.loc[here, column] = table.loc[here, column] ** power
    return replace(evidence, mechanisms=table)


def with_stiffer_solids(evidence, motion, spin):
    """Return the evidence with solid yarns of growing stiffness, each with a factor of motion and spin."""
    row, rows = evidence.rows["isotropic"], {}
    moved, contacts = row.history["centreline_displacement"], row.results["contacts"]
    for number, diameter in enumerate((120, 135, 150, 165, 180, 195)):
        results = {
            "simulation": row.history.assign(centreline_displacement=motion**number * moved),
            "contacts": contacts.assign(spin=spin**number * contacts["contact_spin"].fillna(0)),
        }
        for stiffer, end in product(STIFFER, ("isotropic-course", "isotropic-course-p3", "tie-course")):
            name = f"inertia-{stiffer}-d{diameter}-{end}"
            rows[name] = row.with_results(**results).named(name)
    return replace(evidence, rows={**evidence.rows, **rows})


def with_harmless_ties(evidence, name):
    """Return the evidence in which untied rows change nothing of one variable."""
    return with_direct(evidence, "untied", **{name: evidence.rows["isotropic"].history[name]})


def test_networks_decide_k17_where_no_solids_are_run_and_nowhere_under_a_reading(evidence):
    assert judge("K17", evidence).verdict == "reproduced"
    judged = judge("K17", replace(evidence, base=evidence))
    assert (judged.verdict, judged.note) == ("not yet run", "no stiffer yarns are run under this reading")


def test_degrees_that_disagree_do_not_decide_k17(evidence):
    """The next degree moves further with its stiffness."""
    coarse, fine = (with_stiffer_solids(evidence, motion, 0.9).rows for motion in (0.9, 1.1))
    finer = {name: row for name, row in fine.items() if name.endswith("-isotropic-course-p3")}
    judged = judge("K17", replace(evidence, rows={**coarse, **finer}))
    assert judged.verdict == "undecidable"
    assert judged.note.startswith("missing is agreement of the discretisations")


def test_where_nothing_touches_there_are_no_normals_to_compare(evidence):
    contacts = evidence.rows["isotropic"].results["contacts"]
    judged = judge("R10", with_contacts(evidence, contacts.assign(zones=0 * contacts["zones"])))
    assert (judged.verdict, judged.note) == (
        "not yet run",
        "at no free interlock do both contacts of a side touch",
    )


def test_wale_tension_is_of_the_scenes_that_are_pulled_along_wales(evidence):
    base = replace(evidence, direct={kind: f"dns-{kind}-course" for kind in ("tie", "rough", "isotropic")})
    assert base.pulled_in("wale").direct == {kind: f"dns-{kind}-wale" for kind in ("tie", "isotropic")}
    assert judge("K15", base).note.startswith("the study has no direct simulation with rough contact")


def test_a_test_that_nothing_contradicts_does_not_count_where_it_holds(evidence):
    """Of R4 the order of kx and ky, of R5 the unknowns, which lengths and diameters were inferred from."""
    for claim, why, count in (("R4", "nothing contradicts it", 2), ("R5", "true by construction", 2)):
        uncounted = [row for row in judge(claim, evidence).rows if row.grade and not row.tested]
        assert [row.grade for row in uncounted] == count * [f"holds, not counted: {why}"]


RESOURCES = Path(__file__).parents[2] / "resources"
RULES = pd.read_csv(RESOURCES / "reference" / "paper_claims.csv").fillna("").set_index("id", drop=False)
COMMITTED = pd.read_csv(RESOURCES / "verdicts.csv").fillna("").set_index("id")["measured"]
# Numbers of texts that are no quantity of their claim
GIVEN = {
    "B1": {"0.05 %"},  # docs/notes/beams.md
    "K11": {"1 %", "1.16", "2.2 %"},  # docs/notes/sensitivity.md
    "K12": {"50 %"},  # shares of the motion at which the order was looked at
    "M3": {"48 degrees"},  # by Table 4; the table of angles has all differences
}
BY_HAND = {"S2", "S3", "R5", "R9"}  # whose texts compare with numbers that no row has


@pytest.mark.parametrize("claim", RULES["id"])
def test_texts_name_quantities_that_their_claims_have(evidence, claim):
    """Of the committed verdicts, or of made-up evidence where they are older than a quantity."""
    known = {row.quantity for row in judge(claim, with_stiffer_solids(evidence, 0.9, 0.9)).rows}
    known |= {quantity for quantity, *_ in cells_of(COMMITTED.get(claim, ""))} | {"readings"}
    named = {name for column in TEXTS for name in QUANTITY.findall(RULES.loc[claim, column])}
    assert named <= known


def test_the_page_names_quantities_that_claims_have(evidence):
    page = (RESOURCES.parent / "workflow" / "report" / "results.md").read_text(encoding="utf-8")
    named = re.findall(r'measured\("(\w+)", "([^"]+)"\)', page)
    assert named
    for claim, quantity in named:
        assert quantity in {row.quantity for row in judge(claim, evidence).rows}, claim


def test_a_quantity_that_is_not_measured_is_named_and_not_committed():
    row = {"id": "K9", "verdict": "contradicted", "measured": "pairs | 97% | grows | reproduced"}
    text = "in {pairs}, not in {paris}"
    assert with_values(text, row) == "in 97%, not in [not measured in this study]"
    rules = pd.DataFrame([{"id": "K9", "explanation": text, "holds if": ""}])
    with refusal("'explanation' of K9 names 'paris', which is not measured; .* in braces: pairs"):
        require_measured(pd.DataFrame([row]), rules)
    require_measured(pd.DataFrame([row | {"verdict": "not yet run"}]), rules)


@pytest.mark.parametrize("claim", sorted(set(RULES["id"]) - BY_HAND))
def test_no_text_has_a_measured_number_by_hand(claim):
    """A number is part of the rule, of a reading or of the name of a quantity, or of the paper; else {a quantity}."""
    row = RULES.loc[claim]
    readings = pd.read_csv(RESOURCES / "reference" / "readings.csv").fillna("")
    names = [text for name, _, paper, _ in cells_of(COMMITTED.get(claim, "")) for text in (name, paper)]
    known = measured_numbers("; ".join(map(str, [*row.drop([*TEXTS]), *readings.to_numpy().ravel(), *names])))
    known |= {"5 %"}  # strain of the paper
    known |= {number.partition(" ")[0] for number in known if "." in number} | GIVEN.get(claim, set())
    assert {number for column in TEXTS for number in measured_numbers(QUANTITY.sub("", row[column]))} <= known


VERDICTS = yaml.safe_load(Path(__file__).with_name("verdicts.yaml").read_text())


@pytest.mark.parametrize("row", VERDICTS["numbers"], ids=str)
def test_verdicts_turn_with_the_numbers(evidence, row):
    claim, verdict, change, *arguments = row
    named = arguments.pop() if isinstance(arguments[-1], dict) else {}
    changed = globals()[f"with_{change.replace(' ', '_')}"](evidence, *arguments, **named)
    judged = judge(claim, changed)
    assert judged.verdict == verdict, judged.rows


@pytest.mark.parametrize(("claim", "course", "wale", "verdict"), VERDICTS["axes"])
def test_verdicts_turn_with_the_axes_of_stress(evidence, knit, claim, course, wale, verdict):
    rows = dict(evidence.rows)
    for name, stresses in stressed(knit, course, wale).items():
        rows[name] = rows[name].with_results(stress=stresses)
    judged = judge(claim, replace(evidence, rows=rows))
    assert judged.verdict == verdict, judged.rows
