"""A plain knit."""

from knitstudy.study.kinds import SPECIMENS, Specimen
from knitstudy.study.sections.geometry import Geometry
from knitstudy.study.sections.load import Tension
from knitstudy.study.sections.specimen import Pattern

SPECIMENS.register(
    Specimen(
        name="knit",
        meaning="rows of loops",
        sections={"pattern": Pattern, "geometry": Geometry, "load": Tension},
        geometry=("pattern", "geometry", "yarn.diameter"),
    )
)
