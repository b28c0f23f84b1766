"""YAML documents of a configuration; ambiguous YAML is refused: doubled keys, and values that change their type.

A key that stands twice is an error instead of the last one winning, keys are text (``no`` is not false), 045 is
not 37, 1e-6 is a number as in YAML 1.2, and values are written out instead of being named (``*alias``).
"""

from __future__ import annotations

import copy
import re
from functools import cache, lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

from knitstudy.errors import ConfigurationError, message_of
from knitstudy.registry import unknown_choice

DATA = Path(str(files("knitstudy"))) / "data"
"""Data of the package; in a checkout, links to its folders."""

CONFIG, RESOURCES, WORKFLOW = ((DATA / name).resolve() for name in ("config", "resources", "workflow"))
"""The default configuration, the committed tables, and scripts and rules of the workflow."""


LARGEST = 5_000_000
"""Most characters of a YAML text: reading them takes a few seconds."""

DEEPEST = 20
"""Most lists and mappings inside each other: twice as many as a configuration needs."""


def read_yaml(path: Path) -> dict[str, Any]:
    """Return the mapping in a YAML file.

    Raises ConfigurationError when the file is missing, is not YAML, says a key twice or holds no mapping.
    """
    document = _read_once(_read_text(path), str(path))
    if not isinstance(document, dict):
        raise ConfigurationError(f"{path}: must hold a mapping of keys to values")
    return copy.deepcopy(document)


@lru_cache(maxsize=128)
def _read_once(text: str, where: str) -> Any:
    return parsed(text, where)


def parsed(text: str, where: str) -> Any:
    """Return the content of a YAML text; `where` is the prefix of the ConfigurationError if it cannot be read."""
    if len(text) > LARGEST:
        raise ConfigurationError(f"{where}: has {len(text)} characters; at most {LARGEST} are read")
    try:
        _require_shallow(text)
        return yaml.load(text, Loader=_Loader)
    except _Refused as error:
        raise ConfigurationError(f"{where}, line {error.line}: {error.problem}") from error
    # ValueError: 2001-99-99 looks like a date; AttributeError: a tag of a date before another value.
    except (yaml.YAMLError, ValueError, AttributeError) as error:
        raise ConfigurationError(f"{where}: is not YAML: {_reason(error, text)}") from error


def _require_shallow(text: str) -> None:
    """Refuse aliases, and lists within lists that would take more memory of the stack than there is."""
    depth = 0
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.AliasEvent):  # which may contain itself, or be expanded thousands of times
            raise _Refused(f"write the value out instead of *{event.anchor}", event)
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth > DEEPEST:
            raise _Refused(f"lists or mappings are nested more than {DEEPEST} deep", event)


def _read_text(path: Path) -> str:
    if path.is_fifo():  # which a reader would wait for
        raise ConfigurationError(f"{path}: is a pipe; a file must be there")
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise ConfigurationError(f"{path}: is missing; the configuration folder must have it") from error
    except UnicodeDecodeError as error:
        message = f"is not UTF-8 text (byte {error.start + 1}); save it as UTF-8"
        raise ConfigurationError(f"{path}: {message}") from error
    except OSError as error:
        raise ConfigurationError(
            f"{path}: cannot be read ({error.strerror}); a file must be there"
        ) from error


def _reason(error: Exception, text: str) -> str:
    """Return the error in a text and its place, in one line."""
    mark = getattr(error, "problem_mark", None)
    if not isinstance(error, yaml.MarkedYAMLError) or mark is None:
        return message_of(error, Exception)
    problem = " ".join(filter(None, (error.context, error.problem)))
    (line,) = text.splitlines()[mark.line : mark.line + 1] or [""]
    hint = "; put text that contains braces in quotes"
    return f"line {mark.line + 1}: {problem}{hint if '{' in line else ''}"


class _Refused(yaml.MarkedYAMLError):
    """Valid YAML that means something else than it seems to."""

    def __init__(self, problem: str, node: Any) -> None:
        super().__init__(problem=problem, problem_mark=node.start_mark)
        self.line = node.start_mark.line + 1


class _Loader(yaml.CSafeLoader):
    """SafeLoader for documents that people write."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Read keys as the text that they are, and refuse a key that is defined twice."""
        seen = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode) or key.value == "<<":
                raise _Refused("a key must be a text", key)
            if key.value in seen:
                raise _Refused(f"the key {key.value!r} is defined twice", key)
            key.tag = "tag:yaml.org,2002:str"
            seen.add(key.value)
        return super().construct_mapping(node, deep)

    def construct_number(self, node: yaml.ScalarNode) -> float:
        """Refuse numbers in other than tens: 045 is 37 to YAML, 1:30 is 90, and 1:30.5 is 90.5."""
        whole = node.tag.endswith(":int")
        if ":" in node.value or (whole and not re.fullmatch(r"[-+]?(0|[1-9][0-9_]*)", node.value)):
            message = f"{node.value} is not a plain number: write it in tens, or in quotes if it is a name"
            raise _Refused(message, node)
        return self.construct_yaml_int(node) if whole else self.construct_yaml_float(node)


_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_number)
_Loader.add_constructor("tag:yaml.org,2002:float", _Loader.construct_number)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)


# Defaults of all keys: ``defaults.yaml`` of a configuration over the file of a calibrated loop that it names

# Section and name that a key of a calibrated loop has in a scene.
_LOOP_KEYS = {
    "control_points": ("pattern", "control_points"),
    "course_spacing": ("pattern", "course_spacing"),
    "wale_spacing": ("pattern", "wale_spacing"),
    "diameter": ("yarn", "diameter"),
    "free": ("geometry", "free"),
}

_RECORD = "achieved"  # Record of the calibration, for readers


def base_of(config: Path) -> Path:
    """Return the folder whose defaults, calibration and families hold for a folder, or a file, of scenes."""
    config = Path(config)
    own = config.is_file() or (config.is_dir() and not (config / "defaults.yaml").exists())
    return CONFIG if own else config


def layered_defaults(config: Path = CONFIG) -> dict[str, Any]:
    """Return ``defaults.yaml``, with the loop file that ``pattern.loop`` names laid under it."""
    config = base_of(config)
    document = read_yaml(config / "defaults.yaml")
    pattern = document.get("pattern")
    if not isinstance(pattern, dict) or "loop" not in pattern:
        return document
    layer = _read_loop(config / str(pattern.pop("loop")))
    for name, inside in layer.items():
        if isinstance(document.setdefault(name, {}), dict):
            document[name] = inside | document[name]
    return document


@cache
def packaged_defaults() -> dict[str, Any]:
    """Return the defaults of the package, which scenes and sections take that are made in Python."""
    return layered_defaults()


def _read_loop(path: Path) -> dict[str, Any]:
    """Return the layer of a scene that a file of a calibrated loop gives."""
    loop = read_yaml(path)
    layer: dict[str, Any] = {}
    for name, (section, key) in _LOOP_KEYS.items():
        if name not in loop:
            raise ConfigurationError(f"{path}: the key {name!r} of a calibrated loop is missing")
        layer.setdefault(section, {})[key] = loop[name]
    known = [*_LOOP_KEYS, _RECORD]
    for name in loop.keys() - set(known):
        raise ConfigurationError(f"{path}: {unknown_choice('unknown key', name, name, known)}")
    return layer
