"""A campaign: scenes at the ends of what their keys may be, one thing at a time and all together at random.

``config/extremes.yaml`` says what is tried. A trial need not be a valid scene: a value that no scene may have is part
of the question, and `Trial.scene` refuses it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from knitstudy.errors import ConfigurationError
from knitstudy.registry import find, unknown_choice
from knitstudy.study.configuration import CONFIG, FAMILIES, load_scenes
from knitstudy.study.documents import read_yaml
from knitstudy.study.keys import Section, output, validated
from knitstudy.study.kinds import Labels, all_sections, role_of
from knitstudy.study.scene import Scene

FILE = "extremes.yaml"

BASE = "extreme-"
"""What the names of the scenes begin with that others are made of."""

TOGETHER = "together"
"""The group of scenes in which many keys are changed at once."""

DIGITS = 3
"""Digits of a value that was drawn."""

QUANTITIES: Mapping[str, Callable[[Scene, Any], Scene]] = {
    "across": lambda scene, value: scene.replace("mesh.size", scene.yarn.diameter / value),
    "degree": lambda scene, value: scene.vary({"mesh.degree": value, "mesh.crossing_degree": value}),
    "diameter": lambda scene, value: scene.scaled(length=value / scene.yarn.diameter),
    "stiffness": lambda scene, value: scene.scaled(stiffness=value / scene.yarn.youngs_modulus),
}
"""Quantities that set several keys, in the order in which they follow the keys of a trial."""

APPLIES = {"across": "mesh.size", "degree": "mesh.degree", "diameter": "yarn", "stiffness": "yarn"}
"""The key or section that a scene must have for a quantity to say something of it."""


def _said(allowed: str, **default: Any) -> Any:
    return output("choice", allowed=allowed, source="what is tried", checked="all", **default)


class Alone(Section):
    """One thing at a time: of which scenes, and what each changes."""

    of: tuple[str, ...] = _said("a list of scenes")
    values: dict[str, list[Any]] = _said("values by key", default={})
    cases: tuple[dict[str, Any], ...] = _said("a list of keys with values", default=())

    def changes(self) -> Iterator[dict[str, Any]]:
        """Yield what each scene changes."""
        for keys, values in self.values.items():
            yield from (dict.fromkeys(keys.split(), value) for value in values)
        yield from self.cases


class Together(Section):
    """All at once, at random."""

    scenes: Annotated[int, Field(ge=0)] = _said("a whole number from 0 on: scenes of each base")
    changed: Annotated[float, Field(gt=0, le=1)] = _said(
        "a number > 0 and <= 1: the probability that a key is changed"
    )
    of: tuple[str, ...] = _said("a list of scenes")
    keys: dict[str, Any] = _said("what every key may be")


class Declared(Section):
    """What ``config/extremes.yaml`` holds."""

    seed: Annotated[int, Field(ge=0)] = _said("a whole number from 0 on")
    limit: Annotated[float, Field(gt=0)] = _said("a number > 0, in s")
    cheap: Annotated[float, Field(ge=0)] = _said("a number >= 0, in s")
    alone: dict[str, Any] = _said("groups by name")
    together: dict[str, Any] = _said("a group")


@dataclass(frozen=True)
class Trial:
    """One scene that is tried: a base with some keys and `QUANTITIES` changed."""

    name: str
    group: str
    base: Scene
    changes: Mapping[str, Any]

    @property
    def label(self) -> str:
        """The name as that of a file."""
        return re.sub(r"[^a-z0-9]+", "-", self.name.lower())

    @property
    def model(self) -> str:
        """Name of the base without what all of them begin with."""
        return self.base.name.removeprefix(BASE)

    def scene(self) -> Scene:
        """Return the scene; ConfigurationError where no scene may be so."""
        scene = self.base.vary({name: each for name, each in self.changes.items() if name not in QUANTITIES})
        for name, change in QUANTITIES.items():
            if name in self.changes:
                scene = change(scene, self.changes[name])
        return scene


@dataclass(frozen=True)
class Campaign:
    """All trials, and how long each may take."""

    trials: tuple[Trial, ...]
    limit: float  # processor time of a trial [s]
    cheap: float  # processor time below which a trial is made again in twice the increments [s]


def load_campaign(config: Path = CONFIG) -> Campaign:
    """Return the campaign of a configuration folder.

    Raises ConfigurationError, naming the file, the group, and what is not known or not allowed in it.
    """
    path = Path(config) / FILE
    declared = validated(Declared, read_yaml(path), str(path))
    scenes = load_scenes(config)
    bases = {name.removeprefix(BASE): scene for name, scene in scenes.items() if name.startswith(BASE)}
    trials = []
    for group, inside in declared.alone.items():
        where = f"{path}: alone: {group}"
        alone = validated(Alone, inside, where)
        for name in alone.of:
            base = find(f"scene of {FAMILIES}", bases, name, where)
            for number, changes in enumerate(alone.changes(), 1):
                _require_known(changes, where)
                trials.append(Trial(f"{group} {name} {number}", group, base, changes))
    where = f"{path}: {TOGETHER}"
    together = validated(Together, declared.together, where)
    _require_known([name for keys in together.keys for name in keys.split()], where)
    for index, name in enumerate(together.of):
        base = find(f"scene of {FAMILIES}", bases, name, where)
        for number in range(1, together.scenes + 1):
            # Its own generator: one scene more changes no other.
            changes = _drawn(np.random.default_rng((declared.seed, index, number)), together, base, where)
            trials.append(Trial(f"{TOGETHER} {name} {number}", TOGETHER, base, changes))
    return Campaign(tuple(trials), declared.limit, declared.cheap)


def _require_known(changes: Iterable[str], where: str) -> None:
    """Refuse a key of no scene: a value may be wrong on purpose, a name may not."""
    for name in changes:
        if name not in QUANTITIES and role_of(name) is None:
            keys = {f"{section}.{each}" for section, fields in all_sections().items() for each in fields}
            known = sorted({*QUANTITIES, *Labels.model_fields, *keys})
            raise ConfigurationError(f"{where}: {unknown_choice('unknown key', name, name, known)}")


def _drawn(random: np.random.Generator, together: Together, base: Scene, where: str) -> dict[str, Any]:
    """Return changes of a scene: of every key that it has, with the probability that is asked for."""
    changes: dict[str, Any] = {}
    for keys, between in together.keys.items():
        names = keys.split()
        # Drawn whether it is used or not: what is drawn next does not depend on the base.
        used, value = random.random() < together.changed, _between(random, between, f"{where}: {keys}")
        if used and base.kind.has(APPLIES.get(names[0], names[0])):
            changes |= dict.fromkeys(names, value)
    if base.interaction == "tie":
        changes.pop("interaction", None)
    elif changes.get("interaction") == "rough":
        changes.pop("contact.friction", None)
    if base.kind.fidelity.sources:  # a reduced model is loaded as the simulation behind it
        changes.pop("load.direction", None)
    return changes


def _between(random: np.random.Generator, between: Any, where: str) -> Any:
    """Return a value out of a list or between two ends."""
    share = random.random()
    if isinstance(between, list | tuple) and between:
        return between[int(share * len(between))]
    match between:
        case {"even": [float() | int() as low, float() | int() as high]}:
            value = low + share * (high - low)
        case {"decades": [float() | int() as low, float() | int() as high]} if low > 0 and high > 0:
            value = low * (high / low) ** share
        case _:
            raise ConfigurationError(
                f"{where} is {between!r} but must be a list of values, or even: [low, high] or decades: [low, high]"
            )
    return float(f"{value:.{DIGITS}g}")
