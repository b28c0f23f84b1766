"""Layers of keys that a scene is put together from; none overrides another.

What a family sets, what one of its names sets and what every choice in the name sets are a layer each. A layer
maps dotted keys to values. ``load.strain by case`` gives a key for every choice of a placeholder its value, and
``{case}`` in a text stands for the choice.
"""

from __future__ import annotations

import re
import reprlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.registry import unknown_choice

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
