"""Scenes with several keys changed at once."""

import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.study.configuration import default_scene, load_scene
from knitstudy.study.variation import differences, flattened, vary


def test_keys_that_depend_on_each_other_change_together(config):
    scene = load_scene("dns-a", config)
    with pytest.raises(ConfigurationError, match=r"load\.direction"):
        scene.replace("specimen", "pair")
    changes = {"specimen": "pair", "load.direction": "path", "load.path": [[0.0, 0.0, -1e-5]]}
    varied = vary(scene, changes)
    assert (varied.specimen, varied.load.path) == ("pair", ((0.0, 0.0, -1e-5),))
    assert varied.yarn == scene.yarn


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("load.strane", 0.1, r"scene 'dns-a': unknown key 'load\.strane' \(did you mean 'strain'\?\)"),
        ("lode.strain", 0.1, r"unknown key 'lode\.strain' \(did you mean 'load'\?\)"),
        ("load.strain", "much", r"load\.strain is 'much' but must be a number > 0"),
    ],
)
def test_wrong_changes(config, key, value, message):
    with pytest.raises(ConfigurationError, match=message):
        vary(load_scene("dns-a", config), {"mesh.size": 0.4e-3, key: value})


def test_differences_are_the_changed_keys(config):
    base = default_scene(config)
    assert differences(load_scene("dns-a", config), base) == {}
    varied = vary(load_scene("rom3d-a", config), {"mesh.beam_size": 1e-3})
    assert differences(varied, base) == {
        "fidelity": "rom3d",
        "load.strain": 0.02,
        "mesh.beam_size": 1e-3,
        "rom.contacts_from": "dns-a",
    }


def test_flattened_keys_change_a_scene_back(config):
    base = default_scene(config)
    assert vary(load_scene("rom3d-a", config), flattened(base)) == base
