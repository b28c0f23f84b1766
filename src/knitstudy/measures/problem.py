"""What a simulation is of, whatever it is computed with: specimen, yarn, load and how yarns act on each other."""

from __future__ import annotations

from math import inf
from typing import Any

from knitstudy.study.scene import Scene, digest

PHYSICS = (
    "yarn.youngs_modulus",
    "yarn.poisson_ratio",
    "yarn.material",
    "load.direction",
    "load.lateral",
    "contact.friction",
    "contact.tied_edges",
    "tie.radius",
)
"""Keys that say what is simulated, beside the geometry: not how finely, how far, or by which rule ties are made."""


UNIT = (
    "yarn.youngs_modulus",
    "yarn.poisson_ratio",
    "yarn.material",
    "load.direction",
    "load.lateral",
    "tie.radius",
)
"""Those of them that knits of the same loops share, of whatever size and however their yarns act on each other."""

EXTENT = ("pattern.loops", "pattern.rows")


def problem_of(scene: Scene) -> str:
    """Return a digest that scenes of one physical problem share, and no others."""
    keys: dict[str, Any] = {key: scene.value(key) for key in PHYSICS}
    return digest({"interaction": scene.interaction} | scene.geometry_inputs | keys)


def sticks(scene: Scene) -> bool:
    """Whether yarns touch, and do not slip where they do."""
    interaction = scene.kind.interaction
    return interaction.touches and interaction.friction(scene) == inf


def tied_problem_of(scene: Scene) -> str:
    """Return the digest (`problem_of`) of the same knit under the same load with yarns that are all tied."""
    keys = {key: None if key.startswith("contact.") else scene.value(key) for key in PHYSICS}
    return digest({"interaction": "tie"} | scene.geometry_inputs | keys)


def loops_of(scene: Scene) -> str:
    """Return a digest that scenes of the same loops under the same load share, however many of them there are."""
    keys: dict[str, Any] = {key: scene.value(key) for key in UNIT}
    return digest(keys | {key: value for key, value in scene.geometry_inputs.items() if key not in EXTENT})
