"""Families of scenes: products of names, read from the files of ``config/scenes``.

A file is a family. Its ``scenes`` are names with placeholders, such as ``rom3d-{joint}-{case}``, each with the choices
that its placeholders run through; a block called as a placeholder says which keys each choice sets. A file without
``scenes`` has blocks for all families. The keys of a family, of an entry and of its choices are put together; none
overrides another. ``config/README.md`` shows how files are written.
"""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import Any, Literal, get_args

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.documents import read_yaml
from knitstudy.registry import unknown_choice

Study = Literal["ci", "reduced", "full", "reference", "fabrics"]  # That a scene can belong to
STUDIES: tuple[str, ...] = get_args(Study)
MOST = 10_000  # Scenes that one entry may make; more are taken for a mistake

_OF_FAMILY = ("studies", "keys", "scenes")
_OF_ENTRY = ("name", "studies", "keys")

_PLACEHOLDER = re.compile(r"\{([^{}]*)\}")
_BY = re.compile(r"(\S+) +by +(\S+)")

Blocks = Mapping[str, Mapping[str, dict[str, Any]]]  # Keys that a choice sets, by placeholder and choice


@dataclass(frozen=True)
class Member:
    """A scene of a family: the studies that it belongs to, and the values that it sets, by dotted key.

    ``where`` names its file and itself: the prefix of error messages.
    """

    name: str
    family: str
    studies: tuple[str, ...]
    keys: dict[str, Any]
    where: str


CONFIGURATION = "config.yaml"  # Configuration of the workflow, no family, in the same folder


def read_families(paths: Iterable[Path]) -> dict[str, Member]:
    """Return the scenes of files by name, in the order of the files and of each file.

    Whether a scene may have the keys and values that it sets is not known here.
    Raises ConfigurationError, naming the file and the key that is unknown, doubled or of the wrong type.
    """
    paths = tuple(paths)
    return dict(_read_once(paths, tuple(map(_state, paths))))


def _state(path: Path) -> tuple[Any, ...]:
    """Return path, time and size of a file, which change with its content."""
    stat = path.stat() if path.is_file() else None
    return path.resolve(), stat and (stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=8)
def _read_once(paths: tuple[Path, ...], _: tuple[Any, ...]) -> dict[str, Member]:
    """Return the scenes of files that are in a state."""
    documents = {path: read_yaml(path) for path in paths}
    shared: dict[str, dict[str, Any]] = {}
    for path, document in documents.items():  # those without scenes first: they define for all
        if "scenes" not in document:
            shared |= _blocks(document, shared, path)
    families = {path: document for path, document in documents.items() if "scenes" in document}
    members: dict[str, Member] = {}
    asked: set[str] = set()
    for path, document in families.items():
        blocks = shared | _blocks(document, shared, path)
        for entry in _entries(document, path):
            asked |= entry.keys()
            for member in _members(entry, document, blocks, path):
                if member.name in members:
                    first = f"first in the family {members[member.name].family!r}"
                    raise ConfigurationError(f"{member.where}: is defined twice; {first}")
                members[member.name] = member
    for path, document in families.items():
        for name in document.keys() - {*_OF_FAMILY, *asked}:
            raise ConfigurationError(f"{path}: {_unknown(name)} that an entry of scenes has")
    return members


def _unknown(name: str) -> str:
    return f"{unknown_choice('unknown key', name, name, _OF_FAMILY)}, or a placeholder"


def family_files(folder: Path) -> list[Path]:
    """Return the files of families in the order of the numbers that they begin with, and of their names."""
    if not folder.is_dir():
        raise ConfigurationError(
            f"{folder}: is missing; the configuration must have it, with a file a family"
        )
    visible = [path for path in folder.iterdir() if not path.name.startswith(".")]  # but files of editors
    for path in visible:
        if path.suffix != ".yaml" and path.suffix.lower() in (".yaml", ".yml"):
            better = path.with_suffix(".yaml").name
            raise ConfigurationError(f"{path}: is not read as a family; call it {better}")
    files = (path for path in visible if path.suffix == ".yaml" and path.name != CONFIGURATION)
    paths = sorted(files, key=_place)
    if not paths:
        raise ConfigurationError(f"{folder}: must hold a family of scenes or more, each a file *.yaml")
    return paths


def _place(path: Path) -> tuple[float, str]:
    """Return a family's place: by the number that its name begins with, those without one last."""
    number = re.match(r"\d+", path.name)
    return (int(number[0]) if number else math.inf, path.name)


def _blocks(document: dict[str, Any], shared: Blocks, path: Path) -> dict[str, dict[str, dict[str, Any]]]:
    """Return the blocks of a file: the keys that each choice of a placeholder sets."""
    blocks = {name: choices for name, choices in document.items() if name not in _OF_FAMILY}
    for name, choices in blocks.items():
        if name in _OF_ENTRY:
            scene = "{name: my-knit, case: tie-course, keys: {knit: plain3x3, fidelity: spline_yarns}}"
            fault = f"the key {name!r} belongs to a scene but is a key of the file"
            raise ConfigurationError(f"{path}: {fault}; write `studies: []` and `scenes: [{scene}]`")
        if name in shared:
            other = "is defined for all families in another file; rename one of the two"
            raise ConfigurationError(f"{path}: {name} {other}")
        if not isinstance(choices, dict) or not all(isinstance(keys, dict) for keys in choices.values()):
            form = "with a mapping of its choices to the keys that each sets ({} is none)"
            raise ConfigurationError(f"{path}: {_unknown(name)} {form}, which {reprlib.repr(choices)} is not")
        if "all" in choices:
            raise ConfigurationError(f"{path}: {name} 'all' stands for all choices; rename this one")
    if "scenes" not in document and len(document) > len(blocks):
        raise ConfigurationError(f"{path}: has studies or keys of scenes, but the key 'scenes' is missing")
    return blocks


def _entries(document: dict[str, Any], path: Path) -> list[dict[str, Any]]:
    scenes = document["scenes"]
    if not isinstance(scenes, list) or not scenes or not all(isinstance(scene, dict) for scene in scenes):
        wanted = "a list whose entries begin with '- name: '"
        raise ConfigurationError(f"{path}: scenes is {reprlib.repr(scenes)} but must be {wanted}")
    return scenes


def _members(entry: dict[str, Any], document: dict[str, Any], blocks: Blocks, path: Path) -> Iterator[Member]:
    """Yield the scenes of an entry; of the placeholders asked for the last one runs fastest."""
    name = entry.get("name")
    if not isinstance(name, str):
        wanted = "text, in quotes if a brace begins it"
        raise ConfigurationError(f"{path}: the name of an entry of scenes is {name!r} but must be {wanted}")
    where = f"{path}, scenes {name!r}"
    asked = {key: value for key, value in entry.items() if key not in _OF_ENTRY}
    for key in asked.keys() - blocks.keys():
        raise ConfigurationError(f"{where}: {unknown_choice('unknown key', key, key, [*_OF_ENTRY, *blocks])}")
    studies = _studies(entry.get("studies", document.get("studies")), where)
    choices = [_chosen(placeholder, wanted, blocks, where) for placeholder, wanted in asked.items()]
    count = math.prod(map(len, choices))
    if not 1 <= count <= MOST:
        raise ConfigurationError(f"{where}: stands for {count} scenes but must for 1 to {MOST}")
    for combination in product(*choices):
        taken = dict(zip(asked, combination, strict=True))
        own = _filled(name, taken, f"{path}: name")
        layers = {"the family's keys": document.get("keys", {}), "its keys": entry.get("keys", {})}
        layers |= {f"{group} {choice!r}": blocks[group][choice] for group, choice in taken.items()}
        of_scene = f"{path}, scene {own!r}"
        yield Member(own, path.stem, studies, _together(layers, taken, of_scene), of_scene)


def _chosen(placeholder: str, wanted: Any, blocks: Blocks, where: str) -> list[str]:
    """Return the choices that an entry asks for: all, one or a list."""
    choices = list(blocks[placeholder])
    if wanted == "all":
        return choices
    return _texts(wanted, choices, placeholder, f"{where}: {placeholder}", "all, or ")


def _studies(wanted: Any, where: str) -> tuple[str, ...]:
    """Return the studies of an entry in their usual order."""
    if wanted is None:
        missing = "is missing, in the family as well; [] is for scenes that run only by name"
        raise ConfigurationError(f"{where}: the key 'studies' {missing}")
    named = _texts(wanted, STUDIES, "study", f"{where}: studies", "")
    return tuple(name for name in STUDIES if name in named)


def _texts(wanted: Any, allowed: Sequence[str], what: str, prefix: str, also: str) -> list[str]:
    """Return a list of distinct allowed texts, or one as a list; a whole number is the text that it is written as."""
    listed = wanted if isinstance(wanted, list) else [wanted]
    texts = [str(text) if type(text) is int else text for text in listed]
    if not all(isinstance(text, str) for text in texts):
        raise ConfigurationError(
            f"{prefix} is {wanted!r} but must be {also}of {', '.join(allowed)}, as texts"
        )
    for text in texts:
        if texts.count(text) > 1:
            raise ConfigurationError(f"{prefix} is {wanted!r}, with {text!r} twice")
        if text not in allowed:
            raise ConfigurationError(f"{prefix}: {unknown_choice(f'unknown {what}', text, text, allowed)}")
    return texts


def _together(layers: Mapping[str, Any], taken: Mapping[str, str], where: str) -> dict[str, Any]:
    """Return the keys that layers set together for the choices of a scene; two may not disagree."""
    merged: dict[str, Any] = {}
    origin: dict[str, str] = {}
    for layer, keys in layers.items():
        for key, value in _values(keys, taken, f"{where}: {layer}"):
            if key == "name":
                raise ConfigurationError(
                    f"{where}: name cannot be set; an entry of scenes has it beside keys"
                )
            if isinstance(value, dict):
                wanted = f"a value; keys of a group are written {key}.{next(iter(value), 'key')}"
                raise ConfigurationError(f"{where}: {layer}: {key} is {value!r} but must be {wanted}")
            if key in merged and merged[key] != value:
                both = f"{merged[key]!r} of {origin[key]} but {value!r} of {layer}"
                raise ConfigurationError(f"{where}: {key} is {both}; neither overrides the other")
            merged[key], origin[key] = value, layer
    return merged


def _values(keys: Any, taken: Mapping[str, str], prefix: str) -> Iterator[tuple[str, Any]]:
    """Yield keys with their values for the choices of a scene, by placeholder.

    ``KEY by PLACEHOLDER`` has a value for every choice, and ``{PLACEHOLDER}`` in a text stands for the choice.
    """
    if not isinstance(keys, dict):
        raise ConfigurationError(f"{prefix}: {reprlib.repr(keys)} is not a mapping of keys to values")
    for key, value in keys.items():
        name = key
        if by := _BY.fullmatch(key):
            name, placeholder = by.groups()
            choice = _choice(placeholder, taken, f"{prefix}: {key}")
            if not isinstance(value, dict):
                wanted = f"a mapping that gives every {placeholder} its value"
                raise ConfigurationError(f"{prefix}: {key} is {value!r} but must be {wanted}")
            if choice not in value:
                raise ConfigurationError(
                    f"{prefix}: {key} has no value for {choice!r}, only for {', '.join(value)}"
                )
            value = value[choice]
        yield name, _filled(value, taken, f"{prefix}: {name}")


def _filled(value: Any, taken: Mapping[str, str], prefix: str) -> Any:
    """Return a value with every placeholder in its texts replaced by the choice that is taken for it."""
    if isinstance(value, list):
        return [_filled(item, taken, prefix) for item in value]
    if not isinstance(value, str):
        return value
    text = _PLACEHOLDER.sub(lambda match: _choice(match[1], taken, f"{prefix} is {value!r}"), value)
    if "{" in text or "}" in text:
        raise ConfigurationError(
            f"{prefix} is {value!r}, but braces stand around a placeholder, as in {{case}}"
        )
    return text


def _choice(placeholder: str, taken: Mapping[str, str], prefix: str) -> str:
    if placeholder not in taken:
        message = unknown_choice("unknown placeholder", placeholder, placeholder, list(taken))
        hint = f"an entry of scenes names what a placeholder runs through, as in '{placeholder}: all'"
        raise ConfigurationError(f"{prefix}: {message}; {hint}")
    return taken[placeholder]
