"""A scene is valid, frozen, and the same in every unit."""

import dataclasses

import numpy as np
import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.study.configuration import load_scenes
from knitstudy.study.scene import Scene


@pytest.fixture
def scene(config):
    return load_scenes(config)["dns-a"]


@pytest.fixture
def pair(scene):
    """Scene of two crossing yarns that are pressed and then slid."""
    document = scene.to_dict() | {"specimen": "pair"}
    document["load"] |= {"direction": "path", "path": [[0, 0, -1e-5], [2e-4, 0, -1e-5]]}
    return Scene.from_dict(document)


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
        ("interaction", "glued", "tie, rough"),
        ("specimen", "braid", "knit or pair"),
        ("pair.angle", 0, "a number > 0 and <= 90, in degrees"),
        ("pair.angle", 91, "a number > 0 and <= 90, in degrees"),
        ("pair.length", 0, "a number > 0, in m"),
        ("pair.support", "middle", "ends or back"),
        ("load.stops", [0], "a strain > 0"),
        ("load.path", [[0.0, 1.0]], "three numbers x, y, z, in m"),
        ("contact.friction", -0.1, "a number >= 0"),
        ("contact.normal_stiffness", 0, "a number > 0, times E over the mesh size"),
        ("contact.tangential_stiffness", 0, "a number > 0, times E over the mesh size"),
        ("contact.penetration", 0, "a share of the mesh size"),
        ("contact.augmentations", -1, "a whole number from 0 to 100"),
        ("contact.points", 5, "a whole number from 1 to 4"),
        ("contact.tied_edges", "inner", "outer"),
        ("solver.stabilisation", -1e-9, "a number >= 0"),
        ("fidelity", "fem", "dns, rom3d, rom2d or beam"),
        ("load.direction", "bias", "course or wale for a knit"),
        ("rom.joint", "coincident", "or printed"),
        ("rom.springs", "some", "or zones"),
        ("rom.displacement", "yarn", "interface or centreline"),
        ("rom.section", "tripled", "single or doubled"),
        ("beam.contact", "area", "or line"),
        ("beam.section", "soft", "or hertz"),
        ("beam.stiffness", 0, "a number > 0"),
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
            r"unknown key 'load.strane' \(did you mean 'strain'\?\); allowed are direction, lateral, path, ",
        ),
        ("lod.strain", r"unknown key 'lod.strain' \(did you mean 'load'\?\)"),
        ("colour", "unknown key 'colour'; allowed are beam, contact, fidelity, "),
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


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (
            "load.direction",
            "path",
            r"load\.direction is 'path' but must be course or wale where specimen is knit",
        ),
        ("load.path", [[0, 0, 1e-3]], r"load\.path has 1 legs but must be \[\] for a knit"),
        (
            "load.stops",
            [0.02, 0.01],
            r"load\.stops is \[0\.02, 0\.01\] but must rise between 0 and load\.strain",
        ),
        ("load.stops", [0.02, 0.02], r"load\.stops .* must rise"),
        ("load.stops", [0.01, 0.05], r"load\.stops .* must rise between 0 and load\.strain, 0\.05"),
    ],
)
def test_load_that_is_not_one_of_a_knit(scene, key, value, message):
    with pytest.raises(ConfigurationError, match=message):
        scene.replace(key, value)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("load.direction", "course", r"load\.direction is 'course' but must be path where specimen is pair"),
        ("load.path", [], r"load\.path is empty but must have a leg or more for a pair"),
        ("load.stops", [0.01], r"load\.stops is \[0\.01\] but must be \[\] for a pair"),
        ("fidelity", "rom3d", r"fidelity is 'rom3d' but must be dns where specimen is pair"),
        ("pair.length", 3.6e-3, r"pair\.length is 0\.0036 m but must exceed twice yarn\.diameter, 0\.0018 m"),
    ],
)
def test_pair_that_is_not_allowed(pair, key, value, message):
    with pytest.raises(ConfigurationError, match=message):
        pair.replace(key, value)


def test_rows_in_contact_need_one_that_is_not_tied(scene):
    two = scene.replace("pattern.rows", 2)
    with pytest.raises(ConfigurationError, match=r"contact\.tied_edges is 'outer' but must be none"):
        two.replace("interaction", "isotropic")
    assert two.replace("contact.tied_edges", "none").replace("interaction", "rough").interaction == "rough"


def test_constructor_checks_as_well(scene):
    with pytest.raises(ConfigurationError, match=r"load\.strain is 0"):
        dataclasses.replace(scene, load=dataclasses.replace(scene.load, strain=0.0))


def test_scaled_multiplies_every_length_and_modulus_and_nothing_else(scene):
    scaled = scene.scaled(length=1e3, stiffness=1e-6)
    np.testing.assert_array_equal(scaled.pattern.control_points, 1e3 * scene.pattern.control_points)
    lengths = {
        "pattern": ["course_spacing", "wale_spacing"],
        "pair": ["length"],
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


def test_scaled_multiplies_the_path_of_a_pair(pair):
    scaled = pair.scaled(length=1e3)
    np.testing.assert_array_equal(scaled.load.path, 1e3 * np.array(pair.load.path))
    assert scaled.load.stops == pair.load.stops


def test_hash_knows_what_determines_the_result(scene):
    assert scene.replace("load.strain", 0.04).hash != scene.hash
    assert scene.replace("yarn.density", 905).hash == scene.hash, "905 and 905.0 are one value"
    for key, value in [("name", "other"), ("knit", "other"), ("outputs", ["deck"])]:
        assert scene.replace(key, value).hash == scene.hash


def test_hash_leaves_out_what_a_scene_does_not_use(scene, pair):
    for key, value in [("contact.friction", 0.1), ("pair.angle", 30)]:
        assert scene.replace(key, value).hash == scene.hash
    isotropic = scene.replace("interaction", "isotropic")
    assert isotropic.hash != scene.hash
    assert isotropic.replace("contact.friction", 0.1).hash != isotropic.hash
    assert pair.replace("pair.angle", 30).hash != pair.hash
    assert pair.replace("pair.support", "ends").hash != pair.hash


def test_geometry_key_knows_what_determines_the_geometry(scene):
    for key, value in [("yarn.diameter", 1.7e-3), ("pattern.rows", 2), ("geometry.alpha", 2.0)]:
        assert scene.replace(key, value).geometry_key != scene.geometry_key
    for key, value in [("yarn.youngs_modulus", 1e9), ("load.strain", 0.01), ("mesh.size", 1e-3)]:
        assert scene.replace(key, value).geometry_key == scene.geometry_key
    for key, value in [("pair.angle", 30.0), ("contact.friction", 0.1), ("load.stops", [0.01])]:
        assert scene.replace(key, value).geometry_key == scene.geometry_key


def test_geometry_key_of_a_pair(pair, scene):
    assert pair.geometry_key != scene.geometry_key
    for key, value in [("yarn.diameter", 1.7e-3), ("pattern.clearance", 0.02), ("pair.angle", 30.0)]:
        assert pair.replace(key, value).geometry_key != pair.geometry_key
    for key, value in [("pattern.rows", 2), ("pair.support", "ends"), ("load.path", [[0, 0, -1e-6]])]:
        assert pair.replace(key, value).geometry_key == pair.geometry_key


@pytest.fixture
def sprung(scene):
    document = scene.to_dict() | {"fidelity": "rom3d", "interaction": "isotropic"}
    document["rom"]["contacts_from"] = "dns-a"
    return type(scene).from_dict(document)


def test_given_springs_need_three_values_along_the_global_axes(sprung):
    given = sprung.replace("rom.axes", "global").replace("rom.stiffness", [1e3, 2e3, 3e3])
    assert given.rom.stiffness == (1e3, 2e3, 3e3)
    assert given.scaled(length=1e3, stiffness=1e-6).rom.stiffness == pytest.approx((1.0, 2.0, 3.0))
    for key, value in (("rom.stiffness", [1e3]), ("rom.axes", "contact"), ("rom.springs_from", "dns-b")):
        with pytest.raises(ConfigurationError, match=r"rom\.(stiffness|springs_from) is"):
            given.replace(key, value)


@pytest.mark.parametrize("value", ["dns-b"])
def test_springs_of_another_scene_are_averaged_and_need_springs(sprung, value):
    assert sprung.replace("rom.springs_from", value).rom.springs_from == value
    with pytest.raises(
        ConfigurationError, match=r"rom\.springs_from is 'dns-b' but must be empty where rom\.springs"
    ):
        sprung.replace("rom.springs", "zones").replace("rom.springs_from", value)
    with pytest.raises(
        ConfigurationError, match=r"but must be empty where fidelity is rom3d and interaction is tie"
    ):
        sprung.replace("interaction", "tie").replace("rom.springs_from", value)


def test_beams_in_contact_are_not_tied(scene):
    with pytest.raises(ConfigurationError, match="must be rough or isotropic where fidelity is beam"):
        scene.replace("fidelity", "beam")
    document = scene.to_dict() | {"fidelity": "beam", "interaction": "isotropic"}
    assert type(scene).from_dict(document).fidelity == "beam"


def test_columns_are_tied_in_wale_tension(scene):
    document = scene.to_dict() | {"interaction": "isotropic"}
    document["load"]["direction"] = "wale"
    document["pattern"]["loops"] = 2
    with pytest.raises(ConfigurationError, match=r"must be none where pattern\.loops is 2"):
        type(scene).from_dict(document)
