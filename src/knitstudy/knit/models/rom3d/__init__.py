"""The model `rom3d`: a spatial network of beams with joints or springs where yarns cross (sections 2.5 and 2.6)."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from knitstudy.knit.scene.keys import SceneName, numerics, section
from knitstudy.knit.scene.kinds import MODELS, FidelityModel
from knitstudy.knit.scene.sections import OF_SOLIDS
from knitstudy.knit.scene.shared_sections import BeamGates, BeamMesh, Joints, Tie
from knitstudy.knit.scene.specimens import Knit
from knitstudy.registry import lazy_import


class SpatialJoints(Joints):
    """Joints of the spatial model (Figs. 5 and 6)."""

    joint: Literal["rigid", "pinned", "patch", "printed"] = numerics(
        "choice",
        allowed="rigid (arms), pinned (arms that turn), patch (pinned, compliant) or printed (no arms)",
    )
    """Tied solids yield: patch, 2 and 6 % above them where rigid is 74 and 86 % above. Table 2 prints u_T = 0, u_R = 0,
    and springs between the points: no arms. Checked: all four (scenes rom3d-pinned-*, rom3d-patch-*,
    rom3d-printed-*)."""
    normal: Literal[
        "normal_resultant", "mean_normal_resultant", "resultant", "mean_resultant", "closest_points"
    ] = numerics(
        "inferred",
        allowed="normal_resultant (of the pressure), resultant (of pressure and friction), mean_normal_resultant or "
        "mean_resultant (one for P1 and P2), or closest_points (their line)",
        default="normal_resultant",
    )
    """Section 2.5: the resultant contact force; section 4: contact forces along the normal, frictional forces in the
    tangent plane. Checked: all five (table2_springs, scenes rom3d-normal-*)."""


class SpringKeys(SpatialJoints):
    """Springs where yarns are not tied (Table 2).

    All have one stiffness: the average over crossings of the secants of the relative `displacement` of interfaces or
    centrelines along the `axes`, here or in another scene, or a given `stiffness` along x, y and z.
    """

    springs_from: SceneName | None = numerics(
        "choice", allowed="the name of the scene of solid yarns to measure (empty: that of rom.contacts_from)"
    )
    """Springs of another simulation show whether springs hold for another load. Checked: course springs in wale
    tension and the other way round (scenes rom3d-carried-*)."""
    stiffness: tuple[Annotated[float, Field(gt=0)], ...] = numerics(
        "stated",
        unit="N/m",
        allowed="[], or a list of the springs' three stiffnesses along x, y and z in N/m instead of measured ones",
        max_length=3,
    )
    """Table 2; none: the springs are measured. Checked: the values of Table 2 (scenes rom3d-table2-*)."""
    axes: Literal["local", "global"] = numerics(
        "inferred",
        allowed="local (z along the contact normal, x the course direction in the tangent plane) or global",
    )
    """Table 2 lists x, y and z; Fig. 6b: points and directions of springs. Along global z most measured secants are
    negative (table2_springs). Checked: both with the stiffnesses of Table 2 (scenes rom3d-table2-*)."""
    displacement: Literal["interface", "centreline"] = numerics(
        "stated", meaning="the relative displacement in the secants of the springs"
    )
    """Section 2.6: relative displacement between yarn interfaces; that of the centrelines is a variant. Checked:
    interface and centreline (table2_springs, scenes rom3d-centreline-*)."""

    @model_validator(mode="after")
    def _has_one_source(self) -> SpringKeys:
        if self.contacts_from is None:
            why = "springs are measured at its contacts"
            raise ValueError(
                f"contacts_from is empty but must name a scene of solid yarns where yarns touch: {why}"
            )
        given = list(self.stiffness)
        if given and (len(given) != 3 or self.springs_from):
            wanted = "[] or three values, along x, y and z, which takes an empty rom.springs_from"
            raise ValueError(f"stiffness is {given} but must be {wanted}")
        return self


class _SpatialNetwork(Knit):
    implied: ClassVar = OF_SOLIDS

    mesh: BeamMesh = section()
    gates: BeamGates = section()


class TiedSpatialNetwork(_SpatialNetwork):
    """Spatial networks of knits whose yarns are tied."""

    touches = False

    tie: Tie = section()
    rom: SpatialJoints = section()


class SpatialNetwork(_SpatialNetwork):
    """Spatial networks of knits whose yarns touch."""

    touches = True

    rom: SpringKeys = section()


MODELS.register(
    FidelityModel(
        name="rom3d",
        meaning="a spatial network of beams",
        parts=(TiedSpatialNetwork, SpatialNetwork),
        sources=("rom.contacts_from", "rom.springs_from"),
        build=lazy_import("knitstudy.knit.models.rom3d.build:build"),
        memory=500,
        seconds_a_cell=0.15,
    )
)
