"""The scene: one validated, frozen description of one simulation.

A scene is the only thing that a stage is parametrised by. A scene that exists is valid: a value that is not allowed
raises ConfigurationError. A scene has the sections of its kind and no others: its specimen's, its yarn's, and those
that its fidelity asks for with its interaction. All quantities are SI; the description of a key names its unit.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.alternatives import in_base_keys, without_yarn
from knitstudy.knit.scene.keys import Section, describe, lists, tuples, validated
from knitstudy.knit.scene.kinds import Kind, Labels, all_sections, labels_of, not_of_kind, unknown_key
from knitstudy.knit.scene.stitches import is_plain, size_of_repeat
from knitstudy.knit.scene.yarns import OF, STIFFNESSES
from knitstudy.mechanics.materials import MATERIALS

SOLID = ("hexahedra", "spline_yarns")  # Fidelities whose material may have an axis

LABELS = tuple(name for name in Labels.model_fields if describe(Labels, name).role == "output")
"""Labels that no number depends on: name, knit and outputs."""

USUAL = {
    "yarn.youngs_modulus": (1e6, 1e12, "Pa", "MPa"),
    "yarn.diameter": (1e-6, 0.02, "m", "mm"),
    "pattern.loop_length": (1e-4, 1.0, "m", "mm"),
}
"""Least and largest values of yarns, their unit, and the unit in which a value outside of these may be meant."""

NOTHING: Mapping = MappingProxyType({})


class Scene:
    """One simulation; `to_dict` and `from_dict` translate to and from plain nested mappings.

    Attributes
    ----------
    name, knit, specimen, fidelity, interaction : str
    outputs : tuple of str
    kind : Kind
    sections : mapping of str to Section
        Each is an attribute as well, ``scene.mesh.size``; one that the scene does not have raises AttributeError.
    """

    def __init__(
        self, labels: Labels, kind: Kind, sections: Mapping[str, Section], defaults: Mapping = NOTHING
    ) -> None:
        values = {name: getattr(labels, name) for name in Labels.model_fields}
        self.__dict__.update(values, kind=kind, sections=dict(sections), _defaults=defaults)

    def __reduce__(self) -> tuple:
        """Scenes go to other processes as their keys."""
        return Scene.from_dict, (self.to_dict(), f"scene {self.name!r}", dict(self._defaults))

    @classmethod
    def from_dict(cls, document: Mapping, where: str = "scene", defaults: Mapping = NOTHING) -> Scene:
        """Build a scene from a nested mapping of its keys; `where` they come from begins the message of an error.

        `defaults` are values of keys that are not in the document, for scenes of any kind: keys that the scene's kind
        does not have are left out. The scene remembers them, so that `vary` can make it one of another kind.
        Raises ConfigurationError when a key is unknown, missing, of another kind or has a value that is not allowed.
        """
        empty = [name for name, inside in document.items() if inside == {}]
        keys, yarn = without_yarn(flat(document), where)
        document = nested(keys := in_base_keys(keys, where), where)
        if yarn:
            defaults = nested(flat(defaults) | yarn, where)
        document = {name: defaults[name] for name in Labels.model_fields if name in defaults} | document
        labels = labels_of(document, where)
        kind = Kind.of(labels, where)
        _require_all_of_yarn(kind, yarn, where)
        for key in (*keys, *empty):
            if not kind.has(key):
                raise ConfigurationError(f"{where}: {not_of_kind(kind, key)}")
        sections = {}
        required = nested(kind.specimen.requires, where)  # over defaults: no scene need say them
        for name, section in kind.sections.items():
            own, below = document.get(name, {}), {**defaults.get(name, {}), **required.get(name, {})}
            if isinstance(own, Mapping):
                own = {key: below[key] for key in section.model_fields if key in below} | dict(own)
            sections[name] = validated(section, own, where, f"{name}.")
        scene = cls(labels, kind, sections, defaults)
        for message in _contradictions(scene):
            raise ConfigurationError(f"{where}: {message}")
        return scene

    def __getattr__(self, name: str) -> Section:
        sections = self.__dict__.get("sections", {})
        if name in sections:
            return sections[name]
        raise AttributeError(f"the scene has no section {name!r}, only {', '.join(sections)}")

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a scene cannot be changed ({name}); `Scene.replace` returns another one")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(json.dumps(self.to_dict(), sort_keys=True))

    def __repr__(self) -> str:
        return f"Scene({self.name!r}: {self.fidelity}, {self.specimen}, {self.interaction})"

    def to_dict(self) -> dict:
        """Return the scene as nested mappings of numbers, text and lists."""
        return {name: dict(part) if isinstance(part, dict) else part for name, part in self._document.items()}

    @cached_property
    def _document(self) -> dict:
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

    def values_of(self, *roles: str) -> dict[str, Any]:
        """Return the values of all keys of some roles, by dotted key, but for the labels."""
        return {
            f"{name}.{field}": getattr(section, field)
            for name, section in self.sections.items()
            for field in type(section).model_fields
            if describe(type(section), field).role in roles
        }

    def read(self, keys: Iterable[str]) -> dict:
        """Return sections and dotted keys as plain nested mappings: the inputs of a result.

        Keys that have a default in their field (see `knit.scene.keys.key`) are left out at that default, so that adding
        one changes nothing; sections that the scene does not have are left out as well.
        """
        document = self._document
        read: dict = {}
        for name in keys:
            section, _, inner = name.partition(".")
            if section in Labels.model_fields:
                read[section] = document[section]
            elif section in self.sections:
                fields = type(self.sections[section]).model_fields
                for key in (inner,) if inner else fields:
                    value = document[section].get(key)
                    if key in fields and (fields[key].is_required() or value != lists(fields[key].default)):
                        read.setdefault(section, {})[key] = value
        return read

    def only(self, document: Mapping, keys: Iterable[str]) -> Scene:
        """Return the scene as a stage sees it that has `read` a document by some keys; see `seen`."""
        labels = {name: value for name, value in self.to_dict().items() if name in Labels.model_fields}
        return Scene.seen(labels | dict(document), keys)

    @classmethod
    def seen(cls, document: Mapping, keys: Iterable[str]) -> Scene:
        """Return a scene of some of its keys, not checked again: any other is an AttributeError there.

        `document` is the result of `read` for `keys`, with all labels; keys that are not in it have their defaults.
        """
        labels, keys = labels_of(document, "scene"), set(keys)
        kind = Kind.of(labels, "scene")
        sections = {}
        for name, section in kind.sections.items():
            wanted = {field for field in section.model_fields if keys & {name, f"{name}.{field}"}}
            if wanted:
                values = {key: tuples(value) for key, value in document.get(name, {}).items()}
                sections[name] = section.model_construct(**values)
                for field in section.model_fields.keys() - wanted:
                    sections[name].__dict__.pop(field, None)  # the default of a key that was not read
        return cls(labels, kind, sections)

    def replace(self, key: str, value: Any) -> Scene:
        """Return a scene with one key changed, for example ``scene.replace("solver.increments", 4)``."""
        return self.vary({key: value})

    def vary(self, changes: Mapping[str, Any]) -> Scene:
        """Return a scene with some keys changed, checked once all of them are.

        `changes` are values by dotted key in their units, for example ``{"load.strain": 0.01, "mesh.size": 0.5}``. A
        scene that becomes one of another kind loses the keys and outputs of its former kind, and takes the keys that
        it lacks from the defaults.
        Raises ConfigurationError when a key is unknown or a value is not allowed.
        """
        where, document = f"scene {self.name!r}", self.to_dict()
        changes, yarn = without_yarn(changes, where)
        changes = in_base_keys(changes, where)
        kind = Kind.of(labels_of(document | {"outputs": []} | dict(changes), where), where)
        _require_all_of_yarn(kind, yarn, where)
        changes = {key: value for key, value in yarn.items() if kind.has(key)} | changes
        document["outputs"] = [name for name in self.outputs if name in kind.outputs]
        stays: dict = {}
        for key, value in (flat(document) | dict(changes)).items():
            if key in changes or (kind.has(key) and key not in kind.specimen.requires):
                set_dotted(stays, key, value, where)
        return Scene.from_dict(stays, where, self._defaults)

    def scaled(self, length: float = 1.0, stiffness: float = 1.0) -> Scene:
        """Return the same scene in other units: lengths times `length`, moduli times `stiffness`."""
        factors = {"m": length, "Pa": stiffness, "N/m": stiffness * length}
        factors |= {"N": stiffness * length**2, "N m2": stiffness * length**4}
        document = self.to_dict()
        for name, section in self.sections.items():
            for field in type(section).model_fields:
                factor = factors.get(describe(type(section), field).unit)
                if factor is not None and document[name][field] is not None:
                    document[name][field] = (np.array(document[name][field]) * factor).tolist()
        return Scene.from_dict(document, f"scene {self.name!r}")

    @property
    def is_knit(self) -> bool:
        """Whether it is a knit that ends: rows of loops, or cells cut out of one."""
        return self.specimen in ("knit", "cut_knit")

    @cached_property
    def geometry_inputs(self) -> dict[str, Any]:
        """All that the geometry depends on, by dotted key."""
        return {"specimen": self.specimen} | flat(self.read(self.kind.specimen.geometry))

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


def set_dotted(document: dict, key: str, value: Any, where: str) -> None:
    """Set a nested key by its dotted name, in place; ConfigurationError when there is no such key."""
    section, dot, field = key.partition(".")
    sections = all_sections()
    if (dot and section not in sections) or "." in field:
        raise ConfigurationError(f"{where}: {unknown_key(key)}")
    if dot:
        document.setdefault(section, {})[field] = value
    elif key in sections:
        raise ConfigurationError(f"{where}: {key} is {value!r} but must be a group of keys")
    else:
        document[key] = value


def flat(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of nested mappings by dotted key."""
    keys: dict[str, Any] = {}
    for key, value in document.items():
        parts = {f"{key}.{part}": inner for part, inner in value.items()} if isinstance(value, dict) else {}
        keys |= parts if isinstance(value, dict) else {key: value}
    return keys


def _require_all_of_yarn(kind: Kind, given: Mapping[str, float], where: str) -> None:
    """Refuse a yarn with values that models of a scene's kind would silently leave out."""
    if lost := [key for key in given if key.startswith("yarn.") and not kind.has(key)]:
        remedy = "take fidelity beam, or say yarn.diameter and yarn.youngs_modulus"
        of = f"which scenes of fidelity {kind.fidelity.name} do not have"
        raise ConfigurationError(f"{where}: {OF} gives {', '.join(lost)}, {of}; {remedy}")


def nested(keys: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return nested keys from dotted ones; ConfigurationError where one does not exist."""
    document: dict[str, Any] = {}
    for key, value in keys.items():
        set_dotted(document, key, value, where)
    return document


def digest(document: Any) -> str:
    """Return a short hash of plain data; numbers enter with all their digits."""
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:16]


# Checks between sections; sections check themselves


def questions(scene: Scene) -> list[str]:
    """Return a question for every value that is unusual for yarns, and may be meant in another unit."""
    asked = []
    for name, (least, largest, unit, other) in USUAL.items():
        if not least <= (value := scene.value(name) or least) <= largest:
            usual = f"yarns have {least:g} to {largest:g} {unit}"
            asked.append(f"{name} is {value:g} {unit}; {usual}: is it meant in {other}?")
    return asked


def _contradictions(scene: Scene) -> Iterator[str]:
    """Yield the contradictions between keys of different sections."""
    specimen, fidelity = scene.kind.specimen, scene.fidelity
    for name, value in specimen.requires.items():
        if scene.value(name) not in (None, value):
            of = f"where specimen is {specimen.name}, {specimen.meaning}"
            yield f"{name} is {scene.value(name)!r} but must be {value} {of}"
    if fidelity not in SOLID and MATERIALS.find(scene.yarn.material).directional:
        of = f"where fidelity is {fidelity}; fidelities {' and '.join(SOLID)} know the axis of a yarn"
        yield f"yarn.material is {scene.yarn.material} but must be isotropic {of}"
    if "pattern" in scene.sections:
        yield from _of_knit(scene)
    if "pair" in scene.sections and scene.pair.length <= 2 * scene.yarn.diameter:
        least = f"twice yarn.diameter, {scene.yarn.diameter:g} m"
        yield f"pair.length is {scene.pair.length:g} m but must exceed {least}"
    if scene.is_knit and scene.value("contact.tied_edges") == "outer":
        name = "rows" if scene.load.direction == "course" else "loops"
        count = getattr(scene.pattern, name)
        if count < 3:
            of = f"where pattern.{name} is {count}: nothing is left that is not tied"
            yield f"contact.tied_edges is 'outer' but must be none {of}"
    if scene.value("geometry.diameter_share") not in (None, 1) and scene.value("load.start") in (
        None,
        "drawn",
    ):
        of = "where load.start is not rest: only there do yarns press each other before the load"
        yield f"geometry.diameter_share is {scene.geometry.diameter_share:g} but must be 1 {of}"
    own = [key for key in STIFFNESSES if scene.value(key) is not None]
    if own and scene.value("mesh.section_law") == "curved":
        of = f"where {own[0]} is given: it is the law of the solid circle that this replaces"
        yield f"mesh.section_law is 'curved' but must be straight {of}"
    if specimen.name == "cell":
        yield from _of_cell(scene)
    elif scene.value("yarn.set") not in (None, 1):
        yield f"yarn.set is {scene.yarn.set:g} but must be 1 where specimen is {specimen.name}, which starts as drawn"


def _of_knit(scene: Scene) -> Iterator[str]:
    """Yield why a knit has no room for its yarns, or not an entry for every control point."""
    pattern, diameter = scene.pattern, scene.yarn.diameter
    for name in ("course_spacing", "wale_spacing"):
        if getattr(pattern, name) <= diameter:
            spacing = f"{getattr(pattern, name):g} m"
            yield f"pattern.{name} is {spacing} but must exceed yarn.diameter, {diameter:g} m"
    least = diameter / pattern.course_spacing
    if pattern.course_ratio <= least:
        least = f"yarn.diameter / pattern.course_spacing, {least:.4g}"
        yield f"pattern.course_ratio is {pattern.course_ratio:g} but must exceed {least}"
    for name, repeat in zip(("loops", "rows"), size_of_repeat(pattern.stitches), strict=True):
        if (count := getattr(pattern, name)) % repeat:
            of = f"the {name} of a repeat of pattern.stitches {list(pattern.stitches)}"
            yield f"pattern.{name} is {count} but must be a multiple of {repeat}, {of}"
    mixed = len(set("".join(pattern.stitches))) > 1
    if not is_plain(pattern.stitches) and (scene.specimen, scene.fidelity) != ("cell", "beam"):
        of = f"where pattern.stitches is {list(pattern.stitches)}: such loops find their shape at rest"
        yield f"specimen is {scene.specimen} and fidelity {scene.fidelity} but must be cell and beam {of}"
    if mixed and scene.fidelity == "rom2d":
        of = f"where pattern.stitches is {list(pattern.stitches)}: a honeycomb is that of a plain knit"
        yield f"fidelity is rom2d but must be another {of}"
    if pattern.control_points is None:
        for name, value in (("course_ratio", 1.0), ("keep", "shape")):
            if getattr(pattern, name) != value:
                of = "where pattern.control_points is null: the loop is drawn for the spacings"
                yield f"pattern.{name} is {getattr(pattern, name)!r} but must be {value!r} {of}"
        return
    if mixed:
        of = f"where pattern.stitches is {list(pattern.stitches)}: loops that differ are drawn for the spacings"
        yield f"pattern.control_points has {len(pattern.control_points)} points but must be null {of}"
    if pattern.loop_length is not None:
        of = "where there are pattern.control_points, which have a length"
        yield f"pattern.loop_length is {pattern.loop_length:g} m but must be null {of}"
    points, entries = len(pattern.control_points), len(scene.geometry.free)
    if entries != points:
        wanted = f"{points}, one for each of pattern.control_points"
        yield f"geometry.free has {entries} entries but must have {wanted}"


def _of_cell(scene: Scene) -> Iterator[str]:
    """Yield why a cell is not solved as cells are, or is written without a stiffness at rest."""
    if scene.value("solver.linear") not in (None, "auto", "lu"):
        of = "where specimen is cell, which is solved directly"
        yield f"solver.linear is {scene.solver.linear!r} but must be auto or lu {of}"
    if scene.fidelity != "beam" and scene.load.start != "drawn":
        yield f"load.start is {scene.load.start} but must be drawn where fidelity is {scene.fidelity}"
    if "deck" in scene.outputs and scene.kind.interaction.touches:
        of = f"where specimen is cell and interaction {scene.interaction}"
        why = "before its yarns touch a knit is no shell; use interaction tie"
        yield f"outputs is {list(scene.outputs)} but must be [] {of}: {why}"
