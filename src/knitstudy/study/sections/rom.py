"""Reduced order models: where their joints come from, and of which kind they are (sections 2.4 to 2.6)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from knitstudy.study.keys import SceneName, Section, key


class Joints(Section):
    """Which direct simulation a reduced model takes its joints from; none where the geometry says enough."""

    contacts_from: SceneName | None = key(
        "the name of the dns scene that the joints come from (empty: where yarns are closest, tied by tie.radius)",
        standing="choice",
        source="the DNS whose contact zones make the joints (sections 2.4, 2.5)",
        checked="one DNS a knit, and none (scenes trade-*-rom*): tied knits carry the same within 1e-13",
        default=None,
    )


class PlanarJoints(Joints):
    """Of the planar model (Fig. 4); `section` is that of a segment which two yarns share.

    Its segments join the contacts, or lie along the maximum principal stress of the simulation `stress_from` (Fig. 14).
    """

    section: Literal["single", "doubled"] = key(
        "single or doubled: a segment of the planar model that two yarns share",
        standing="assumed",
        source=(
            "section 2.4: the same cross section as the yarns; where two yarns share a segment "
            "nothing is printed"
        ),
        checked="single and doubled (scenes rom2d-doubled-*)",
    )

    honeycomb: Literal["geometry", "principal_stress"] = key(
        "geometry (segments of the planar model join the contacts) or principal_stress (they lie along it)",
        standing="stated",
        source="section 3.4: MPS-based honeycombs beside the one from geometry",
        checked="both (scenes rom2d-by-*-stress-*)",
        default="geometry",
    )

    stress_from: SceneName | None = key(
        "the name of the dns scene whose principal stress segments lie along (empty where rom.honeycomb is geometry)",
        standing="choice",
        source="Table 4: directions of course and of wale tension, each pulled in both directions",
        checked="course and wale tension (scenes rom2d-by-*-stress-*)",
        default=None,
    )

    @model_validator(mode="after")
    def _stress_where_used(self) -> PlanarJoints:
        if (self.honeycomb == "principal_stress") != (self.stress_from is not None):
            wanted = "name a dns scene" if self.honeycomb == "principal_stress" else "be empty"
            raise ValueError(
                f"stress_from is {self.stress_from!r} but must {wanted} where rom.honeycomb is {self.honeycomb}"
            )
        return self


class SpatialJoints(Joints):
    """Of the spatial model (Figs. 5 and 6)."""

    joint: Literal["rigid", "pinned", "patch", "printed"] = key(
        (
            "rigid (arms to the contact point), pinned (arms that may turn there), patch (pinned, and yielding as the "
            "tied area does) or printed (as in Table 2: no arms)"
        ),
        standing="assumed",
        source=(
            "Table 2: u_T = 0, u_R = 0, and springs between the points; rigid arms to the contact "
            "point, a variant takes the paper at its word"
        ),
        checked="all four (scenes rom3d-pinned-*, rom3d-patch-*, rom3d-printed-*)",
    )


class Springs(SpatialJoints):
    """Springs where yarns are not tied (Table 2).

    They are averaged or of each crossing's own "zones", secants of the relative `displacement` of interfaces or
    centrelines along the `axes` of the contact or the global ones; or those of another scene, or of given `stiffness`
    along x, y and z.
    """

    springs_from: SceneName | None = key(
        ("the name of the dns scene whose averaged springs are used (empty for that of rom.contacts_from)"),
        standing="choice",
        source="springs of another simulation test what carries over from one load to another",
        checked="course springs in wale tension and the other way round (scenes rom3d-carried-*)",
    )

    springs: Literal["averaged", "zones"] = key(
        "averaged (one stiffness for all crossings) or zones (each crossing its own)",
        standing="stated",
        source="Table 2 prints one stiffness a direction; a variant gives every crossing its own",
        checked="averaged and zones (scenes rom3d-zones-*)",
    )

    stiffness: tuple[Annotated[float, Field(gt=0)], ...] = key(
        ("[], or a list of the springs' three stiffnesses along x, y and z in N/m instead of measured ones"),
        unit="N/m",
        standing="stated",
        source="Table 2; none: the springs are measured",
        checked="those of Table 2 (scenes rom3d-table2-*)",
        max_length=3,
    )

    axes: Literal["contact", "global"] = key(
        "contact (springs along the normal and in the tangent plane) or global (along x, y and z)",
        standing="inferred",
        source=(
            "Table 2 lists x, y and z; secants along these are negative at many crossings, along the "
            "contact's own axes at none (table2_springs)"
        ),
        checked="contact; global with the stiffnesses of Table 2 (scenes rom3d-table2-*)",
    )

    displacement: Literal["interface", "centreline"] = key(
        "interface or centreline: the relative displacement whose secants the springs are",
        standing="stated",
        source=(
            "section 2.6: relative displacement between yarn interfaces; that of the centrelines is a variant"
        ),
        checked="interface and centreline (table2_springs, scenes rom3d-centreline-*)",
    )

    @model_validator(mode="after")
    def _measured(self) -> Springs:
        if self.contacts_from is None:
            raise ValueError(
                "contacts_from is empty but must name a dns scene where yarns touch: springs are measured at its"
                " contacts"
            )
        return self

    @model_validator(mode="after")
    def _one_source(self) -> Springs:
        for name, value, empty in (
            ("springs_from", self.springs_from, "empty"),
            ("stiffness", list(self.stiffness) or None, "[]"),
        ):
            if value is not None and self.springs != "averaged":
                raise ValueError(
                    f"{name} is {value!r} but must be {empty} where rom.springs is {self.springs}: every crossing's own"
                    " springs are measured at that crossing"
                )
        if self.stiffness and (len(self.stiffness) != 3 or self.axes != "global" or self.springs_from):
            raise ValueError(
                f"stiffness is {list(self.stiffness)} but must be [] or three values, along x, y and z, which takes"
                " rom.axes global and an empty rom.springs_from"
            )
        return self
