"""Keys of a scene: type, bounds, unit, meaning, standing and source of each stand once, in its section.

A section is a frozen pydantic model whose fields are made by `key`. What is allowed, error messages, the JSON schema,
``config/inputs.tsv``, ``knitstudy check`` and ``docs/keys.md`` all follow from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Annotated, Any, NamedTuple

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

SceneName = Annotated[str, Field(pattern="^[a-z][a-z0-9_-]*$")]
"""Small letters, digits, - and _."""


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
    described = {"unit": unit, "standing": standing, "source": source, "checked": checked}
    return Field(
        default,
        description=allowed if isinstance(allowed, str) else None,
        json_schema_extra=described | ({} if isinstance(allowed, str) else {"allowed": allowed}),
        **bounds,
    )


class Section(BaseModel):
    """A group of keys that belong together."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Description(NamedTuple):
    """What is known of one key."""

    unit: str
    allowed: str
    standing: str
    source: str
    checked: str


def describe(section: type[Section], name: str) -> Description:
    """Return what is known of the key `name` of a section."""
    field = section.model_fields[name]
    extra = dict(field.json_schema_extra)
    allowed = extra.pop("allowed", None)
    return Description(allowed=allowed() if allowed else field.description, **extra)


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
        raise ConfigurationError(f"{where}: {prefix.rstrip('.')} is {values!r} but must be a group of keys")
    for name in values:
        if name not in section.model_fields:
            message = unknown_choice(
                "unknown key", f"{prefix}{name}", str(name), sorted(section.model_fields)
            )
            raise ConfigurationError(f"{where}: {message}")
    for path, value in _leaves(values, ()):
        name = prefix + ".".join(map(str, path))
        if isinstance(value, float) and not math.isfinite(value):
            raise ConfigurationError(f"{where}: {name} is {value!r} but must be a finite number")
        if isinstance(value, int) and abs(value) > LARGEST:
            raise ConfigurationError(
                f"{where}: {name} has {len(str(abs(value)))} digits but must be a number that fits"
            )
    try:
        return section.model_validate({name: _tuples(value) for name, value in values.items()})
    except ValidationError as errors:
        # A key that is missing counts last: another that is wrong may be the same one misspelt.
        first = min(errors.errors(), key=lambda error: error["type"] == "missing")
        raise ConfigurationError(f"{where}: {_message(section, first, prefix)}") from None


def _message(section: type[Section], error: Mapping, prefix: str) -> str:
    if error["type"] == "value_error" and not error["loc"]:  # keys against each other: it says all
        return f"{prefix}{error['ctx']['error']}"
    name, *inside = error["loc"]
    if error["type"] == "missing":
        return f"the key {prefix + name!r} is missing"
    value = error["input"]
    full = prefix + ".".join(map(str, (name, *inside)))
    return f"{full} is {_lists(value)!r} but must be {describe(section, name).allowed}"


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
