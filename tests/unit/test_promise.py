"""What is promised of other knits: what a model is off there, and when that counts as held; the page about it."""

from pathlib import Path

import pytest
import study
from click.testing import CliRunner

from knitstudy.cli.main import main
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.promises import corrected
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import FORCE, LARGEST_U_Z
from knitstudy.report.kept_pages import BEGIN, END, insert_between_marks, trade_summary
from knitstudy.stages.simulate import Results
from knitstudy.tables import catalogue as tables

TEMPLATE = Path(__file__).resolve().parents[2] / "workflow" / "report" / "accuracy.j2"


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


@pytest.fixture(scope="module")
def table(cases):
    every = {name: each for name, each in study.histories(cases).items() if cases[name].fidelity != "beam"}
    sources = {"every": every, "every_contacts": {}, "scenes": cases, "reference": study.reference(cases)}
    return tables.tabulate("trade", **sources).assign(simulations="36 of 40", made="2026-11-21")


def test_the_page_is_written_from_the_table(table):
    page = insert_between_marks(f"before\n{BEGIN}\nold\n{END}\nafter\n", trade_summary(TEMPLATE, table))
    assert page.startswith(f"before\n{BEGIN}\n")
    assert page.endswith(f"{END}\nafter\n")
    assert "old" not in page
    assert "36 of 40 of the study" in page
    assert "**3 x 3 cells, tie constraint, course tension.** For 5 % in force take" in page
    assert page.count("| force | 3 x 3,") == 4
    assert "### On other knits" not in page


ASKS = ("--set", "fidelity=auto", "--set", "ask.question=force", "--set", "ask.accuracy=0.05")


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
