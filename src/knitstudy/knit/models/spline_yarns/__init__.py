"""The model `spline_yarns`: solid yarns of polynomials over the section times splines along the yarn."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from knitstudy.knit.scene.keys import Section, numerics, resolution, section
from knitstudy.knit.scene.kinds import MODELS, FidelityModel
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.sections import SolidYarn
from knitstudy.knit.scene.shared_sections import SolidContact, SolidGates, SolidNewton, Tie, TiedEdges
from knitstudy.knit.scene.specimens import Cell, Crossing, Knit
from knitstudy.mechanics.solids.spline_yarn import LARGEST_DEGREE
from knitstudy.registry import lazy_import

Degree = Annotated[int, Field(ge=2, le=LARGEST_DEGREE)]

Span = Annotated[float, Field(ge=0.05, le=2.0)]
"""Over the yarn's radius: a loop's bends have no room in longer spans, and shorter ones only cost."""

LOCKS = "as sections of degree 1 cannot widen in bending: 2.1 times too stiff at a Poisson ratio of 0.4"


class PolynomialMesh(Section):
    """Degree over the section and length of spans, on legs and near crossings.

    Spans nearer to a crossing than a radius have the degree `crossing_degree`; their length is `crossing_span` there
    and grows to `span`.
    """

    group: ClassVar[str] = "mesh"

    degree: Degree = resolution("choice", meaning=LOCKS, default=2)
    """Numerical; degree of the polynomials over the section, away from crossings. Checked: 2 to 6: of one loop, force
    +3.2 % at 2 and within 0.3 % from 3 on (docs/notes/solid_yarns.md)."""
    span: Span = resolution(
        "choice", unit="yarn radii", meaning="in yarn radii, and not below mesh.crossing_span", default=0.9
    )
    """Numerical; length of a span away from crossings. Checked: 0.6 to 1.8: of one loop, force +0.8 % at 1.8
    (docs/notes/solid_yarns.md)."""
    crossing_degree: Degree = resolution("choice", meaning="not below mesh.degree", default=2)
    """Numerical; degree of the polynomials near crossings. Checked: 2 to 6: force +2.5 to +3.6 % with 2 everywhere
    (docs/notes/solid_yarns.md)."""
    crossing_span: Span = resolution("choice", unit="yarn radii", default=0.9)
    """Numerical; length of a span near crossings. Checked: 0.3 to 0.9: of a cell with friction, force +0.7 and u_z -4 %
    at 0.9 (docs/notes/solid_yarns.md)."""

    @model_validator(mode="after")
    def _is_finer_near_crossings(self) -> PolynomialMesh:
        if self.crossing_degree < self.degree:
            raise ValueError(
                f"crossing_degree is {self.crossing_degree} but must be at least mesh.degree, {self.degree}"
            )
        if self.crossing_span > self.span:
            raise ValueError(
                f"crossing_span is {self.crossing_span:g} but must be at most mesh.span, {self.span:g}"
            )
        return self


class PolynomialContact(SolidContact):
    """Contact of spline yarns on their curved surfaces.

    The local indentation that the polynomials cannot represent is added in series, computed from their own space.
    Drawn yarns overlap by `penetration` at most. Cells of contact have the size `cell` around the yarn, and along it
    near crossings; elsewhere along the yarn they are three times as long.
    """

    cell: float = numerics("choice", unit="yarn radii", default=0.25, ge=0.05, le=0.5)
    """Numerical; length of a cell near crossings, with 3 x 3 Gauss points. Checked: 0.15 to
    0.75 of a pair: force +0.3 % at 0.15, -2.5 % at 0.5, -7.6 % at 0.75 (docs/notes/contact.md)."""


class PolynomialKnitContact(TiedEdges, PolynomialContact):
    """Contact of knits of spline yarns."""


class SplineScene(Scene):
    """Scenes of solid yarns of polynomials times splines."""

    yarn: SolidYarn = section()
    mesh: PolynomialMesh = section()
    tie: Tie = section()
    gates: SolidGates = section()


class TiedSplineYarns(SplineScene, Knit):
    """Knits of tied solid yarns."""

    specimens = ("cut_knit", "knit")
    touches = False

    solver: SolidNewton = section()


class SplineYarns(SplineScene, Knit):
    """Knits of solid yarns in contact."""

    specimens = ("cut_knit", "knit")
    touches = True

    solver: SolidNewton = section()
    contact: PolynomialKnitContact = section()


class TiedPairOfSplineYarns(SplineScene, Crossing):
    """Two tied solid yarns."""

    specimens = ("pair",)
    touches = False

    solver: SolidNewton = section()


class PairOfSplineYarns(SplineScene, Crossing):
    """Two solid yarns in contact."""

    specimens = ("pair",)
    touches = True
    implied: ClassVar = {"contact.tied_edges": "outer"}

    solver: SolidNewton = section()
    contact: PolynomialContact = section()


class TiedCellOfSplineYarns(SplineScene, Cell):
    """Cells of an endless knit of tied solid yarns, which are solved directly."""

    specimens = ("cell",)
    touches = False
    implied: ClassVar = {"load.start": "drawn"}


class CellOfSplineYarns(SplineScene, Cell):
    """Cells of an endless knit of solid yarns in contact, which are solved directly."""

    specimens = ("cell",)
    touches = True
    implied: ClassVar = {"load.start": "drawn", "contact.tied_edges": "none"}

    contact: PolynomialContact = section()


MODELS.register(
    FidelityModel(
        name="spline_yarns",
        meaning="solid yarns of polynomials times splines",
        parts=(
            TiedSplineYarns,
            SplineYarns,
            TiedPairOfSplineYarns,
            PairOfSplineYarns,
            TiedCellOfSplineYarns,
            CellOfSplineYarns,
        ),
        solid=True,
        outputs=("fields", "vtu"),
        build=lazy_import("knitstudy.knit.models.spline_yarns.build:build"),
    )
)
