"""What is promised of other knits: what a model is off there, and when that counts as held; the page about it."""

import pytest
import study
from click.testing import CliRunner

from knitstudy.cli.main import main
from knitstudy.measures.estimate import Estimate
from knitstudy.measures.promises import corrected
from knitstudy.measures.reference import Reference
from knitstudy.measures.response import FORCE, LARGEST_U_Z
from knitstudy.stages.simulate import Results


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
