"""Configuration files become scenes, or one message that names file, key, value and the allowed values."""

import pytest
import yaml
from refusals import refusal

from knitstudy.run.configuration import load_scene, load_scenes

FAMILY = "scenes/small.yaml"


def rewrite(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_family_over_defaults_over_loop(config):
    scenes = load_scenes(config)
    assert list(scenes) == ["dns-a", "rom3d-a"]
    assert scenes["dns-a"].load.strain == 0.05
    assert scenes["rom3d-a"].load.strain == 0.02
    assert scenes["dns-a"].outputs == ("fields", "vtu")
    assert scenes["dns-a"].yarn.diameter == 1.8e-3
    defaults = yaml.safe_load((config / "defaults.yaml").read_text())
    defaults["pattern"]["course_spacing"] = 11e-3
    (config / "defaults.yaml").write_text(yaml.safe_dump(defaults))
    assert load_scenes(config)["dns-a"].pattern.course_spacing == 11e-3


def test_a_wrong_scene_stops_itself_and_no_other(config):
    rewrite(config / FAMILY, "load.strain: 2e-2", "load.strian: 2e-2")
    assert load_scene("dns-a", config).name == "dns-a"
    for load in (load_scenes, lambda config: load_scene("rom3d-a", config)):
        with refusal(r"unknown key 'load\.strian'"):
            load(config)


def test_a_wrong_first_scene_of_a_knit_stops_no_other_scene_of_the_knit(config):
    other = "studies: []\nscenes:\n- name: beam-b\n  keys: {knit: plain, fidelity: beam, interaction: isotropic}\n"
    (config / "scenes" / "z-beams.yaml").write_text(other)
    rewrite(config / FAMILY, "outputs: [fields, vtu]", "load.strian: 0.01")
    with refusal(r"'dns-a'.*load\.strian"):
        load_scene("dns-a", config)
    assert load_scene("beam-b", config).knit == "plain"


def test_scenes_of_one_knit_share_its_geometry(config):
    rewrite(config / FAMILY, "load.strain: 2e-2", "yarn.diameter: 1.7e-3")
    message = r"scene 'rom3d-a': knit is 'plain', as in .*'dns-a', but yarn\.diameter is 0\.0017"
    with refusal(message):
        load_scenes(config)


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("loop.yaml", None, r"loop\.yaml: is missing"),
        ("defaults.yaml", "lod: 3", r"defaults\.yaml: unknown key 'lod' \(did you mean 'load'\?\)"),
        ("defaults.yaml", "specimen: knit\nspecimen: pair", r"defaults\.yaml, line 2: the key 'specimen'"),
    ],
)
def test_file_that_is_missing_or_broken(config, file, content, message):
    (config / file).unlink()
    if content is not None:
        (config / file).write_text(content)
    with refusal(message):
        load_scenes(config)
