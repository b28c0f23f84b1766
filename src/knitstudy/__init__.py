"""knitstudy: how knitted textiles carry load, from yarn geometry to reduced order models."""

from pkgutil import resolve_name
from typing import Any

__version__ = "0.1.0"

_PLACES = {
    "Fabric": "knitstudy.knit.geometry.fabric:Fabric",
    "read_fabric": "knitstudy.knit.geometry.readers:read_fabric",
    "Scene": "knitstudy.knit.scene.scene:Scene",
    "load_scene": "knitstudy.run.configuration:load_scene",
    "simulate": "knitstudy.run.store:simulate",
}
"""Names for scripts and notebooks, imported when they are asked for: the command starts without them.

Wings add others, such as ``plot``.
"""

__all__ = ["Fabric", "Scene", "load_scene", "read_fabric", "simulate"]


def __getattr__(name: str) -> Any:
    if name not in _PLACES and not name.startswith("_"):
        from knitstudy.registry import wings

        for wing in wings():
            _PLACES.update(wing.names)
    if name not in _PLACES:
        raise AttributeError(f"module 'knitstudy' has no attribute {name!r}")
    return resolve_name(_PLACES[name])
