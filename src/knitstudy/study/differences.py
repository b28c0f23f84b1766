"""In which keys a scene differs from the defaults."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from knitstudy.study.scene import LABELS, Scene


def flattened(scene: Scene) -> dict[str, Any]:
    """Return the values of a scene by dotted key, in the order of its sections."""
    return flat(scene.to_dict())


def flat(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of nested mappings by dotted key."""
    found: dict[str, Any] = {}
    for key, value in document.items():
        inside = (
            {f"{key}.{part}": inner for part, inner in value.items()}
            if isinstance(value, dict)
            else {key: value}
        )
        found |= inside
    return found


def differences(scene: Scene, defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Return those keys of a scene, but labels and outputs, whose values are not the defaults."""
    below = {
        f"{name}.{key}": field.default
        for name, section in scene.sections.items()
        for key, field in type(section).model_fields.items()
        if not field.is_required()
    }
    defaults = below | dict(defaults)
    return {
        key: value
        for key, value in flattened(scene).items()
        if key not in LABELS and (key not in defaults or value != defaults[key])
    }
