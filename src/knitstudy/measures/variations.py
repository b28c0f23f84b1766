"""Scenes in which one input at a time is changed: whatever else they share, and in which interactions they come."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from knitstudy.measures.discretisation import INTERACTIONS, is_cut, is_direct
from knitstudy.study.keys import Description, describe
from knitstudy.study.kinds import Labels, all_sections
from knitstudy.study.scene import LABELS, Scene, digest

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
"""Inputs that are changed one at a time, by key, and what figures and tables call them."""

COEFFICIENT, WITHOUT_LIMIT = "contact.friction", "rough"
"""Rough contact is friction without a limit: one more value of the coefficient."""


@dataclass(frozen=True)
class Variation:
    """One input at another value than the base's, or the base itself, whose key is empty.

    Attributes
    ----------
    key : str
        Of `INPUTS`.
    value : number or str or None
    scenes : mapping of str to Scene
        By interaction; those of the base where an interaction does not know the input.
    varied : tuple of str
        Interactions whose scenes are not the base's.
    """

    key: str
    value: Any
    scenes: Mapping[str, Scene]
    varied: tuple[str, ...] = ()

    @property
    def described(self) -> Description:
        """What is known of the input: unit, standing and source."""
        section, dot, field = self.key.partition(".")
        return describe(all_sections()[section][field], field) if dot else describe(Labels, section)


def variations(scenes: Iterable[Scene]) -> list[Variation]:
    """Return the base and every other value of every input, in the order of `INPUTS` and of the values.

    Of direct simulations in course tension those count that differ in nothing else; of several such groups the one that
    has most scenes. The base has of every input the value that most of them have. Nothing where nothing is varied.

    Parameters
    ----------
    scenes : iterable of Scene
        In the order of the families; of equal ones the first counts.
    """
    groups: dict[str, dict[tuple, Scene]] = {}
    for scene in scenes:
        if (is_direct(scene) or is_cut(scene)) and scene.value("load.direction") == "course":
            groups.setdefault(_all_but_inputs(scene), {}).setdefault(
                (scene.interaction, *_inputs(scene)), scene
            )
    if not groups:
        return []
    found = max(groups.values(), key=len)
    usual = tuple(_most_common(values) for values in zip(*(key[1:] for key in found), strict=True))
    base = {kind: _at(found, kind, usual) for kind in INTERACTIONS}
    base = {kind: scene for kind, scene in base.items() if scene}
    varied = [_at_value(found, base, usual, *change) for change in _changes(found, usual)]
    return [Variation("", None, base), *(each for each in varied if each.varied)] if varied else []


def _changes(found: Mapping[tuple, Scene], usual: tuple) -> list[tuple[int, Any]]:
    """Return every value of every input that is not the usual one, with the place of the input."""
    changes = []
    for place, key in enumerate(INPUTS):
        values = {each[1 + place] for each in found} - {None, usual[place]}
        changes += [(place, value) for value in sorted(values)]
        if key == COEFFICIENT and values:
            changes.append((place, WITHOUT_LIMIT))
    return changes


def _at_value(
    found: Mapping[tuple, Scene], base: Mapping[str, Scene], usual: tuple, place: int, value: Any
) -> Variation:
    """Return the scenes of one value of one input; an interaction without a scene of it is not there."""
    key = list(INPUTS)[place]
    if value == WITHOUT_LIMIT:
        rough = {"isotropic": base["rough"]} if "rough" in base else {}
        return Variation(key, value, rough, tuple(rough))
    scenes, varied = {}, []
    for kind in base:
        if base[kind].value(key) is None:
            scenes[kind] = base[kind]
        elif scene := _at(found, kind, (*usual[:place], value, *usual[place + 1 :])):
            scenes[kind] = scene
            varied.append(kind)
    return Variation(key, value, scenes, tuple(varied))


def _at(found: Mapping[tuple, Scene], kind: str, wanted: tuple) -> Scene | None:
    """Return the scene of an interaction whose inputs, as far as it knows them, are as wanted."""
    for (interaction, *values), scene in found.items():
        if interaction == kind and all(
            one in (None, other) for one, other in zip(values, wanted, strict=True)
        ):
            return scene
    return None


def _inputs(scene: Scene) -> tuple:
    return tuple(scene.value(key) for key in INPUTS)


def _most_common(values: Iterable[Any]) -> Any:
    """Return the most frequent value that is not None; of equally frequent ones the first."""
    counted = Counter(value for value in values if value is not None).most_common(1)
    return counted[0][0] if counted else None


def _all_but_inputs(scene: Scene) -> str:
    """Return a digest of all that ties and contact share but the inputs, and where increments end."""
    left_out = {*INPUTS, *LABELS, "interaction", "load.stops"}
    document = {
        name: {field: value for field, value in inside.items() if f"{name}.{field}" not in left_out}
        if isinstance(inside, dict)
        else inside
        for name, inside in scene.to_dict().items()
        if name not in left_out and name != "contact"
    }
    return digest(document)
