"""The page of all keys, ``docs/reference/keys.md``: ``python docs/reference/keys.py`` writes it from their sections."""

from __future__ import annotations

from collections.abc import Iterable
from inspect import cleandoc, get_annotations
from pathlib import Path

from knitstudy.files import write_text
from knitstudy.knit.scene.keys import ROLES, Section, allowed_values, describe_with_source, lists
from knitstudy.knit.scene.kinds import INTERACTIONS, MODELS, SPECIMENS, Labels, all_kinds, all_sections
from knitstudy.registry import listed
from knitstudy.run.advice import AUTO, Requirements

COMMAND = "python docs/reference/keys.py"

PAGE = Path(__file__).with_suffix(".md")

COLUMNS = ("unit", "role", "provenance", "source", "checked")

TITLE = f"""\
# Keys of a scene

`{COMMAND}` writes this page from `src/knitstudy/knit`; changes of the page itself are lost.

A scene has only the sections of its kind: those of its specimen, its yarn, its fidelity and its interaction. A key of
another kind is an error, which names the key. Values are in SI units, sizes of elements in yarn radii.
[config/README.md](../../config/README.md) explains provenance. A key without a default on this page has its default in
[config/defaults.yaml](../../config/defaults.yaml), or must be set.
[Alternative keys of a knit](../../config/README.md#a-knit-of-your-own) can replace keys of this page.
"""


def keys_page() -> str:
    """Return ``docs/reference/keys.md``: every key by its section, with the scenes that have it."""
    roles = _table(
        ("role", "keys of this role define"), [(f"`{name}`", text) for name, text in ROLES.items()]
    )
    parts = [TITLE, f"## Roles\n\n{roles}", "## Kinds of scenes\n"]
    for what, kinds in (("specimen", SPECIMENS), ("fidelity", MODELS), ("interaction", INTERACTIONS)):
        parts.append(
            _table((what, "meaning"), [(f"`{name}`", kind.meaning) for name, kind in kinds.all().items()])
        )
    parts.append(f"## Labels\n\n{_section_text('', dict.fromkeys(Labels.model_fields, Labels))}")
    parts.append(
        f"## `ask`\n\n{_section_text('ask.', dict.fromkeys(Requirements.model_fields, Requirements))}"
    )
    parts += [f"## `{name}`\n\n{_section_text(f'{name}.', keys)}" for name, keys in all_sections().items()]
    return "\n".join(parts)


def scenes_with(key: str) -> str:
    """Return in words which scenes have a key."""
    match = every = all_kinds()
    having = [kind for kind in every if kind.has(key)]
    limits = []
    for label in ("fidelity", "interaction", "specimen"):
        names = {getattr(kind, label).name for kind in having}
        narrower = [kind for kind in match if getattr(kind, label).name in names]
        if narrower != match:
            limits.append(f"{label} {listed(sorted(names))}")
        match = narrower
    return ("; ".join(limits) or "all") + ("" if match == having else "; not all of these")


def _section_text(prefix: str, described: dict[str, type[Section]]) -> str:
    """Return the docstrings of a section's classes, and a table of its keys."""
    own = {name: _defining(section, name) for name, section in described.items()}
    text = "\n\n".join(cleandoc(section.__doc__ or "") for section in dict.fromkeys(own.values()))
    rows = []
    for name, section in described.items():
        unit, *about = (getattr(describe_with_source(section, name), column) for column in COLUMNS)
        having = f"fidelity {AUTO}" if section is Requirements else scenes_with(f"{prefix}{name}")
        allowed, default = allowed_values(section, name), _default(section, name)
        rows.append((f"`{prefix}{name}`", unit, allowed, default, having, *about))
    columns = ("key", "unit", "allowed", "default", "scenes", "role", "provenance", "source", "checked")
    return f"{text}\n\n{_table(columns, rows)}"


def _default(section: type[Section], name: str) -> str:
    """Return the default in the field of a key; nothing if ``defaults.yaml`` has the default, or there is none."""
    field = section.model_fields[name]
    if field.is_required():
        return ""
    return "null" if field.default is None else str(lists(field.default))


def _defining(section: type[Section], name: str) -> type[Section]:
    """Return the class of a section that a key is written in."""
    return next(each for each in section.__mro__ if name in get_annotations(each))


def _table(columns: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [columns, tuple("---" for _ in columns), *rows]
    cells = (" | ".join(cell.replace("|", r"\|") for cell in line) for line in lines)
    return "".join(f"| {line} |\n" for line in cells)


if __name__ == "__main__":
    write_text(keys_page(), PAGE)
