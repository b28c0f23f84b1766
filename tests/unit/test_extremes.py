"""A trial ends with a sound history, a named error or a silent failure, and its row is kept whole."""

import os
from dataclasses import replace

import extremes
import pytest
import study
import yaml
from extremes import CAUSES, KEPT, Trial, cause, draw, judged, load_trials, run

from knitstudy.datasets import read_table
from knitstudy.errors import ConfigurationError, ConvergenceError, GeometryError
from knitstudy.run.configuration import CONFIG


@pytest.fixture
def trial(plain_scene):
    return Trial("strain a 1", "strain", plain_scene, {"load.strain": 0.1}, 5.0, 0.0)


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
        (GeometryError("yarn.diameter 1 m: no loop"), "refused", "loop"),
        (ConvergenceError("increment 2: misses; the limit gates.ledger is 5%"), "stopped", "gate"),
        (ZeroDivisionError("division by zero"), "silent", "silent"),
        (MemoryError(), "silent", "silent"),
    ],
)
def test_every_end_has_a_row(trial, simulated, error, outcome, why):
    simulated(fails(error))
    row = judged(trial, None, None)
    assert (row["outcome"], row["error"], cause(row)) == (outcome, type(error).__name__, why)
    assert str(error) in row["reason"]
    assert cause(row) in CAUSES


def test_a_process_that_dies_is_a_silent_failure(trial, simulated):
    simulated(lambda scene: os._exit(7))
    row = run(trial, None, None)
    assert (row["outcome"], row["reason"]) == ("silent", "the process ended with status 7")
    assert (row["trial"], row["changed"]) == ("strain a 1", "load.strain = 0.1")


def test_trials_change_one_thing_or_draw_values_within_their_ranges():
    """Of the campaign as it is declared; quantities change the keys that they stand for."""
    declared, trials = yaml.safe_load((CONFIG / "extremes.yaml").read_text()), load_trials(CONFIG)
    alone = [(each.model, dict(each.changes)) for each in trials if each.group == "penalty"]
    both = {"contact.normal_stiffness": 0.1, "contact.tangential_stiffness": 0.1}
    assert (len(alone), alone[0]) == (5, ("hexahedra-slide", both))
    ranges = {key: each for keys, each in declared["together"]["keys"].items() for key in keys.split()}
    drawn = [
        (key, value) for each in trials if each.group == "together" for key, value in each.changes.items()
    ]
    assert {key for key, _ in drawn} == set(ranges)
    for key, value in drawn:
        if isinstance(ranges[key], list):
            assert value in ranges[key]
        else:
            ((low, high),) = ranges[key].values()
            assert low <= value <= high
    for name, key, value in (("diameter", "yarn.diameter", 1.0), ("stiffness", "yarn.youngs_modulus", 1.0)):
        scene = replace(trials[0], changes={name: value}).scene()
        assert scene.value(key) == pytest.approx(value)


def test_the_map_of_the_kept_trials_fits_on_its_page():
    assert min(study.room_around(draw(read_table(KEPT)))) > 0
