"""knitstudy: how knitted textiles carry load, from yarn geometry to reduced models."""

from typing import Any

__version__ = "1.0.0"

_PLACES = {
    "knit.geometry.fabric": ("Fabric",),
    "knit.geometry.readers": ("read_fabric",),
    "knit.models.beam": ("Beams", "CellOfBeams"),
    "knit.models.hexahedra": ("Hexahedra", "TiedHexahedra"),
    "knit.models.rom2d": ("PlanarNetwork",),
    "knit.models.rom3d": ("SpatialNetwork", "TiedSpatialNetwork"),
    "knit.models.spline_yarns": (
        "CellOfSplineYarns",
        "SplineYarns",
        "TiedCellOfSplineYarns",
        "TiedSplineYarns",
    ),
    "knit.scene.knitout": ("repeat_of",),
    "knit.scene.scene": ("Scene",),
    "knit.scene.sections": (
        "BeamYarn",
        "CellStrain",
        "KnitTension",
        "Pattern",
        "SecondYarn",
        "SetYarn",
        "SolidYarn",
    ),
    "knit.scene.shared_sections": ("Friction",),
    "run.configuration": ("load_scene",),
    "run.simulations": ("simulate", "simulate_many"),
}
"""Names for scripts and notebooks by module, imported when they are asked for: the command starts without them."""

_NAMES = {name: f"knitstudy.{module}:{name}" for module, names in _PLACES.items() for name in names}

__all__ = [*_NAMES]  # optional packages add others, such as ``plot``


def __getattr__(name: str) -> Any:
    from knitstudy.registry import optional_packages, resolve

    if name not in _NAMES and not name.startswith("_"):
        for package in optional_packages():
            _NAMES.update(package.names)
    if name not in _NAMES:
        raise AttributeError(f"module 'knitstudy' has no attribute {name!r}")
    return resolve(_NAMES[name])
