"""Keys of a scene: type, bounds, unit, meaning, standing and source of each stand once, in its section.

A section is a frozen pydantic model whose fields are made by `key`. What is allowed, error messages, the JSON schema,
``config/inputs.tsv``, ``knitstudy check`` and ``docs/keys.md`` all follow from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from knitstudy.errors import ConfigurationError
from knitstudy.registry import unknown_choice

STANDINGS = ("stated", "inferred", "assumed", "calibrated", "choice")
"""What an input is worth; see config/README.md."""

NO_DEFAULT = ...

LONGEST = 1e6
"""Largest length, in m."""

LARGEST = 2**63
"""Whole numbers beyond are none that anything here counts."""

LONG = 120
"""Characters of a value beyond which a message does not show all of it."""

SceneName = Annotated[str, Field(pattern="^[a-z][a-z0-9_-]{0,199}$")]
"""At most 200 small letters, digits, - and _: names of files begin with it, and those may have 255."""


def key(
    allowed: str | Callable[[], str],
    *,
    standing: str,
    source: str,
    checked: str,
    unit: str = "1",
    default: Any = NO_DEFAULT,
    **bounds: Any,
) -> Any:
    """Return the field of a key.

    Parameters
    ----------
    allowed : str or callable
        Completes the sentence "<key> is ... but must be ..."; a callable where registries say what there is.
    standing : str
        One of `STANDINGS`.
    source : str
        Where the value comes from.
    checked : str
        The range over which results were checked.
    unit : str
    default : optional
        Value under which every result from before the key existed was made: at this value the key enters no digest,
        so that adding it runs nothing again. It must never be changed; the study's own values stand in
        ``config/defaults.yaml``.
    **bounds
        ``gt``, ``ge``, ``lt``, ``le``, ``min_length``, ``pattern`` as of pydantic.
    """
    return Field(default, json_schema_extra=Description(unit, allowed, standing, source, checked), **bounds)


class Section(BaseModel):
    """A group of keys that belong together."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


@dataclass(frozen=True)
class Description:
    """What is known of one key; see `key`."""

    unit: str
    says: str | Callable[[], str]
    standing: str
    source: str
    checked: str

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        return self.says if isinstance(self.says, str) else self.says()

    def __call__(self, schema: dict) -> None:
        """Add it to the JSON schema of the key."""
        names = ("unit", "standing", "source", "checked")
        schema |= {"description": self.allowed} | {name: getattr(self, name) for name in names}


def describe(section: type[Section], name: str) -> Description:
    """Return what is known of the key `name` of a section."""
    return section.model_fields[name].json_schema_extra


def validated(section: type[Section], values: Any, where: str, prefix: str = "") -> Section:
    """Return a section of given values.

    Parameters
    ----------
    section : subclass of Section
    values : mapping
        As read from YAML: lists stand for tuples.
    where : str
        File or scene that the values come from; begins the message.
    prefix : str
        Name of the section with a dot, or nothing.

    Raises
    ------
    ConfigurationError
        For the first key that is unknown, missing or has a value that is not allowed.
    """
    if not isinstance(values, Mapping):
        message = f"{prefix.rstrip('.')} is {_shown(values)} but must be a group of keys"
        raise ConfigurationError(f"{where}: {message}")
    for name in values:
        if name not in section.model_fields:
            message = unknown_choice(
                "unknown key", f"{prefix}{name}", str(name), sorted(section.model_fields)
            )
            raise ConfigurationError(f"{where}: {message}")
    for path, value in _leaves(values, ()):
        if isinstance(value, float) and not math.isfinite(value):
            raise ConfigurationError(f"{where}: {_said(prefix, path, value)} but must be a finite number")
        if isinstance(value, int) and abs(value) > LARGEST:
            message = f"{_said(prefix, path, value)} but must be {describe(section, path[0]).allowed}"
            raise ConfigurationError(f"{where}: {message}")
    try:
        return section.model_validate({name: _tuples(value) for name, value in values.items()})
    except ValidationError as errors:
        # A key that is missing counts last: another that is wrong may be the same one misspelt.
        first = min(errors.errors(), key=_is_missing)
        raise ConfigurationError(f"{where}: {_message(section, first, prefix)}") from None


def _message(section: type[Section], error: Mapping, prefix: str) -> str:
    if error["type"] == "value_error" and not error["loc"]:  # keys against each other: it says all
        return f"{prefix}{error['ctx']['error']}"
    name = error["loc"][0]
    if _is_missing(error):
        return f"the key {prefix + name!r} is missing; it must be {describe(section, name).allowed}"
    return f"{_said(prefix, error['loc'], error['input'])} but must be {describe(section, name).allowed}"


def _is_missing(error: Mapping) -> bool:
    """Return whether a key is missing; further inside, a list is too short."""
    return error["type"] == "missing" and len(error["loc"]) == 1


def _said(prefix: str, path: Sequence, value: Any) -> str:
    """Say what the value of a key is, or of an entry of its list."""
    return f"{prefix}{path[0]} {'has the entry' if len(path) > 1 else 'is'} {_shown(value)}"


def _shown(value: Any) -> str:
    """Return a value as YAML has it, cut where it is long."""
    if isinstance(value, int) and abs(value) > LARGEST:
        return f"a whole number of {math.ceil(math.log10(2) * value.bit_length())} digits"
    text = repr(_lists(value))
    return text if len(text) <= LONG else f"{text[:LONG]} ..."


def _leaves(node: Any, path: tuple) -> Iterator[tuple[tuple, Any]]:
    if isinstance(node, Mapping):
        children = node.items()
    elif isinstance(node, list | tuple):
        children = enumerate(node)
    else:
        yield path, node
        return
    for name, child in children:
        yield from _leaves(child, (*path, name))


def registered(value: str, names: Iterable[str]) -> str:
    """Return a value that is one of names; ValueError, for pydantic, where it is not."""
    if value not in names:
        raise ValueError("not registered")
    return value


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list | tuple) else value


def _lists(value: Any) -> Any:
    return [_lists(each) for each in value] if isinstance(value, list | tuple) else value
