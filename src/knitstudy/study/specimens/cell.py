"""One cell of an endless knit, which repeats itself in both directions."""

from knitstudy.study.kinds import SPECIMENS, Specimen
from knitstudy.study.sections.geometry import Geometry
from knitstudy.study.sections.load import CellStrain
from knitstudy.study.sections.specimen import Pattern

SPECIMENS.register(
    Specimen(
        name="cell",
        meaning="a cell of an endless knit",
        sections={"pattern": Pattern, "geometry": Geometry, "load": CellStrain},
        geometry=("pattern", "geometry", "yarn.diameter"),
        stage="cell",
        outputs=("deck",),
        requires={"contact.tied_edges": "none", "solver.stabilisation": 0},
    )
)
