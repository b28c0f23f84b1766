"""knitstudy: how knitted textiles carry load, from yarn geometry to reduced order models."""

from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:  # for editors and type checkers
    from knitstudy.knit.geometry.fabric import Fabric
    from knitstudy.knit.geometry.readers import read_fabric
    from knitstudy.knit.models.beam import Beams, CellOfBeams
    from knitstudy.knit.models.hexahedra import Hexahedra, TiedHexahedra
    from knitstudy.knit.models.rom2d import PlanarNetwork
    from knitstudy.knit.models.rom3d import SpatialNetwork, TiedSpatialNetwork
    from knitstudy.knit.models.spline_yarns import (
        CellOfSplineYarns,
        SplineYarns,
        TiedCellOfSplineYarns,
        TiedSplineYarns,
    )
    from knitstudy.knit.scene.scene import Scene
    from knitstudy.knit.scene.sections import BeamYarn, CellStrain, KnitTension, Pattern, SetYarn, SolidYarn
    from knitstudy.knit.scene.shared_sections import Friction
    from knitstudy.run.configuration import load_scene
    from knitstudy.run.store import simulate

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
    "knit.scene.scene": ("Scene",),
    "knit.scene.sections": ("BeamYarn", "CellStrain", "KnitTension", "Pattern", "SetYarn", "SolidYarn"),
    "knit.scene.shared_sections": ("Friction",),
    "run.configuration": ("load_scene",),
    "run.store": ("simulate",),
}
"""Names for scripts and notebooks by module, imported when they are asked for: the command starts without them."""

_NAMES = {name: f"knitstudy.{module}:{name}" for module, names in _PLACES.items() for name in names}

__all__ = [  # wings add others, such as ``plot``
    "BeamYarn",
    "Beams",
    "CellOfBeams",
    "CellOfSplineYarns",
    "CellStrain",
    "Fabric",
    "Friction",
    "Hexahedra",
    "KnitTension",
    "Pattern",
    "PlanarNetwork",
    "Scene",
    "SetYarn",
    "SolidYarn",
    "SpatialNetwork",
    "SplineYarns",
    "TiedCellOfSplineYarns",
    "TiedHexahedra",
    "TiedSpatialNetwork",
    "TiedSplineYarns",
    "load_scene",
    "read_fabric",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name not in _NAMES and not name.startswith("_"):
        from knitstudy.registry import wings

        for wing in wings():
            _NAMES.update(wing.names)
    if name not in _NAMES:
        raise AttributeError(f"module 'knitstudy' has no attribute {name!r}")
    return resolve_name(_NAMES[name])
