"""Polynomials over the section times splines along the yarn: what solid yarns without hexahedra are divided into."""

from __future__ import annotations

from pydantic import model_validator

from knitstudy.mechanics.spline_yarn.basis import LARGEST_DEGREE
from knitstudy.study.keys import Section, key

SHORTEST, LONGEST = 0.05, 2.0
"""Of spans, over the yarn's radius: a loop's bends have no room in longer ones, and shorter ones only cost."""

LOCKS = "with 1 a section cannot widen where a bent yarn is compressed: 2.1 times too stiff at a Poisson ratio of 0.4"


class PolynomialMesh(Section):
    """Degree over the section and length of spans, on legs and near crossings, and the degree of the splines.

    Spans nearer to a crossing than `crossing_reach` have the degree `crossing_degree`; their length is `crossing_span`
    there and grows to `span`.
    """

    degree: int = key(
        f"a whole number from 2 to {LARGEST_DEGREE} ({LOCKS})",
        standing="choice",
        source="numerical; degree of the polynomials over the section, away from crossings",
        checked="2 to 6: of one loop, force +3.2 % at 2 and within 0.3 % from 3 on (docs/solid_yarns.md)",
        default=2,
        ge=2,
        le=LARGEST_DEGREE,
    )

    spline_degree: int = key(
        "a whole number from 2 to 5",
        standing="choice",
        source="numerical; of the splines along the yarn; quadratic ones need half as many spans more",
        checked="2 and 3",
        default=3,
        ge=2,
        le=5,
    )

    span: float = key(
        f"a number from {SHORTEST:g} to {LONGEST:g}, in yarn radii, and not below mesh.crossing_span",
        unit="yarn radii",
        standing="choice",
        source="numerical; length of a span away from crossings",
        checked="0.6 to 1.8: of one loop, force +0.8 % at 1.8 (docs/solid_yarns.md)",
        default=0.9,
        ge=SHORTEST,
        le=LONGEST,
    )

    crossing_degree: int = key(
        f"a whole number from mesh.degree to {LARGEST_DEGREE}",
        standing="choice",
        source="numerical; degree of the polynomials near crossings",
        checked=(
            "2 to 6 of a tied cell, 2 to 4 with friction: force +2.5 and +3.6 % with 2 everywhere, within 0.4 % from "
            "3 on (docs/solid_yarns.md)"
        ),
        default=2,
        ge=2,
        le=LARGEST_DEGREE,
    )

    crossing_span: float = key(
        f"a number from {SHORTEST:g} to {LONGEST:g}, in yarn radii",
        unit="yarn radii",
        standing="choice",
        source="numerical; length of a span near crossings",
        checked="0.3 to 0.9: of a cell with friction, force +0.7 and u_z -4 % at 0.9 (docs/solid_yarns.md)",
        default=0.9,
        ge=SHORTEST,
        le=LONGEST,
    )

    crossing_reach: float = key(
        "a number >= 0 and <= 10, in yarn radii",
        unit="yarn radii",
        standing="choice",
        source="numerical; distance from a crossing along the yarn up to which spans count as near",
        checked="0.5 to 1.5",
        default=1.0,
        ge=0,
        le=10,
    )

    @model_validator(mode="after")
    def _falls_away_from_crossings(self) -> PolynomialMesh:
        if self.crossing_degree < self.degree:
            raise ValueError(
                f"crossing_degree is {self.crossing_degree} but must be at least mesh.degree, {self.degree}"
            )
        if self.crossing_span > self.span:
            raise ValueError(
                f"crossing_span is {self.crossing_span:g} but must be at most mesh.span, {self.span:g}"
            )
        return self
