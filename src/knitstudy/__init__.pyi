"""Names of the package for editors and type checkers; ``__init__.py`` imports them when they are asked for."""

from typing import Any

from knitstudy.knit.geometry.fabric import Fabric as Fabric
from knitstudy.knit.geometry.readers import read_fabric as read_fabric
from knitstudy.knit.models.beam import Beams as Beams
from knitstudy.knit.models.beam import CellOfBeams as CellOfBeams
from knitstudy.knit.models.hexahedra import Hexahedra as Hexahedra
from knitstudy.knit.models.hexahedra import TiedHexahedra as TiedHexahedra
from knitstudy.knit.models.rom2d import PlanarNetwork as PlanarNetwork
from knitstudy.knit.models.rom3d import SpatialNetwork as SpatialNetwork
from knitstudy.knit.models.rom3d import TiedSpatialNetwork as TiedSpatialNetwork
from knitstudy.knit.models.spline_yarns import CellOfSplineYarns as CellOfSplineYarns
from knitstudy.knit.models.spline_yarns import SplineYarns as SplineYarns
from knitstudy.knit.models.spline_yarns import TiedCellOfSplineYarns as TiedCellOfSplineYarns
from knitstudy.knit.models.spline_yarns import TiedSplineYarns as TiedSplineYarns
from knitstudy.knit.scene.knitout import repeat_of as repeat_of
from knitstudy.knit.scene.scene import Scene as Scene
from knitstudy.knit.scene.sections import BeamYarn as BeamYarn
from knitstudy.knit.scene.sections import CellStrain as CellStrain
from knitstudy.knit.scene.sections import KnitTension as KnitTension
from knitstudy.knit.scene.sections import Pattern as Pattern
from knitstudy.knit.scene.sections import SecondYarn as SecondYarn
from knitstudy.knit.scene.sections import SetYarn as SetYarn
from knitstudy.knit.scene.sections import SolidYarn as SolidYarn
from knitstudy.knit.scene.shared_sections import Friction as Friction
from knitstudy.run.configuration import load_scene as load_scene
from knitstudy.run.simulations import simulate as simulate
from knitstudy.run.simulations import simulate_many as simulate_many

__version__: str

def __getattr__(name: str) -> Any: ...
