"""A plain knit."""

from knitstudy.study.kinds import SPECIMENS, Specimen
from knitstudy.study.sections.geometry import Geometry
from knitstudy.study.sections.load import KnitTension
from knitstudy.study.sections.specimen import Pattern

SPECIMENS.register(
    Specimen(
        name="knit",
        meaning="rows of loops",
        sections={"pattern": Pattern, "geometry": Geometry, "load": KnitTension},
        geometry=("pattern", "geometry", "yarn.diameter"),
    )
)
