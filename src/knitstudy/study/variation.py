"""Scenes that differ from one of the table in some keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from knitstudy.study.scene import Scene, set_dotted


def vary(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """Return a scene with some keys changed, checked once all of them are.

    Keys that depend on each other, such as ``specimen`` and ``load.direction``, can be changed together; one key
    alone is what `Scene.replace` does.

    Parameters
    ----------
    scene : Scene
    changes : mapping of str to value
        Values by dotted key, for example ``{"load.strain": 0.01, "mesh.size": 0.45e-3}``; SI units.

    Raises
    ------
    ConfigurationError
        When a key is unknown or a value is not allowed.
    """
    document, where = scene.to_dict(), f"scene {scene.name!r}"
    for key, value in changes.items():
        set_dotted(document, key, value, where)
    return Scene.from_dict(document, where)


def flattened(scene: Scene) -> dict[str, Any]:
    """Return the values of a scene by dotted key, in the order of its sections."""
    flat: dict[str, Any] = {}
    for key, value in scene.to_dict().items():
        flat |= (
            {f"{key}.{part}": inner for part, inner in value.items()}
            if isinstance(value, dict)
            else {key: value}
        )
    return flat


def differences(scene: Scene, base: Scene) -> dict[str, Any]:
    """Return those keys of a scene, but labels and outputs, whose values are not those of another scene."""
    there = flattened(base)
    return {
        key: value
        for key, value in flattened(scene).items()
        if key not in ("name", "knit", "outputs") and value != there[key]
    }
