"""Configuration files become scenes, or one message that names file, key, value and what is allowed."""

import pytest
import yaml

from knitstudy.errors import ConfigurationError
from knitstudy.study.configuration import load_knits, load_scene, load_scenes, load_study


def rewrite(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def set_default(config, key, value):
    defaults = yaml.safe_load((config / "defaults.yaml").read_text())
    section, name = key.split(".")
    defaults[section][name] = value
    (config / "defaults.yaml").write_text(yaml.safe_dump(defaults))


def test_row_over_defaults_over_loop(config):
    scenes = load_scenes(config)
    assert list(scenes) == ["dns-a", "rom3d-a"]
    assert scenes["dns-a"].load.strain == 0.05
    assert scenes["rom3d-a"].load.strain == 0.02
    assert scenes["dns-a"].outputs == ("fields", "vtu")
    assert scenes["dns-a"].yarn.diameter == 1.8e-3
    set_default(config, "pattern.course_spacing", 11e-3)
    assert load_scenes(config)["dns-a"].pattern.course_spacing == 11e-3


def test_independent_of_the_current_directory(tmp_path, monkeypatch):
    here = load_scenes()
    monkeypatch.chdir(tmp_path)
    assert load_scenes() == here


def test_number_without_point_or_sign_is_a_number(config):
    rewrite(config / "scenes.tsv", "2e-2", "2e-1")
    assert load_scene("rom3d-a", config).load.strain == 0.2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("2e-2", "much", r"scenes\.tsv, scene 'rom3d-a': load\.strain is 'much' but must be a number > 0"),
        ("2e-2", "0", r"scene 'rom3d-a': load\.strain is 0 but must be a number > 0"),
        ("2e-2", "[", r"scene 'rom3d-a': load\.strain is '\[', which is not YAML"),
        ("load.strain", "load.stress", r"unknown key 'load\.stress'"),
        (
            "\tdns-a\t",
            "\tdns-b\t",
            r"rom\.contacts_from names the unknown dns scene 'dns-b'.*allowed are dns-a",
        ),
        ("\tdns-a\t", "\trom3d-a\t", r"rom\.contacts_from names the unknown dns scene 'rom3d-a'"),
        ("rom3d-a\treduced\tplain", "rom3d-a\treduced\tother", r"knit is 'other' but must be 'plain' as in"),
        ("rom3d-a\treduced", "rom3d-a\thuge", r"line 3: unknown study 'huge'.*ci, reduced, full"),
        ("rom3d-a\t", "dns-a\t", r"line 3: scene 'dns-a' is there twice"),
        ("\t2e-2\t", "\t2e-2\t\t", r"line 3: must have as many cells as the first line"),
        ("\t2e-2\t", "", r"line 3: must have as many cells as the first line"),
        ("study", "group", r"must have the columns 'scene' and 'study'"),
        (
            "[fields, vtu]",
            "[fields, film]",
            r"scene 'dns-a': outputs\.1 is 'film' but must be fields, vtu or deck",
        ),
    ],
)
def test_table_that_is_not_allowed(config, old, new, message):
    rewrite(config / "scenes.tsv", old, new)
    with pytest.raises(ConfigurationError, match=message):
        load_scenes(config)


def test_scenes_of_one_knit_share_its_geometry(config):
    rewrite(config / "scenes.tsv", "load.strain", "yarn.diameter")
    rewrite(config / "scenes.tsv", "2e-2", "1.7e-3")
    message = r"scene 'rom3d-a': knit is 'plain', as in .*'dns-a', but yarn\.diameter is 0\.0017"
    with pytest.raises(ConfigurationError, match=message):
        load_scenes(config)


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("defaults.yaml", None, r"defaults\.yaml: is missing"),
        ("scenes.tsv", None, r"scenes\.tsv: is missing"),
        ("loop.yaml", None, r"loop\.yaml: is missing"),
        ("defaults.yaml", "a: [", r"defaults\.yaml: is not YAML"),
        ("defaults.yaml", "pattern: 3", r"defaults\.yaml: pattern is 3 but must be a group of keys"),
        ("defaults.yaml", "lod: 3", r"defaults\.yaml: unknown key 'lod' \(did you mean 'load'\?\)"),
        ("defaults.yaml", "- 1", r"defaults\.yaml: must hold a mapping"),
        ("loop.yaml", "diameter: 1.8e-3", r"loop\.yaml: the key 'control_points' .* is missing"),
        (
            "scenes.tsv",
            "scene\tstudy\n",
            r"scenes\.tsv: must have the columns .* at least one scene",
        ),
    ],
)
def test_file_that_is_missing_or_broken(config, file, content, message):
    (config / file).unlink()
    if content is not None:
        (config / file).write_text(content)
    with pytest.raises(ConfigurationError, match=message):
        load_scenes(config)


def test_names_that_do_not_exist(config):
    with pytest.raises(ConfigurationError, match=r"unknown scene 'dns-b' \(did you mean 'dns-a'\?\)"):
        load_scene("dns-b", config)
    with pytest.raises(ConfigurationError, match=r"unknown study 'ful' \(did you mean 'full'\?\)"):
        load_study("ful", config)


def test_studies_are_lists_of_scenes(config):
    assert load_study("reduced", config) == ("dns-a", "rom3d-a")
    assert load_study("ci", config) == ("dns-a",)


def test_geometry_does_not_see_other_changes_of_a_scene(config):
    before = load_knits(config)["plain"]
    rewrite(config / "scenes.tsv", "load.strain", "mesh.size")
    rewrite(config / "scenes.tsv", "2e-2", "2e-4")
    assert load_knits(config)["plain"] == before
    set_default(config, "pattern.clearance", 0.02)
    assert load_knits(config)["plain"] != before


def test_geometry_of_a_pair_does_not_see_its_load(config):
    table = config / "scenes.tsv"
    column = "\tspecimen\tload.direction\tload.path"
    rows = table.read_text().splitlines()
    pair = ["pair-a", "ci", "cross", "", "", "", "", "pair", "path", "[[0, 0, -1e-5]]"]
    table.write_text(
        "\n".join([rows[0] + column, *(row + 3 * "\t" for row in rows[1:]), "\t".join(pair), ""])
    )
    before = load_knits(config)["cross"]
    assert (before.specimen, before.pair) == ("pair", load_scene("pair-a", config).pair)
    rewrite(table, "-1e-5", "-2e-5")
    assert load_knits(config)["cross"] == before
    set_default(config, "pair.angle", 30.0)
    assert load_knits(config)["cross"] != before
    rewrite(table, "cross", "plain")
    with pytest.raises(ConfigurationError, match=r"knit is 'plain', .* but specimen is 'pair', there 'knit'"):
        load_scenes(config)
