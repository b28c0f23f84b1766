"""Quantities that no reference knows, between what the finest two independent models say of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from knitstudy.measures.discretisation import discretisation, finer, is_direct, made_of
from knitstudy.measures.estimate import UNKNOWN, Estimate
from knitstudy.measures.names import NAMES
from knitstudy.study.scene import Scene

TRUST = (
    "quadratic hexahedra",
    "solid yarns",
    "one-point hexahedra",
    "rom3d patch",
    "beam hertz patch",
)
"""Independent models, the one before the other where both are at hand; what is not here brackets nothing."""


@dataclass(frozen=True)
class Bracket:
    """An estimate, and the models that it lies between, in words."""

    estimate: Estimate = UNKNOWN
    said: str = ""


def family_of(scene: Scene) -> str:
    """Return the independent model that a scene is one resolution of."""
    if is_direct(scene):
        return discretisation(scene)
    variants = (scene.value(key) for key in ("rom.joint", "beam.section", "beam.tie"))
    return " ".join([scene.fidelity, *filter(None, variants)])


def bracket(values: Mapping[str, float], scenes: Mapping[str, Scene]) -> Bracket:
    """Return the middle of what two models say, as uncertain as half of what lies between them.

    Of the models that are trusted the first two count, each by its finest resolution.

    Parameters
    ----------
    values : mapping of str to float
        Of one quantity of one problem, by scene.
    scenes : mapping of str to Scene
    """
    finest: dict[str, Scene] = {}
    for scene in (scenes[name] for name in values):
        known = finest.setdefault(family_of(scene), scene)
        if is_direct(scene) and finer(scene, known):
            finest[family_of(scene)] = scene
    taken = [finest[family] for family in TRUST if family in finest][:2]
    if len(taken) < 2:
        return Bracket()
    one, other = (values[scene.name] for scene in taken)
    said = " and ".join(made_of(scene) if is_direct(scene) else NAMES[scene.fidelity] for scene in taken)
    return Bracket(Estimate(0.5 * (one + other), 0.5 * abs(one - other)), said)
