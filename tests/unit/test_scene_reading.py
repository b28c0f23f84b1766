"""What a stage sees of a scene: the keys that it reads and no others."""

import pytest

from knitstudy.study.configuration import load_scenes
from knitstudy.study.keys import Section, key
from knitstudy.study.scene import Scene


@pytest.fixture
def scene(config):
    return load_scenes(config)["dns-a"]


def test_value_of_a_key_that_the_scene_lacks(scene):
    assert scene.value("mesh.size") == 0.3e-3
    assert scene.value("mesh") is scene.mesh
    assert scene.value("contact.friction") is scene.value("contact") is scene.value("mesh.beam_size") is None


def test_section_that_the_scene_lacks_is_named(scene):
    with pytest.raises(
        AttributeError, match=r"the scene has no section 'contact', only pattern, geometry, load"
    ):
        scene.contact  # noqa: B018


def test_sections_and_single_keys_are_read(scene):
    assert scene.read(["specimen", "mesh.size", "tie", "contact", "rom.joint", "mesh.beam_size"]) == {
        "specimen": "knit",
        "mesh": {"size": 0.3e-3},
    }


def test_other_keys_are_not_there(scene):
    keys = ["load", "mesh.size"]
    seen = scene.only(scene.read(keys), keys)
    assert (seen.name, seen.fidelity, seen.kind) == (scene.name, scene.fidelity, scene.kind)
    assert seen.load == scene.load
    assert seen.mesh.size == scene.mesh.size
    with pytest.raises(AttributeError, match="growth"):
        seen.mesh.growth  # noqa: B018
    with pytest.raises(AttributeError, match="no section 'yarn'"):
        seen.yarn  # noqa: B018
    assert seen.value("mesh.growth") is None


def test_keys_at_their_defaults_are_seen_although_nothing_is_read_of_them(scene):
    assert scene.read(["gates"]) == {}
    assert scene.only({}, ["gates"]).gates == scene.gates
    varied = scene.replace("gates.ledger", 0.5)
    assert varied.only(varied.read(["gates"]), ["gates"]).gates == varied.gates
    one = varied.only(varied.read(["gates.hourglass"]), ["gates.hourglass"])
    assert one.gates.hourglass == scene.gates.hourglass
    with pytest.raises(AttributeError, match="ledger"):
        one.gates.ledger  # noqa: B018


def test_what_is_seen_is_what_was_read(scene):
    whole = ["specimen", "interaction", "fidelity", "outputs", *scene.sections]
    assert scene.only(scene.read(whole), whole) == scene


class Grown(Section):
    """A section that a key was added to."""

    old: float = key("numerics", "choice", source="a test")
    added: float = key("numerics", "choice", source="a test", ge=0, default=1.0)
    list_added: tuple[float, ...] = key("numerics", "choice", allowed="a list", source="a test", default=())


def grown(scene, **values):
    return Scene(scene, scene.kind, {"grown": Grown(**{"old": 2.0} | values)})


def test_a_new_key_changes_nothing_at_its_default(scene):
    before = {"grown": {"old": 2.0}}
    assert grown(scene).read(["grown"]) == before
    assert grown(scene, added=1.0, list_added=()).read(["grown"]) == before
    assert grown(scene).hash == grown(scene, added=1.0).hash
    assert grown(scene).to_dict()["grown"] == {"old": 2.0, "added": 1.0, "list_added": []}


def test_a_new_key_counts_at_other_values(scene):
    assert grown(scene, added=2.0).read(["grown"]) == {"grown": {"old": 2.0, "added": 2.0}}
    assert grown(scene, list_added=(1.0,)).read(["grown.list_added"]) == {"grown": {"list_added": [1.0]}}
    assert grown(scene).hash != grown(scene, added=2.0).hash
