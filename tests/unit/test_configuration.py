"""Configuration files and families become scenes, or one message that names file, key and fault."""

import re
from pathlib import Path

import pytest
import yaml
from refusals import REFUSED, refusal

from knitstudy.errors import ConfigurationError
from knitstudy.run.configuration import CONFIG, load_scene, load_scenes
from knitstudy.run.families import family_files, read_families

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


@pytest.mark.parametrize(("file", "content", "message"), REFUSED["configurations"])
def test_file_that_is_missing_or_broken(config, file, content, message):
    (config / file).unlink()
    if content is not None:
        (config / file).write_text(content)
    with refusal(message):
        load_scenes(config)


CASES, BOTH = (
    (Path(__file__).parent / "families" / name).read_text() for name in ("cases.yaml", "family.yaml")
)


@pytest.fixture
def folder(tmp_path):
    """Function that writes files of families, by default the two above, and returns their folder."""

    def write(**files):
        for name, text in ({"cases": CASES, "family": BOTH} | files).items():
            (tmp_path / f"{name}.yaml").write_text(text)
        return tmp_path

    return write


def replaced(old, new, text=BOTH):
    assert old in text
    return text.replace(old, new)


def refused(folder):
    """Return the reason, in one line, for which the folder is refused."""
    with pytest.raises(ConfigurationError) as error:
        read_families(family_files(folder))
    assert "\n" not in str(error.value)
    return str(error.value)


def test_members_take_the_keys_of_family_entry_and_choices(folder):
    members = read_families(family_files(folder()))
    assert list(members) == ["dns-tie-fine", "dns-tie-045", "dns-slip-fine", "dns-slip-045", "rom-slip"]
    assert members["dns-tie-045"].keys == {
        "knit": "plain",
        "load.strain": 0.05,
        "interaction": "tie",
        "mesh.size": 0.5,
    }
    assert members["dns-tie-045"].studies == ("reduced", "full")
    reduced = members["rom-slip"]
    assert reduced.keys["rom.contacts_from"] == "dns-slip-fine"
    assert reduced.keys["load.strain"] == 0.03
    assert (reduced.studies, reduced.family) == (("ci",), "family")
    assert reduced.where.endswith("family.yaml, scene 'rom-slip'")


def test_files_are_read_in_the_order_of_their_numbers(folder):
    own = "studies: []\nscenes:\n- name: {}\n"
    path = folder(**{"10-b": own.format("b"), "9-a": own.format("a"), "own": own.format("c")})
    for hidden in (".#own.yaml", "._own.yaml", ".own.yml"):  # of editors and systems
        (path / hidden).write_text("\0")
    names = list(read_families(family_files(path)))
    assert (names[:2], names[-1]) == (["a", "b"], "c")
    assert read_families(family_files(path))["a"].studies == ()


@pytest.mark.parametrize(("old", "new", "message"), REFUSED["families"])
def test_family_that_is_not_allowed(folder, old, new, message):
    assert message in refused(folder(family=replaced(old, new)))


def test_examples_of_the_readme_are_families(tmp_path):
    examples = re.findall(r"```yaml\n(.*?)```", (CONFIG / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len(examples) == 2
    for path in CONFIG.glob("**/*.yaml"):
        copy = tmp_path / path.relative_to(CONFIG)
        copy.parent.mkdir(exist_ok=True)
        copy.write_bytes(path.read_bytes())
    for number, text in enumerate(examples):
        (tmp_path / "scenes" / f"own{number}.yaml").write_text(text)
    scenes = load_scenes(tmp_path)
    assert scenes["dns-tie-course-twenty-nodes"].mesh.element == "quadratic"
    assert scenes["dns-tie-wale-soft"].load.strain == 0.03
    assert list(scenes)[: -len(scenes) + len(load_scenes())] == list(load_scenes())
