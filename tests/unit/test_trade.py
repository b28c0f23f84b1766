"""What accuracy costs: fronts, sentences, brackets, points of a made-up study, and what single knobs buy."""

import itertools

import numpy as np
import pytest
import study

from knitstudy.measures.cost import PROCESSOR, WALL, Expense, expense_of
from knitstudy.measures.discretisation import problem_of, sticks, tied_problem_of
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.questions import BEAM_SLIP, QUESTIONS, TOTAL, answers, known
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import NORMAL, SLIP, TANGENTIAL
from knitstudy.measures.trade import as_direct, points_of
from knitstudy.measures.trade_points import REFERENCE, Point, bound_cheaper_settings, turned
from knitstudy.study.choice import front


def price(point):
    return point[0]


def error(point):
    return point[1]


def test_a_front_is_what_nothing_beats():
    """By comparing all pairs."""
    random = np.random.default_rng(1)
    points = [tuple(each) for each in random.integers(1, 30, (200, 2))]
    found = front(points, price, error)
    beaten = {
        one
        for one, other in itertools.permutations(set(points), 2)
        if other[0] <= one[0] and other[1] <= one[1]
    }
    assert set(found) == set(points) - beaten
    assert found == sorted(found)


@pytest.fixture(scope="module")
def scenes(plain_scene):
    return study.scenes(plain_scene)


def with_crossings(history):
    """Return a history of beams in contact, of a knit of 3 x 3 cells: nothing acts but in the centre cell."""
    increments = history.sizes["increment"]
    force = np.zeros((increments, 36, 3))
    force[-1, 16:20] = [0.0, 3.0, 4.0]
    slip = np.full((increments, 36), np.nan)
    slip[-1, 16:18] = 2e-5
    return history.assign(
        crossing_force=(("increment", "crossing", "xyz"), force),
        crossing_slip=(("increment", "crossing"), slip),
    )


@pytest.fixture(scope="module")
def sources(scenes):
    every = study.histories(scenes)
    every |= {name: with_crossings(each) for name, each in every.items() if scenes[name].fidelity == "beam"}
    return {"every": every, "every_contacts": {}, "scenes": scenes, "reference": study.reference(scenes)}


def test_errors_are_to_the_reference_with_its_uncertainty(scenes, sources):
    points = points_of(sources["every"], {}, scenes, sources["reference"])
    of = {(point.scene.name, point.question.name): point for point in points}
    point = of["rom3d-tie-wale", "force"]
    assert point.error.value == pytest.approx(0.2)
    assert point.error.uncertainty == pytest.approx(1.2 / 0.98 - 1.2)
    assert point.source == REFERENCE
    assert point.bound == point.error.value + point.error.uncertainty
    assert of["beam-isotropic-course", "force"].error.value == pytest.approx(0.1)
    assert {name for scene, name in of if scene.startswith("rom2d")} == {"force"}
    assert as_direct(scenes["beam-isotropic-wale"], scenes).name == "dns-isotropic-wale"
    assert as_direct(scenes["rom3d-tie-wale"], scenes).name == "dns-tie-wale"
    assert as_direct(scenes["beam-isotropic-wale"], {}) is None


def test_cheaper_settings_inherit_their_deviation(plain_scene):
    """Longer spans that come out better than what they coarsen do so by two errors that cancel."""
    yarns = plain_scene.vary(
        {
            "fidelity": "spline_yarns",
            "solver.increments": 12,
            "mesh.crossing_span": 0.9,
            "mesh.crossing_degree": 2,
        }
    )
    assert not turned(yarns)

    def point(name, error, seconds, answer=1.0, **keys):
        scene = yarns.vary({"name": name} | {key.replace("__", "."): value for key, value in keys.items()})
        return Point(
            scene=scene,
            interaction="tie",
            question=QUESTIONS["force"],
            quantity="force",
            strain=0.05,
            true=Estimate(1.0, 0.0),
            source=REFERENCE,
            error=Estimate(error, 0.001),
            expense=Expense(seconds, 0.0, WALL, 10.0),
            answers={"force": answer},
        )

    points = [
        point("main", 0.022, 20.0),
        point("longer", 0.008, 12.0, 0.97, mesh__span=1.8, mesh__crossing_span=1.8),
        point("alike", 0.022, 6.0, solver__increments=1),
        point("worse", 0.050, 8.0, mesh__span=1.8, mesh__crossing_span=1.8, solver__increments=2),
        point("both", 0.010, 5.0, 0.99, mesh__span=1.8, mesh__crossing_span=1.8, solver__increments=1),
        point("shorter", 0.004, 40.0, mesh__span=0.6, mesh__crossing_span=0.6),
        point("other", 0.003, 5.0, mesh__degree=3, mesh__crossing_degree=3, solver__increments=4),
    ]
    bounds = {each.scene.name: each.bound for each in bound_cheaper_settings(points)}
    expected = {"main": 0.023, "alike": 0.023, "shorter": 0.005, "other": 0.004}
    assert bounds == pytest.approx(expected | dict.fromkeys(("longer", "worse", "both"), 0.053))


def test_ties_stand_in_for_contact_that_sticks(scenes, sources):
    """They are compared with what is known of rough contact, and are no surer than they are of ties."""
    rough = scenes["dns-tie-course"].vary({"name": "dns-rough-course", "interaction": "rough"})
    assert sticks(rough)
    assert not sticks(scenes["dns-isotropic-course"])
    assert tied_problem_of(rough) == problem_of(scenes["dns-tie-course"])
    every = sources["every"] | {rough.name: sources["every"]["dns-tie-course"]}
    known = study.reference(scenes | {rough.name: rough})
    points = points_of(every, {}, scenes | {rough.name: rough}, known)
    found = {
        (point.interaction, point.scene.name): point for point in points if point.question.name == "force"
    }
    tied, standing = (found[name, "rom3d-tie-course"] for name in ("tie", "rough"))
    assert standing.called == "ties in place of contact, " + tied.called
    assert (standing.stands_in, tied.stands_in) == (True, False)
    assert standing.bound >= tied.bound
    assert not found["rough", rough.name].stands_in
    assert ("isotropic", "dns-tie-course") not in found


def test_a_reduced_model_costs_what_its_contacts_cost(scenes, sources):
    expense = expense_of(scenes["rom3d-tie-course"], sources["every"])
    assert (expense.seconds, expense.sources, expense.clock) == (100.5, 100.0, WALL)
    assert expense.memory == 300
    timed = {name: each.assign_attrs(processor_seconds=2.0) for name, each in sources["every"].items()}
    expense = expense_of(scenes["rom3d-tie-course"], timed)
    assert (expense.seconds, expense.clock) == (4.0, PROCESSOR)
    assert expense_of(scenes["rom3d-tie-course"], {"rom3d-tie-course": timed["rom3d-tie-course"]}) is None


def test_beams_answer_by_the_whole_force_of_the_crossings_of_the_centre_cell(scenes):
    history = with_crossings(study.history())
    scene, strain = scenes["beam-isotropic-course"], float(history["strain"][-1])
    found = answers(QUESTIONS["contact"], scene, history, None, strain)
    assert found == {TOTAL: pytest.approx(5.0), BEAM_SLIP: pytest.approx(1e-5)}
    reference = Reference({(NORMAL, 0.05): Estimate(3.0, 0.3), (TANGENTIAL, 0.05): Estimate(4.0, 0.0)})
    total = known(reference, TOTAL, 0.05)
    assert (total.value, total.uncertainty) == (pytest.approx(5.0), pytest.approx(0.3 * 0.6))
    assert not known(reference, BEAM_SLIP, 0.05).known
    assert known(Reference({(SLIP, 0.05): Estimate(1e-5, 0.0)}), BEAM_SLIP, 0.05).known
