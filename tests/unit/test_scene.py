"""A scene is valid, frozen, and the same in every unit."""

import numpy as np
import pytest
from pydantic import ValidationError

from knitstudy.errors import ConfigurationError
from knitstudy.mechanics.elements import ELEMENTS
from knitstudy.study.configuration import load_scenes
from knitstudy.study.scene import Scene


@pytest.fixture
def scene(config):
    return load_scenes(config)["dns-a"]


@pytest.fixture
def pair(scene):
    """Scene of two crossing yarns that are pressed and then slid."""
    return scene.vary({"specimen": "pair", "load.path": [[0, 0, -1e-5], [2e-4, 0, -1e-5]]})


@pytest.fixture
def scenes(scene, pair):
    """Scenes that have all keys between them."""
    touching = scene.replace("interaction", "isotropic")
    reduced = {"rom.contacts_from": "dns-a"}
    return [
        scene,
        pair,
        touching,
        touching.vary({"fidelity": "rom3d"} | reduced),
        touching.vary({"fidelity": "rom2d"} | reduced),
        touching.replace("fidelity", "beam"),
    ]


def having(scenes, key):
    """Return the first scene that has a key."""
    section, _, field = key.partition(".")
    return next(
        scene
        for scene in scenes
        if section in scene.to_dict() and (not field or field in scene.to_dict()[section])
    )


def test_plain_mapping_and_back(scene):
    assert Scene.from_dict(scene.to_dict()) == scene


def test_plain_mapping_of_every_kind_and_back(scenes):
    for scene in scenes:
        assert Scene.from_dict(scene.to_dict()) == scene
        assert hash(Scene.from_dict(scene.to_dict())) == hash(scene)


def test_is_frozen_to_the_last_number(scene):
    with pytest.raises(
        AttributeError, match=r"a scene cannot be changed \(load\); `Scene\.replace` returns another"
    ):
        scene.load = None
    with pytest.raises(ValidationError, match="frozen"):
        scene.load.strain = 0.1
    with pytest.raises(TypeError, match="does not support item assignment"):
        scene.pattern.control_points[0][0] = 1.0


@pytest.mark.parametrize(
    ("key", "value", "allowed"),
    [
        ("yarn.diameter", 0.0, "a number > 0 and <= 1e6, in m"),
        ("yarn.diameter", -1e-3, "a number > 0 and <= 1e6, in m"),
        ("yarn.youngs_modulus", 0, "a number > 0 and <= 1e20, in Pa"),
        ("yarn.poisson_ratio", 0.5, "a number between -1 and 0.5"),
        ("yarn.poisson_ratio", -1.0, "a number between -1 and 0.5"),
        (
            "yarn.material",
            "rubber",
            "hencky (linear in logarithmic strain), neo_hookean (of rubber), "
            "st_venant_kirchhoff (linear in Green's strain) or "
            "transversely_isotropic (five constants about the yarn's axis)",
        ),
        ("pattern.loops", 0, "a whole number from 1 to 10000"),
        ("pattern.rows", 1.5, "a whole number from 1 to 10000"),
        ("pattern.clearance", -0.1, "a number from 0 to 1, in yarn radii"),
        ("load.strain", 0, "a number from -0.2 to 0.5, not 0"),
        ("load.strain", -0.21, "a number from -0.2 to 0.5, not 0"),
        ("load.strain", "0.05", "a number from -0.2"),
        ("load.strain", True, "a number from -0.2"),
        ("load.strain", float("nan"), "a finite number"),
        ("pair.angle", 0, "a number > 0 and <= 90, in degrees"),
        ("pair.angle", 91, "a number > 0 and <= 90, in degrees"),
        ("pair.length", 0, "a number > 0 and <= 1e6, in m"),
        ("pair.support", "middle", "ends or back"),
        ("load.stops", [True], "has the entry True but must be a list of strains on the way"),
        (
            "load.path",
            [[0.0, 1.0]],
            "has the entry [0.0, 1.0] but must be a list of one displacement x, y, z in m or more",
        ),
        ("contact.friction", -0.1, "a number from 0 to 1e6"),
        ("contact.normal_stiffness", 0, "a number > 0 and <= 1e12, times E over the mesh size"),
        ("contact.tangential_stiffness", 0, "a number > 0 and <= 1e12, times E over the mesh size"),
        ("contact.penetration", 0, "a number > 0 and <= 1, a share of the mesh size"),
        ("contact.augmentations", -1, "a whole number from 0 to 100"),
        ("contact.points", 5, "a whole number from 1 to 4"),
        ("contact.tied_edges", "inner", "outer (the first"),
        ("solver.stabilisation", -1e-9, "a number from 0 to 1e6, times Young's modulus"),
        ("load.direction", "bias", "course or wale"),
        ("rom.joint", "coincident", "rigid (arms"),
        ("rom.springs", "some", "averaged (one stiffness"),
        ("rom.displacement", "yarn", "interface or centreline"),
        ("rom.section", "tripled", "single or doubled"),
        ("beam.section", "soft", "rigid (a penalty) or hertz"),
        ("beam.stiffness", 0, "a number > 0"),
        ("mesh.size", float("inf"), "a finite number"),
        ("mesh", 3.0, "a group of keys"),
        ("solver.linear", "magic", "auto, three_scale, amg or lu"),
        ("outputs", ["film"], "a list out of [fields, vtu, deck] where fidelity is hexahedra"),
        ("outputs", "vtu", "a list of what is written besides"),
        ("geometry.free", ["q"] * 8, "has the entry 'q' but must be a list of the components that may move"),
        ("name", "Has spaces", "a name of at most 200 small letters"),
    ],
)
def test_value_that_is_not_allowed(scenes, key, value, allowed):
    assert_refused(having(scenes, key), key, value, allowed)


@pytest.mark.parametrize(
    ("key", "value", "allowed"),
    [
        ("interaction", "glued", "tie, rough, isotropic"),
        ("specimen", "knut", "knit, cut_knit, cell, pair"),
        ("fidelity", "rom4d", "hexahedra, spline_yarns, rom3d, rom2d, beam, window"),
    ],
)
def test_unknown_kind(scene, key, value, allowed):
    with pytest.raises(ConfigurationError, match=rf"unknown {key} '{value}'.*; allowed are {allowed}$"):
        scene.replace(key, value)


@pytest.mark.parametrize(
    ("key", "value", "allowed"),
    [
        ("contact.points", 3.0, "a whole number from 1 to 4"),
        ("contact.points", True, "a whole number from 1 to 4"),
        ("contact.points", "3", "a whole number from 1 to 4"),
        ("solver.increments", 10**6, "a whole number from 1 to 10000"),
        ("yarn.youngs_modulus", 1e300, "a number > 0 and <= 1e20, in Pa"),
        ("yarn.youngs_modulus", None, "a number > 0 and <= 1e20, in Pa"),
        ("mesh.size", [[1e-3]], "a number > 0 and <= 1e6, in m"),
        ("mesh.size", {"size": 1e-3}, "a number > 0 and <= 1e6, in m"),
        ("mesh.element", 8, ELEMENTS.allowed()),
        ("load.stops", [[0.01]], "has the entry [0.01] but must be a list of strains on the way"),
        ("load.stops", [0.01, float("nan")], "has the entry nan but must be a finite number"),
        ("load.stops", 0.01, "a list of strains on the way"),
        ("load.path", [[0.0, 0.0, 1e-3, 0.0]], "has the entry [0.0, 0.0, 0.001, 0.0] but must be a list"),
        ("pattern.control_points", [[0, 0, "x"]] * 4, "has the entry 'x' but must be a list of at least 4"),
        ("geometry.free", ["z", 3], "has the entry 3 but must be a list of the components that may move"),
        ("name", 3, "a name of at most 200 small letters"),
        ("fidelity", ["hexahedra"], "beam (beams in contact), hexahedra (solid yarns of hexahedra)"),
    ],
)
def test_value_of_a_wrong_type(scenes, key, value, allowed):
    assert_refused(having(scenes, key), key, value, allowed)


@pytest.mark.parametrize(("key", "digits"), [("solver.increments", 401), ("mesh.size", 5001)])
def test_integer_beyond_a_double(scene, key, digits):
    with pytest.raises(
        ConfigurationError, match=rf"{key} is a whole number of {digits} digits but must be a .* to|<="
    ):
        scene.replace(key, 10 ** (digits - 1))


def test_value_that_fills_pages_is_cut(scene):
    with pytest.raises(ConfigurationError) as caught:
        scene.replace("yarn.material", "x" * 10_000)
    assert len(str(caught.value)) < 400
    assert "xxx ... but must be hencky" in str(caught.value)


@pytest.mark.parametrize("key", [3, None, True, 0.5])
def test_key_that_is_no_text(scene, key):
    document = scene.to_dict()
    with pytest.raises(ConfigurationError, match=f"a\\.yaml: unknown key '{key}'"):
        Scene.from_dict(document | {key: 1}, "a.yaml")
    document["load"][key] = 1
    with pytest.raises(ConfigurationError, match=f"a\\.yaml: unknown key 'load\\.{key}'"):
        Scene.from_dict(document, "a.yaml")


def assert_refused(scene, key, value, allowed):
    """Assert that one line names the key, its value and what is allowed."""
    with pytest.raises(ConfigurationError) as caught:
        scene.replace(key, value)
    message = str(caught.value)
    shown = allowed if " but must be " in allowed else f"is {value!r} but must be {allowed}"
    assert f"scene 'dns-a': {key} {shown}" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("key", "message"),
    [
        (
            "load.strane",
            r"unknown key 'load.strane' \(did you mean 'strain'\?\); allowed are direction, lateral, stops",
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


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [
        ({}, "rom.contacts_from", "x"),
        ({}, "contact.friction", 0.5),
        ({}, "mesh.beam_size", 1e-3),
        ({}, "load.path", [[0.0, 0.0, 1e-3]]),
        ({}, "pair.angle", 30.0),
        ({}, "beam.tie", "rigid"),
        ({"interaction": "rough"}, "contact.friction", 0.5),
        ({"fidelity": "rom3d", "rom.contacts_from": "dns-a"}, "rom.springs_from", "dns-b"),
        ({"fidelity": "rom3d", "rom.contacts_from": "dns-a"}, "solver.hourglass", 0.005),
        ({"fidelity": "rom3d", "rom.contacts_from": "dns-a"}, "mesh.size", 1e-3),
        ({"fidelity": "rom2d", "rom.contacts_from": "dns-a"}, "mesh.beam_size", 1e-3),
        ({"fidelity": "rom2d", "rom.contacts_from": "dns-a"}, "rom.joint", "rigid"),
        ({"specimen": "pair", "load.path": [[0.0, 0.0, -1e-5]]}, "load.direction", "course"),
        ({"specimen": "pair", "load.path": [[0.0, 0.0, -1e-5]]}, "load.stops", [0.01]),
        ({"specimen": "pair", "load.path": [[0.0, 0.0, -1e-5]]}, "pattern.clearance", 0.01),
    ],
)
def test_key_of_another_kind_of_scene(scene, kind, key, value):
    of = scene.vary(kind)
    with pytest.raises(ConfigurationError) as caught:
        of.replace(key, value)
    said = (
        f"is no key of a scene whose specimen is {of.specimen}, fidelity {of.fidelity} and"
        f" interaction {of.interaction}; leave it out"
    )
    assert str(caught.value) == f"scene 'dns-a': {key} {said}"


def test_key_that_another_kind_of_scene_needs(scene):
    with pytest.raises(ConfigurationError, match=r"the key 'load\.path' is missing"):
        scene.replace("specimen", "pair")


def test_springs_are_measured_somewhere(scene):
    """Ties hang on the geometry alone."""
    with pytest.raises(
        ConfigurationError,
        match=r"contacts_from is empty but must name a scene of solid yarns where yarns touch",
    ):
        scene.vary({"fidelity": "rom3d", "interaction": "isotropic"})
    assert scene.replace("fidelity", "rom3d").rom.contacts_from is None


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("load.direction", "path", r"load\.direction is 'path' but must be course or wale"),
        (
            "load.stops",
            [0.02, 0.01],
            r"load\.stops is \[0\.02, 0\.01\] but must go on from one to the next between 0 and load\.strain, 0\.05",
        ),
        ("load.stops", [0.02, 0.02], r"load\.stops .* must go on"),
        ("load.stops", [0.01, 0.05], r"load\.stops .* must go on .* between 0 and load\.strain, 0\.05"),
        ("load.stops", [-0.01], r"load\.stops .* must go on .* between 0 and load\.strain, 0\.05"),
    ],
)
def test_load_that_is_not_one_of_a_knit(scene, key, value, message):
    with pytest.raises(ConfigurationError, match=message):
        scene.replace(key, value)


def test_stops_of_a_compression_go_down(scene):
    pressed = scene.vary({"load.strain": -0.05, "load.stops": [-0.01, -0.02]})
    assert pressed.load.stops == (-0.01, -0.02)
    with pytest.raises(
        ConfigurationError, match=r"load\.stops .* must go on .* between 0 and load\.strain, -0\.05"
    ):
        scene.replace("load.strain", -0.05).replace("load.stops", [0.01])


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("load.path", [], r"load\.path is \[\] but must be a list of one displacement x, y, z in m or more"),
        (
            "fidelity",
            "rom3d",
            r"fidelity is 'rom3d' but must be hexahedra or spline_yarns where specimen is pair",
        ),
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
    loose = two.vary({"interaction": "rough", "contact.tied_edges": "none"})
    assert loose.contact.tied_edges == "none"


LENGTHS = {
    "pattern": ["course_spacing", "wale_spacing"],
    "pair": ["length"],
    "yarn": ["diameter"],
    "mesh": ["size", "beam_size"],
}


def test_scaled_multiplies_every_length_and_modulus_and_nothing_else(scenes):
    for scene in scenes:
        scaled = scene.scaled(length=1e3, stiffness=1e-6)
        before, after = scene.to_dict(), scaled.to_dict()
        for section, key in (("pattern", "control_points"), ("load", "path")):
            if section in before and key in before[section]:
                points = np.array(before[section].pop(key))
                np.testing.assert_array_equal(after[section].pop(key), 1e3 * points)
        for section, keys in LENGTHS.items():
            for key in keys:
                if key in before.get(section, {}):
                    assert after[section].pop(key) == 1e3 * before[section].pop(key)
        assert after["yarn"].pop("youngs_modulus") == 1e-6 * before["yarn"].pop("youngs_modulus")
        assert after == before


def test_hash_knows_what_determines_the_result(scene):
    assert scene.replace("load.strain", 0.04).hash != scene.hash
    assert scene.replace("load.strain", 0.05).hash == scene.hash
    for key, value in [("name", "other"), ("knit", "other"), ("outputs", ["deck"])]:
        assert scene.replace(key, value).hash == scene.hash


def test_hash_knows_every_key_of_the_kind(scene, pair):
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
    for key, value in [("interaction", "rough"), ("tie.radius", 0.1), ("load.stops", [0.01])]:
        assert scene.replace(key, value).geometry_key == scene.geometry_key


def test_geometry_key_of_a_pair(pair, scene):
    assert pair.geometry_key != scene.geometry_key
    for key, value in [("yarn.diameter", 1.7e-3), ("pair.clearance", 0.02), ("pair.angle", 30.0)]:
        assert pair.replace(key, value).geometry_key != pair.geometry_key
    for key, value in [("mesh.size", 1e-3), ("pair.support", "ends"), ("load.path", [[0, 0, -1e-6]])]:
        assert pair.replace(key, value).geometry_key == pair.geometry_key


@pytest.fixture
def sprung(scene):
    return scene.vary({"fidelity": "rom3d", "interaction": "isotropic", "rom.contacts_from": "dns-a"})


def test_given_springs_need_three_values_along_the_global_axes(sprung):
    given = sprung.vary({"rom.axes": "global", "rom.stiffness": [1e3, 2e3, 3e3]})
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


def test_beams_in_contact_are_not_tied(scene):
    with pytest.raises(ConfigurationError, match="must be rough or isotropic where fidelity is beam"):
        scene.replace("fidelity", "beam")
    assert scene.vary({"fidelity": "beam", "interaction": "isotropic"}).contact.tied_edges == "outer"


def test_columns_are_tied_in_wale_tension(scene):
    with pytest.raises(ConfigurationError, match=r"must be none where pattern\.loops is 2"):
        scene.vary({"interaction": "isotropic", "load.direction": "wale", "pattern.loops": 2})


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"yarn.transverse_modulus": 1e9},
            r"yarn\.transverse_modulus is 1e\+09 but must be null where yarn\.material is",
        ),
        (
            {"yarn.material": "transversely_isotropic", "yarn.transverse_modulus": 1e12},
            r"yarn\.axial_poisson_ratio is 0\.42 and stores no positive energy",
        ),
        (
            {"yarn.material": "transversely_isotropic", "fidelity": "rom3d"},
            r"yarn\.material is transversely_isotropic but must be isotropic where fidelity is rom3d",
        ),
    ],
)
def test_materials_with_an_axis(plain_scene, keys, message):
    with pytest.raises(ConfigurationError, match=message):
        plain_scene.vary(keys)
