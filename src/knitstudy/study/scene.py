"""The scene: one validated, frozen description of one simulation.

It is the only thing that a stage is parametrised by. A scene that exists is valid: constructing one with a value that
is not allowed raises ConfigurationError. It has the sections of its kind and no others: its specimen's, its yarn's, and
those that its fidelity asks for with its interaction. All quantities are SI; the description of a key names its unit.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from types import MappingProxyType
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.registry import unknown_choice
from knitstudy.study.keys import Section, describe, validated
from knitstudy.study.kinds import FIDELITIES, INTERACTIONS, SPECIMENS, Fidelity, Interaction, Specimen
from knitstudy.study.scene_checks import check_keys_together
from knitstudy.study.sections.labels import Labels
from knitstudy.study.sections.yarn import Yarn

LABELS = ("name", "knit", "outputs")
"""Keys that no number depends on."""


@dataclass(frozen=True)
class Kind:
    """What kind of scene one is, and the sections that it has for that."""

    specimen: Specimen
    interaction: Interaction
    fidelity: Fidelity

    @classmethod
    def of(cls, document: Mapping, where: str) -> Kind:
        """Return the kind that a document says.

        Raises
        ------
        ConfigurationError
            Where there is no such kind, or the fidelity does not model that specimen or interaction.
        """
        labels = {name: document[name] for name in Labels.model_fields if name in document}
        labels = validated(Labels, labels, where)
        specimen = SPECIMENS.find(labels.specimen, where)
        interaction = INTERACTIONS.find(labels.interaction, where)
        fidelity = FIDELITIES.find(labels.fidelity, where)
        if specimen.name not in fidelity.specimens:
            others = [n for n in FIDELITIES.names() if specimen.name in FIDELITIES.find(n, where).specimens]
            raise ConfigurationError(
                f"{where}: fidelity is {fidelity.name!r} but must be {' or '.join(others)} where specimen is"
                f" {specimen.name}"
            )
        if not (interaction.touches or fidelity.tied):
            others = [n for n in INTERACTIONS.names() if INTERACTIONS.find(n, where).touches]
            raise ConfigurationError(
                f"{where}: interaction is {interaction.name!r} but must be {' or '.join(others)} where fidelity is"
                f" {fidelity.name}: tied beams are the model of fidelity rom3d"
            )
        kind = cls(specimen, interaction, fidelity)
        if any(name not in kind.outputs for name in labels.outputs):
            allowed = f"a list out of [{', '.join(kind.outputs)}]" if kind.outputs else "[]"
            of = (
                f"fidelity is {fidelity.name}" if specimen.outputs is None else f"specimen is {specimen.name}"
            )
            raise ConfigurationError(
                f"{where}: outputs is {list(labels.outputs)} but must be {allowed} where {of}"
            )
        return kind

    @property
    def stage(self) -> str:
        """Stage that simulates it."""
        return self.specimen.stage or self.fidelity.stage

    @property
    def outputs(self) -> tuple[str, ...]:
        """What a scene may ask to be written besides."""
        return self.fidelity.outputs if self.specimen.outputs is None else self.specimen.outputs

    @cached_property
    def sections(self) -> Mapping[str, type[Section]]:
        """Sections by their names."""
        return {**self.specimen.sections, "yarn": Yarn, **self.fidelity.sections(self.interaction)}


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
        self,
        labels: Labels,
        kind: Kind,
        sections: Mapping[str, Section],
        defaults: Mapping = MappingProxyType({}),
    ) -> None:
        values = {name: getattr(labels, name) for name in Labels.model_fields}
        self.__dict__.update(values, kind=kind, sections=dict(sections), _defaults=defaults)

    @classmethod
    def from_dict(
        cls, document: Mapping, where: str = "scene", defaults: Mapping = MappingProxyType({})
    ) -> Scene:
        """Build a scene from a nested mapping of its keys.

        Parameters
        ----------
        document : mapping
            Keys that the scene must have by its kind.
        where : str
            File or scene that they come from; begins the message.
        defaults : mapping
            Values of keys that are not in the document, for scenes of any kind: what its kind has no key for is left
            out. The scene remembers them, so that `replace` can make it one of another kind.

        Raises
        ------
        ConfigurationError
            When a key is unknown, missing, of another kind of scene or has a value that is not allowed.
        """
        document = {name: defaults[name] for name in Labels.model_fields if name in defaults} | dict(document)
        kind = Kind.of(document, where)
        names = {name: document[name] for name in Labels.model_fields if name in document}
        for name, inside in document.items():
            if name not in kind.sections and name not in Labels.model_fields:
                first = [f"{name}.{inner}" for inner in inside] if isinstance(inside, Mapping) else []
                raise ConfigurationError(f"{where}: {not_of_kind(kind, (first or [str(name)])[0])}")
        sections = {}
        for name, section in kind.sections.items():
            required = any(field.is_required() for field in section.model_fields.values())
            if required and name not in document and name not in defaults:
                raise ConfigurationError(f"{where}: the key {name!r} is missing")
            own, below = document.get(name, {}), defaults.get(name, {})
            for inner in own if isinstance(own, Mapping) else ():
                if inner not in section.model_fields and inner in (known_keys(name) or {}):
                    raise ConfigurationError(f"{where}: {not_of_kind(kind, f'{name}.{inner}')}")
            if isinstance(own, Mapping):
                own = {key: below[key] for key in section.model_fields if key in below} | dict(own)
            sections[name] = validated(section, own, where, f"{name}.")
        scene = cls(validated(Labels, names, where), kind, sections, defaults)
        check_keys_together(scene, where)
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
        labels = {name: _plain(getattr(self, name)) for name in Labels.model_fields}
        return labels | {name: section.model_dump(mode="json") for name, section in self.sections.items()}

    def value(self, key: str) -> Any:
        """Return the value of a dotted key or a section; None where a scene of this kind has none."""
        found: Any = self
        for part in key.split("."):
            found = getattr(found, part, None)
        return found

    def read(self, keys: Iterable[str]) -> dict:
        """Return what sections and dotted keys say, as plain nested mappings: what a result depends on.

        Keys that were added with a default (see `study.keys.key`) are left out at that default, so that adding one
        changes nothing; sections that the scene does not have are left out as well.
        """
        document = self.to_dict()
        found: dict = {}
        for name in keys:
            section, _, inner = name.partition(".")
            if section in self.sections:
                fields = type(self.sections[section]).model_fields
                for field in [inner] if inner else fields:
                    value = document[section].get(field)
                    added = field in fields and not fields[field].is_required()
                    if field in fields and not (added and value == _plain(fields[field].default)):
                        found.setdefault(section, {})[field] = value
            elif section in Labels.model_fields:
                found[section] = document[section]
        return found

    def only(self, document: Mapping, keys: Iterable[str]) -> Scene:
        """Return the scene as a stage sees it that has `read` a document by some keys; see `seen`."""
        labels = {name: _plain(getattr(self, name)) for name in Labels.model_fields}
        return Scene.seen(labels | dict(document), keys)

    @classmethod
    def seen(cls, document: Mapping, keys: Iterable[str]) -> Scene:
        """Return a scene of some of its keys, not checked again: any other is an AttributeError there.

        Parameters
        ----------
        document : mapping
            What `read` returns, with all labels.
        keys : iterable of str
            What was read: keys that are not in the document for that are at their defaults.
        """
        kind, keys = Kind.of(document, "scene"), set(keys)
        labels = validated(Labels, {name: document[name] for name in Labels.model_fields}, "scene")
        sections = {}
        for name, section in kind.sections.items():
            wanted = {field for field in section.model_fields if keys & {name, f"{name}.{field}"}}
            if wanted:
                values = {key: _tuples(value) for key, value in document.get(name, {}).items()}
                sections[name] = section.model_construct(**values)
                for field in section.model_fields.keys() - wanted:
                    sections[name].__dict__.pop(field, None)  # the default of what was not read
        return cls(labels, kind, sections)

    def replace(self, key: str, value: Any) -> Scene:
        """Return a scene with one key changed, for example ``scene.replace("solver.increments", 4)``."""
        return self.vary({key: value})

    def vary(self, changes: Mapping[str, Any]) -> Scene:
        """Return a scene with some keys changed, checked once all of them are.

        A scene that becomes one of another kind loses the keys and outputs that this has no use for, and takes what it
        asks for besides from the defaults.

        Parameters
        ----------
        changes : mapping of str to value
            Values by dotted key, for example ``{"load.strain": 0.01, "mesh.size": 0.45e-3}``; SI units.

        Raises
        ------
        ConfigurationError
            When a key is unknown or a value is not allowed.
        """
        where, own = f"scene {self.name!r}", {}
        for key, value in changes.items():
            set_dotted(own, key, value, where)
        document = self.to_dict()
        labels = {name: own[name] for name in own if name in Labels.model_fields}
        kind = Kind.of(document | {"outputs": []} | labels, where)
        document["outputs"] = [name for name in self.outputs if name in kind.outputs]
        stays = {
            name: {key: value for key, value in inside.items() if key in kind.sections[name].model_fields}
            if isinstance(inside, dict)
            else inside
            for name, inside in document.items()
            if name in kind.sections or name in Labels.model_fields
        }
        for name, inside in own.items():
            stays[name] = stays.get(name, {}) | inside if isinstance(inside, dict) else inside
        return Scene.from_dict(stays, where, self._defaults)

    def scaled(self, length: float = 1.0, stiffness: float = 1.0) -> Scene:
        """Return the same scene in other units: lengths times `length`, moduli times `stiffness`.

        The density is left alone: no result of a quasi-static scene depends on it.
        """
        factors = {"m": length, "Pa": stiffness, "N/m": stiffness * length}
        document = self.to_dict()
        for name, section in self.sections.items():
            for field in type(section).model_fields:
                factor = factors.get(describe(type(section), field).unit)
                if factor is not None:
                    document[name][field] = _times(document[name][field], factor)
        return Scene.from_dict(document, f"scene {self.name!r}")

    @property
    def geometry_inputs(self) -> dict[str, Any]:
        """All that the geometry depends on, by dotted key."""
        document = self.read(self.kind.specimen.geometry)
        keys = {
            f"{name}.{field}": value for name, inside in document.items() for field, value in inside.items()
        }
        return {"specimen": self.specimen} | keys

    @property
    def geometry_key(self) -> str:
        """Hash of all that the geometry depends on."""
        return digest(self.geometry_inputs)

    @property
    def hash(self) -> str:
        """Hash of everything that determines the result: all keys but the labels."""
        kinds = [name for name in Labels.model_fields if name not in LABELS]
        return digest(self.read([*kinds, *self.sections]))


def set_dotted(document: dict, key: str, value: Any, where: str) -> None:
    """Set a nested key by its dotted name, in place; ConfigurationError when there is no such key."""
    section, dot, field = key.partition(".")
    if (dot and known_keys(section) is None) or "." in field:
        allowed = sorted(all_sections())
        raise ConfigurationError(f"{where}: {unknown_choice('unknown key', key, section, allowed)}")
    if not dot:
        document[key] = value
        return
    inside = document.setdefault(section, {})
    if not isinstance(inside, dict):
        raise ConfigurationError(f"{where}: {section} is {inside!r} but must be a group of keys")
    inside[field] = value


def all_kinds() -> list[Kind]:
    """Return every kind of scene that there may be."""
    return [
        Kind(SPECIMENS.find(specimen), interaction, fidelity)
        for fidelity in FIDELITIES.all().values()
        for interaction in INTERACTIONS.all().values()
        if interaction.touches or fidelity.tied
        for specimen in fidelity.specimens
    ]


def all_sections() -> dict[str, dict[str, type[Section]]]:
    """Return the keys of every section of any kind of scene, each with the class that describes it."""
    return _sections_of(SPECIMENS.names(), INTERACTIONS.names(), FIDELITIES.names())


@cache
def _sections_of(*names: tuple[str, ...]) -> dict[str, dict[str, type[Section]]]:
    """Return `all_sections`, formed once for all that is registered under these names."""
    found: dict[str, dict[str, type[Section]]] = {}
    for kind in all_kinds():
        for section, described in kind.sections.items():
            keys = found.setdefault(section, {})
            for field in described.model_fields:
                keys.setdefault(field, described)
    return found


def known_keys(section: str) -> dict[str, type[Section]] | None:
    """Return the keys of a section of any kind of scene; None if there is no such section."""
    return all_sections().get(section)


def not_of_kind(kind: Kind, key: str) -> str:
    """Return the message for a key that a scene does not have: unknown, or of another kind."""
    section, _, field = key.partition(".")
    known = all_sections()
    if section not in known:
        allowed = sorted({*known, *Labels.model_fields})
        return unknown_choice("unknown key", key, section, allowed)
    if field and field not in known[section]:
        return unknown_choice("unknown key", key, field, sorted(known[section]))
    return (
        f"{key} is no key of a scene whose specimen is {kind.specimen.name}, fidelity {kind.fidelity.name} and"
        f" interaction {kind.interaction.name}; leave it out"
    )


def _plain(value: Any) -> Any:
    return [_plain(each) for each in value] if isinstance(value, tuple) else value


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def _times(value: Any, factor: float) -> Any:
    """Return a number or a nested list of numbers times a factor."""
    return [_times(item, factor) for item in value] if isinstance(value, list) else value * factor


def digest(document: Any) -> str:
    """Return a short hash of plain data; numbers enter with all their digits."""
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:16]
