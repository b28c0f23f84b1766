"""The model `rom2d`: a planar honeycomb of beams (section 2.4, Fig. 4)."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import model_validator

from knitstudy.knit.scene.keys import SceneName, numerics, section
from knitstudy.knit.scene.kinds import MODELS, FidelityModel
from knitstudy.knit.scene.sections import OF_SOLIDS
from knitstudy.knit.scene.shared_sections import Joints
from knitstudy.knit.scene.specimens import Knit
from knitstudy.registry import lazy_import


class PlanarJoints(Joints):
    """Joints of the planar model (Fig. 4); `section` is the section of a segment that two yarns share.

    Segments join the contacts, or lie along the maximum principal stress of the simulation `stress_from` (Fig. 14).
    """

    section: Literal["single", "doubled"] = numerics(
        "assumed", meaning="the section of a segment that two yarns share"
    )
    """Section 2.4: the same cross section as the yarns; not printed where two yarns share a segment. Checked:
    single and doubled (scenes rom2d-doubled-*)."""
    honeycomb: Literal["geometry", "principal_stress"] = numerics(
        "stated",
        allowed="geometry (segments join the contacts) or principal_stress (segments lie along the stress)",
        default="geometry",
    )
    """Section 3.4: honeycombs based on the maximum principal stress, and the honeycomb from geometry. Checked: both
    (scenes rom2d-by-*-stress-*)."""
    stress_from: SceneName | None = numerics(
        "choice",
        allowed="the name of a scene of solid yarns (empty where rom.honeycomb is geometry)",
        default=None,
    )
    """Table 4: directions of course and of wale tension, each pulled in both directions. Checked: course and wale
    tension (scenes rom2d-by-*-stress-*)."""

    @model_validator(mode="after")
    def _stress_where_used(self) -> PlanarJoints:
        if (self.honeycomb == "principal_stress") != (self.stress_from is not None):
            wanted = "name a scene of solid yarns" if self.stress_from is None else "be empty"
            of = f"where rom.honeycomb is {self.honeycomb}"
            raise ValueError(f"stress_from is {self.stress_from!r} but must {wanted} {of}")
        return self


class PlanarNetwork(Knit):
    """Planar networks of knits."""

    implied: ClassVar = OF_SOLIDS
    takes: ClassVar = "one stitch"

    rom: PlanarJoints = section()


MODELS.register(
    FidelityModel(
        name="rom2d",
        meaning="a planar honeycomb of beams",
        parts=(PlanarNetwork,),
        sources=("rom.contacts_from", "rom.stress_from"),
        build=lazy_import("knitstudy.knit.models.rom2d.build:build"),
        memory=500,
        seconds_a_cell=0.15,
    )
)
