"""Kinds of scenes: a specimen, an interaction of its yarns and a fidelity, by which it is computed.

The kind of a scene says which sections it has: a tied scene has no friction, a knit has no angle. A plugin, which is a
module that the configuration names under ``plugins``, adds a kind to one of the three dictionaries (config/README.md).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.keys import (
    SceneName,
    Section,
    describe,
    lists,
    numerics,
    output,
    physics,
    validated,
)
from knitstudy.knit.scene.sections import (
    CellStrain,
    Geometry,
    KnitTension,
    Pair,
    Path,
    Pattern,
    Yarn,
)
from knitstudy.knit.scene.shared_sections import Sliding
from knitstudy.registry import Registry, find, meanings, near_names

Sections = Mapping[str, type[Section]]


@dataclass(frozen=True)
class Specimen:
    """What is simulated."""

    name: str
    meaning: str
    sections: Sections
    geometry: tuple[str, ...]  # sections and dotted keys that its geometry depends on
    whole: bool = True  # whether all its yarns are whole and end
    outputs: tuple[str, ...] = ()  # outputs that a scene may ask for besides the outputs of its model
    # Dotted keys that have one value alone there, of scenes that have them
    requires: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Interaction:
    """How yarns act on each other."""

    name: str
    meaning: str
    # Coefficient of friction from the section `contact`, inf for rough yarns; None for tied yarns
    friction: Callable[[Any], float] | None
    keys: type[Section] | None = None  # keys of the section ``contact`` besides the keys of the fidelity

    @property
    def touches(self) -> bool:
        """Whether yarns are in contact, except where they stay tied."""
        return self.friction is not None

    def contact(self, base: type[Section]) -> type[Section]:
        """Return the section ``contact`` of a fidelity that asks for the keys of `base`."""
        return base if self.keys is None else _joined(self.keys, base)


@cache
def _joined(keys: type[Section], base: type[Section]) -> type[Section]:
    return type(base.__name__, (keys, base), {"__doc__": base.__doc__})


@dataclass(frozen=True)
class Model:
    """A model of a fabric: its specimens and interactions, keys, name, look in figures and cost."""

    name: str  # value of the key `fidelity`
    meaning: str
    label: str  # in figures and tables
    specimens: tuple[str, ...]  # that it can model
    sections: Sections  # beside the sections of the specimen and of the yarn
    # (scene, fabric, ...) -> Problem; other parameters name the data of other stages
    build: Callable[..., Any]
    touching: Sections = field(default_factory=dict)  # further ones of scenes whose yarns are in contact
    # Further ones of scenes whose yarns are all tied; None if it cannot model such scenes
    tied: Sections | None = field(default_factory=dict)
    slips: tuple[str, ...] = ()  # specimens of it whose yarns have to slip: none that are `ROUGH`
    solid: bool = False  # whether all yarns are solids
    sources: tuple[str, ...] = ()  # dotted keys that name direct simulations which it takes something from
    outputs: tuple[str, ...] = ("vtu",)  # outputs that a scene may ask for besides the history
    look: tuple[str, str, str] = ("#1A1A1A", "-", "o")  # colour, dash and marker of its lines in figures
    # Expected memory, memory of each cell on top [MB], and processor time of a cell in twelve increments [s]; for
    # solids, all three follow from the number of unknowns
    memory: float = 1000
    memory_a_cell: float = 0
    seconds_a_cell: float = 1.0

    def sections_with(self, interaction: Interaction) -> dict[str, type[Section]]:
        """Return the sections of a scene with some interaction."""
        sections = {**self.sections, **(self.touching if interaction.touches else self.tied or {})}
        if "contact" in sections:
            sections["contact"] = interaction.contact(sections["contact"])
        return sections


def _by_name(*kinds: Any) -> dict[str, Any]:
    return {kind.name: kind for kind in kinds}


_KNIT = {"pattern": Pattern, "geometry": Geometry}
_KNIT_GEOMETRY = ("pattern", "geometry", "yarn.diameter")

ROUGH = "rough"

SPECIMENS = _by_name(
    Specimen("knit", "rows of loops", {**_KNIT, "load": KnitTension}, _KNIT_GEOMETRY),
    Specimen("cut_knit", "cells cut out of a knit", {**_KNIT, "load": KnitTension}, _KNIT_GEOMETRY),
    Specimen(
        "cell",
        "a cell of an endless knit",
        {**_KNIT, "load": CellStrain},
        _KNIT_GEOMETRY,
        whole=False,
        outputs=("deck",),
        requires={"contact.tied_edges": "none", "solver.stabilisation": 0},
    ),
    Specimen(
        "pair",
        "two straight yarns that cross",
        {"pair": Pair, "load": Path},
        ("pair.angle", "pair.length", "pair.clearance", "yarn.diameter"),
    ),
)

INTERACTIONS = _by_name(
    Interaction("tie", "no motion where yarns cross", friction=None),
    Interaction(ROUGH, "contact without slip", friction=lambda contact: math.inf),
    Interaction(
        "isotropic",
        "contact with Coulomb friction",
        friction=lambda contact: contact.friction,
        keys=Sliding,
    ),
)

MODELS: Registry[Model] = Registry("fidelity", "knitstudy.knit.models")
"""The models by the value of the key `fidelity`; every one is registered in a file of its own."""


def register(kind: Specimen | Interaction) -> None:
    """Add a specimen or an interaction from outside of the package; ConfigurationError if its name is taken."""
    kinds: dict[str, Any] = {Specimen: SPECIMENS, Interaction: INTERACTIONS}[type(kind)]
    if kind.name in kinds:
        raise ConfigurationError(f"{type(kind).__name__.lower()} {kind.name!r} is registered twice")
    kinds[kind.name] = kind


class Labels(Section):
    """Name and kind of a scene."""

    name: SceneName = output(
        "choice", allowed="a name of at most 200 small letters, digits, - and _, that starts with a letter"
    )
    """Names files."""
    knit: SceneName = output(
        "choice", allowed="a name like that of a scene; scenes with one label share one geometry"
    )
    """Names files."""
    specimen: str = physics("inferred", allowed=lambda: meanings(SPECIMENS))
    """Section 3.1: unit cells; Tables 3 and 5 divide by nine of them, cut out of a knit. Checked: all."""
    fidelity: str = numerics("choice", allowed=lambda: meanings(MODELS.all()))
    """Sections 2.3 to 2.6 of the paper: DNS, 3D ROM, 2D ROM; section 3.3: beams in contact. Checked: all."""
    interaction: str = physics("stated", allowed=lambda: meanings(INTERACTIONS))
    """Section 2.2, Fig. 2 and Table 1: tie constraint, rough contact, isotropic Coulomb friction. Checked: all."""
    outputs: tuple[str, ...] = output("choice", allowed="a list of further files, for example [fields, vtu]")
    """No result depends on them. Checked: all."""


def labels_of(document: Mapping, where: str) -> Labels:
    """Return the labels in a document, which may hold other keys; a ConfigurationError names the wrong label."""
    labels = {name: document[name] for name in Labels.model_fields if name in document}
    return validated(Labels, labels, where)


@dataclass(frozen=True)
class Kind:
    """Kind of a scene, and its sections."""

    specimen: Specimen
    interaction: Interaction
    fidelity: Model

    @classmethod
    def of(cls, labels: Labels, where: str) -> Kind:
        """Return the kind that labels name.

        Raises ConfigurationError where there is no such kind, or the fidelity does not model that specimen or
        interaction.
        """
        specimen = find("specimen", SPECIMENS, labels.specimen, where)
        interaction = find("interaction", INTERACTIONS, labels.interaction, where)
        fidelity = MODELS.find(labels.fidelity, where)
        if specimen.name not in fidelity.specimens:
            others = [model.name for model in MODELS.all().values() if specimen.name in model.specimens]
            wanted = f"{' or '.join(others)} where specimen is {specimen.name}"
            raise ConfigurationError(f"{where}: fidelity is {fidelity.name!r} but must be {wanted}")
        if not interaction.touches and fidelity.tied is None:
            others = [interaction.name for interaction in INTERACTIONS.values() if interaction.touches]
            wanted = f"{' or '.join(others)} where fidelity is {fidelity.name}"
            why = "tied beams are the model of fidelity rom3d"
            raise ConfigurationError(
                f"{where}: interaction is {interaction.name!r} but must be {wanted}: {why}"
            )
        if specimen.name in fidelity.slips and interaction.name == ROUGH:
            of = (
                f"where specimen is {specimen.name} and fidelity {fidelity.name}: at large strains yarns slip"
            )
            raise ConfigurationError(f"{where}: interaction is {ROUGH!r} but must be isotropic {of}")
        kind = cls(specimen, interaction, fidelity)
        if not set(labels.outputs) <= set(kind.outputs):
            allowed = f"a list out of [{', '.join(kind.outputs)}]" if kind.outputs else "[]"
            wanted = f"{allowed} where fidelity is {labels.fidelity}"
            raise ConfigurationError(f"{where}: outputs is {list(labels.outputs)} but must be {wanted}")
        return kind

    @property
    def direct(self) -> bool:
        """Whether a scene is a direct simulation: of a fabric that ends, all of its yarns solids."""
        return self.fidelity.solid and self.specimen.whole

    @property
    def outputs(self) -> tuple[str, ...]:
        """Outputs that a scene may ask for."""
        return tuple(dict.fromkeys((*self.fidelity.outputs, *self.specimen.outputs)))

    def has(self, key: str) -> bool:
        """Whether a scene of this kind has a label, a section or a dotted key."""
        section, dot, name = key.partition(".")
        if not dot:
            return key in self.sections or key in Labels.model_fields
        return section in self.sections and name in self.sections[section].model_fields

    @cached_property
    def sections(self) -> Sections:
        """Sections by their names."""
        return {**self.specimen.sections, "yarn": Yarn, **self.fidelity.sections_with(self.interaction)}


def all_kinds() -> list[Kind]:
    """Return every kind of scene that there may be."""
    return [
        Kind(SPECIMENS[specimen], interaction, fidelity)
        for fidelity in MODELS.all().values()
        for interaction in INTERACTIONS.values()
        if interaction.touches or fidelity.tied is not None
        for specimen in fidelity.specimens
        if specimen not in fidelity.slips or interaction.name != ROUGH
    ]


def all_sections() -> dict[str, dict[str, type[Section]]]:
    """Return the keys of every section of any kind of scene, each with the class that describes it."""
    return _sections_of(tuple(SPECIMENS), tuple(INTERACTIONS), MODELS.names())


@cache
def _sections_of(*names: tuple[str, ...]) -> dict[str, dict[str, type[Section]]]:
    """Return `all_sections`, formed once for all that is there under these names."""
    sections: dict[str, dict[str, type[Section]]] = {}
    for kind in all_kinds():
        for section, described in kind.sections.items():
            keys = sections.setdefault(section, {})
            for name in described.model_fields:
                keys.setdefault(name, described)
    return sections


def defaults_of_fields() -> dict[str, Any]:
    """Return the defaults that stand in the fields of keys, by dotted key."""
    fields = {key: section.model_fields[key.rpartition(".")[2]] for key, section in all_keys().items()}
    return {key: lists(field.default) for key, field in fields.items() if not field.is_required()}


def all_keys() -> dict[str, type[Section]]:
    """Return the classes that describe the keys of all kinds of scenes, by label and by dotted key."""
    labels = dict.fromkeys(Labels.model_fields, Labels)
    sections = all_sections().items()
    return labels | {f"{name}.{key}": section for name, keys in sections for key, section in keys.items()}


def role_of(key: str) -> str | None:
    """Return the role of a dotted key or a label; None if there is no such key."""
    section = all_keys().get(key)
    return describe(section, key.rpartition(".")[2]).role if section else None


def unit_of(key: str) -> str:
    """Return the unit of a dotted key or a label; an empty text if there is no such key."""
    section = all_keys().get(key)
    return describe(section, key.rpartition(".")[2]).unit if section else ""


def unknown_key(key: str) -> str:
    """Return the message for a key that no scene has, with similar keys of all sections."""
    hint = near_names(key, [*all_sections(), *all_keys()])
    return f"unknown key {key!r}{hint}; `knitstudy check SCENE` lists the keys of a scene"


def not_of_kind(kind: Kind, key: str) -> str:
    """Return the message for a key that a scene does not have: unknown, or of another kind."""
    if key not in all_keys() and key not in all_sections():
        return unknown_key(key)
    of = f"specimen is {kind.specimen.name}, fidelity {kind.fidelity.name}"
    return f"{key} is no key of a scene whose {of} and interaction {kind.interaction.name}; leave it out"
