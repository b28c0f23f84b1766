"""Two straight yarns that cross."""

from knitstudy.study.kinds import SPECIMENS, Specimen
from knitstudy.study.sections.load import Path
from knitstudy.study.sections.specimen import Pair

SPECIMENS.register(
    Specimen(
        name="pair",
        meaning="two straight yarns that cross",
        sections={"pair": Pair, "load": Path},
        geometry=("pair.angle", "pair.length", "pair.clearance", "yarn.diameter"),
    )
)
