"""The direct simulations that reduced models take joints, springs and stresses from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.scene import Scene
from knitstudy.registry import unknown_choice

SHARED = {
    "rom.contacts_from": ("knit", "interaction", "load.direction", "tie.radius"),
    "rom.springs_from": ("knit", "interaction"),
}
"""Keys that a scene shares, if it has them, with the direct simulation that another key of it names."""

SPRINGS = (
    "yarn.diameter",
    "yarn.youngs_modulus",
    "yarn.poisson_ratio",
    "yarn.material",
    "contact.friction",
    "load.strain",
)
"""Keys that springs depend on beside the keys of the knit: springs are secants at full load."""


@dataclass(frozen=True)
class Source:
    """The direct simulation that a key of a scene names; `where` begins messages.

    Its methods raise ConfigurationError, which names the other scene and the key that both have to share.
    """

    scene: Scene
    key: str
    where: str

    @cached_property
    def name(self) -> str:
        """Name of the direct simulation."""
        name: str = self.scene.value(self.key)
        return name

    @cached_property
    def springs(self) -> tuple[str, ...]:
        """Keys that springs depend on, if springs of the scene are measured in this simulation."""
        joints = self.scene.value("rom")
        if self.scene.value("rom.axes") is None or joints.stiffness:
            return ()
        return SPRINGS if self.key == f"rom.{'springs' if joints.springs_from else 'contacts'}_from" else ()

    def among(self, scenes: Mapping[str, Scene]) -> Scene:
        """Return the direct simulation, which must be there, as it is."""
        if self.name in scenes and (other := scenes[self.name]).kind.direct:
            return other
        direct = sorted(other.name for other in scenes.values() if other.kind.direct)
        what = f"{self.key} names the unknown scene of solid yarns"
        raise ConfigurationError(f"{self.where}: {unknown_choice(what, self.name, self.name, direct)}")

    def made_for_scene(self, other: Scene) -> Scene:
        """Return the direct simulation with the geometry of the scene.

        If springs are measured in it, it takes the scene's yarn and strain as well.
        """
        inputs, changed = self.scene.geometry_inputs, {}
        if any(other.geometry_inputs.get(key) != value for key, value in inputs.items()):
            changed = inputs | {"knit": self.scene.knit}
        given = {key: self.scene.value(key) for key in self.springs}
        changed |= {key: value for key, value in given.items() if value not in (None, other.value(key))}
        if strain := changed.get("load.strain"):
            changed["load.stops"] = [stop for stop in other.value("load.stops") if 0 < stop / strain < 1]
        return other.vary(changed) if changed else other

    def check(self, other: Scene) -> None:
        """Refuse a direct simulation that does not go with the scene."""
        if self.key == "rom.stress_from" and "fields" not in other.outputs:
            wanted = "must name a scene whose outputs hold fields, which stresses come from"
            raise ConfigurationError(f"{self.where}: {self.key} is {self.name!r} but {wanted}")
        for shared in dict.fromkeys((*SHARED.get(self.key, ("knit",)), *self.springs)):
            here: Any = self.scene.value(shared)
            there: Any = other.value(shared)
            if here is not None and here != there:
                wanted = f"{there!r} as in {self.key}, {self.name!r}"
                raise ConfigurationError(f"{self.where}: {shared} is {here!r} but must be {wanted}")
