"""What is written of keys follows from their sections: files of the checkout, and a schema of every kind of scene."""

import jsonschema
import pytest

from knitstudy.study.configuration import CONFIG, default_keys, load_scenes
from knitstudy.study.documentation import (
    COMMAND,
    INPUTS,
    KEYS,
    in_words,
    inputs_table,
    keys_page,
    main,
    schema_of,
)
from knitstudy.study.keys import STANDINGS, describe
from knitstudy.study.kinds import Labels, all_kinds, all_sections

DESCRIBED = [("", name, Labels) for name in Labels.model_fields] + [
    (f"{section}.", name, described)
    for section, keys in all_sections().items()
    for name, described in keys.items()
]


@pytest.mark.parametrize(("path", "written"), [(INPUTS, inputs_table), (KEYS, keys_page)])
def test_files_are_up_to_date(path, written):
    assert path.read_text(encoding="utf-8") == written(), f"{path.name} is not up to date: run {COMMAND}"


@pytest.mark.parametrize(("section", "name", "described"), DESCRIBED)
def test_every_key_has_its_unit_standing_source_and_range(section, name, described):
    said = describe(described, name)
    assert said.standing in STANDINGS
    assert all((said.unit, said.allowed, said.source, said.checked))
    assert f"| `{section}{name}` |" in keys_page()


def test_every_default_is_described():
    assert set(default_keys(CONFIG)) <= {section + name for section, name, _ in DESCRIBED}


def kinds(**wanted):
    return [
        kind
        for kind in all_kinds()
        if all(getattr(kind, what).name in names for what, names in wanted.items())
    ]


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ({}, "all"),
        ({"specimen": ["pair"]}, "all of a pair"),
        ({"fidelity": ["rom2d", "beam"]}, "rom2d; beam"),
        ({"fidelity": ["hexahedra"], "interaction": ["tie"]}, "hexahedra with tie"),
        (
            {"fidelity": ["hexahedra"], "specimen": ["knit"], "interaction": ["rough", "isotropic"]},
            "hexahedra of a knit with isotropic or rough",
        ),
    ],
)
def test_scenes_that_have_a_key_in_words(wanted, said):
    assert in_words(kinds(**wanted)) == said


def test_there_are_kinds_of_all_scenes():
    made = {(scene.specimen, scene.fidelity, scene.interaction) for scene in load_scenes().values()}
    known = {(kind.specimen.name, kind.fidelity.name, kind.interaction.name) for kind in all_kinds()}
    assert made <= known
    assert ("pair", "beam", "isotropic") not in known
    assert ("knit", "beam", "tie") not in known


def test_all_scenes_fit_the_schema_of_their_kind():
    validators = {}
    for scene in load_scenes().values():
        kind = scene.specimen, scene.fidelity, scene.interaction
        if kind not in validators:
            schema = schema_of(scene.kind)
            validators[kind] = jsonschema.validators.validator_for(schema)(schema)
        validators[kind].validate(scene.to_dict())


@pytest.mark.parametrize(
    ("section", "changes"),
    [
        ("load", {"strain": 0.6}),
        ("load", {"strain": True}),
        ("load", {"path": []}),
        ("pattern", {"loops": 1.5}),
        ("mesh", {"beam_size": 1e-3}),
        ("geometry", {"free": ["q"]}),
        ("rom", {"contacts_from": "dns-a"}),
    ],
)
def test_schema_refuses_what_a_scene_does(config, section, changes):
    scene = load_scenes(config)["dns-a"]
    document = scene.to_dict()
    document[section] = document.get(section, {}) | changes
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, schema_of(scene.kind))


def test_command_writes_files_and_schemas(tmp_path, monkeypatch):
    monkeypatch.setattr("knitstudy.study.documentation.INPUTS", tmp_path / "inputs.tsv")
    monkeypatch.setattr("knitstudy.study.documentation.KEYS", tmp_path / "docs" / "keys.md")
    main([str(tmp_path / "schemas")])
    assert (tmp_path / "inputs.tsv").read_text() == inputs_table()
    assert (tmp_path / "docs" / "keys.md").read_text() == keys_page()
    assert len(list((tmp_path / "schemas").glob("*.schema.json"))) == len(all_kinds())
