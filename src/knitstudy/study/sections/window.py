"""Which cells of a knit are solid yarns, and what joins the beams around them."""

from __future__ import annotations

from pydantic import field_validator

from knitstudy.study.keys import SceneName, Section, key
from knitstudy.study.sections.gates import Gates
from knitstudy.study.sections.mesh import BeamMesh
from knitstudy.study.sections.polynomial_mesh import PolynomialMesh


class Window(Section):
    """The middle cell of the window by its interlock `row` and its `column`, how many `cells` wide and high it is.

    Around them a `margin` of cells is solid as well, whose crossings are not asked for. Where yarns touch outside,
    beams are in contact, or springs stand for it that the simulation `springs_from` measures, of a knit of any size.
    """

    row: int | None = key(
        "a whole number from 0 to pattern.rows - 1, or null for the middle",
        standing="choice",
        source="what is asked for",
        checked="the centre cell of 3 x 3 and 10 x 10 cells (docs/window.md)",
        default=None,
        ge=0,
    )

    column: int | None = key(
        "a whole number from 0 to pattern.loops - 1, or null for the middle",
        standing="choice",
        source="what is asked for",
        checked="the centre cell of 3 x 3 and 10 x 10 cells (docs/window.md)",
        default=None,
        ge=0,
    )

    cells: int = key(
        "an odd whole number >= 1",
        standing="choice",
        source="what is asked for",
        checked="1, and 3 of 3 x 3 cells (docs/window.md)",
        default=1,
        ge=1,
        le=999,
    )

    margin: int = key(
        "a whole number >= 0",
        standing="choice",
        source="numerical; how far from what is asked for yarns become beams",
        checked="0, and 1 of 3 x 3 cells with ties (docs/window.md)",
        default=0,
        ge=0,
        le=999,
    )

    springs_from: SceneName | None = key(
        "the name of a dns scene in contact whose averaged springs are used outside, or null where beams touch",
        standing="choice",
        source="numerical; secants at full load stand for contact at full load alone",
        checked="both, in 3 x 3 cells (docs/window.md)",
        default=None,
    )

    @field_validator("cells")
    @classmethod
    def _has_a_middle(cls, value: int) -> int:
        if value % 2 == 0:
            raise ValueError(f"cells is {value} but must be odd: one cell is the middle")
        return value


class WindowMesh(PolynomialMesh, BeamMesh):
    """Of the solid yarns in the window, and of the beams around it."""


class WindowGates(Gates):
    """Limits of a window besides."""

    jump: float = key(
        "a number > 0, over the largest force where solid yarns and beams meet",
        standing="choice",
        source="numerical; what Newton's method leaves is a hundredth of it, docs/window.md",
        checked="1e-4",
        default=1e-4,
        gt=0,
    )
