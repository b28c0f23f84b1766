"""Defaults of all keys: ``defaults.yaml`` of a configuration over the file of a calibrated loop that it names."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from knitstudy.errors import ConfigurationError
from knitstudy.knit.scene.documents import CONFIG, read_yaml
from knitstudy.registry import unknown_choice

# Section and name that a key of a calibrated loop has in a scene.
_LOOP_KEYS = {
    "control_points": ("pattern", "control_points"),
    "course_spacing": ("pattern", "course_spacing"),
    "wale_spacing": ("pattern", "wale_spacing"),
    "diameter": ("yarn", "diameter"),
    "free": ("geometry", "free"),
}

_RECORD = "achieved"  # Record of the calibration, for readers


def base_of(config: Path) -> Path:
    """Return the folder whose defaults, calibration and families hold for a folder, or a file, of scenes."""
    config = Path(config)
    own = config.is_file() or (config.is_dir() and not (config / "defaults.yaml").exists())
    return CONFIG if own else config


def layered_defaults(config: Path = CONFIG) -> dict[str, Any]:
    """Return ``defaults.yaml``, with the loop file that ``pattern.loop`` names laid under it."""
    config = base_of(config)
    document = read_yaml(config / "defaults.yaml")
    pattern = document.get("pattern")
    if not isinstance(pattern, dict) or "loop" not in pattern:
        return document
    layer = _read_loop(config / str(pattern.pop("loop")))
    for name, inside in layer.items():
        if isinstance(document.setdefault(name, {}), dict):
            document[name] = inside | document[name]
    return document


@cache
def packaged_defaults() -> dict[str, Any]:
    """Return the defaults of the package, which scenes and sections take that are made in Python."""
    return layered_defaults()


def _read_loop(path: Path) -> dict[str, Any]:
    """Return the layer of a scene that a file of a calibrated loop gives."""
    loop = read_yaml(path)
    layer: dict[str, Any] = {}
    for name, (section, key) in _LOOP_KEYS.items():
        if name not in loop:
            raise ConfigurationError(f"{path}: the key {name!r} of a calibrated loop is missing")
        layer.setdefault(section, {})[key] = loop[name]
    known = [*_LOOP_KEYS, _RECORD]
    for name in loop.keys() - set(known):
        raise ConfigurationError(f"{path}: {unknown_choice('unknown key', name, name, known)}")
    return layer
