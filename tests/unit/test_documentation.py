"""The page of keys follows from their sections."""

import pytest

from knitstudy.measures.discretisation import HOW_FAR, physics_of
from knitstudy.study.configuration import load_scenes
from knitstudy.study.scene_type import Labels, all_sections, role_of

DESCRIBED = {name: (Labels, name) for name in Labels.model_fields} | {
    f"{section}.{name}": (described, name)
    for section, keys in all_sections().items()
    for name, described in keys.items()
}


def test_every_physical_key_enters_the_problem_and_no_other():
    for scene in load_scenes().values():
        found = physics_of(scene).keys()
        wanted = {key for key in DESCRIBED if role_of(key) == "physics" and has(scene, key)}
        assert found | {HOW_FAR} == wanted | {HOW_FAR}, scene


def has(scene, key):
    section, _, name = key.rpartition(".")
    return not section or (section in scene.sections and name in type(scene.sections[section]).model_fields)


@pytest.mark.parametrize("name", ["columns", "keys"])
def test_documentation_is_up_to_date(docs_script, name):
    """Otherwise: python docs/NAME.py."""
    docs = docs_script(name)
    page = docs.PAGE.read_text(encoding="utf-8")
    assert (docs.renewed(page) if name == "columns" else docs.keys_page()) == page
