"""The page of all keys, ``docs/reference/keys.md``: ``python docs/reference/keys.py`` writes it from their sections."""

from __future__ import annotations

import re
from collections.abc import Iterable
from inspect import cleandoc, get_annotations
from pathlib import Path

from knitstudy.files import write_text
from knitstudy.knit.scene.keys import ROLES, Section, allowed_values, documented, lists
from knitstudy.knit.scene.kinds import Labels, all_kinds, all_sections, word_of
from knitstudy.registry import listed
from knitstudy.run.advice import AUTO, Requirements

COMMAND = "python docs/reference/keys.py"

PAGE = Path(__file__).with_suffix(".md")

TITLE = f"""\
# Keys of a scene

Every key with its allowed values, its default, and where its value comes from. `{COMMAND}` writes this page; changes
of the page itself are lost.

A scene has only the keys of its kind: the line above a table says which scenes, parentheses behind a key name others.
A key of another kind is an error. Values are in SI units; brackets behind a key hold the unit. The last column has the
role and, where it is no choice, the [provenance](../../config/README.md#provenance-of-inputs) of the value;
`knitstudy check SCENE --sources` prints sources, and the ranges over which results were checked. A key without a
default on this page has its default in [config/defaults.yaml](../../config/defaults.yaml), or must be set.
[Alternative keys of a knit](../../config/README.md#a-knit-of-your-own) can replace keys of this page.
"""


def keys_page() -> str:
    """Return ``docs/reference/keys.md``: every key by its section, with the scenes that have it."""
    roles = _table(
        ("role", "keys of this role define"), [(f"`{name}`", text) for name, text in ROLES.items()]
    )
    parts = [TITLE, f"## Roles\n\n{roles}"]
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
            limits.append(f"{label} {listed(sorted(map(word_of, names)))}")
        match = narrower
    return ("; ".join(limits) or "all") + ("" if match == having else "; not all of these")


def _section_text(prefix: str, described: dict[str, type[Section]]) -> str:
    """Return the docstrings of a section's classes, and a table of its keys with the scenes that have them."""
    own = {name: _defining(section, name) for name, section in described.items()}
    parts = [cleandoc(section.__doc__ or "") + "\n" for section in dict.fromkeys(own.values())]
    having = {name: _having(prefix, name, section) for name, section in described.items()}
    usual = max(having.values(), key=lambda scenes: (scenes == "all", list(having.values()).count(scenes)))
    others = {name: scenes if scenes != usual else "" for name, scenes in having.items()}
    rows = [_row(prefix, name, section, others[name]) for name, section in described.items()]
    parts.append(f"Scenes: {usual}.\n\n" + _table(("key", "allowed", "default", "origin"), rows))
    return "\n".join(parts)


def _having(prefix: str, name: str, section: type[Section]) -> str:
    return f"fidelity {AUTO}" if section is Requirements else scenes_with(f"{prefix}{name}")


def _row(prefix: str, name: str, section: type[Section], having: str) -> tuple[str, ...]:
    """Return the row of a key: name with unit and other scenes, allowed values, default, and origin of the value."""
    known = documented(section, name)
    unit = "" if known.unit == "1" else f" [{known.unit}]"
    scenes = f" ({having})" if having else ""
    return (
        f"`{prefix}{name}`{unit}{scenes}",
        re.sub(rf",? in {re.escape(known.unit)}(?=[:,]|$)", "", allowed_values(section, name)),
        _default(section, name),
        known.role if known.provenance == "choice" else f"{known.role}, {known.provenance}",
    )


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
    cells = [" | ".join(cell.replace("|", r"\|") for cell in line) for line in (columns, *rows)]
    cells = [f"| {line} |\n" for line in cells]
    return "".join([cells[0], "|---" * len(columns), "|\n", *cells[1:]])


if __name__ == "__main__":
    write_text(keys_page(), PAGE)
