"""How yarns act on each other (section 2.2, Fig. 2 and Table 1)."""

from __future__ import annotations

from typing import Literal

from knitstudy.study.keys import Section, key


class Tie(Section):
    """The mean and the linear moments of two yarns' displacement on a disc are joined where they cross and are tied."""

    radius: float = key(
        "a number from 0.05 to 0.8, in yarn radii",
        unit="yarn radii",
        standing="inferred",
        source=(
            "sqrt(2 R delta), within which yarns of radius R are nearer to each other than delta = 5 % of "
            "the stated 0.3 mm, Abaqus's default; the area of one facet of that size"
        ),
        checked="0.1 to 0.5: force of a tied cell of solid yarns -7 to +15 % (docs/ties.md)",
        default=0.183,
        ge=0.05,
        le=0.8,
    )


class TiedEdges(Section):
    """Which crossings of a knit in contact stay tied (Fig. 3).

    Of the "outer" interlock rows in course tension and columns of loops in wale tension, or "none".
    """

    tied_edges: Literal["outer", "none"] = key(
        ("outer (the first and the last interlock row, in wale tension the outer columns, are tied) or none"),
        standing="stated",
        source=(
            "section 2.3, Fig. 3: top and bottom rows are tied in course tension; in wale tension "
            '"for the same reason", taken as the outer columns'
        ),
        checked="outer and none (scene inputs-untied-isotropic-course)",
    )


class SolidContact(TiedEdges):
    """Contact of solid yarns (Table 1): stiffnesses over E / h, and how it is integrated and enforced.

    A `penetration` deeper than this share of h is removed by at most so many `augmentations` an increment. `points` are
    Gauss points along each side of a facet.
    """

    normal_stiffness: float = key(
        "a number > 0 and <= 1e12, times E over the mesh size",
        unit="E / h",
        standing="stated",
        source=(
            "Table 1: contact stiffness over element stiffness is 10; as pressure over gap it is "
            "taken as 10 E / h"
        ),
        checked=(
            "3, 10 and 30 of knits without multipliers (scenes *-penalty*); 3 to 30, of a pair "
            "pressed by 90 um at 0.3 mm: force -1.5 to +0.1 %, as multipliers bound the penetration"
        ),
        gt=0,
        le=1e12,
    )

    tangential_stiffness: float = key(
        "a number > 0 and <= 1e12, times E over the mesh size",
        unit="E / h",
        standing="stated",
        source=(
            "Table 1: stick stiffness over element stiffness is 10; as traction over slip it is taken"
            " as 10 E / h"
        ),
        checked="3 to 30, of a pair slid by 0.45 mm at 0.3 mm: force within 0.04 %, work -1.8 to +0.7 %",
        gt=0,
        le=1e12,
    )

    penetration: float = key(
        "a number > 0 and <= 1, a share of the mesh size",
        unit="h",
        standing="assumed",
        source="Table 1 says hard contact; how hard is not printed",
        checked=(
            "0.003 and 0.01, of a pair pressed by 90 um and slid at 0.3 mm: force within 1 % at the "
            "end of the way"
        ),
        gt=0,
        le=1,
    )

    augmentations: int = key(
        "a whole number from 0 to 100",
        standing="choice",
        source="numerical; updates of the multipliers where the penalty alone lets yarns in too deep",
        checked="10; 3 were needed at most by pairs pressed by 90 um",
        ge=0,
        le=100,
    )

    points: int = key(
        "a whole number from 1 to 4",
        standing="choice",
        source=(
            "numerical; Gauss points along each side of a facet; crossings lie over the middles of "
            "facets, where even numbers have no point and find contact late"
        ),
        checked=(
            "1 to 4, of a pair pressed by 36 um: with 2 it begins 10 um late at 0.3 mm and 17 um at "
            "0.45 mm (force -13 and -46 %)"
        ),
        ge=1,
        le=4,
    )


class Sliding(Section):
    """Coulomb friction."""

    friction: float = key(
        "a number from 0 to 1e6",
        standing="stated",
        source=(
            "Table 1: 0.76; static value of the data sheet of the polypropylene, which gives 0.44 for sliding"
        ),
        checked="0 to 1.5 (scenes inputs-friction*)",
        ge=0,
        le=1e6,
    )
