"""The knit as beams in contact (section 3.3, Fig. 12b)."""

from __future__ import annotations

from typing import Literal

from knitstudy.study.keys import Section, key


class Beam(Section):
    """Contact at the closest points of every crossing, of "rigid" or "hertz" sections; kind of ties.

    Section 3.3: only one contact node is captured for beams that are not parallel. `stiffness` is the penalty of rigid
    sections, over E R.
    """

    section: Literal["rigid", "hertz"] = key(
        "rigid (a penalty) or hertz (the approach of two crossed cylinders)",
        standing="inferred",
        source="section 3.3: the deformation of the cross-section is ignored",
        checked="rigid and hertz (scenes beam-*)",
    )

    tie: Literal["rigid", "pinned", "patch"] = key(
        "rigid, pinned (sections may turn) or patch (pins that yield as tied areas do): crossings that are tied",
        standing="assumed",
        source=(
            "section 2.3 ties the outer rows; a tied patch of solids lets sections turn nearly "
            "freely and yields, beams that are joined do not"
        ),
        checked="all three (scenes beam-pinned-*, beam-patch-*)",
    )

    stiffness: float = key(
        "a number > 0 and <= 1e12, times E R",
        unit="E R",
        standing="assumed",
        source="nothing printed; hard contact",
        checked="10 and 100 (scenes beam-*)",
        gt=0,
        le=1e12,
    )
