"""A trial ends with a sound history, a named error or a silent failure, and its row is kept whole."""

import os

import numpy as np
import pandas as pd
import pytest
from synthetic import history

from knitstudy.errors import ConfigurationError, ConvergenceError, GeometryError
from knitstudy.figures.extremes_map import CAUSES, draw
from knitstudy.stages import extremes
from knitstudy.stages.extremes import Trial, cause, judged, run
from knitstudy.stages.simulate import Results


@pytest.fixture
def trial(plain_scene):
    return Trial("strain a 1", "strain", plain_scene, {"load.strain": 0.1})


@pytest.fixture
def simulated(monkeypatch):
    """Function that puts something in the place of the simulation."""

    def by(does):
        monkeypatch.setattr(extremes, "simulate", lambda scene, folder, **options: does(scene))

    return by


def fails(error):
    def does(scene):
        raise error

    return does


@pytest.mark.parametrize(
    ("error", "outcome", "why"),
    [
        (
            ConfigurationError("scene 'a': load.strain is 1 but must be a number from -0.2"),
            "refused",
            "bounds",
        ),
        (ConfigurationError("load.strain is 1 but must be 2 as in yarn.diameter"), "refused", "keys"),
        (GeometryError("yarn.diameter 1 m: no loop"), "refused", "loop"),
        (ConvergenceError("increment 2: open; gates.ledger allows 5%"), "stopped", "gate"),
        (
            ConvergenceError("increment 2: does not converge: solver.increments may help"),
            "stopped",
            "balance",
        ),
        (ZeroDivisionError("division by zero"), "silent", "silent"),
        (MemoryError(), "silent", "silent"),
    ],
)
def test_every_end_has_a_row(trial, simulated, error, outcome, why):
    simulated(fails(error))
    row = judged(trial, 0.0, None, None)
    assert (row["outcome"], row["error"], cause(row)) == (outcome, type(error).__name__, why)
    assert str(error) in row["reason"]
    assert cause(row) in CAUSES


def test_a_refusal_names_its_keys(trial, simulated):
    simulated(fails(ConvergenceError("gates.ledger allows 5%: use more solver.increments, not mesh.sizes")))
    assert judged(trial, 0.0, None, None)["keys named"].split() == ["solver.increments", "gates.ledger"]


def test_a_history_that_is_not_sound_is_a_silent_failure(trial, simulated):
    broken = history(force=(0.0, 1.0, np.nan), scene="a").assign(
        {name: ("increment", np.linspace(0, 1, 3)) for name in ("load", "residual")}
    )
    broken["reaction"] = (("increment", "xyz"), np.zeros((3, 3)))
    broken["energy"] = (("increment", "form"), np.ones((3, 1)))
    broken = broken.assign_coords(form=["external"])
    simulated(lambda scene: Results(scene, None, broken))
    row = judged(trial, 0.0, None, None)
    assert (row["outcome"], row["reason"]) == ("silent", "force holds what is no number")


def test_a_process_that_dies_is_a_silent_failure(trial, simulated):
    simulated(lambda scene: os._exit(7))
    row = run(trial, 5.0, 0.0, None, None)
    assert (row["outcome"], row["reason"]) == ("silent", "the process ended with status 7")
    assert (row["trial"], row["changed"]) == ("strain a 1", "load.strain = 0.1")


def test_the_map_has_a_square_for_every_trial():
    rows = [
        {"group": group, "model": model, "number": number, "cause": why}
        for group in ("strain", "gap")
        for model in ("a", "b")
        for number, why in enumerate(CAUSES, 1)
    ]
    page = draw(pd.DataFrame(rows))
    (axes,) = page.axes
    assert len(axes.collections[0].get_offsets()) == len(rows)
    assert [text.get_text() for text in axes.get_yticklabels()] == ["strain", "gap"]
    labels = [text.get_text() for text in page.legends[0].get_texts()]
    assert labels == [f"{label} (4)" for label, _ in CAUSES.values()]
