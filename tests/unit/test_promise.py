"""What is promised of other knits: what a model is off there, and when that counts as held; the page about it."""

import pytest
import study
from click.testing import CliRunner

from knitstudy.cli.main import main
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.promises import Promise, compare, corrected, error_made
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import FORCE, LARGEST_U_Z
from knitstudy.stages.simulate import Results
from knitstudy.study.choice import AGAIN, Ask, Choice, Rung, second


def of(force):
    """Return a history with a force at full load, and no contacts."""
    return study.history(force=(0, force / 2, force))


@pytest.fixture
def reference():
    return Reference({(FORCE, 0.05): Estimate(10.0, 0.1), (LARGEST_U_Z, 0.05): Estimate(5e-4, 0.0)})


def corrected_force(reference, base, here):
    found = corrected(reference, (of(base), None), (of(here), None), float(of(base)["strain"][-1]))
    return found.at(FORCE, 0.05)


def test_an_error_is_taken_over_and_half_of_it_is_left_open(reference):
    """12 N where 10 +- 0.1 N are true: 24 N elsewhere stand for 20 N, open by 1 % and half of a sixth."""
    assert float(of(1.0)["strain"][-1]) == pytest.approx(0.05)
    force = corrected_force(reference, 12.0, 24.0)
    assert force.value == pytest.approx(20.0)
    assert force.uncertainty == pytest.approx(20.0 * (0.01 + 0.5 / 6))


def test_the_largest_error_of_a_question_counts(reference, plain_scene):
    scene = plain_scene.vary({"name": "mine", "fidelity": "rom3d"})
    quantity, error = error_made("force", scene, of(11.0), None, reference, 0.05)
    assert (quantity, error.value) == (FORCE, pytest.approx(0.1))
    assert error.uncertainty == pytest.approx(11 / 9.9 - 1.1)
    nothing, unknown = error_made("stress", scene, of(11.0), None, reference, 0.05)
    assert nothing == ""
    assert not unknown.known


@pytest.mark.parametrize(
    ("error", "held", "surely"),
    [
        ((0.02, 0.01), True, True),
        ((0.04, 0.02), True, None),
        ((0.09, 0.01), False, False),
        ((0.06, 0.02), False, None),
    ],
)
def test_a_promise_is_held_by_its_value_and_surely_by_its_uncertainty(error, held, surely):
    promise = Promise("s", "force", "m", 0.05, Estimate(*error), FORCE, 1.0, 1.0)
    assert (promise.held, promise.surely) == (held, surely)


ASKS = ("--set", "fidelity=auto", "--set", "ask.question=force", "--set", "ask.accuracy=0.05")


def result(scene, force):
    """Scene, history with a force at full load, and no contacts."""
    return scene, study.history(force=(0, force / 2, force)), None


@pytest.fixture
def scene(plain_scene):
    return plain_scene.vary({"name": "mine", "fidelity": "rom3d"})


@pytest.mark.parametrize(
    ("mine", "theirs", "error"), [(11.0, 10.0, 0.02), (9.0, 10.0, 0.3), (10.0, 10.0, 0.01)]
)
def test_bounds_hold_wherever_the_truth_is(scene, mine, theirs, error):
    found = compare("force", result(scene, mine), result(scene, theirs), error)
    assert found.quantity == FORCE
    off = [abs(mine / true - 1) for true in (theirs / (1 + error), theirs / (1 - error))]
    assert found.least <= min(off) + 1e-12
    assert found.most >= max(off[0], 0.0) - 1e-12
    assert found.most == pytest.approx(abs(mine / theirs - 1) * (1 + error) + error)
    assert found.least >= 0


def rung(name, error, seconds, kind=None):
    return Rung(name, kind or name, name, "spline_yarns", error, seconds, 10.0)


@pytest.mark.parametrize(
    ("seconds", "error", "taken"),
    [(AGAIN, 0.01, "other"), (1.01 * AGAIN, 0.01, "coarse"), (0.5, 0.095, "coarse"), (0.5, 0.08, "other")],
)
def test_the_surest_of_what_costs_little_more_is_compared_with(seconds, error, taken):
    mine, coarse, other = rung("mine", 0.05, 1.0), rung("coarse", 0.09, 0.3), rung("other", error, seconds)
    again = rung("mine, again", 0.01, 1.0, kind="mine")
    choice = Choice(Ask(question="force", accuracy=0.05), mine, (coarse, mine, other, again), 3, 3)
    assert second(choice).scene == taken
    unsure = rung("unsure", 1.01 * AGAIN * 0.05, 0.3)
    assert second(Choice(choice.ask, mine, (mine, again, unsure), 3, 3)) is None


def test_the_command_compares_unless_told_not_to(monkeypatch):
    histories = []

    def simulate(scene, folder, **options):
        histories.append(study.history(force=(0, 1, 10.0 + 2 * len(histories))))
        return Results(scene, None, histories[-1], path=folder / "a.nc")

    monkeypatch.setattr("knitstudy.stages.simulate.simulate", simulate)
    monkeypatch.setattr("knitstudy.measures.summary.summarise", lambda history: [])
    ended = CliRunner().invoke(main, ["run", "yarns-tie-course", *ASKS])
    assert ended.exit_code == 0, ended.output
    assert "force within 0.05: take " in ended.stderr
    assert "warning: force is off by" in ended.stderr
    assert len(histories) == 2
    alone = CliRunner().invoke(main, ["run", "yarns-tie-course", *ASKS, "--no-compare"])
    assert "is off by" not in alone.stderr
    assert len(histories) == 3
