"""What accuracy costs: fronts, sentences, brackets, points of a made-up study, and what single knobs buy."""

import itertools

import numpy as np
import pytest
import study

from knitstudy.measures.cost import PROCESSOR, WALL, expense_of
from knitstudy.measures.trade import as_direct, points_of
from knitstudy.measures.trade_points import REFERENCE
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
def sources(cases):
    every = {name: each for name, each in study.histories(cases).items() if cases[name].fidelity != "beam"}
    return {"every": every, "every_contacts": {}, "scenes": cases, "reference": study.reference(cases)}


def test_errors_are_to_the_reference_with_its_uncertainty(cases, sources):
    points = points_of(sources["every"], {}, cases, sources["reference"])
    of = {(point.scene.name, point.question.name): point for point in points}
    point = of["rom3d-tie-wale", "force"]
    assert point.error.value == pytest.approx(0.2)
    assert point.error.uncertainty == pytest.approx(1.2 / 0.98 - 1.2)
    assert point.source == REFERENCE
    assert point.bound == point.error.value + point.error.uncertainty
    assert {name for scene, name in of if scene.startswith("rom2d")} == {"force"}
    assert as_direct(cases["beam-isotropic-wale"], cases).name == "dns-isotropic-wale"
    assert as_direct(cases["rom3d-tie-wale"], cases).name == "dns-tie-wale"
    assert as_direct(cases["beam-isotropic-wale"], {}) is None


def test_a_reduced_model_costs_what_its_contacts_cost(cases, sources):
    expense = expense_of(cases["rom3d-tie-course"], sources["every"])
    assert (expense.seconds, expense.sources, expense.clock) == (100.5, 100.0, WALL)
    assert expense.memory == 300
    timed = {name: each.assign_attrs(processor_seconds=2.0) for name, each in sources["every"].items()}
    expense = expense_of(cases["rom3d-tie-course"], timed)
    assert (expense.seconds, expense.clock) == (4.0, PROCESSOR)
    assert expense_of(cases["rom3d-tie-course"], {"rom3d-tie-course": timed["rom3d-tie-course"]}) is None
