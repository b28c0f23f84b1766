"""Scenes with several keys changed at once."""

import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.study.configuration import default_keys, load_scene
from knitstudy.study.scene import differences, flattened


def test_a_scene_of_another_kind_takes_its_sections_from_the_defaults(config):
    scene = load_scene("dns-a", config)
    with pytest.raises(ConfigurationError, match=r"the key 'load\.path' is missing"):
        scene.replace("specimen", "pair")
    pair = scene.vary({"specimen": "pair", "load.path": [[0.0, 0.0, -1e-5]]})
    assert (pair.specimen, pair.load.path, pair.pair.angle) == ("pair", ((0.0, 0.0, -1e-5),), 90.0)
    assert pair.yarn == scene.yarn
    assert "pattern" not in pair.sections
    touching = scene.replace("interaction", "isotropic")
    assert touching.contact.friction == 0.76
    assert touching.replace("interaction", "tie") == scene


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("load.strane", 0.1, r"scene 'dns-a': unknown key 'load\.strane' \(did you mean 'strain'\?\)"),
        ("lode.strain", 0.1, r"unknown key 'lode\.strain' \(did you mean 'load'\?\)"),
        ("load.strain", "much", r"load\.strain is 'much' but must be a number from -0\.2"),
    ],
)
def test_wrong_changes(config, key, value, message):
    with pytest.raises(ConfigurationError, match=message):
        load_scene("dns-a", config).vary({"mesh.size": 0.4e-3, key: value})


def test_differences_are_the_changed_keys(config):
    defaults = default_keys(config)
    assert differences(load_scene("dns-a", config), defaults) == {}
    varied = load_scene("rom3d-a", config).vary({"mesh.beam_size": 1e-3})
    assert differences(varied, defaults) == {
        "fidelity": "rom3d",
        "load.strain": 0.02,
        "mesh.beam_size": 1e-3,
        "rom.contacts_from": "dns-a",
    }


def test_flattened_keys_make_the_scene_again(config):
    scene = load_scene("rom3d-a", config)
    assert scene.replace("load.strain", 0.01).vary(flattened(scene)) == scene
