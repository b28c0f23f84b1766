"""What is said of keys follows from their sections: the page, the schemas, and what a problem is."""

import importlib.util
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from knitstudy.errors import DataFileError
from knitstudy.loading.columns import CONTACTS, HISTORY, STRESSES
from knitstudy.measures.discretisation import HOW_FAR, physics_of
from knitstudy.study.configuration import CONFIG, default_keys, load_scenes
from knitstudy.study.documentation import COMMAND, KEYS, keys_page, main, schema_of
from knitstudy.study.documents import read_yaml
from knitstudy.study.keys import ROLES, allowed_values, describe
from knitstudy.study.kinds import Labels, all_kinds, all_sections, defaults_of_fields, role_of
from knitstudy.study.scene import flat

DESCRIBED = {name: (Labels, name) for name in Labels.model_fields} | {
    f"{section}.{name}": (described, name)
    for section, keys in all_sections().items()
    for name, described in keys.items()
}


def test_page_is_up_to_date():
    assert KEYS.read_text(encoding="utf-8") == keys_page(), f"{KEYS.name} is not up to date: run {COMMAND}"


@pytest.mark.parametrize("key", DESCRIBED)
def test_every_key_is_described(key):
    said = describe(*DESCRIBED[key])
    assert all((said.unit, said.standing, said.source, said.checked, allowed_values(*DESCRIBED[key])))
    assert role_of(key) == said.role in ROLES
    assert f"| `{key}` |" in keys_page()


def test_every_physical_key_enters_the_problem_and_no_other():
    for scene in load_scenes().values():
        found = physics_of(scene).keys()
        wanted = {key for key in DESCRIBED if role_of(key) == "physics" and has(scene, key)}
        assert found | {HOW_FAR} == wanted | {HOW_FAR}, scene


def has(scene, key):
    section, _, name = key.rpartition(".")
    return not section or (section in scene.sections and name in type(scene.sections[section]).model_fields)


def test_a_default_stands_in_one_place():
    assert default_keys(CONFIG).keys() <= DESCRIBED.keys()
    document = flat(read_yaml(CONFIG / "defaults.yaml"))
    assert document.keys() & defaults_of_fields().keys() == set()


def kinds(**wanted):
    return [
        kind
        for kind in all_kinds()
        if all(getattr(kind, what).name in names for what, names in wanted.items())
    ]


def test_all_scenes_fit_the_schema_of_their_kind():
    validators = {}
    for scene in load_scenes().values():
        kind = scene.specimen, scene.fidelity, scene.interaction
        if kind not in validators:
            schema = schema_of(scene.kind)
            validators[kind] = jsonschema.validators.validator_for(schema)(schema)
        validators[kind].validate(scene.to_dict())


def test_command_writes_page_and_schemas(tmp_path, monkeypatch):
    monkeypatch.setattr("knitstudy.study.documentation.KEYS", tmp_path / "docs" / "keys.md")
    main([str(tmp_path / "schemas")])
    assert (tmp_path / "docs" / "keys.md").read_text() == keys_page()
    assert len(list((tmp_path / "schemas").glob("*.schema.json"))) == len(all_kinds())


SCRIPT = Path(__file__).parents[2] / "docs" / "columns.py"


@pytest.mark.parametrize("columns", [HISTORY, CONTACTS, STRESSES])
def test_an_unknown_name_is_refused(columns):
    with pytest.raises(DataFileError, match=r"has no variable 'forse'.*knitstudy/loading/columns\.tsv"):
        columns.variables({"forse": np.zeros(1)})


def test_documentation_is_up_to_date():
    """Otherwise: python docs/columns.py."""
    specification = importlib.util.spec_from_file_location("docs_columns", SCRIPT)
    docs = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(docs)
    page = docs.PAGE.read_text(encoding="utf-8")
    assert docs.renewed(page) == page
    with pytest.raises(ValueError, match="columns of history"):
        docs.renewed(page.replace("<!-- end of columns of history -->", ""))
