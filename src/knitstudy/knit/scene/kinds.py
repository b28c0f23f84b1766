"""Kinds of scenes: a specimen, an interaction of its yarns and a fidelity, by which it is computed.

The kind of a scene says which sections it has: a tied scene has no friction, a knit has no angle. A plugin, which is a
module that the configuration names under ``plugins``, registers a specimen, an interaction or a model here
(config/README.md). Specimens bring classes of scenes (`knit.scene.specimens`), and models classes that derive
from these.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, wraps
from typing import Any, ClassVar, Literal, TypeVar, get_type_hints

from pydantic import create_model, field_validator

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
from knitstudy.knit.scene.shared_sections import Friction
from knitstudy.registry import Registry, find, meanings, near_names

Sections = dict[str, type[Section]]
Found = TypeVar("Found")

ROUGH = "rough"  # the interaction of yarns in contact that cannot slip
WORDS = {"isotropic": "friction"}  # what users read and write for names in digests and committed tables


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
    specimen: str = physics("inferred", allowed=lambda: meanings(SPECIMENS.all()))
    """Section 3.1: unit cells; Tables 3 and 5 divide by nine of them, cut out of a knit. Checked: all."""
    fidelity: str = numerics("choice", allowed=lambda: meanings(MODELS.all()))
    """Sections 2.3 to 2.6 of the paper: solids, networks of beams; section 3.3: beams in contact. Checked: all."""
    interaction: str = physics("stated", allowed=lambda: meanings(_by_word()))
    """Section 2.2, Fig. 2 and Table 1: ties, rough contact, friction, which may be called isotropic as there.
    Checked: all."""
    outputs: tuple[str, ...] = output("choice", allowed="a list of further files, for example [fields, vtu]")
    """No result depends on them. Checked: all."""

    @field_validator("interaction")
    @classmethod
    def _kept_name(cls, given: str) -> str:
        return next((name for name, word in WORDS.items() if word == given), given)


class Part(Labels):
    """Sections that a specimen, or a model of it, brings to its scenes: the fields whose type is a section."""

    kind: ClassVar[Kind]
    specimens: ClassVar[tuple[str, ...]] = ()
    """The specimens whose scenes are of this class."""
    touches: ClassVar[bool | None] = None
    """Of a model: whether yarns of these scenes are in contact; None: in contact or tied."""
    takes: ClassVar[Literal["one stitch", "knit and purl", "all stitches"]] = "knit and purl"
    """Of a model: the repeats of stitches that its loops may have."""
    slips: ClassVar[bool] = False
    """Of a model: whether yarns in contact have to be able to slip."""
    ignored_if_set: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Of a model: dotted keys that it ignores if the other keys are all set."""
    implied: ClassVar[Mapping[str, Any]] = {}
    """Of a model: values by dotted key of physical keys that its scenes do not have, as it knows one value alone. They
    belong to the physical problem."""


@dataclass(frozen=True, eq=False)
class Specimen:
    """What is simulated."""

    name: str
    meaning: str
    part: type[Part]  # its sections
    geometry: tuple[str, ...]  # sections and dotted keys that its geometry depends on
    whole: bool = True  # whether all its yarns are whole and end
    outputs: tuple[str, ...] = ()  # outputs that a scene may ask for besides the outputs of its model


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
class FidelityModel:
    """A model of a fabric: its classes of scenes, name and cost."""

    name: str  # value of the key `fidelity`
    meaning: str
    parts: tuple[type[Part], ...]  # the classes of scenes that it models
    # (scene, fabric, ...) -> Problem; other parameters name the data of other stages
    build: Callable[..., Any]
    solid: bool = False  # whether all yarns are solids
    sources: tuple[str, ...] = ()  # dotted keys that name direct simulations which it takes something from
    outputs: tuple[str, ...] = ("vtu",)  # outputs that a scene may ask for besides the history
    # Expected memory, memory of each cell on top [MB], and processor time of a cell in twelve increments [s]; for
    # solids, all three follow from the number of unknowns
    memory: float = 1000
    memory_a_cell: float = 0
    seconds_a_cell: float = 1.0

    @property
    def specimens(self) -> tuple[str, ...]:
        """Names of the specimens that it models."""
        return tuple(dict.fromkeys(name for part in self.parts for name in part.specimens))

    def part(self, specimen: Specimen, interaction: Interaction) -> type[Part] | None:
        """Return the class of its scenes of a specimen and an interaction; None if it does not model them."""
        for part in self.parts:
            if specimen.name in part.specimens and part.touches in (None, interaction.touches):
                return None if part.slips and interaction.name == ROUGH else part
        return None


SPECIMENS: Registry[Specimen] = Registry("specimen", "knitstudy.knit.scene.specimens")
INTERACTIONS: Registry[Interaction] = Registry("interaction")
MODELS: Registry[FidelityModel] = Registry("fidelity", "knitstudy.knit.models")
"""The models by the value of the key `fidelity`; every one is registered in a folder of its own."""

INTERACTIONS.register(Interaction("tie", "no motion where yarns cross", friction=None))
INTERACTIONS.register(Interaction(ROUGH, "contact without slip", friction=lambda contact: math.inf))
INTERACTIONS.register(Interaction("isotropic", "Coulomb's law", lambda contact: contact.friction, Friction))


def word_of(value: Any) -> Any:
    """Return what users call an interaction, of its recorded name; any other value as it is."""
    return WORDS.get(value, value) if isinstance(value, str) else value


def _by_word() -> dict[str, Interaction]:
    return {word_of(name): interaction for name, interaction in INTERACTIONS.all().items()}


@dataclass(frozen=True, eq=False)
class Kind:
    """Kind of a scene, and its sections."""

    specimen: Specimen
    interaction: Interaction
    fidelity: FidelityModel

    @staticmethod
    def of(labels: Labels, where: str) -> Kind:
        """Return the kind that labels name.

        Raises ConfigurationError where there is no such kind, or the fidelity does not model that specimen or
        interaction.
        """
        specimen = SPECIMENS.find(labels.specimen, where)
        interaction = find("interaction", _by_word(), word_of(labels.interaction), where)
        fidelity = MODELS.find(labels.fidelity, where)
        if fidelity.part(specimen, interaction) is None:
            raise ConfigurationError(f"{where}: {_why_not(specimen, interaction, fidelity)}")
        kind = _kind(specimen, interaction, fidelity)
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
    def part(self) -> type[Part]:
        """The class of its model, which has the sections of its specimen as well."""
        part = self.fidelity.part(self.specimen, self.interaction)
        assert part is not None, "a kind exists only where its model has a class for it"
        assert issubclass(part, self.specimen.part), (
            f"{part.__name__} must be a {self.specimen.part.__name__}"
        )
        return part

    @cached_property
    def sections(self) -> Sections:
        """Sections by their names."""
        hints = get_type_hints(self.part).items()
        sections = {
            name: hint for name, hint in hints if isinstance(hint, type) and issubclass(hint, Section)
        }
        if "contact" in sections:
            sections["contact"] = self.interaction.contact(sections["contact"])
        return sections

    @cached_property
    def scene(self) -> type[Part]:
        """The class of its scenes."""
        fields: dict[str, Any] = {name: (section, ...) for name, section in self.sections.items()}
        made = create_model(self.part.__name__, __base__=self.part, **fields)
        made.kind = self
        return made


@cache
def _kind(specimen: Specimen, interaction: Interaction, fidelity: FidelityModel) -> Kind:
    return Kind(specimen, interaction, fidelity)


def _why_not(specimen: Specimen, interaction: Interaction, fidelity: FidelityModel) -> str:
    """Return why a model has no scenes of a specimen with an interaction, and what has."""
    if specimen.name not in fidelity.specimens:
        others = [model.name for model in MODELS.all().values() if specimen.name in model.specimens]
        return f"fidelity is {fidelity.name!r} but must be {' or '.join(others)} where specimen is {specimen.name}"
    good = [word for word, other in _by_word().items() if fidelity.part(specimen, other)]
    wanted = f"{' or '.join(good)} where specimen is {specimen.name} and fidelity {fidelity.name}"
    why = (
        "at large strains yarns slip" if interaction.touches else "tied beams are the model of fidelity rom3d"
    )
    return f"interaction is {word_of(interaction.name)!r} but must be {wanted}: {why}"


def all_kinds() -> list[Kind]:
    """Return every kind of scene that there may be."""
    return [
        _kind(specimen, interaction, fidelity)
        for fidelity in MODELS.all().values()
        for interaction in INTERACTIONS.all().values()
        for specimen in SPECIMENS.all().values()
        if fidelity.part(specimen, interaction) is not None
    ]


def _of_all_registered(function: Callable[[], Found]) -> Callable[[], Found]:
    """Return a function whose result is formed once for all specimens, interactions and models that there are."""
    kept = cache(lambda *names: function())
    return wraps(function)(lambda: kept(SPECIMENS.names(), INTERACTIONS.names(), MODELS.names()))


@_of_all_registered
def all_sections() -> dict[str, dict[str, type[Section]]]:
    """Return the keys of every section of any kind of scene, each with the class that describes it."""
    sections: dict[str, dict[str, type[Section]]] = {}
    for kind in all_kinds():
        for section, described in kind.sections.items():
            keys = sections.setdefault(section, {})
            for name in described.model_fields:
                keys.setdefault(name, described)
    return sections


@_of_all_registered
def all_keys() -> dict[str, type[Section]]:
    """Return the classes that describe the keys of all kinds of scenes, by label and by dotted key."""
    labels: dict[str, type[Section]] = dict.fromkeys(Labels.model_fields, Labels)
    sections = all_sections().items()
    return labels | {f"{name}.{key}": section for name, keys in sections for key, section in keys.items()}


def defaults_of_fields() -> dict[str, Any]:
    """Return the defaults that the fields of sections declare, by dotted key."""
    fields = {key: section.model_fields[key.rpartition(".")[2]] for key, section in all_keys().items()}
    return {key: lists(field.default) for key, field in fields.items() if not field.is_required()}


def role_of(key: str) -> str | None:
    """Return the role of a dotted key or a label; None if there is no such key."""
    section = all_keys().get(key)
    return describe(section, key.rpartition(".")[2]).role if section else None


def unit_of(key: str) -> str:
    """Return the unit of a dotted key or a label; an empty text if there is no such key."""
    section = all_keys().get(key)
    return describe(section, key.rpartition(".")[2]).unit if section else ""


def labels_of(document: Mapping[str, Any], where: str) -> Labels:
    """Return the labels in a document, which may hold other keys; a ConfigurationError names the wrong label."""
    labels = {name: document[name] for name in Labels.model_fields if name in document}
    return validated(Labels, labels, where)


def unknown_key(key: str) -> str:
    """Return the message for a key that no scene has, with similar keys of all sections."""
    asks = " where fidelity is not auto"
    near = near_names(key, [*all_sections(), *all_keys()])
    hint = asks if key.startswith("ask.") else near
    return f"unknown key {key!r}{hint}; `knitstudy check SCENE` lists the keys of a scene"


def not_of_kind(kind: Kind, key: str) -> str:
    """Return the message for a key that a scene does not have: unknown, or of another kind."""
    if key not in all_keys() and key not in all_sections():
        return unknown_key(key)
    of = f"specimen is {kind.specimen.name}, fidelity {kind.fidelity.name}"
    return f"{key} is not a key of a scene whose {of} and interaction {word_of(kind.interaction.name)}; leave it out"
