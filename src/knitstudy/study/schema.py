"""Validation of configuration documents: one message that names the key, the value and what is allowed."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import Any

import jsonschema
import yaml
from jsonschema.exceptions import ValidationError

from knitstudy.errors import ConfigurationError


@cache
def scene_schema() -> dict:
    """Return the JSON schema of one scene (``scene.schema.yaml`` beside this module)."""
    return yaml.safe_load(files("knitstudy.study").joinpath("scene.schema.yaml").read_text(encoding="utf-8"))


MANY = 20
"""Names beyond which a message that has a nearest one does not list all."""


def validate(document: Any, schema: dict, where: str) -> None:
    """Check a document against a JSON schema whose descriptions say what is allowed.

    Parameters
    ----------
    document
        Mapping read from YAML or put together from a table.
    schema
        JSON schema; ``description`` of a property completes "<key> must be ...".
    where
        File, table row or scene that the document comes from; begins the message.

    Raises
    ------
    ConfigurationError
        For the first key that is unknown, missing or has a value that is not allowed.
    """
    _check_finite(document, where)
    errors = jsonschema.Draft202012Validator(schema).iter_errors(document)
    first = min(errors, key=_rank, default=None)
    if first is not None:
        raise ConfigurationError(f"{where}: {_message(first)}")


def _rank(error: ValidationError) -> tuple[int, str]:
    """Order errors: an unknown key first and a missing key last, since a misspelt one is missing as well."""
    ranks = {"additionalProperties": 0, "required": 2}
    return ranks.get(error.validator, 1), dotted(error.absolute_path)


def _message(error: ValidationError) -> str:
    key = dotted(error.absolute_path)
    if error.validator == "additionalProperties":
        allowed = sorted(error.schema["properties"])
        unknown = sorted(set(error.instance) - set(allowed))[0]
        return unknown_choice("unknown key", dotted([*error.absolute_path, unknown]), unknown, allowed)
    if error.validator == "required":
        missing = next(name for name in error.validator_value if name not in error.instance)
        return f"the key {dotted([*error.absolute_path, missing])!r} is missing"
    allowed = error.schema.get("description", error.message)
    return f"{key or 'the document'} is {error.instance!r} but must be {allowed}"


def unknown_choice(what: str, full_name: str, name: str, allowed: list[str]) -> str:
    """Return a message for a name that does not exist: the nearest one that does, and all unless they are many."""
    near = difflib.get_close_matches(name, allowed, n=1)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    if near and len(allowed) > MANY:
        return f"{what} {full_name!r}{hint}; {len(allowed)} names are allowed"
    return f"{what} {full_name!r}{hint}; allowed are {', '.join(allowed) if allowed else 'none'}"


def dotted(path: Any) -> str:
    """Return the dotted name of a path of keys and list positions, for example ``load.strain``."""
    return ".".join(str(part) for part in path)


def _check_finite(document: Any, where: str) -> None:
    """Refuse NaN and infinities, which pass every bound of a JSON schema."""
    for path, value in _leaves(document, ()):
        if isinstance(value, float) and not math.isfinite(value):
            raise ConfigurationError(f"{where}: {dotted(path)} is {value!r} but must be a finite number")


def _leaves(node: Any, path: tuple) -> Iterator[tuple[tuple, Any]]:
    if isinstance(node, dict):
        children = node.items()
    elif isinstance(node, list):
        children = enumerate(node)
    else:
        yield path, node
        return
    for key, child in children:
        yield from _leaves(child, (*path, key))
