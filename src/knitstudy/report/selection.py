"""Which scenes of a study figures and tables are about, and what they call them.

- "dns", "rom3d", "rom2d": one direct simulation and the reduced models made from it.
- "tie", "rough", "isotropic", "untied": direct simulations like that one but for the interaction, to be compared.
- "frictions": several of one mesh with different coefficients of friction, ties and rough contact beside them.
- "pairs": all pairs of crossing yarns that are pressed on each other and then slide.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from knitstudy.catalogue import COURSE, OUTER_ROWS_TIED, VARIANTS
from knitstudy.scene import Scene

REDUCED = ("rom3d", "rom2d")

ALIKE = ("specimen", "knit", "mesh.size", "mesh.element", "load.direction", "load.lateral")
"""Keys that scenes share when they are compared; they may be pulled to different strains."""


def roles_of(scenes: Iterable[Scene], of: Mapping[str, Any]) -> dict[str, Scene | list[Scene]]:
    """Return scenes of a study by what figures and tables call them; what the study lacks is not there.

    Parameters
    ----------
    scenes : iterable of Scene
        Scenes of a study in the order of the table.
    of : mapping
        Wanted values of the main scene's keys, for example ``{"interaction": "tie"}``.
    """
    scenes = list(scenes)
    models = models_of(scenes, of)
    several = {"frictions": friction_sweep(scenes), "pairs": pairs(scenes)}
    variants = variants_of(models["dns"], scenes) if models else {}
    return models | variants | {role: found for role, found in several.items() if found}


def models_of(scenes: Iterable[Scene], of: Mapping[str, Any]) -> dict[str, Scene]:
    """Return one direct simulation and the reduced models made from it, by fidelity.

    The first DNS of the table that fits is taken, or the first with all reduced models if there is one, and
    of each reduced model the first.

    Parameters
    ----------
    scenes : iterable of Scene
        Scenes of a study in the order of the table.
    of : mapping
        Wanted values of keys, for example ``{"interaction": "tie", "load.direction": "course"}``.

    Returns
    -------
    dict of str to Scene
        Keys "dns", "rom3d" and "rom2d" as far as the study has them; empty without a DNS.
    """
    fitting = [scene for scene in scenes if _fits(scene, of)]
    found = [_family(dns, fitting) for dns in fitting if dns.fidelity == "dns"]
    return max(found, key=len, default={})  # of equals the first


def variants_of(main: Scene, scenes: Iterable[Scene]) -> dict[str, Scene]:
    """Return the first direct simulation of every interaction (`catalogue.VARIANTS`) that compares with a scene."""
    alike = [scene for scene in scenes if scene.fidelity == "dns" and _values(scene) == _values(main)]
    found = {name: [scene for scene in alike if _fits(scene, of)] for name, of in VARIANTS.items()}
    return {name: fitting[0] for name, fitting in found.items() if fitting}


def friction_sweep(scenes: Iterable[Scene]) -> list[Scene]:
    """Return the direct simulations of that mesh, in course tension, which has most coefficients of friction.

    The first of every coefficient is taken, and ties and rough contact of the same mesh come with them. Without two
    coefficients there is no sweep.
    """
    groups: dict[tuple, dict[tuple, Scene]] = {}
    for scene in scenes:
        if scene.fidelity == "dns" and _fits(scene, COURSE | OUTER_ROWS_TIED):
            slides = scene.interaction == "isotropic"
            kind = (scene.interaction, scene.contact.friction if slides else None)
            groups.setdefault(_values(scene), {}).setdefault(kind, scene)

    def coefficients(group: dict[tuple, Scene]) -> int:
        return sum(interaction == "isotropic" for interaction, _ in group)

    largest = max(groups.values(), key=coefficients, default={})
    return list(largest.values()) if coefficients(largest) > 1 else []


def pairs(scenes: Iterable[Scene]) -> list[Scene]:
    """Return the direct simulations of two crossing yarns that slide: their paths have more legs than one."""
    return [scene for scene in scenes if scene.specimen == "pair" and len(scene.load.path) > 1]


def _family(dns: Scene, scenes: list[Scene]) -> dict[str, Scene]:
    made_from_it = [scene for scene in scenes if scene.rom.contacts_from == dns.name]
    first = {scene.fidelity: scene for scene in reversed(made_from_it)}
    return {"dns": dns} | {fidelity: first[fidelity] for fidelity in REDUCED if fidelity in first}


def _fits(scene: Scene, of: Mapping[str, Any]) -> bool:
    return all(_value(scene, key) == value for key, value in of.items())


def _values(scene: Scene) -> tuple:
    return tuple(_value(scene, key) for key in ALIKE)


def _value(scene: Scene, key: str) -> object:
    """Return the value of a dotted key."""
    value: object = scene
    for part in key.split("."):
        value = getattr(value, part)
    return value
