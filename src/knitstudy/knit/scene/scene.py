"""The scene: one validated, frozen description of one simulation.

A scene is the only thing that a stage is parametrised by. A scene that exists is valid: a value that is not allowed
raises ConfigurationError. A scene has the sections of its kind and no others: its specimen's, its yarn's, and those
that its fidelity asks for with its interaction. All quantities are SI; the description of a key names its unit.

Specimens and models bring classes of scenes, whose fields are sections. A class is called with what a user says::

    CellOfBeams(pattern=Pattern(course_spacing=0.9e-3, wale_spacing=1.1e-3, loops=1, rows=1),
                yarn=SetYarn(diameter=0.25e-3), load=CellStrain(strain=0.3))

Keys that are not set have their defaults.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any, dataclass_transform

import numpy as np
from pydantic import PrivateAttr, ValidationError

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.alternatives import OF_BEAMS, SECTIONS, in_base_keys
from knitstudy.knit.scene.documents import packaged_defaults
from knitstudy.knit.scene.keys import Section, describe, explicit_keys, lists, section, tuples, validated
from knitstudy.knit.scene.kinds import (
    MODELS,
    Kind,
    Labels,
    Part,
    all_keys,
    all_sections,
    labels_of,
    not_of_kind,
    unit_of,
    unknown_key,
    word_of,
)
from knitstudy.knit.scene.sections import PairPath, Tension, Yarn
from knitstudy.knit.scene.shared_sections import Gates, Newton
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.mechanics.materials import MATERIALS

FREE_OF_STRESS = {"yarn.set": 1.0}
"""How yarns lie in drawn loops, for models that do not ask."""

MODULUS = "yarn.youngs_modulus"

LABELS = tuple(name for name in Labels.model_fields if describe(Labels, name).role == "output")
"""Labels that no number depends on: name, knit and outputs."""

USUAL = {
    "yarn.youngs_modulus": (1e6, 1e12, "Pa", "MPa"),
    "yarn.diameter": (1e-6, 0.02, "m", "mm"),
}
"""Least and largest values of yarns, their unit, and the unit in which a value outside of these may be meant."""
SECOND = SECTIONS[1]
ROWS = f"{SECOND}.rows"
LONG = 500  # yarn radii beyond which a length of a loop is questioned; shipped scenes have at most 44

NAMELESS = "scene"  # Name of scenes that are made in Python without a name
NOTHING: Mapping[str, Any] = MappingProxyType({})


@dataclass_transform(kw_only_default=True)
class Scene(Part):
    """One simulation; `to_dict` and `from_dict` translate to and from plain nested mappings.

    Attributes
    ----------
    name, knit, specimen, fidelity, interaction : str
    outputs : tuple of str
    yarn, load, solver, gates : Section
        Each class of scenes has further sections; one that a scene does not have raises AttributeError.
    kind : Kind
    """

    yarn: Yarn = section()
    load: Tension | PairPath = section()
    solver: Newton = section()
    gates: Gates = section()
    _defaults: Mapping[str, Any] = PrivateAttr(default_factory=dict)

    @classmethod
    def of_user(cls, **parts: Any) -> Scene:
        """Return the scene of these sections and labels; ConfigurationError where a key is unknown or wrong."""
        document = {name: explicit_keys(part) for name, part in parts.items()}
        labels = _labels(cls) | {"knit": document.get("name", NAMELESS)}
        return cls.from_dict(labels | document, "scene", packaged_defaults())

    @classmethod
    def from_dict(
        cls, document: Mapping[str, Any], where: str = "scene", defaults: Mapping[str, Any] = NOTHING
    ) -> Scene:
        """Build a scene of a mapping of keys, nested or by dotted name; messages begin with `where` they come from.

        `defaults` are values of keys that are not in the document, for scenes of any kind: keys that the scene's kind
        does not have are left out. The scene remembers them, so that `vary` can make it one of another kind.
        Raises ConfigurationError when a key is unknown, missing, of another kind or has a value that is not allowed.
        """
        made = _scene_of(flat(document), defaults, where)
        for name in [name for name, inside in document.items() if inside == {}]:
            if not made.kind.has(name):
                raise ConfigurationError(f"{where}: {not_of_kind(made.kind, name)}")
        return made

    def vary(self, changes: Mapping[str, Any]) -> Scene:
        """Return a scene with some keys changed, checked once all of them are.

        `changes` are values by dotted key in their units, for example ``{"load.strain": 0.01, "mesh.size": 0.5}``. A
        scene that becomes one of another kind loses the keys and outputs of its former kind, and takes the keys that
        it lacks from the defaults.
        Raises ConfigurationError when a key is unknown or not read, or a value is not allowed.
        """
        where = f"scene {self.name!r}"
        made = _scene_of(changes, self._defaults, where, self)
        made.require_read(changes, where)
        return made

    def labelled(self, labels: Mapping[str, str]) -> Scene:
        """Return the scene under other names of its own and of its knit; its sections are not checked again."""
        names = {name: getattr(self, name) for name in Labels.model_fields} | dict(labels)
        fields: dict[str, Any] = {**dict(labels_of(names, f"scene {self.name!r}")), **self.sections}
        made = type(self).model_construct(**fields)
        made._defaults = self._defaults
        return made

    def replace(self, key: str, value: Any) -> Scene:
        """Return a scene with one key changed, for example ``scene.replace("solver.increments", 4)``."""
        return self.vary({key: value})

    def scaled(self, length: float = 1.0, stiffness: float = 1.0) -> Scene:
        """Return the same scene in other units: lengths times `length`, moduli times `stiffness`."""
        factors = {"m": length, "Pa": stiffness, "N/m": stiffness * length}
        factors |= {"N": stiffness * length**2, "N m2": stiffness * length**4}
        changes = {}
        for key, value in self._own_values().items():
            factor = factors.get(unit_of(key))
            if factor is not None and value is not None:
                changes[key] = (np.array(value) * factor).tolist()
        return _scene_of(changes, self._defaults, f"scene {self.name!r}", self)

    def require_read(self, explicit: Iterable[str], where: str) -> None:
        """Refuse explicitly set keys that other keys make ineffective; `where` is the prefix of error messages."""
        for key in explicit:
            if others := self.replaced_by(key):
                given = f"where {', '.join(others)} {'is' if len(others) == 1 else 'are'} given"
                raise ConfigurationError(f"{where}: {key} is not read {given}; leave it out")

    def replaced_by(self, key: str) -> tuple[str, ...]:
        """Return the keys that make a key ineffective because they are set; none where the key is read."""
        others = self.kind.part.ignored_if_set.get(key, ())
        return others if all(self.value(other) is not None for other in others) else ()

    def __reduce__(self) -> tuple[Any, ...]:
        """Scenes go to other processes as their keys."""
        return _again, (self.to_dict(), dict(self._defaults))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(json.dumps(self.to_dict(), sort_keys=True))

    def __repr__(self) -> str:
        return f"Scene({self.name!r}: {self.fidelity}, {self.specimen}, {word_of(self.interaction)})"

    __str__ = __repr__

    @property
    def sections(self) -> dict[str, Section]:
        """Its sections by name."""
        return {name: vars(self)[name] for name in self.kind.sections if name in vars(self)}

    def to_dict(self) -> dict[str, Any]:
        """Return the scene as nested mappings of numbers, text and lists."""
        return {name: dict(part) if isinstance(part, dict) else part for name, part in self._document.items()}

    @cached_property
    def _document(self) -> dict[str, Any]:
        labels = {name: lists(getattr(self, name)) for name in Labels.model_fields}
        return labels | {name: section.model_dump(mode="json") for name, section in self.sections.items()}

    def value(self, key: str) -> Any:
        """Return the value of a dotted key or a section; None where a scene of this kind has none."""
        value: Any = self
        for part in key.split("."):
            value = getattr(value, part, None)
        return value

    def metres(self, key: str) -> float | None:
        """Return the value of a dotted key in yarn radii as a length [m]; None where the scene has no such key."""
        value = self.value(key)
        return None if value is None else value * self.yarn.radius

    def _own_values(self) -> dict[str, Any]:
        """Return the values of all keys by dotted name, but for the labels."""
        sections = self.sections.items()
        return {f"{name}.{key}": value for name, part in sections for key, value in vars(part).items()}

    def values_of(self, *roles: str) -> dict[str, Any]:
        """Return the values of all keys of some roles, by dotted key, but for the labels; implied ones as well."""
        values = {**self.kind.part.implied, **self._own_values()}
        described = all_keys()
        return {
            key: value
            for key, value in values.items()
            if describe(described[key], key.partition(".")[2]).role in roles
        }

    def read(self, keys: Iterable[str]) -> dict[str, Any]:
        """Return sections and dotted keys as plain nested mappings: the inputs of a result.

        Keys that have a default in their field (see `knit.scene.keys.key`) are left out at that default, so that adding
        one changes nothing; sections that the scene does not have are left out as well.
        """
        names = set(keys)
        document = {
            name: value for name, value in self._document.items() if name in names & {*Labels.model_fields}
        }
        for group, part in self.sections.items():
            for key, value in self._document[group].items():
                asked = group in names or f"{group}.{key}" in names
                if asked and value != _default_of(type(part), key):
                    document.setdefault(group, {})[key] = value
        return document

    def only(self, document: Mapping[str, Any], keys: Iterable[str]) -> Scene:
        """Return the scene as a stage sees it that has `read` a document by some keys: any other key is not there.

        The document may hold labels in place of the scene's own.
        """
        names = set(keys)
        labels = {name: tuples(document.get(name, getattr(self, name))) for name in Labels.model_fields}
        parts: dict[str, Any] = {}
        for name, part in self.sections.items():
            seen = {key: value for key, value in vars(part).items() if names & {name, f"{name}.{key}"}}
            if seen:
                parts[name] = type(part).model_construct()
                vars(parts[name]).clear()
                vars(parts[name]).update(seen)
        return type(self).model_construct(**labels, **parts)

    @property
    def friction(self) -> float:
        """Coefficient of friction of yarns in contact: infinite where they do not slip."""
        friction = self.kind.interaction.friction
        return math.inf if friction is None else friction(self.sections["contact"])

    @property
    def tex(self) -> Floats | float:
        """Linear density [g/km] of the yarn, from yarn.of or yarn.tex; nan if neither gives it; see `radius`."""
        return self.tex_of("yarn")

    def tex_of(self, section: str) -> float:
        """Return the linear density [g/km] of the yarn of a section; nan where it is not known."""
        return self._defaults.get(section, {}).get("tex") or math.nan

    @property
    def radius(self) -> Floats | float:
        """Radius of its yarn [m]; one for every row where there are several yarns."""
        return self.yarn.radius

    @property
    def is_knit(self) -> bool:
        """Whether it is a knit that ends: rows of loops, or cells cut out of one."""
        return self.specimen in ("knit", "cut_knit")

    @property
    def of_geometry(self) -> tuple[str, ...]:
        """Sections and dotted keys that the geometry depends on, beside the specimen."""
        return self.kind.specimen.geometry

    @cached_property
    def geometry_inputs(self) -> dict[str, Any]:
        """All that the geometry depends on, by dotted key."""
        return {"specimen": self.specimen} | flat(self.read(self.of_geometry))

    @cached_property
    def geometry_key(self) -> str:
        """Hash of all that the geometry depends on."""
        return digest(self.geometry_inputs)

    @cached_property
    def hash(self) -> str:
        """Hash of everything that determines the result: all keys but the labels."""
        kinds = [name for name in Labels.model_fields if name not in LABELS]
        return digest(self.read([*kinds, *self.sections]))


# Keys by their dotted names


def _set_dotted(document: dict[str, Any], key: str, value: Any, where: str) -> None:
    """Set a nested key by its dotted name, in place; ConfigurationError when there is no such key."""
    section, dot, field = key.partition(".")
    sections = all_sections()
    if (dot and section not in sections) or "." in field:
        raise ConfigurationError(f"{where}: {unknown_key(key)}")
    if dot:
        document.setdefault(section, {})[field] = value
    elif key in sections:
        known = f"a group of keys; set one of them, such as {key}.{next(iter(sections[key]))}"
        raise ConfigurationError(f"{where}: {key} is {value!r} but must be {known}")
    else:
        document[key] = value


def flat(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of nested mappings by dotted key."""
    keys: dict[str, Any] = {}
    for key, value in document.items():
        parts = {f"{key}.{part}": inner for part, inner in value.items()} if isinstance(value, dict) else {}
        keys |= parts if isinstance(value, dict) else {key: value}
    return keys


def _labels(cls: type[Part]) -> dict[str, Any]:
    """Return the labels that a class of scenes implies: its model, its first specimen, ties where yarns may be tied."""
    model = next((model for model in MODELS.all().values() if cls in model.parts), None)
    if model is None:
        known = ", ".join(part.__name__ for model in MODELS.all().values() for part in model.parts)
        raise ConfigurationError(f"{cls.__name__} is not a class of scenes of a model; take one of {known}")
    interaction = "isotropic" if cls.touches else "tie"
    return {
        "name": NAMELESS,
        "fidelity": model.name,
        "specimen": cls.specimens[0],
        "interaction": interaction,
    }


def _scene_of(
    keys: Mapping[str, Any],  # by dotted name, with alternative keys
    defaults: Mapping[str, Any],  # by section, for any kind of scene
    where: str,
    before: Scene | None = None,
) -> Scene:
    """Return the scene of keys over those of its yarns, over the scene before, over defaults.

    Every scene is made here; `_again` alone takes one that is complete to another process.
    Alternative keys become keys of scenes, the labels give the kind, and what this kind would silently leave out is
    refused, before sections are checked.
    """
    own, of_yarns = in_base_keys(keys, where)
    if of_yarns:
        defaults = nested(flat(defaults) | of_yarns, where)
    labels, kind = _labels_and_kind(own, defaults, where, before)
    if before is None:
        known = flat(defaults)
    else:
        known = before._own_values()
        implied = _implied_before(kind, own, known)
        own = {key: value for key, value in own.items() if key not in implied}
        known |= implied
    _require_kind(kind, own, of_yarns, known, where)
    if before is not None and MODULUS not in own:
        _require_all_of_yarn(kind, _stiffnesses(known), where)
    given = nested({key: value for key, value in of_yarns.items() if kind.has(key)} | own, where)
    return _checked(kind, labels, given, defaults, where, before.sections if before else NOTHING)


def _implied_before(kind: Kind, own: Mapping[str, Any], before: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys that the kind before had, and whose values this kind knows without them."""
    implied = {**FREE_OF_STRESS, **kind.part.implied}
    return {
        key: value for key, value in own.items() if key in before and key in implied and not kind.has(key)
    }


def _stiffnesses(known: Mapping[str, Any]) -> list[str]:
    """Return the keys of the stiffnesses of its own that a yarn has."""
    return [key for name in OF_BEAMS if known.get(key := f"yarn.{name}") is not None]


def _labels_and_kind(
    own: Mapping[str, Any], defaults: Mapping[str, Any], where: str, before: Scene | None
) -> tuple[Labels, Kind]:
    """Return labels by keys, by the scene before or by defaults; of its outputs those that the kind can have."""
    given = {name: own[name] for name in Labels.model_fields if name in own}
    if before is None:
        below = {name: defaults[name] for name in Labels.model_fields if name in defaults}
    else:
        below = {name: getattr(before, name) for name in Labels.model_fields} | {"outputs": ()}
    labels = labels_of(below | given, where)
    kind = Kind.of(labels, where)
    if before is not None and "outputs" not in given:
        outputs = tuple(name for name in before.outputs if name in kind.outputs)
        labels = labels.model_copy(update={"outputs": outputs})
    return labels, kind


def _again(document: Mapping[str, Any], defaults: Mapping[str, Any]) -> Scene:
    """Return a scene of all its keys in another process, where its defaults may be those of another kind."""
    where = f"scene {document['name']!r}"
    labels = labels_of(document, where)
    return _checked(Kind.of(labels, where), labels, document, defaults, where)


def _checked(
    kind: Kind,
    labels: Labels,
    given: Mapping[str, Any],  # explicitly set keys by section
    defaults: Mapping[str, Any],  # the same, of any kind of scene
    where: str,
    before: Mapping[str, Section] = NOTHING,  # sections of the scene that this one is made of
) -> Scene:
    """Return a scene of given keys, of keys of the scene before, and of defaults; only changed sections are checked.

    A ConfigurationError names the first key that is wrong, or the first contradiction between sections.
    """
    fields: dict[str, Any] = dict(labels)
    for name, keys_of in kind.sections.items():
        inside = given.get(name, {})
        stays = before.get(name)
        if type(stays) is keys_of and not inside:
            fields[name] = stays
            continue
        below = defaults.get(name, {}) | (vars(stays) if stays else {})
        known = {key: value for key, value in below.items() if key in keys_of.model_fields}
        fields[name] = validated(keys_of, known | inside, where, f"{name}.")
    try:
        made = kind.scene.model_validate(fields)
    except ValidationError as errors:
        raise ConfigurationError(f"{where}: {errors.errors()[0]['ctx']['error']}") from None
    assert isinstance(made, Scene)
    made._defaults = defaults
    return made


def _default_of(described: type[Section], key: str) -> Any:
    """Return the default in the field of a key; a key without one equals nothing that this returns."""
    return lists(described.model_fields[key].default)


def _require_kind(
    kind: Kind, keys: Iterable[str], yarn: Mapping[str, float], before: Mapping[str, Any], where: str
) -> None:
    """Refuse keys that a kind does not have, and a yarn or values from before that it would leave out."""
    given = {**before, ROWS: None, **dict.fromkeys((*keys, *yarn), "")}
    second = [key for key, value in given.items() if key.startswith(f"{SECOND}.") and value is not None]
    if second and not kind.has(ROWS):
        of = f"specimen is {kind.specimen.name} and fidelity {kind.fidelity.name}"
        can = "cells of beams that slide have two yarns: specimen cell, fidelity beam, interaction friction"
        raise ConfigurationError(f"{where}: {second[0]} is given where {of}: {can}")
    _require_all_of_yarn(kind, yarn, where)
    _require_same_problem(kind, before, where)
    for key in keys:
        if not kind.has(key):
            raise ConfigurationError(f"{where}: {not_of_kind(kind, key)}")


def _require_same_problem(kind: Kind, before: Mapping[str, Any], where: str) -> None:
    """Refuse a yarn or a load that a kind does not model, where it would be left out; isotropic laws are alike."""
    for key, value in {**FREE_OF_STRESS, **kind.part.implied}.items():
        given = value if kind.has(key) else before.get(key, value)
        alike = given == value or (key == "yarn.material" and not MATERIALS.find(given).directional)
        if key.startswith(("yarn.", "load.")) and not alike:
            of = f"only this is supported by fidelity {kind.fidelity.name} and specimen {kind.specimen.name}"
            raise ConfigurationError(f"{where}: {key} is {given!r} but must be {value!r}: {of}")


def _require_all_of_yarn(kind: Kind, given: Iterable[str], where: str) -> None:
    """Refuse a yarn with values that models of a scene's kind would silently leave out."""
    if lost := [key for key in given if key.startswith("yarn.") and key != "yarn.tex" and not kind.has(key)]:
        remedy = "take fidelity beam, or say yarn.diameter and yarn.youngs_modulus"
        of = f"which scenes of fidelity {kind.fidelity.name} do not have"
        raise ConfigurationError(f"{where}: the yarn has {', '.join(lost)}, {of}; {remedy}")


def nested(keys: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return nested keys from dotted ones; ConfigurationError where one does not exist."""
    document: dict[str, Any] = {}
    for key, value in keys.items():
        _set_dotted(document, key, value, where)
    return document


def digest(document: Any) -> str:
    """Return a short hash of plain data; numbers enter with all their digits."""
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:16]


def rounded(document: Any, digits: int) -> Any:
    """Return plain data with all numbers rounded to a number of significant digits."""
    text = json.dumps(document)
    return json.loads(text, parse_float=lambda number: float(f"{float(number):.{digits}g}") + 0.0)


def unit_warnings(scene: Scene) -> list[str]:
    """Return a warning for every value that is unusual for yarns, and may be meant in another unit."""
    warnings = []
    for name, (least, largest, unit, other) in USUAL.items():
        if not least <= (value := scene.value(name) or least) <= largest:
            usual = f"yarns have {least:g} to {largest:g} {unit}"
            warnings.append(f"{name} is {value:g} {unit}; {usual}: is it meant in {other}?")
    for name in ("pattern.course_spacing", "pattern.wale_spacing", "pattern.loop_length"):
        if (radii := (value := scene.value(name) or 0.0) / scene.yarn.radius) > LONG:
            warnings.append(f"{name} is {value:g} m, {radii:.0f} radii of the yarn: is it meant in mm?")
    return warnings
