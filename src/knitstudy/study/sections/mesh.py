"""Element sizes."""

from __future__ import annotations

from typing import Literal

from pydantic import field_validator

from knitstudy.mechanics.elements import ELEMENTS
from knitstudy.study.keys import LONGEST, Section, key, registered


class SolidMesh(Section):
    """Sizes of solid elements at crossings, their growth on legs, and the element."""

    size: float = key(
        "a number > 0 and <= 1e6, in m",
        unit="m",
        standing="stated",
        source="Table 5: 0.3 mm",
        checked="0.225 to 0.6 mm: force +7 % at 0.6 mm (docs/sensitivity.md)",
        gt=0,
        le=LONGEST,
    )

    growth: float = key(
        "a number from 1 to 4, spacing on legs over size",
        standing="assumed",
        source="spacing of slices between crossings; near the count of nodes in Table 5",
        checked="1 to 1.5: force within 0.1 % (docs/sensitivity.md)",
        ge=1,
        le=4,
    )

    refinement: float = key(
        "a number from 1 to 3, size over the size of elements at crossings",
        default=1.0,
        standing="assumed",
        source="slices stand nearer, and sections are drawn towards the other yarn (docs/refinement.md)",
        checked="1 to 3 (docs/refinement.md)",
        ge=1,
        le=3,
    )

    element: str = key(
        ELEMENTS.allowed,
        standing="stated",
        source=("section 2.3: linear hexahedra with reduced integration; quadratic ones are the reference"),
        checked="over quadratic, tied cell at 0.3 mm: one_point -3 % in force",
    )

    @property
    def smallest(self) -> float:
        """Size of elements at crossings [m]: what contact is measured with."""
        return self.size / self.refinement

    @field_validator("element")
    @classmethod
    def _is_registered(cls, value: str) -> str:
        return registered(value, ELEMENTS.names())


class BeamMesh(Section):
    """Size of beam elements, and their section."""

    beam_size: float = key(
        "a number > 0 and <= 1e6, in m",
        unit="m",
        standing="stated",
        source="Table 5: 0.5 mm",
        checked="0.5 mm",
        gt=0,
        le=LONGEST,
    )

    section_law: Literal["straight", "curved"] = key(
        "straight (of a straight rod) or curved (of a rod as bent as the yarn is): the law of the beams' sections",
        standing="assumed",
        source=(
            "section 2.5: beams along the centrelines, whose sections the paper does not say; a bent yarn of solids is"
            " as stiff as curved says, 8 to 15 % stiffer than straight (docs/beams.md)"
        ),
        checked="curved and straight: force -4 to -6 % (scenes rom3d-straight-*)",
    )
