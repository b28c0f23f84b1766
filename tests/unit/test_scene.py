"""A scene is valid, frozen, and the same in every unit."""

import dataclasses

import numpy as np
import pytest

from knitstudy.configuration import load_scenes
from knitstudy.errors import ConfigurationError
from knitstudy.scene import Scene


@pytest.fixture
def scene(config):
    return load_scenes(config)["dns-a"]


def test_plain_mapping_and_back(scene):
    assert Scene.from_dict(scene.to_dict()) == scene


def test_is_frozen_to_the_last_array(scene):
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.load.strain = 0.1
    with pytest.raises(ValueError, match="read-only"):
        scene.pattern.control_points[0, 0] = 1.0


@pytest.mark.parametrize(
    ("key", "value", "allowed"),
    [
        ("yarn.diameter", 0.0, "a number > 0, in m"),
        ("yarn.diameter", -1e-3, "a number > 0, in m"),
        ("yarn.youngs_modulus", 0, "a number > 0, in Pa"),
        ("yarn.poisson_ratio", 0.5, "between -1 and 0.5"),
        ("yarn.poisson_ratio", -1.0, "between -1 and 0.5"),
        ("yarn.material", "rubber", "hencky, neo_hookean or st_venant_kirchhoff"),
        ("pattern.loops", 0, "a whole number of at least 1"),
        ("pattern.rows", 1.5, "a whole number of at least 1"),
        ("pattern.clearance", -0.1, "from 0 to 1"),
        ("load.strain", 0, "a number > 0"),
        ("load.strain", "0.05", "a number > 0"),
        ("load.strain", True, "a number > 0"),
        ("load.strain", float("nan"), "a finite number"),
        ("load.direction", "bias", "course"),
        ("interaction", "glued", "tie"),
        ("fidelity", "fem", "dns, rom3d or rom2d"),
        ("mesh.size", float("inf"), "a finite number"),
        ("mesh", 3.0, "a group of keys"),
        ("solver.linear", "magic", "auto, three_scale, amg or lu"),
        ("outputs", ["film"], "fields, vtu or deck"),
        ("outputs", "vtu", "a list out of fields, vtu and deck"),
        ("geometry.free", ["q"] * 8, "letters x, y and z"),
        ("name", "Has spaces", "small letters"),
    ],
)
def test_value_that_is_not_allowed(scene, key, value, allowed):
    with pytest.raises(ConfigurationError) as caught:
        scene.replace(key, value)
    message = str(caught.value)
    assert key in message
    assert repr(value[0] if key in ("geometry.free",) else value).strip("[]") in message
    assert allowed in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("key", "message"),
    [
        (
            "load.strane",
            r"unknown key 'load.strane' \(did you mean 'strain'\?\); allowed are direction, lateral, strain",
        ),
        ("lod.strain", r"unknown key 'lod.strain' \(did you mean 'load'\?\)"),
        ("colour", "unknown key 'colour'; allowed are fidelity, "),
    ],
)
def test_unknown_key(scene, key, message):
    with pytest.raises(ConfigurationError, match=message):
        scene.replace(key, 1.0)


def test_missing_key(scene):
    document = scene.to_dict()
    del document["load"]["strain"]
    with pytest.raises(ConfigurationError, match=r"a\.yaml: the key 'load\.strain' is missing"):
        Scene.from_dict(document, "a.yaml")


@pytest.mark.parametrize("key", ["course_spacing", "wale_spacing"])
def test_rows_and_columns_closer_than_a_diameter(scene, key):
    with pytest.raises(
        ConfigurationError, match=rf"pattern\.{key} is 0\.0018 m but must exceed yarn\.diameter"
    ):
        scene.replace(f"pattern.{key}", scene.yarn.diameter)


def test_one_entry_of_free_for_every_control_point(scene):
    with pytest.raises(ConfigurationError, match=r"geometry\.free has 7 entries but must have 8"):
        scene.replace("geometry.free", ["z"] * 7)


def test_source_of_contacts_goes_with_the_fidelity(scene):
    with pytest.raises(
        ConfigurationError, match=r"rom\.contacts_from is 'x' but must be empty where fidelity is dns"
    ):
        scene.replace("rom.contacts_from", "x")
    with pytest.raises(ConfigurationError, match=r"rom\.contacts_from is empty but must name a dns scene"):
        scene.replace("fidelity", "rom2d")


def test_constructor_checks_as_well(scene):
    with pytest.raises(ConfigurationError, match=r"load\.strain is 0"):
        dataclasses.replace(scene, load=dataclasses.replace(scene.load, strain=0.0))


def test_scaled_multiplies_every_length_and_modulus_and_nothing_else(scene):
    scaled = scene.scaled(length=1e3, stiffness=1e-6)
    np.testing.assert_array_equal(scaled.pattern.control_points, 1e3 * scene.pattern.control_points)
    lengths = {
        "pattern": ["course_spacing", "wale_spacing"],
        "yarn": ["diameter"],
        "mesh": ["size", "beam_size"],
    }
    before, after = scene.to_dict(), scaled.to_dict()
    for section, keys in lengths.items():
        for key in keys:
            assert after[section].pop(key) == 1e3 * before[section].pop(key)
    assert after["yarn"].pop("youngs_modulus") == 1e-6 * before["yarn"].pop("youngs_modulus")
    del before["pattern"]["control_points"], after["pattern"]["control_points"]
    assert after == before


def test_hash_knows_what_determines_the_result(scene):
    assert scene.replace("load.strain", 0.04).hash != scene.hash
    assert scene.replace("yarn.density", 905).hash == scene.hash, "905 and 905.0 are one value"
    for key, value in [("name", "other"), ("knit", "other"), ("outputs", ["deck"])]:
        assert scene.replace(key, value).hash == scene.hash


def test_geometry_key_knows_what_determines_the_geometry(scene):
    for key, value in [("yarn.diameter", 1.7e-3), ("pattern.rows", 2), ("geometry.alpha", 2.0)]:
        assert scene.replace(key, value).geometry_key != scene.geometry_key
    for key, value in [("yarn.youngs_modulus", 1e9), ("load.strain", 0.01), ("mesh.size", 1e-3)]:
        assert scene.replace(key, value).geometry_key == scene.geometry_key
