"""knitstudy: how knitted textiles carry load, from yarn geometry to reduced order models."""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_PLACES = {
    "Fabric": "knitstudy.knit.geometry.fabric",
    "read_fabric": "knitstudy.knit.geometry.readers",
    "Scene": "knitstudy.knit.scene.scene",
    "load_scene": "knitstudy.run.configuration",
    "simulate": "knitstudy.run.store",
    "plot": "knitstudy.use.plot",
}
"""Names for scripts and notebooks, imported when they are asked for: the command starts without them."""

__all__ = ["Fabric", "Scene", "load_scene", "plot", "read_fabric", "simulate"]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'knitstudy' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)
