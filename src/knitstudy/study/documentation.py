"""What there is to say of all keys, written from their sections: ``docs/keys.md``, ``config/inputs.tsv``, JSON schemas.

``python -m knitstudy.study.documentation`` writes both files of the checkout; with a folder, the schemas as well.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
from collections.abc import Collection, Iterator, Mapping
from inspect import cleandoc, get_annotations
from pathlib import Path

from knitstudy.files import replacing
from knitstudy.registry import listed
from knitstudy.study.choice import AUTO, Ask
from knitstudy.study.configuration import CONFIG
from knitstudy.study.keys import Section, describe
from knitstudy.study.kinds import (
    FIDELITIES,
    INTERACTIONS,
    SPECIMENS,
    Fidelity,
    Interaction,
    Kind,
    Labels,
    Specimen,
    all_kinds,
    all_sections,
)

COMMAND = "python -m knitstudy.study.documentation"

INPUTS = CONFIG / "inputs.tsv"
KEYS = CONFIG.parent / "docs" / "keys.md"

COLUMNS = ("unit", "standing", "source", "checked")

TITLE = """\
# Keys of a scene

Written by `{command}` from `src/knitstudy/study`; what is changed here is lost.

A scene has the sections of its kind and no others: those of its specimen, those of its yarn, and those that its
fidelity asks for with its interaction. A key of another kind is refused by name. All values are in SI units; what a
standing means says [config/README.md](../config/README.md).
"""


def inputs_table() -> str:
    """Return ``config/inputs.tsv``: what every key is worth."""
    text = io.StringIO()
    table = csv.writer(text, delimiter="\t", lineterminator="\n", quoting=csv.QUOTE_NONE, quotechar=None)
    table.writerow(("key", *COLUMNS))
    for key, section in _keys():
        described = describe(section, key.rpartition(".")[2])
        table.writerow((key, *(getattr(described, column) for column in COLUMNS)))
    return text.getvalue()


def keys_page() -> str:
    """Return ``docs/keys.md``: every key by its section, with the scenes that have it."""
    parts = [TITLE.format(command=COMMAND), "## Kinds of scenes\n"]
    parts += [
        _kinds_table(*registry)
        for registry in (("specimen", SPECIMENS), ("fidelity", FIDELITIES), ("interaction", INTERACTIONS))
    ]
    parts += [
        f"## Labels\n\n{_section_text(Labels.model_fields, {name: Labels for name in Labels.model_fields})}"
    ]
    for name, keys in _described():
        parts.append(f"## `{name}`\n\n{_section_text([f'{name}.{field}' for field in keys], keys)}")
    return "\n".join(parts)


def schema_of(kind: Kind) -> dict:
    """Return the JSON schema of a kind of scene, as `Scene.to_dict` writes it."""
    labels = Labels.model_json_schema()
    names = {"specimen": kind.specimen, "interaction": kind.interaction, "fidelity": kind.fidelity}
    for label, is_of in names.items():
        labels["properties"][label] |= {"const": is_of.name}
    labels["properties"]["outputs"]["items"] = {"enum": list(kind.outputs)}
    sections = {name: section.model_json_schema() for name, section in kind.sections.items()}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"Scene of a {_kind_name(kind)}",
        "type": "object",
        "properties": labels["properties"] | sections,
        "required": [*labels["required"], *sections],
        "additionalProperties": False,
    }


def in_words(kinds: list[Kind]) -> str:
    """Return in words which of `all_kinds` some are, given in that order."""
    every = all_kinds()
    if kinds == every:
        return "all"
    specimens = {kind.specimen.name for kind in kinds}
    if kinds == [kind for kind in every if kind.specimen.name in specimens]:
        return f"all of a {listed(sorted(specimens))}"
    said = []
    for name in FIDELITIES:
        some, of = ([kind for kind in each if kind.fidelity.name == name] for each in (kinds, every))
        if some:
            said.append(name + _narrowed(some, of))
    return "; ".join(said)


def _narrowed(some: list[Kind], of: list[Kind]) -> str:
    """Return by what some scenes of a fidelity are told from the others."""
    text = ""
    specimens, interactions = (
        {kind.specimen.name for kind in some},
        {kind.interaction.name for kind in some},
    )
    if specimens != {kind.specimen.name for kind in of if kind.interaction.name in interactions}:
        text += f" of a {listed(sorted(specimens))}"
    if interactions != {kind.interaction.name for kind in of}:
        text += f" with {listed(sorted(interactions))}"
    return text


def _kind_name(kind: Kind) -> str:
    return f"{kind.specimen.name}, {kind.fidelity.name}, {kind.interaction.name}"


def _keys() -> Iterator[tuple[str, type[Section]]]:
    """Yield every dotted key with a section that describes it."""
    for label in Labels.model_fields:
        yield label, Labels
    for name, keys in _described():
        for field, section in keys.items():
            yield f"{name}.{field}", section


def _described() -> Iterator[tuple[str, dict[str, type[Section]]]]:
    """Yield every section with its keys, and the classes that describe them: what is asked, and what scenes have."""
    yield "ask", dict.fromkeys(Ask.model_fields, Ask)
    yield from all_sections().items()


def _having(key: str) -> list[Kind]:
    """Return the kinds of scenes that have a key."""
    name, dot, field = key.partition(".")
    return [
        kind
        for kind in all_kinds()
        if not dot or (name in kind.sections and field in kind.sections[name].model_fields)
    ]


def _kinds_table(what: str, kinds: Mapping[str, Specimen | Fidelity | Interaction]) -> str:
    return _table((what, "is"), [(f"`{name}`", kind.meaning) for name, kind in kinds.items()])


def _section_text(keys: Collection[str], described: dict[str, type[Section]]) -> str:
    """Return what the classes of a section say, and a table of its keys."""
    own = {field: _defining(section, field) for field, section in described.items()}
    said = "\n\n".join(cleandoc(section.__doc__ or "") for section in dict.fromkeys(own.values()))
    rows = []
    for key in keys:
        field = key.rpartition(".")[2]
        about = describe(described[field], field)
        said_of = (
            about.unit,
            about.allowed,
            in_words(_having(key)) or AUTO,
            about.standing,
            about.source,
            about.checked,
        )
        rows.append((f"`{key}`", *said_of))
    return f"{said}\n\n{_table(('key', 'unit', 'allowed', 'scenes', 'standing', 'source', 'checked'), rows)}"


def _defining(section: type[Section], field: str) -> type[Section]:
    """Return the class of a section that a key is written in."""
    return next(each for each in section.__mro__ if field in get_annotations(each))


def _table(columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [columns, tuple("---" for _ in columns), *rows]
    return (
        "\n".join("| " + " | ".join(cell.replace("|", r"\|") for cell in line) + " |" for line in lines)
        + "\n"
    )


def _write(path: Path, text: str) -> None:
    with replacing(path) as partial:
        Path(partial).write_text(text, encoding="utf-8")


def main(arguments: list[str] | None = None) -> None:
    """Write both files, and the schema of every kind of scene into a folder if one is named."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "schemas", nargs="?", type=Path, help="folder for the JSON schema of every kind of scene"
    )
    folder = parser.parse_args(arguments).schemas
    _write(INPUTS, inputs_table())
    _write(KEYS, keys_page())
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        for kind in all_kinds():
            name = "-".join((kind.specimen.name, kind.fidelity.name, kind.interaction.name))
            _write(folder / f"{name}.schema.json", json.dumps(schema_of(kind), indent=2) + "\n")


if __name__ == "__main__":
    main()
