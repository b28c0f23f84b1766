"""What is promised of other knits: what a model is off there, and when that counts as held; the page about it."""

import pandas as pd
import pytest
import study

from knitstudy.errors import DataFileError
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.promises import Promise, corrected, error_made
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import FORCE, LARGEST_U_Z, NORMAL
from knitstudy.report.kept_pages import BEGIN, END, insert_between_marks, trade_summary
from knitstudy.stages.kept_tables import TRADE, TRADE_PAGE
from knitstudy.tables import catalogue as tables


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


def test_what_the_reference_does_not_know_is_not_expected(reference):
    found = corrected(reference, (of(12.0), None), (of(24.0), None), 0.05)
    assert not found.at(NORMAL, 0.05).known


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


@pytest.fixture(scope="module")
def table(plain_scene):
    scenes = study.scenes(plain_scene)
    every = {name: each for name, each in study.histories(scenes).items() if scenes[name].fidelity != "beam"}
    sources = {"every": every, "every_contacts": {}, "scenes": scenes, "reference": study.reference(scenes)}
    return tables.tabulate("trade", **sources).assign(simulations="36 of 40", made="2026-11-21")


def test_the_page_is_written_from_the_table(table):
    page = insert_between_marks(f"before\n{BEGIN}\nold\n{END}\nafter\n", trade_summary(table))
    assert page.startswith(f"before\n{BEGIN}\n")
    assert page.endswith(f"{END}\nafter\n")
    assert "old" not in page
    assert "36 of 40 of the study" in page
    assert "**3 x 3 cells, tie constraint, course tension.** For 5 % in force take" in page
    assert page.count("| force | 3 x 3,") == 4
    assert "### On other knits" not in page


def test_promises_are_counted(table):
    promises = pd.DataFrame(
        {
            "scene": ["a", "a", "unseen-mixed-b"],
            "question": "force",
            "accuracy [1]": 0.05,
            "interaction": "tie constraint",
            "held": [True, True, False],
            "surely held": [True, None, False],
            "of another model [1]": [True, False, True],
            "seconds [s]": [6.0, 2.0, 2.0],
            "seconds of the cheapest that would have done [s]": [1.5, 2.0, 2.0],
        }
    )
    said = trade_summary(table, promises)
    assert "| force, 5 % | tie constraint | 3 | 2 | 1 | 4 |" in said
    assert "Of 2 knits 1 kept every promise, and 2 of 3 promises held" in said
    assert (
        "by another model than that which the truth is drawn from 1 of 2, and 0 of 1 of knits with several"
        in said
    )
    assert (
        "1 cost more than 3 times the cheapest rung that would have done, the dearest 4 times (bar: 3)."
        in said
    )


def test_a_page_without_marks_is_refused():
    with pytest.raises(DataFileError, match="must have the lines"):
        insert_between_marks("nothing", "text")


def test_the_page_of_the_checkout_has_marks():
    page = TRADE_PAGE.read_text(encoding="utf-8")
    assert insert_between_marks(page, "text") != page
    assert TRADE.path.is_file()
