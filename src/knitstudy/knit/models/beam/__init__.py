"""The model `beam`: beams that touch along whole yarns (section 3.3, Fig. 12b)."""

from __future__ import annotations

from typing import Annotated, Literal

from knitstudy.knit.scene.keys import OneOf, Positive, Section, numerics
from knitstudy.knit.scene.kinds import MODELS, Model
from knitstudy.knit.scene.sections import BeamYarn
from knitstudy.knit.scene.shared_sections import BeamGates, BeamMesh, Newton, Tie, TiedEdges
from knitstudy.mechanics.beams.laws import LAWS
from knitstudy.registry import later


class TouchingBeamGates(BeamGates):
    """Additional limits of beams in contact."""

    point: float = numerics("choice", meaning="over the internal energy", default=0.3, gt=0)
    """Share of contact beyond the verified range of bends, angles and overlaps, gates.md. Checked: 0.3, below which
    forces of jerseys are within 8 % of solid yarns."""


class Beam(Section):
    """Contact along all yarns with "rigid" or "hertz" sections, and the ties.

    Rigid sections press each other with `stiffness` E sqrt(R) approach^1.5; pinned ties have `stiffness` E R.
    """

    section: Annotated[str, OneOf(LAWS.all)] = numerics("choice")
    """Section 3.3 ignores the deformation of the cross-section: rigid, a third more force in cells that slide.
    Checked: rigid and hertz (scenes beam-*)."""
    tie: Literal["rigid", "pinned", "patch"] = numerics(
        "choice",
        allowed="rigid, pinned (sections can turn) or patch (pins as compliant as tied areas): the tied crossings",
    )
    """Section 2.3 ties the outer rows; tied solids turn nearly freely and are compliant: patch. Checked: all three."""
    stiffness: Positive = numerics("assumed", meaning="where hertz sections have 0.8 to 0.9")
    """Not printed; hard contact. Checked: 10 and 100 (scenes beam-*)."""


MODELS.register(
    Model(
        name="beam",
        meaning="beams in contact",
        label="beams",
        specimens=("knit", "cut_knit", "cell"),
        slips=("cell",),
        sections={
            "yarn": BeamYarn,
            "mesh": BeamMesh,
            "tie": Tie,
            "solver": Newton,
            "gates": TouchingBeamGates,
            "beam": Beam,
        },
        touching={"contact": TiedEdges},
        tied=None,
        build=later("knitstudy.knit.models.beam.build:build"),
        look=("#00704F", "-", "P"),
        memory=350,
        memory_a_cell=3.3,
        seconds_a_cell=1.1,
    )
)
