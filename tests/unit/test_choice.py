"""A model is chosen for what is asked: the cheapest that is sure enough, or one message of what comes nearest."""

import pandas as pd
import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.files import write_table
from knitstudy.study.choice import INTERACTIONS, Ask, choose, resolved
from knitstudy.study.configuration import load_scenes

ROWS = [  # scene, interaction, question, error at most, seconds, memory
    ("planar", "tie", "force", 3.0, 1.5, 4.0),
    ("network", "tie", "force", 0.04, 2.0, 15.0),
    ("network", "tie", "out_of_plane", 0.2, 2.0, 15.0),
    ("yarns", "tie", "force", 0.02, 10.0, 60.0),
    ("yarns", "tie", "out_of_plane", 0.06, 10.0, 60.0),
    ("yarns", "tie", "stress", 0.06, 10.0, 60.0),
    ("fine", "tie", "force", 0.01, 40.0, 160.0),
    ("sourced", "tie", "force", 0.001, 0.1, 1.0),
    ("network", "rough", "force", 0.09, 2.0, 15.0),
    ("touching", "rough", "force", 0.03, 20.0, 200.0),
]


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    path = tmp_path_factory.mktemp("kept") / "trade.csv"
    rows = [
        {
            "question": question,
            "interaction": INTERACTIONS[interaction],
            "direction": "course",
            "cells [1]": "3 x 3",
            "model": scene,
            "model and knobs": scene,
            "error at most [1]": error,
            "seconds [s]": seconds,
            "memory growth [MB]": memory,
            "scene": scene,
        }
        for scene, interaction, question, error, seconds, memory in ROWS
    ]
    write_table(pd.DataFrame(rows), path)
    return path


@pytest.fixture(scope="module")
def templates(plain_scene):
    third = {"mesh.degree": 3, "mesh.crossing_degree": 3, "mesh.crossing_span": 0.6}
    found = (
        plain_scene.vary({"name": "planar", "fidelity": "rom2d", "rom.contacts_from": None}),
        plain_scene.vary(
            {"name": "network", "fidelity": "rom3d", "rom.contacts_from": None, "rom.joint": "patch"}
        ),
        plain_scene.vary({"name": "sourced", "fidelity": "rom3d", "rom.contacts_from": "yarns"}),
        plain_scene.vary({"name": "yarns", "fidelity": "spline_yarns"}),
        plain_scene.vary({"name": "fine", "fidelity": "spline_yarns"} | third),
        plain_scene.vary({"name": "touching", "fidelity": "spline_yarns", "interaction": "rough"}),
    )
    return {scene.name: scene for scene in found}


@pytest.fixture
def choice(plain_scene, templates, kept):
    problem = plain_scene.vary({"name": "mine", "fidelity": "spline_yarns"})

    def chosen(changes=(), **ask):
        return choose(problem.vary(dict(changes)), Ask(**ask), templates, "scene 'mine'", kept)

    return chosen


@pytest.mark.parametrize(
    ("accuracy", "model"), [(5.0, "planar"), (0.05, "network"), (0.03, "yarns"), (0.01, "fine")]
)
def test_the_cheapest_that_is_sure_enough_is_taken(choice, accuracy, model):
    found = choice(question="force", accuracy=accuracy)
    assert found.rung.model == model
    assert found.rung.error <= accuracy
    assert [rung.model for rung in found.front] == ["planar", "network", "yarns", "fine"]


def test_ties_stand_in_for_contact_as_far_as_that_was_measured(choice, templates):
    rough = {"interaction": "rough"}
    found = choice(rough, question="force", accuracy=0.1)
    assert found.rung.model == "network"
    assert resolved(found, templates)["interaction"] == "tie"
    assert choice(rough, question="force", accuracy=0.05).rung.model == "touching"
    half = rough | {"load.strain": 0.5 * templates["network"].load.strain}
    assert choice(half, question="force", accuracy=0.1).rung.model == "touching"


def test_a_budget_of_memory_takes_what_is_dearer_in_time_or_ends(choice):
    assert choice(question="force", accuracy=0.05, memory=20.0).rung.model == "network"
    with pytest.raises(ConfigurationError, match=r"ask\.memory is 20, but within ask\.accuracy 0\.01 the"):
        choice(question="force", accuracy=0.01, memory=20.0)


def test_an_accuracy_that_nothing_reaches_names_what_comes_nearest(choice):
    message = r"ask\.accuracy is 0\.001, but no model is known to be off by less than 0\.01 .* fine is .* ask for that"
    with pytest.raises(ConfigurationError, match=message):
        choice(question="force", accuracy=0.001)


def _read(path):
    return tuple(pd.read_csv(path, keep_default_na=False, dtype=str).to_dict("records"))


def test_scenes_of_a_family_may_ask(config, kept, monkeypatch):
    """Read as everything reads them: an ordinary scene."""
    monkeypatch.setattr("knitstudy.study.choice._rows", lambda _: _read(kept))
    families = config / "scenes"
    (families / "9-trade.yaml").write_text(
        "studies: []\nkeys: {knit: plain}\n"
        "scenes:\n"
        "- name: network\n  keys: {fidelity: rom3d, rom.joint: patch}\n"
        "- name: mine\n  keys: {fidelity: auto, ask.question: force, ask.accuracy: 0.05, load.strain: 0.04}\n"
    )
    scenes = load_scenes(config)
    assert scenes["mine"].fidelity == "rom3d"
    assert scenes["mine"].load.strain == 0.04
    assert scenes["mine"] == scenes["network"].vary({"name": "mine", "load.strain": 0.04})
