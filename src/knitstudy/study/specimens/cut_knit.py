"""Cells cut out of a knit, whose outer yarns end in the middles of their legs."""

from knitstudy.study.kinds import SPECIMENS, Specimen
from knitstudy.study.sections.geometry import Geometry
from knitstudy.study.sections.load import KnitTension
from knitstudy.study.sections.specimen import Pattern

SPECIMENS.register(
    Specimen(
        name="cut_knit",
        meaning="cells cut out of a knit",
        sections={"pattern": Pattern, "geometry": Geometry, "load": KnitTension},
        geometry=("pattern", "geometry", "yarn.diameter"),
        stage="cut_knit",
        outputs=(),
        requires={"solver.stabilisation": 0},
    )
)
