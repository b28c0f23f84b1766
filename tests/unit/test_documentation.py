"""What is said of keys follows from their sections: the page, and what a problem is."""

import importlib.util
from pathlib import Path

from knitstudy.measures.discretisation import HOW_FAR, physics_of
from knitstudy.study.configuration import load_scenes
from knitstudy.study.documentation import COMMAND, KEYS, keys_page
from knitstudy.study.kinds import Labels, all_sections, role_of

DESCRIBED = {name: (Labels, name) for name in Labels.model_fields} | {
    f"{section}.{name}": (described, name)
    for section, keys in all_sections().items()
    for name, described in keys.items()
}


def test_page_is_up_to_date():
    assert KEYS.read_text(encoding="utf-8") == keys_page(), f"{KEYS.name} is not up to date: run {COMMAND}"


def test_every_physical_key_enters_the_problem_and_no_other():
    for scene in load_scenes().values():
        found = physics_of(scene).keys()
        wanted = {key for key in DESCRIBED if role_of(key) == "physics" and has(scene, key)}
        assert found | {HOW_FAR} == wanted | {HOW_FAR}, scene


def has(scene, key):
    section, _, name = key.rpartition(".")
    return not section or (section in scene.sections and name in type(scene.sections[section]).model_fields)


SCRIPT = Path(__file__).parents[2] / "docs" / "columns.py"


def test_documentation_is_up_to_date():
    """Otherwise: python docs/columns.py."""
    specification = importlib.util.spec_from_file_location("docs_columns", SCRIPT)
    docs = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(docs)
    page = docs.PAGE.read_text(encoding="utf-8")
    assert docs.renewed(page) == page
