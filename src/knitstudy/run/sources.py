"""The direct simulations that reduced models take joints, springs and stresses from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

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
    """The direct simulation `other` that a key of a scene names; `where` is the prefix of error messages.

    `of` and `check` raise ConfigurationError, which names the other scene and the key that both have to share.
    """

    scene: Scene
    key: str
    other: Scene
    where: str

    @classmethod
    def of(cls, scene: Scene, key: str, scenes: Mapping[str, Scene], where: str) -> Source:
        """Return the direct simulation among scenes that a key names."""
        name = scene.value(key)
        if name in scenes and (other := scenes[name]).kind.direct:
            return cls(scene, key, other, where)
        direct = sorted(other.name for other in scenes.values() if other.kind.direct)
        what = f"{key} names the unknown scene of solid yarns"
        raise ConfigurationError(f"{where}: {unknown_choice(what, name, name, direct)}")

    @property
    def springs(self) -> tuple[str, ...]:
        """Keys that springs depend on, if springs of the scene are measured in this simulation."""
        joints = self.scene.value("rom")
        if self.scene.value("rom.axes") is None or joints.stiffness:
            return ()
        return SPRINGS if self.key == f"rom.{'springs' if joints.springs_from else 'contacts'}_from" else ()

    def adapted(self) -> Source:
        """Return the direct simulation with the geometry of the scene.

        If springs are measured in it, it takes the scene's yarn and strain as well.
        """
        scene = self.scene
        other = self.other
        changed = {}
        if any(other.geometry_inputs.get(key) != value for key, value in scene.geometry_inputs.items()):
            changed = scene.geometry_inputs | {"knit": scene.knit}
        given = {key: scene.value(key) for key in self.springs}
        changed |= {key: value for key, value in given.items() if value not in (None, other.value(key))}
        if strain := changed.get("load.strain"):
            changed["load.stops"] = [stop for stop in other.value("load.stops") if 0 < stop / strain < 1]
        return replace(self, other=other.vary(changed)) if changed else self

    def check(self) -> None:
        """Refuse a direct simulation that does not go with the scene."""
        name = self.scene.value(self.key)
        if self.key == "rom.stress_from" and "fields" not in self.other.outputs:
            wanted = "must name a scene whose outputs hold fields, which stresses come from"
            raise ConfigurationError(f"{self.where}: {self.key} is {name!r} but {wanted}")
        for shared in dict.fromkeys((*SHARED.get(self.key, ("knit",)), *self.springs)):
            here, there = self.scene.value(shared), self.other.value(shared)
            if here is not None and here != there:
                wanted = f"{there!r} as in {self.key}, {name!r}"
                raise ConfigurationError(f"{self.where}: {shared} is {here!r} but must be {wanted}")
