"""Contact of solid yarns that are polynomials times splines: where its points are."""

from __future__ import annotations

from pydantic import model_validator

from knitstudy.study.keys import key
from knitstudy.study.sections.interaction import SolidContact


class PolynomialContact(SolidContact):
    """Contact of solid yarns without hexahedra, on their true surfaces.

    The local indentation that polynomials cannot show is added in series, computed from their own space: stiffnesses,
    penetration and augmentations have no effect.
    Cells of contact are as long as `cell` along the yarn within `window` of a crossing, and three times as long
    elsewhere; around they are `cell`.
    """

    cell: float = key(
        "a number from 0.05 to 0.5, in yarn radii",
        unit="yarn radii",
        standing="choice",
        source="numerical; length of a cell near crossings, with contact.points x contact.points Gauss points",
        checked="0.15 to 0.75 of a pair: force +0.3 % at 0.15, -2.5 % at 0.5, -7.6 % at 0.75 (docs/contact.md)",
        default=0.25,
        ge=0.05,
        le=0.5,
    )

    window: float = key(
        "a number from 0.3 to 4, in yarn radii, and not below contact.cell",
        unit="yarn radii",
        standing="choice",
        source="numerical; sqrt(2) times the larger semiaxis of the area of contact and the way that it slides",
        checked="0.8 to 1.6 of a pair: force within 1.3 % (docs/contact.md)",
        default=1.2,
        ge=0.3,
        le=4,
    )

    @model_validator(mode="after")
    def _has_a_cell_in_its_window(self) -> PolynomialContact:
        if self.window < self.cell:
            raise ValueError(f"window is {self.window:g} but must be at least contact.cell, {self.cell:g}")
        return self
