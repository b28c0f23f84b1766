"""Knits in which one input is changed at a time, by the names of their scenes: "inputs-{what}-{interaction}-course"."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.measures.discretisation import INTERACTIONS
from knitstudy.study.keys import Description, describe
from knitstudy.study.kinds import Labels, all_sections
from knitstudy.study.scene import Scene

INPUTS = {
    "contact.friction": "coefficient of friction",
    "contact.tied_edges": "rows that stay tied",
    "specimen": "specimen",
    "pattern.clearance": "clearance of the yarns",
    "tie.radius": "radius of a tie",
    "yarn.youngs_modulus": "Young's modulus",
    "yarn.poisson_ratio": "Poisson's ratio",
    "yarn.material": "material law",
    "load.lateral": "driven ends sideways",
}
"""Inputs that are changed one at a time, by key, in words."""

BASE, CHANGED = "yarns-{}-course", re.compile(r"inputs-(.+)-(tie|rough|isotropic)-course")
"""Names of the scenes with all inputs as usual, by interaction, and of those with one input changed."""

COEFFICIENT, WITHOUT_LIMIT = "contact.friction", "rough"
"""Rough contact is friction without a limit: one more value of the coefficient."""


@dataclass(frozen=True)
class Variation:
    """One input at another value than usual; the base, whose key is empty, has all inputs as usual.

    Attributes
    ----------
    key : str
        One of `INPUTS`.
    value : number or str or None
    scenes : mapping of str to Scene
        By interaction; those of the base for interactions that the input does not concern.
    varied : tuple of str
        Interactions whose scenes are not those of the base.
    """

    key: str
    value: Any
    scenes: Mapping[str, Scene]
    varied: tuple[str, ...] = ()

    @property
    def described(self) -> Description:
        """Unit, standing and source of the input."""
        section, dot, field = self.key.partition(".")
        return describe(all_sections()[section][field], field) if dot else describe(Labels, section)


def variations(scenes: Iterable[Scene]) -> list[Variation]:
    """Return the base and every other value of every input, in the order of `INPUTS` and of the values.

    Nothing where no input is varied.

    Raises
    ------
    ConfigurationError
        If a scene of a varied input changes none of them.
    """
    scenes = {scene.name: scene for scene in scenes}
    base = {kind: scenes[BASE.format(kind)] for kind in INTERACTIONS if BASE.format(kind) in scenes}
    changed: dict[str, dict[str, Scene]] = {}
    for name, scene in scenes.items():
        if (parts := CHANGED.fullmatch(name)) and parts[2] in base:
            changed.setdefault(parts[1], {})[parts[2]] = scene
    found = [_variation(base, changes) for changes in changed.values()]
    if any(each.key == COEFFICIENT for each in found) and "rough" in base:
        found.append(Variation(COEFFICIENT, WITHOUT_LIMIT, {"isotropic": base["rough"]}, ("isotropic",)))
    order = list(INPUTS)
    found.sort(key=lambda each: (order.index(each.key), each.value == WITHOUT_LIMIT, each.value))
    return [Variation("", None, base), *found] if found else []


def _variation(base: Mapping[str, Scene], changed: Mapping[str, Scene]) -> Variation:
    kind, scene = next(iter(changed.items()))
    key = next((key for key in INPUTS if scene.value(key) != base[kind].value(key)), None)
    if key is None:
        raise ConfigurationError(
            f"scene {scene.name!r} changes none of {', '.join(INPUTS)}: give it another name"
        )
    return Variation(key, scene.value(key), {**base, **changed}, tuple(k for k in base if k in changed))
