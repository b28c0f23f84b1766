"""Families of scenes: products of names, read from the files of ``config/scenes``.

A file is a family. Its ``scenes`` are names with placeholders, such as ``rom3d-{joint}-{case}``, each with the
choices that its placeholders run through; a block called as a placeholder says what each choice sets. A file
without ``scenes`` has blocks that all families may use. ``config/README.md`` shows how files are written.
"""

from __future__ import annotations

import difflib
import math
import re
import reprlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.registry import unknown_choice
from knitstudy.study.documents import read_yaml

STUDIES = ("ci", "reduced", "full", "reference", "trade")
"""Names of the studies that a scene can belong to."""

MOST = 10_000
"""Scenes that one entry may make: with more, a list is not what was meant."""

_OF_FAMILY = ("studies", "keys", "scenes")
_OF_ENTRY = ("name", "studies", "keys")


@dataclass(frozen=True)
class Member:
    """A scene of a family: the studies that it belongs to, and the values that it sets, by dotted key.

    ``where`` names its file and itself: the beginning of a message.
    """

    name: str
    family: str
    studies: tuple[str, ...]
    keys: dict[str, Any]
    where: str


def read_families(folder: Path) -> dict[str, Member]:
    """Return the scenes of a folder by name: files in the order of their numbers, scenes in the order of each file.

    Whether a scene may have the keys and values that it sets is not known here.

    Raises
    ------
    ConfigurationError
        Naming the file, and what in it is unknown, doubled, of the wrong type or of no use.
    """
    families = [_Family.read(path) for path in _files(Path(folder))]
    shared: dict[str, _Block] = {}
    for family in families:  # those without scenes first: they define for all
        if not family.entries:
            shared |= _distinct(family.blocks, shared)
    members: dict[str, Member] = {}
    for family in families:
        blocks = shared | _distinct(family.blocks, shared) if family.entries else {}
        for member in (member for entry in family.entries for member in entry.members(blocks)):
            if member.name in members:
                there = members[member.name].family
                raise ConfigurationError(f"{member.where}: is there twice, the first in the family {there!r}")
            members[member.name] = member
    for family in families:
        family.check_used()
    return members


def _files(folder: Path) -> list[Path]:
    """Return the files of families in the order of the numbers that they begin with, and of their names."""
    if not folder.is_dir():
        raise ConfigurationError(
            f"{folder}: is missing; the configuration folder must have it, with a file a family"
        )
    for path in folder.iterdir():
        if path.suffix != ".yaml" and path.suffix.lower() in (".yaml", ".yml"):
            raise ConfigurationError(
                f"{path}: is not read as a family; call it {path.with_suffix('.yaml').name}"
            )
    paths = sorted(folder.glob("*.yaml"), key=_place)
    if not paths:
        raise ConfigurationError(f"{folder}: must hold a family of scenes or more, each a file *.yaml")
    return paths


def _distinct(blocks: Mapping[str, _Block], shared: Mapping[str, _Block]) -> dict[str, _Block]:
    """Return blocks that are none of those that all families share."""
    for name, block in blocks.items():
        if name in shared:
            raise ConfigurationError(
                f"{block.where}: {name} is defined for all families in {shared[name].where}; rename one of the two"
            )
    return dict(blocks)


@dataclass(frozen=True)
class _Family:
    """A file: what its scenes set, if it has any, and blocks."""

    layer: Layer
    entries: list[_Entry]
    blocks: dict[str, _Block]

    @classmethod
    def read(cls, path: Path) -> _Family:
        document, where = read_yaml(path), str(path)
        blocks = {
            name: _Block.read(name, choices, where)
            for name, choices in document.items()
            if name not in _OF_FAMILY
        }
        layer = Layer.read(document.get("keys", {}), "the family's keys", where)
        if "scenes" not in document:
            if len(document) > len(blocks):
                raise ConfigurationError(
                    f"{where}: has studies or keys of scenes, but the key 'scenes' is missing"
                )
            return cls(layer, [], blocks)
        scenes = document["scenes"]
        if not isinstance(scenes, list) or not scenes or not all(isinstance(each, dict) for each in scenes):
            raise ConfigurationError(
                f"{where}: scenes is {reprlib.repr(scenes)} but must be a list whose entries begin with '- name: '"
            )
        studies = document.get("studies")
        return cls(layer, [_Entry.read(each, studies, layer, path) for each in scenes], blocks)

    def check_used(self) -> None:
        """Refuse what no scene of the folder uses."""
        for block in self.blocks.values():
            block.check_used()
        self.layer.check_used()
        for entry in self.entries:
            entry.layer.check_used()


@dataclass(frozen=True)
class _Block:
    """What a placeholder can be, and what each choice sets; ``used`` gathers the choices of scenes."""

    placeholder: str
    choices: dict[str, Layer]
    where: str
    used: set[str] = field(default_factory=set)

    @classmethod
    def read(cls, placeholder: str, document: Any, where: str) -> _Block:
        if placeholder in _OF_ENTRY:
            raise ConfigurationError(
                f"{where}: {placeholder} is a key of an entry of scenes, and no placeholder"
            )
        mapping = isinstance(document, dict) and bool(document)
        misspelt = difflib.get_close_matches(placeholder, _OF_FAMILY)
        if not mapping or (misspelt and not all(isinstance(keys, dict) for keys in document.values())):
            message = unknown_choice("unknown key", placeholder, placeholder, list(_OF_FAMILY))
            raise ConfigurationError(
                f"{where}: {message}, or a placeholder with a mapping of its choices to what each sets, which"
                f" {reprlib.repr(document)} is not"
            )
        if "all" in document:
            raise ConfigurationError(f"{where}: {placeholder} 'all' stands for all choices; rename this one")
        choices = {
            choice: Layer.read(keys, f"{placeholder} {choice!r}", where) for choice, keys in document.items()
        }
        return cls(placeholder, choices, where)

    def chosen(self, asked: Any, where: str) -> list[str]:
        """Return the choices that an entry asks for: all, one or a list."""
        if asked == "all":
            return list(self.choices)
        found = _texts(asked, f"{where}: {self.placeholder}", f"all, or of {', '.join(self.choices)}")
        unknown = next((choice for choice in found if choice not in self.choices), None)
        if unknown is not None:
            message = unknown_choice(f"unknown {self.placeholder}", unknown, unknown, list(self.choices))
            raise ConfigurationError(f"{where}: {message}")
        return found

    def check_used(self) -> None:
        """Refuse a choice that no scene makes, and what one says for nothing."""
        if not self.used:
            message = unknown_choice("unknown key", self.placeholder, self.placeholder, list(_OF_FAMILY))
            raise ConfigurationError(f"{self.where}: {message}, or a placeholder that an entry of scenes has")
        unused = next((choice for choice in self.choices if choice not in self.used), None)
        if unused is not None:
            raise ConfigurationError(
                f"{self.where}: {self.placeholder} {unused!r} is of no scene; take it out, or into an entry of scenes"
            )
        for layer in self.choices.values():
            layer.check_used()


@dataclass(frozen=True)
class _Entry:
    """An entry of ``scenes``: a name, the choices asked for by placeholder, and what all scenes so named have."""

    name: str
    asked: dict[str, Any]
    studies: tuple[str, ...]
    family: Layer
    layer: Layer
    path: Path

    @classmethod
    def read(cls, document: dict, studies: Any, family: Layer, path: Path) -> _Entry:
        name = document.get("name")
        if not isinstance(name, str):
            raise ConfigurationError(
                f"{path}: the name of an entry of scenes is {name!r} but must be text, in quotes if a brace begins it"
            )
        where = f"{path}, scenes {name!r}"
        asked = {key: value for key, value in document.items() if key not in _OF_ENTRY}
        layer = Layer.read(document.get("keys", {}), "its keys", where)
        studies = document.get("studies", studies)
        if studies is None:
            raise ConfigurationError(
                f"{where}: the key 'studies' is missing, in the family as well; [] is for scenes that run only by name"
            )
        return cls(name, asked, _studies(studies, where), family, layer, path)

    def members(self, blocks: Mapping[str, _Block]) -> Iterator[Member]:
        """Yield the scenes; of the placeholders asked for the last one runs fastest."""
        where = f"{self.path}, scenes {self.name!r}"
        for key in self.asked:
            if key not in blocks:
                message = unknown_choice("unknown key", key, key, [*_OF_ENTRY, *blocks])
                raise ConfigurationError(f"{where}: {message}")
        for placeholder in PLACEHOLDER.findall(self.name):
            if placeholder not in blocks:
                message = unknown_choice("unknown placeholder", placeholder, placeholder, list(blocks))
                raise ConfigurationError(f"{where}: {message}")
            if placeholder not in self.asked:
                raise ConfigurationError(
                    f"{where}: {{{placeholder}}} is open; add '{placeholder}: all', or a list"
                )
        choices = [blocks[placeholder].chosen(asked, where) for placeholder, asked in self.asked.items()]
        count = math.prod(map(len, choices))
        if not 1 <= count <= MOST:
            raise ConfigurationError(f"{where}: stands for {count} scenes but must for 1 to {MOST}")
        for taken in product(*choices):
            yield self._member(dict(zip(self.asked, taken, strict=True)), blocks)

    def _member(self, taken: dict[str, str], blocks: Mapping[str, _Block]) -> Member:
        name = filled(self.name, taken, f"{self.path}: name")
        where = f"{self.path}, scene {name!r}"
        layers = [self.family, self.layer]
        for placeholder, choice in taken.items():
            blocks[placeholder].used.add(choice)
            layers.append(blocks[placeholder].choices[choice])
        keys = together(layers, taken, where)
        if "name" in keys:
            raise ConfigurationError(
                f"{where}: name is no key that can be set; an entry of scenes has it beside keys"
            )
        return Member(name, self.path.stem, self.studies, keys, where)


def _studies(asked: Any, where: str) -> tuple[str, ...]:
    """Return the studies of an entry in their usual order."""
    found = _texts(asked, f"{where}: studies", f"of {', '.join(STUDIES)}")
    unknown = next((name for name in found if name not in STUDIES), None)
    if unknown is not None:
        raise ConfigurationError(
            f"{where}: {unknown_choice('unknown study', unknown, unknown, list(STUDIES))}"
        )
    return tuple(name for name in STUDIES if name in found)


def _texts(asked: Any, what: str, must: str) -> list[str]:
    """Return a list of distinct texts, or one text as a list; a whole number is the text that it is written as."""
    listed = asked if isinstance(asked, list) else [asked]
    texts = [str(each) if type(each) is int else each for each in listed]
    if not all(isinstance(each, str) for each in texts):
        raise ConfigurationError(f"{what} is {asked!r} but must be {must}, as texts")
    doubled = next((each for each in texts if texts.count(each) > 1), None)
    if doubled is not None:
        raise ConfigurationError(f"{what} is {asked!r}, with {doubled!r} twice")
    return texts


def _place(path: Path) -> tuple[float, str]:
    """Return a family's place: by the number that its name begins with, those without one last."""
    number = re.match(r"\d+", path.name)
    return (int(number[0]) if number else math.inf, path.name)


# ---- Layers of keys that a scene is put together from; none overrides another
# What a family sets, what one of its names sets and what every choice in the name sets are a layer each. A layer
# maps dotted keys to values. ``load.strain by case`` gives a key for every choice of a placeholder its value, and
# ``{case}`` in a text stands for the choice.


PLACEHOLDER = re.compile(r"\{([^{}]*)\}")
"""A placeholder in a text."""

_BY = re.compile(r"(\S+) +by +(\S+)")


@dataclass(frozen=True)
class Layer:
    """Keys that one thing sets: ``fixed`` ones, and those that go by the choice of a placeholder.

    ``what`` and ``where`` name the thing and its file in messages; ``used`` gathers what scenes took of ``by``.
    """

    fixed: dict[str, Any]
    by: dict[tuple[str, str], dict[str, Any]]
    what: str
    where: str
    used: set[tuple[str, str]] = field(default_factory=set)

    @classmethod
    def read(cls, document: Any, what: str, where: str) -> Layer:
        """Read a layer from a mapping.

        Raises
        ------
        ConfigurationError
            When it is none, or something in it is a mapping that must be none, or the other way round.
        """
        if not isinstance(document, dict):
            raise ConfigurationError(
                f"{where}: {what}: {reprlib.repr(document)} is no mapping of keys to values; {{}} is one without any"
            )
        layer = cls({}, {}, what, where)
        for key, value in document.items():
            by = _BY.fullmatch(key)
            if by and not (isinstance(value, dict) and value):
                must = f"a mapping that gives every {by[2]} its value"
                raise ConfigurationError(f"{where}: {what}: {key} is {value!r} but must be {must}")
            if by:
                layer.by[by[1], by[2]] = value
            else:
                layer.fixed[key] = value
        return layer

    def values(self, taken: Mapping[str, str], where: str) -> Iterator[tuple[str, Any]]:
        """Yield keys and values for the choices that a scene takes, by placeholder.

        Raises
        ------
        ConfigurationError
            When a key goes by a placeholder that the scene does not have, or has no value for its choice.
        """
        yield from self.fixed.items()
        for (key, placeholder), values in self.by.items():
            said = f"{where}: {self.what}: {key} by {placeholder}"
            if placeholder not in taken:
                message = unknown_choice("unknown placeholder", placeholder, placeholder, list(taken))
                raise ConfigurationError(f"{said}: {message}")
            choice = taken[placeholder]
            if choice not in values:
                raise ConfigurationError(f"{said} has no value for {choice!r}, only for {', '.join(values)}")
            self.used.add((key, choice))
            yield key, values[choice]

    def check_used(self) -> None:
        """Refuse values by the choice of a placeholder that no scene takes.

        Raises
        ------
        ConfigurationError
        """
        for (key, placeholder), values in self.by.items():
            unused = next((choice for choice in values if (key, choice) not in self.used), None)
            if unused is not None:
                raise ConfigurationError(
                    f"{self.where}: {self.what}: {key} by {placeholder} has a value for {unused!r}, which no scene of"
                    " it takes; take it out"
                )


def together(layers: Iterable[Layer], taken: Mapping[str, str], where: str) -> dict[str, Any]:
    """Return the keys that layers set together for the choices of a scene.

    Raises
    ------
    ConfigurationError
        When two set one key to different values, or what they set is no value of a key.
    """
    found: dict[str, Any] = {}
    said_by: dict[str, str] = {}
    for layer in layers:
        for key, value in layer.values(taken, where):
            said = filled(value, taken, f"{where}: {layer.what}: {key}")
            if isinstance(said, dict):
                raise ConfigurationError(
                    f"{where}: {layer.what}: {key} is {said!r} but must be a value; keys of a group are written"
                    f" {key}.{next(iter(said), 'key')}"
                )
            if key in found and found[key] != said:
                raise ConfigurationError(
                    f"{where}: {key} is {found[key]!r} of {said_by[key]} but {said!r} of {layer.what}; neither"
                    " overrides the other: set it in one of them"
                )
            found[key], said_by[key] = said, layer.what
    for key in found:
        group = next((other for other in found if key.startswith(f"{other}.")), None)
        if group is not None:
            raise ConfigurationError(
                f"{where}: {group} is {found[group]!r} but is a group of keys, with {key} in it"
            )
    return found


def filled(value: Any, taken: Mapping[str, str], where: str) -> Any:
    """Return a value with every placeholder in its texts replaced by the choice that is taken for it.

    Raises
    ------
    ConfigurationError
        When a text has a placeholder for which none is, or a brace that belongs to none.
    """
    if isinstance(value, list):
        return [filled(item, taken, where) for item in value]
    if not isinstance(value, str):
        return value
    for placeholder in PLACEHOLDER.findall(value):
        if placeholder not in taken:
            message = unknown_choice("unknown placeholder", placeholder, placeholder, list(taken))
            raise ConfigurationError(f"{where} is {value!r}: {message}")
    text = PLACEHOLDER.sub(lambda match: taken[match[1]], value)
    if "{" in text or "}" in text:
        raise ConfigurationError(
            f"{where} is {value!r}, but braces stand around a placeholder, as in {{case}}"
        )
    return text
