"""The model `beam`: beams that touch along whole yarns (section 3.3, Fig. 12b)."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import model_validator

from knitstudy.knit.scene.alternatives import SECTIONS, STIFFNESSES, in_section
from knitstudy.knit.scene.keys import OneOf, Section, numerics, section
from knitstudy.knit.scene.kinds import MODELS, FidelityModel
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.sections import INLAY, OF_SOLIDS, BeamYarn, CellStrain, SecondYarn, SetYarn
from knitstudy.knit.scene.shared_sections import BeamGates, BeamMesh, Tie, TiedEdges
from knitstudy.knit.scene.specimens import Cell, Knit
from knitstudy.mechanics.beams.laws import LAWS
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.registry import lazy_import

OF_SECOND = tuple(in_section(key, SECTIONS[1]) for key in STIFFNESSES)
THINNEST = 0.5  # of the diameters of two yarns, thinner over thicker: contact was checked down to there


class TouchingBeamGates(BeamGates):
    """Additional limits of beams in contact."""

    point: float = numerics("choice", meaning="over the internal energy", default=0.3, gt=0)
    """Share of contact beyond the verified range of bends, angles and overlaps, gates.md. Checked: 0.3, below which
    forces of jerseys are within 10 % of solid yarns."""


class FrictionAlone(Section, group="contact"):
    """Contact of cells: the keys of the interaction alone."""


class BeamKeys(Section, group="beam"):
    """Contact along all yarns with "rigid" or "hertz" sections.

    Rigid sections press each other with 10 E sqrt(R) approach^1.5.
    """

    section: Annotated[str, OneOf(LAWS.all)] = numerics("choice")
    """Section 3.3 ignores the deformation of the cross-section: rigid, a third more force in cells that slide.
    Checked: rigid and hertz (scenes beam-*)."""


class TiedBeamKeys(BeamKeys):
    """Contact along all yarns with "rigid" or "hertz" sections, and the ties.

    Rigid sections press each other with 10 E sqrt(R) approach^1.5; pinned ties have 10 E R.
    """

    tie: Literal["rigid", "pinned", "patch"] = numerics(
        "choice",
        allowed="rigid, pinned (sections can turn) or patch (pins as compliant as tied areas): the tied crossings",
    )
    """Section 2.3 ties the outer rows; tied solids turn nearly freely and are compliant: patch. Checked: all three."""


class _Beams(Scene):
    touches = True

    yarn: BeamYarn = section()
    mesh: BeamMesh = section()
    gates: TouchingBeamGates = section()

    @model_validator(mode="after")
    def _has_straight_sections_of_its_own(self) -> Self:
        own = [key for key in (*STIFFNESSES, *OF_SECOND) if self.value(key) is not None]
        if own and self.mesh.section_law == "curved":
            of = f"where {own[0]} is given: it is the law of the solid circle that this replaces"
            raise ValueError(f"mesh.section_law is 'curved' but must be straight {of}")
        return self


class Beams(_Beams, Knit):
    """Knits of beams in contact."""

    implied: ClassVar = OF_SOLIDS | {"yarn.set": 1.0}

    tie: Tie = section()
    beam: TiedBeamKeys = section()
    contact: TiedEdges = section()


class CellOfBeams(_Beams, Cell):
    """Cells of an endless knit of beams in contact."""

    slips = True
    takes: ClassVar = "all stitches"
    ignored_if_set: ClassVar = {
        "beam.section": ("yarn.pressing",),
        "yarn.youngs_modulus": (*STIFFNESSES, "yarn.pressing"),
    }
    implied: ClassVar = OF_SOLIDS | {"contact.tied_edges": "none", "tie.radius": 0.183}

    yarn: SetYarn = section()
    yarn_b: SecondYarn = section()
    load: CellStrain = section()
    beam: BeamKeys = section()
    contact: FrictionAlone = section()

    @property
    def yarns(self) -> tuple[SetYarn, ...]:
        """The yarn of rows a, and the yarn of rows b if there is one."""
        values = {key: getattr(self.yarn_b, key) for key in SecondYarn.model_fields}
        own = {key: value for key, value in values.items() if value is not None and key != "rows"}
        return (self.yarn, self.yarn.model_copy(update=own)) if own else (self.yarn,)

    @property
    def of_geometry(self) -> tuple[str, ...]:
        """Sections and dotted keys that the geometry depends on, beside the specimen."""
        laid = INLAY in self.yarn_b.rows
        return (*super().of_geometry, *(("yarn_b.rows", "yarn_b.diameter") if laid else ()))

    def _by_row(self, one: float, other: float) -> Floats | float:
        if len(self.yarns) == 1:
            return one
        turns = self.yarn_b.rows
        count = self.pattern.rows * len(turns) // (len(turns) - turns.count(INLAY))
        return np.array([one, other])[self.yarn_of(np.arange(count))]

    @property
    def radius(self) -> Floats | float:
        """Radius of the yarn, or of all yarns, rows and inlays (Y,), where there are two [m]."""
        return self._by_row(self.yarn.radius, self.yarns[-1].radius)

    @property
    def tex(self) -> Floats | float:
        """Linear density [g/km], as `radius`; nan where it is not known."""
        one, other = (self.tex_of(section) for section in SECTIONS)
        return self._by_row(one, one if math.isnan(other) and self.yarn_b.diameter is None else other)

    def yarn_of(self, rows: Ints) -> Ints:
        """Return which of its two yarns rows and inlays (k,) are of."""
        turns = np.array([int(row != "a") for row in self.yarn_b.rows])
        return turns[rows % len(turns)]

    @model_validator(mode="after")
    def _can_have_its_second_yarn(self) -> Self:
        count = self.pattern.rows
        turns = self.yarn_b.rows
        second = self.yarns[-1]
        if second is self.yarn:
            if turns != ("a", "b"):
                raise ValueError(
                    f"yarn_b.rows is {list(turns)} but there is no yarn b: set yarn_b.of, or values of yarn_b"
                )
            return self
        if turns[0] == INLAY or 2 * INLAY in "".join(turns):
            raise ValueError(f"yarn_b.rows is {list(turns)} but must have a row, a or b, before every inlay")
        if count % (repeat := len(turns) - turns.count(INLAY)):
            raise ValueError(
                f"pattern.rows is {count} but must be a multiple of {repeat}, as of yarn_b.rows {list(turns)}"
            )
        most = self.yarn.diameter
        own = second.diameter
        if not (least := THINNEST * most) <= own <= most:
            wanted = f"from {least:g} to {most:g} m, yarn.diameter: loops are drawn for the thicker yarn"
            raise ValueError(f"yarn_b.diameter is {own:g} m but must be {wanted}")
        if self.yarn.pressing is None and second.pressing is not None:
            raise ValueError("yarn_b.pressing is given but yarn.pressing is not: give both, or none")
        replaced = (second.stretching, second.bending, second.twisting, second.pressing)
        if self.yarn_b.youngs_modulus is not None and None not in replaced:
            raise ValueError(
                "yarn_b.youngs_modulus is not read where all stiffnesses are given; leave it out"
            )
        return self


MODELS.register(
    FidelityModel(
        name="beam",
        meaning="beams in contact",
        parts=(Beams, CellOfBeams),
        build=lazy_import("knitstudy.knit.models.beam.build:build"),
        memory=350,
        memory_a_cell=3.3,
        seconds_a_cell=1.1,
    )
)
