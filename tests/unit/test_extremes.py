"""A trial ends with a sound history, a named error or a silent failure, and its row is kept whole."""

import os

import extremes
import pytest
import yaml
from extremes import CAUSES, KEPT, Trial, cause, draw, judged, load_trials, run
from layout import room_around

from knitstudy.errors import ConfigurationError, ConvergenceError, GeometryError
from knitstudy.files import read_table


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
        (ConvergenceError("increment 2: open; gates.ledger allows 5%"), "stopped", "gate"),
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


BASES = {
    "a": {},
    "b": {"fidelity": "rom3d", "rom.contacts_from": "extreme-a"},
    "c": {"interaction": "isotropic"},
}

DECLARED = {
    "seed": 1,
    "limit": 10.0,
    "cheap": 1.0,
    "alone": {
        "strain": {"of": ["b"], "values": {"load.strain": [-1]}, "cases": [{"load.stops": [0.01]}]},
        "both": {"of": ["c"], "values": {"contact.normal_stiffness contact.tangential_stiffness": [3]}},
        "size": {"of": ["a"], "values": {"diameter": [1.0]}},
        "stiffness": {"of": ["a"], "values": {"stiffness": [1.0]}},
        "across": {"of": ["a"], "values": {"across": [5]}},
    },
    "together": {
        "scenes": 40,
        "changed": 0.5,
        "of": ["a", "b", "c"],
        "keys": {
            "load.strain": {"even": [0.1, 0.2]},
            "mesh.size": {"decades": [1e-2, 1]},
            "interaction": ["rough", "isotropic"],
            "contact.friction": {"even": [0, 1]},
            "diameter": {"decades": [1e-3, 1]},
        },
    },
}


@pytest.fixture
def campaign(config):
    """Trials of a campaign."""
    scenes = [{"name": f"extreme-{name}", "keys": {"knit": "plain", **keys}} for name, keys in BASES.items()]
    (config / "scenes" / "small.yaml").write_text(yaml.safe_dump({"studies": [], "scenes": scenes}))
    (config / "extremes.yaml").write_text(yaml.safe_dump(DECLARED))
    return load_trials(config)


def changes(campaign, group):
    return [(trial.model, dict(trial.changes)) for trial in campaign if trial.group == group]


def test_values_and_cases_change_one_thing_at_a_time(campaign):
    assert changes(campaign, "strain") == [("b", {"load.strain": -1}), ("b", {"load.stops": [0.01]})]
    both = {"contact.normal_stiffness": 3, "contact.tangential_stiffness": 3}
    assert changes(campaign, "both") == [("c", both)]


def test_draws_lie_in_their_ranges_and_are_of_keys_that_the_scene_has(campaign):
    together = changes(campaign, "together")
    assert len(together) == 3 * 40
    strains = [changed["load.strain"] for _, changed in together if "load.strain" in changed]
    assert 0.1 <= min(strains) < 0.12 < 0.18 < max(strains) <= 0.2
    keys = {model: {key for name, changed in together if name == model for key in changed} for model in "abc"}
    assert keys["b"] == {"load.strain", "diameter"}
    assert keys["c"] == {"load.strain", "mesh.size", "diameter", "interaction", "contact.friction"}


def test_the_map_of_the_kept_trials_fits_on_its_page():
    assert min(room_around(draw(read_table(KEPT)))) > 0
