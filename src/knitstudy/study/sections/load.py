"""What drives a specimen."""

from __future__ import annotations

from itertools import pairwise
from typing import ClassVar, Literal

from pydantic import field_validator, model_validator

from knitstudy.study.keys import Section, key


class Tension(Section):
    """A specimen is deformed to an engineering `strain`, compressed if it is negative.

    `lateral`: what goes with it held or free; `stops`: strains at which an increment has to end.
    """

    strain: float = key(
        "a number from -0.2 to 0.5, not 0 (0.05 is 5 %, -0.05 a compression)",
        standing="stated",
        source="section 3.1: 5 % course strain",
        checked="-5 to 5 %",
        ge=-0.2,
        le=0.5,
    )

    lateral: Literal["fixed", "free"] = key(
        "fixed or free: the other components of the driven ends, of a cell its other strains",
        standing="assumed",
        source=(
            "prescribed displacements on the driven side; lateral components held, a variant leaves them free"
        ),
        checked="fixed; free: force -3.3 % (docs/sensitivity.md)",
    )

    stops: tuple[float, ...] = key(
        "a list of strains on the way, for example [0.01, 0.02], or []",
        standing="choice",
        source="numerical; where increments end, so that figures show the strains of Fig. 7c",
        checked="none",
    )

    @field_validator("strain")
    @classmethod
    def _goes_somewhere(cls, strain: float) -> float:
        if strain == 0:
            raise ValueError("nothing is deformed")
        return strain

    @model_validator(mode="after")
    def _stops_are_on_the_way(self) -> Tension:
        shares = (0.0, *(stop / self.strain for stop in self.stops), 1.0)
        if any(later <= earlier for earlier, later in pairwise(shares)):
            raise ValueError(
                f"stops is {list(self.stops)} but must go on from one to the next between 0 and load.strain, "
                f"{self.strain:g}"
            )
        return self


class KnitTension(Tension):
    """A knit is pulled in `direction` to an engineering `strain` (section 2.3, Fig. 3).

    `lateral`: driven ends fixed or free in the other components; `stops`: strains at which an increment has to end.
    """

    direction: Literal["course", "wale"] = key(
        "course or wale",
        standing="stated",
        source=(
            "section 2.3: course and wale tension; in wale tension sinker arcs of the bottom yarn are"
            " held and head arcs of the top yarn driven"
        ),
        checked="both",
    )


class CellStrain(Tension):
    """A cell is deformed to an engineering `strain`: in course or wale direction, in both alike, or sheared.

    `lateral`: the other strains in the plane are held at 0, or free, so that no force goes with them.
    """

    deformation: Literal["course", "wale", "biaxial", "shear"] = key(
        "course, wale, biaxial or shear",
        standing="choice",
        source="strains in the plane that define a shell's stiffness",
        checked="all four",
        default="course",
    )


class Path(Section):
    """The grips of the upper yarn of a pair go to the displacements of `path` one after another.

    They go in straight legs that take equal shares of the load factor, the first from where they are.
    """

    lateral: ClassVar = "fixed"

    path: tuple[tuple[float, float, float], ...] = key(
        "a list of one displacement x, y, z in m or more",
        unit="m",
        standing="choice",
        source="of a case of verification; none for a knit",
        checked="none",
        min_length=1,
    )
