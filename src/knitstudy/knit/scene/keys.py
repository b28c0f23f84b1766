"""Keys of a scene: type, bounds, unit, role, provenance and source of each stand once, in the field of its section.

A section is a frozen pydantic model whose fields are made by `physics`, `resolution`, `numerics` and `output`. The
text under a field is the source of the value and, after "Checked:", the range over which results were checked. Allowed
values in words, error messages, ``knitstudy check``, ``keys.md`` and the identity of a problem follow from there.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import pairwise
from types import NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Literal,
    Self,
    TypeVar,
    Unpack,
    get_args,
    get_origin,
)

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import core_schema

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.documents import packaged_defaults
from knitstudy.registry import listed, meanings, unknown_choice

ROLES = {
    "physics": "the simulated problem: scenes with the same physics keys have one reference",
    "resolution": "the resolution: scenes of a refinement series differ in these keys",
    "numerics": "the model and its settings",
    "output": "the recorded results, and the question to `ask`",
}
"""Role of a key; other modules treat keys by their roles."""

PROVENANCES = ("stated", "inferred", "assumed", "calibrated", "choice")
"""Provenance of an input; see config/README.md."""

LARGEST = 2**63  # Of larger whole numbers a message counts the digits
LONG = 120  # Largest number of characters of a value in a message

SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}

SceneName = Annotated[str, Field(pattern="^[a-z][a-z0-9_-]{0,199}$")]
"""At most 200 small letters, digits, - and _: file names begin with it, and these may have 255."""

Length = Annotated[float, Field(gt=0, le=1e6)]  # A length in m

Positive = Annotated[float, Field(gt=0, le=1e12)]

Count = Annotated[int, Field(ge=1, le=10_000)]


@dataclass(frozen=True)
class OneOf:
    """Type of a key whose value is the name of a registered thing; `entries` returns the registered things by name."""

    entries: Callable[[], Mapping[str, Any]]

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return core_schema.no_info_after_validator_function(self._registered, handler(source))

    def _registered(self, value: str) -> str:
        if value not in self.entries():
            raise ValueError("not registered")
        return value


def key(
    role: str,  # one of `ROLES`
    provenance: str,  # one of `PROVENANCES`
    *,
    unit: str = "1",
    meaning: str = "",  # follows type and bounds in messages; by default the unit does
    # Allowed values in words, in place of type, bounds and meaning: the end of "<key> is ... but must be ..."
    allowed: str | Callable[[], str] = "",
    default: Any = ...,
    **bounds: Any,  # ``gt``, ``ge``, ``lt``, ``le``, ``min_length``, ``pattern`` as of pydantic
) -> Any:
    """Return the field of a key; the text under it names its source (see above).

    The default is the value of scenes that do not set the key. Results from before the key existed were made under this
    value: the default enters no digest, so that a new key runs nothing again, and must never be changed. Defaults of
    other keys are in ``config/defaults.yaml``; no key has a default in both places.
    """
    if role not in ROLES or provenance not in PROVENANCES:
        raise ValueError(f"a key of role {role!r} and provenance {provenance!r}")
    known: Any = Description(role, provenance, unit, meaning, allowed)
    return Field(default, json_schema_extra=known, **bounds)


physics, resolution, numerics, output = (partial(key, role) for role in ROLES)
"""Fields of keys by their roles: `key` without its first argument."""

declared = partial(output, "choice")
"""Field of a key of a campaign's file, which has no role in a scene."""


def section() -> Any:
    """Return the field of a section of a scene, which a user may leave out: all its keys then have their defaults."""
    return Field()


@dataclass(frozen=True)
class Description:
    """Description of one key; see `key`."""

    role: str
    provenance: str
    unit: str
    meaning: str
    allowed: Any
    source: str = ""  # where the value comes from
    checked: str = "none"  # the range over which results were checked


if TYPE_CHECKING:  # editors and type checkers see the fields of the class
    _Model = BaseModel
else:

    class _CalledByUsers(type(BaseModel)):
        """Metaclass of sections and scenes: a call builds one from a user's keyword arguments."""

        def __call__(cls, **values):
            return cls.of_user(**values)

    class _Model(BaseModel, metaclass=_CalledByUsers):
        """A model that is called by users."""


class Section(_Model):
    """A group of keys that belong together.

    A section that is made in Python, ``Pattern(rows=4)``, has the packaged defaults of keys that are not set.
    """

    group: ClassVar[str] = ""
    """Name of the group of keys in a scene, and in ``defaults.yaml``; the head of its class gives it."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)

    def __init_subclass__(cls, group: str = "", **config: Unpack[ConfigDict]) -> None:
        super().__init_subclass__(**config)
        cls.group = group or cls.group

    @classmethod
    def of_user(cls, **values: Any) -> Self:
        """Return a section of some of its keys; ConfigurationError where a key is unknown or has a wrong value.

        Other keys have their packaged defaults.
        """
        below = packaged_defaults().get(cls.group, {}) if cls.group else {}
        missing = {
            name: below[name]
            for name, field in cls.model_fields.items()
            if field.is_required() and name in below and name not in values
        }
        made = validated(cls, missing | values, cls.__name__)
        made.__pydantic_fields_set__.difference_update(missing)
        return made


AnySection = TypeVar("AnySection", bound=Section)


def explicit_keys(part: Any) -> Any:
    """Return the explicitly set keys of a section as plain data; anything else unchanged."""
    return part.model_dump(mode="json", exclude_unset=True) if isinstance(part, Section) else part


@cache
def describe(section: type[Section], name: str) -> Description:
    """Return the description of the key `name` of a section, without source and checked range."""
    known: Any = section.model_fields[name].json_schema_extra
    assert isinstance(known, Description), f"{section.__name__}.{name} is not a key"
    return known


@cache
def _texts(section: type[Section]) -> dict[str, str]:
    """Return the texts below the keys that a section itself declares; none if its source code is not available."""
    try:
        source = inspect.getsource(section)
    except OSError:
        return {}
    described = ast.parse(textwrap.dedent(source)).body[0]
    assert isinstance(described, ast.ClassDef)
    texts = {}
    for field, below in pairwise(described.body):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(below, ast.Expr)
        ):
            texts[field.target.id] = inspect.cleandoc(ast.literal_eval(below.value))
    return texts


def documented(section: type[Section], name: str) -> Description:
    """Return the description of a key with source and checked range, which are read from the text below the key."""
    bases = (base for base in section.__mro__ if issubclass(base, Section))
    text = next((texts[name] for texts in map(_texts, bases) if name in texts), "")
    source, _, checked = " ".join(text.split()).partition(" Checked: ")
    known = describe(section, name)
    return replace(known, source=source.removesuffix("."), checked=checked.removesuffix(".") or "none")


def allowed_values(section: type[Section], name: str) -> str:
    """Return the allowed values of the key `name` of a section in words: its own, or by type and bounds."""
    field = section.model_fields[name]
    known = describe(section, name)
    if known.allowed:
        return str(known.allowed() if callable(known.allowed) else known.allowed)
    kinds = get_args(field.annotation) if isinstance(field.annotation, UnionType) else (field.annotation,)
    text = _bounded("a whole number" if kinds[0] is int else "a number", field)
    if get_origin(kinds[0]) is Literal:
        text = listed(get_args(kinds[0]))
    for registered in (choice for choice in field.metadata if isinstance(choice, OneOf)):
        text = meanings(registered.entries())
    meaning = known.meaning or (f"in {known.unit}" if known.unit != "1" else "")
    text += f", {meaning}" if meaning else ""
    return text + (", or null" if NoneType in kinds else "")


def _bounded(number: str, field: FieldInfo) -> str:
    bounds = {
        name: f"{getattr(bound, name):g}".replace("e+0", "e").replace("e+", "e")
        for bound in field.metadata
        for name in SIGNS
        if hasattr(bound, name)
    }
    match bounds:
        case {"ge": low, "le": high}:
            return f"{number} from {low} to {high}"
        case {"gt": low, "lt": high}:
            return f"{number} between {low} and {high} (both excluded)"
    return f"{number} " + " and ".join(f"{SIGNS[name]} {limit}" for name, limit in bounds.items())


def validated(section: type[AnySection], values: Any, where: str, prefix: str = "") -> AnySection:
    """Return a section of given values, as read from YAML: lists stand for tuples.

    `where`, the file or scene that they come from, is the prefix of error messages; `prefix` is the name of the section
    with a dot, or is empty.
    Raises ConfigurationError for the first key that is unknown, missing or has a value that is not allowed.
    """
    if not isinstance(values, Mapping):
        raise ConfigurationError(f"{where}: {refused(prefix.rstrip('.'), values, 'a group of keys')}")
    for name in values.keys() - section.model_fields.keys():
        message = unknown_choice("unknown key", f"{prefix}{name}", str(name), sorted(section.model_fields))
        raise ConfigurationError(f"{where}: {message}")
    try:
        return section.model_validate({name: tuples(value) for name, value in values.items()})
    except ValidationError as errors:
        # A key that is missing counts last: another that is wrong may be the same one misspelt.
        first = min(errors.errors(), key=_is_missing)
        raise ConfigurationError(f"{where}: {_message(section, first, prefix)}") from None


def _message(section: type[Section], error: Mapping[str, Any], prefix: str) -> str:
    if error["type"] == "value_error" and not error["loc"]:  # keys against each other: it says all
        return f"{prefix}{error['ctx']['error']}"
    name = error["loc"][0]
    if _is_missing(error):
        return f"the key {prefix + name!r} is missing; it must be {allowed_values(section, name)}"
    wanted = "a finite number" if error["type"] == "finite_number" else allowed_values(section, name)
    verb = "has the entry" if len(error["loc"]) > 1 else "is"
    return refused(f"{prefix}{name}", error["input"], wanted, verb)


def _is_missing(error: Mapping[str, Any]) -> bool:
    """Return whether a key is missing; further inside, a list is too short."""
    return error["type"] == "missing" and len(error["loc"]) == 1


def refused(key: str, value: Any, wanted: str, verb: str = "is") -> str:
    """Return the message for the value of a key, or for an entry of its list, as YAML, cut where it is long."""
    text = repr(lists(value))
    if isinstance(value, int) and abs(value) > LARGEST:
        text = f"a whole number of {math.ceil(math.log10(2) * value.bit_length())} digits"
    return f"{key} {verb} {text if len(text) <= LONG else f'{text[:LONG]} ...'} but must be {wanted}"


def tuples(value: Any) -> Any:
    """Return a value with tuples in the place of lists."""
    return tuple(map(tuples, value)) if isinstance(value, list | tuple) else value


def lists(value: Any) -> Any:
    """Return a value with lists in the place of tuples."""
    return list(map(lists, value)) if isinstance(value, list | tuple) else value
