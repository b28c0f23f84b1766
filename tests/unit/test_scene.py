"""A scene is valid, frozen and the same in every unit; a stage sees the keys that it reads and no others."""

import pickle
import re
from typing import ClassVar

import numpy as np
import pytest
from refusals import REFUSED, refusal

from knitstudy.knit.models.beam import Beams, CellOfBeams
from knitstudy.knit.models.spline_yarns import SplineYarns
from knitstudy.knit.scene.documents import packaged_defaults
from knitstudy.knit.scene.keys import Section, key, section
from knitstudy.knit.scene.kinds import MODELS, FidelityModel
from knitstudy.knit.scene.scene import Scene, flat, unit_warnings
from knitstudy.knit.scene.sections import CellStrain, KnitTension, Pattern, SetYarn
from knitstudy.knit.scene.shared_sections import Friction
from knitstudy.knit.scene.specimens import Knit
from knitstudy.run.configuration import load_scene, load_scenes


@pytest.fixture
def scene(config):
    return load_scenes(config)["dns-a"]


def test_friction_is_the_word_for_a_name_that_digests_keep(scene):
    """Kept results and tables have the paper's word, isotropic; people read and write friction."""
    said, kept = (scene.replace("interaction", name) for name in ("friction", "isotropic"))
    assert (said, said.hash, said.interaction) == (kept, kept.hash, "isotropic")
    assert str(said).endswith(", friction)")
    assert said.to_dict()["interaction"] == "isotropic"
    with refusal("not a key of a scene .* and interaction friction"):
        said.replace("yarn.set", 0.5)


@pytest.mark.parametrize("name", ["course_spacing", "wale_spacing", "loop_length"])
def test_lengths_of_a_thousand_radii_are_questioned(scene, name):
    """A loop has tens of radii of yarn: a thousand are mm that were typed as m."""
    usual = scene.yarn.radius * 30
    assert unit_warnings(scene.replace(f"pattern.{name}", usual)) == []
    (warning,) = unit_warnings(scene.replace(f"pattern.{name}", 1e3 * usual))
    assert re.fullmatch(
        rf"pattern\.{name} is [\d.]+ m, 30000 radii of the yarn: is it meant in mm\?", warning
    )


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


def test_scenes_go_to_other_processes(scenes):
    """A pool of processes pickles its arguments, with all parts of a scene's kind."""
    for each in (*scenes, scenes[2].replace("interaction", "rough")):
        assert pickle.loads(pickle.dumps(each)) == each


def test_a_scene_goes_to_other_processes_though_its_kind_does_not_have_the_values_of_its_defaults(scene):
    """Its defaults are those of the solid that it was made from: of another material, and beams know one alone."""
    defaults = {
        **packaged_defaults(),
        "yarn": packaged_defaults()["yarn"] | {"material": "transversely_isotropic"},
    }
    document = {name: part for name, part in scene.to_dict().items() if name not in ("yarn", "interaction")}
    solid = Scene.from_dict(document | {"interaction": "friction"}, "a", defaults)
    assert solid.yarn.material == "transversely_isotropic"
    beams = solid.vary({"fidelity": "beam", "yarn.material": "hencky"})
    again = pickle.loads(pickle.dumps(beams))
    assert again == beams
    assert again.hash == beams.hash
    assert again.vary({"fidelity": "hexahedra"}) == beams.vary({"fidelity": "hexahedra"})
    with refusal("yarn.material is 'transversely_isotropic' but must be 'hencky'"):
        solid.vary({"fidelity": "beam"})


@pytest.mark.parametrize("made", ["of the file", "varied"])
def test_the_friction_of_a_yarn_is_that_of_every_scene_with_this_yarn(made):
    """Rough yarns have no friction; once they slide, it is that of their yarn and not the default."""
    fabric = load_scene("fabric-acrylic-rib-course-free")
    knit = load_scene("yarns-isotropic-course").vary({"fidelity": "beam", "interaction": "rough"})
    yarn = {"yarn.of": "acrylic"}
    if made == "varied":
        rough = knit.vary(yarn)
    else:
        document = {name: part for name, part in knit.to_dict().items() if name not in ("yarn", "mesh")}
        rough = Scene.from_dict(document | yarn, "a", packaged_defaults())
    assert rough.vary({"interaction": "friction"}).contact.friction == fabric.contact.friction
    assert knit.vary({"interaction": "friction"}).contact.friction == 0.76


MANY_DIGITS = ["dns-tie-course", {"pattern.courses_per_metre": 10**400}, "is a whole number of 401 digits"]


@pytest.mark.parametrize(("name", "changes", "message"), [*REFUSED["scenes"], MANY_DIGITS])
def test_changes_that_are_refused(name, changes, message):
    with refusal(message):
        load_scene(name).vary(changes)


@pytest.mark.parametrize(("group", "message"), [("lod", "unknown key 'lod'"), ("beam", "beam is not a key")])
def test_an_empty_group_that_a_scene_does_not_have_is_refused(scene, group, message):
    with refusal(message):
        Scene.from_dict(scene.to_dict() | {group: {}})


def test_pairs_of_stops_are_even_steps(scene):
    stops = scene.replace("load.stops", [0.001, [0.002, 0.0004], 0.01]).load.stops
    assert stops == pytest.approx((0.001, 0.001 + 0.001 / 3, 0.001 + 0.002 / 3, 0.002, 0.01))


def test_stiffness_of_springs_is_scaled():
    ties = load_scene("rom3d-tie-course")
    assert ties.vary({"rom.contacts_from": None}).rom.contacts_from is None, "ties hang on the geometry alone"
    given = ties.vary({"interaction": "isotropic", "rom.stiffness": [1e3, 2e3, 3e3]})
    assert given.scaled(length=1e3, stiffness=1e-6).rom.stiffness == pytest.approx((1.0, 2.0, 3.0))


LENGTHS = ("pattern.course_spacing", "pattern.wale_spacing", "pair.length", "yarn.diameter")
POINTS = ("pattern.control_points", "load.path")


def test_scaled_multiplies_every_length_and_modulus_and_nothing_else(scenes):
    factors = dict.fromkeys((*LENGTHS, *POINTS), 1e3) | {"yarn.youngs_modulus": 1e-6}
    for scene in scenes:
        before, after = flat(scene.to_dict()), flat(scene.scaled(length=1e3, stiffness=1e-6).to_dict())
        for name in before.keys() & factors:
            np.testing.assert_array_equal(after.pop(name), factors[name] * np.array(before.pop(name)))
        assert after == before


def test_hash_follows_from_the_keys_that_determine_the_result(scene, pair):
    isotropic = scene.replace("interaction", "isotropic")
    for of, name, value in [
        (scene, "load.strain", 0.04),
        (isotropic, "contact.friction", 0.1),
        (pair, "pair.angle", 30),
    ]:
        assert of.replace(name, value).hash != of.hash
    assert isotropic.hash != scene.hash
    for name, value in [("name", "other"), ("knit", "other"), ("outputs", ["deck"])]:
        assert scene.replace(name, value).hash == scene.hash


def test_geometry_key_follows_from_the_keys_that_determine_the_geometry(scene, pair):
    path = [[0, 0, -1e-6]]
    seen = [(scene, "yarn.diameter", 1.7e-3), (scene, "pattern.rows", 2), (scene, "geometry.alpha", 2.0)]
    seen += [(pair, "yarn.diameter", 1.7e-3), (pair, "pair.clearance", 0.02), (pair, "pair.angle", 30.0)]
    unseen = [(scene, "yarn.youngs_modulus", 1e9), (scene, "load.strain", 0.01), (scene, "tie.radius", 0.1)]
    unseen += [(pair, "mesh.size", 10 / 9), (pair, "pair.support", "ends"), (pair, "load.path", path)]
    for of, name, value in seen:
        assert of.replace(name, value).geometry_key != of.geometry_key
    for of, name, value in unseen:
        assert of.replace(name, value).geometry_key == of.geometry_key


def test_other_keys_are_not_there(scene):
    keys = ["load", "mesh.size"]
    seen = scene.only(scene.read(keys), keys)
    assert (seen.name, seen.fidelity, seen.kind) == (scene.name, scene.fidelity, scene.kind)
    assert seen.load == scene.load
    assert seen.mesh.size == scene.mesh.size
    with pytest.raises(AttributeError, match="refinement"):
        seen.mesh.refinement  # noqa: B018
    with pytest.raises(AttributeError, match="'yarn'"):
        seen.yarn  # noqa: B018
    assert seen.value("mesh.refinement") is None


class Grown(Section):
    """A section that keys were added to."""

    old: float = key("numerics", "choice")
    added: float = key("numerics", "choice", ge=0, default=1.0)
    list_added: tuple[float, ...] = key("numerics", "choice", allowed="a list", default=())


class GrownKnit(Knit):
    """A knit with such a section, of ties of one radius."""

    specimens = ("knit",)
    implied: ClassVar = {"tie.radius": 0.183}
    grown: Grown = section()


@pytest.fixture
def grown(scene, monkeypatch):
    """Function to a scene of a model with such a section."""
    model = FidelityModel("growing", "a model that grew", (GrownKnit,), build=None)
    monkeypatch.setitem(MODELS._entries, model.name, model)
    return lambda **keys: scene.vary(
        {"fidelity": "growing", "outputs": [], "grown.old": 2.0}
        | {f"grown.{name}": value for name, value in keys.items()}
    )


def test_a_new_key_counts_at_other_values_than_its_default_alone(grown):
    before = {"grown": {"old": 2.0}}
    assert grown().read(["grown"]) == before
    assert grown(added=1.0, list_added=()).read(["grown"]) == before
    assert grown().hash == grown(added=1.0).hash
    assert grown().to_dict()["grown"] == {"old": 2.0, "added": 1.0, "list_added": []}
    assert grown(added=2.0).read(["grown"]) == {"grown": {"old": 2.0, "added": 2.0}}
    assert grown(list_added=(1.0,)).read(["grown.list_added"]) == {"grown": {"list_added": [1.0]}}
    assert grown().hash != grown(added=2.0).hash


def test_an_implied_value_belongs_to_the_problem_and_is_no_key(grown):
    assert grown().read(["tie"]) == {}
    assert grown().values_of("physics")["tie.radius"] == 0.183
    assert grown().value("tie.radius") is None
    with refusal(r"tie\.radius is not a key of a scene whose .* fidelity growing"):
        grown().replace("tie.radius", 0.2)


def test_a_scene_is_made_of_what_a_user_says():
    pattern = Pattern(course_spacing=0.9e-3, wale_spacing=1.1e-3, loops=1, rows=1)
    cell = CellOfBeams(pattern=pattern, yarn=SetYarn(diameter=0.25e-3), load=CellStrain(strain=0.3))
    assert (cell.specimen, cell.fidelity, cell.interaction) == ("cell", "beam", "isotropic")
    assert cell.pattern.control_points is None, "loops are drawn for the spacings"
    defaults = packaged_defaults()
    assert cell.yarn.youngs_modulus == defaults["yarn"]["youngs_modulus"]
    assert cell.contact.friction == defaults["contact"]["friction"]
    assert cell.load.deformation == "course"
    assert isinstance(cell.vary({"load.strain": 0.1}), CellOfBeams)
    rough = SplineYarns(interaction="rough", load=KnitTension(direction="wale"), name="mine")
    assert (rough.name, rough.knit, rough.specimen, rough.load.direction) == (
        "mine",
        "mine",
        "cut_knit",
        "wale",
    )
    for made, message in [
        (lambda: Pattern(course_spacin=1e-3), r"Pattern: unknown key 'course_spacin' \(did you mean"),
        (lambda: Pattern(rows=0), "Pattern: rows is 0 but must be a whole number from 1"),
        (
            lambda: CellOfBeams(pattern=Pattern(course_spacing=1e-4)),
            "scene: pattern.course_spacing is 0.0001 m but",
        ),
        (lambda: Beams(contact=Friction(friction=-1.0)), "Friction: friction is -1.0"),
        (lambda: Knit(), "Knit is not a class of scenes of a model; take one of Beams, CellOfBeams"),
    ]:
        with refusal(message):
            made()


def test_models_of_beams_are_the_accurate_ones_unless_a_scene_says_otherwise():
    beams = load_scene("yarns-isotropic-course").vary({"fidelity": "beam"})
    assert (beams.beam.section, beams.beam.tie) == ("hertz", "patch")
    assert load_scene("yarns-tie-course").vary({"fidelity": "rom3d"}).rom.joint == "patch"
    paper = load_scene("beam-isotropic-course"), load_scene("rom3d-tie-course")
    assert (paper[0].beam.section, paper[0].beam.tie, paper[1].rom.joint) == ("rigid", "rigid", "rigid")


@pytest.mark.parametrize("key", ["yarn.youngs_modulus", "beam.section"])
def test_a_key_that_others_make_idle_is_refused(key):
    fabric = load_scene("fabric-acrylic-rib-course-free")
    with refusal(rf"{key} is not read where .*yarn\.pressing (is|are) given"):
        fabric.replace(key, fabric.value(key))
    fabric.vary({key: fabric.value(key), "yarn.pressing": None})
    assert fabric.scaled(stiffness=1e-6).yarn.pressing == pytest.approx(1e-6 * fabric.yarn.pressing)


@pytest.mark.parametrize(("name", "changes", "kind", "message"), REFUSED["other kinds"])
def test_a_yarn_or_a_load_is_not_lost_in_another_kind(name, changes, kind, message):
    scene = load_scene(name).vary(changes)
    with refusal(message):
        scene.vary(kind)
