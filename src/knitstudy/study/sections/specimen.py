"""Size and shape of what is simulated: a knit, or two crossing yarns."""

from __future__ import annotations

from typing import Literal

from knitstudy.study.keys import LONGEST, Section, key


class Pattern(Section):
    """Size and shape of the knit: `rows` rows of interlocks between `rows` + 1 yarns of `loops` loops.

    `control_points` (P, 3) in m describe one loop from sinker centre to sinker centre before optimisation; `clearance`
    is the gap c0 wanted at every crossing, in yarn radii. `course_spacing` and `wale_spacing` are those that it is
    drawn for; rows stand `course_ratio` times the course spacing apart, and `keep` says what stays of the drawn loop.
    """

    loops: int = key(
        "a whole number from 1 to 10000",
        standing="stated",
        source="sections 3.1 and 3.5: 3 x 3 unit cells",
        checked="3",
        ge=1,
        le=10_000,
    )

    rows: int = key(
        "a whole number from 1 to 10000",
        standing="inferred",
        source=(
            "n + 1 yarns for n rows of interlocks: DOF(n) = n^2 [21057 + 40700 (1 - 2/n)] fits Table "
            "3 within 0.3 %"
        ),
        checked="3",
        ge=1,
        le=10_000,
    )

    course_spacing: float = key(
        "a number > 0 and <= 1e6, in m",
        unit="m",
        standing="calibrated",
        source="not printed; fitted with the control points",
        checked="one value",
        gt=0,
        le=LONGEST,
    )

    wale_spacing: float = key(
        "a number > 0 and <= 1e6, in m",
        unit="m",
        standing="calibrated",
        source="not printed; fitted with the control points",
        checked="one value",
        gt=0,
        le=LONGEST,
    )

    control_points: tuple[tuple[float, float, float], ...] = key(
        "a list of at least 4 points x, y, z in m",
        unit="m",
        standing="calibrated",
        source=(
            "not printed; fitted to the angles of Table 4 and to 41.6 mm of yarn a loop (999 beam "
            "nodes at 0.5 mm over 12 loops, Table 5)"
        ),
        checked="one loop shape",
        min_length=4,
    )

    clearance: float = key(
        "a number from 0 to 1, in yarn radii",
        unit="yarn radii",
        standing="assumed",
        source=(
            "not printed; small and positive, as Fig. 7 shows no contact at 0.05 % and symmetric "
            "contact by 0.45 % strain"
        ),
        checked="0.005 to 0.04: force -2.3 % at 0.04 (docs/sensitivity.md)",
        ge=0,
        le=1,
    )

    course_ratio: float = key(
        "a number from 0.5 to 2, course spacing over the one that the loop is drawn for",
        standing="choice",
        source="Fig. 11a varies the course spacing without saying how far",
        checked="0.7 to 1.3 (docs/geometry.md)",
        default=1.0,
        ge=0.5,
        le=2,
    )

    keep: Literal["shape", "length", "wale_spacing"] = key(
        "shape, length or wale_spacing: what stays of the drawn loop at another course spacing or diameter",
        standing="choice",
        source="not printed: Fig. 11 does not say what is held fixed (docs/geometry.md)",
        checked="all three",
        default="shape",
    )


class Pair(Section):
    """Two straight yarns of `length` that cross at `angle` in their middles, `clearance` yarn radii apart.

    Held and driven are, by `support`, the nodes of both "ends", or the surface of the half turned away from the other
    yarn, the "back".
    """

    angle: float = key(
        "a number > 0 and <= 90, in degrees",
        unit="degree",
        standing="choice",
        source="of a case of verification",
        checked="90 and 30",
        gt=0,
        le=90,
    )

    length: float = key(
        "a number > 0 and <= 1e6, in m, of each of the two yarns",
        unit="m",
        standing="choice",
        source=(
            "of a case of verification: nearly three diameters, beyond what the other yarn covers at "
            "30 degrees"
        ),
        checked="5 mm",
        gt=0,
        le=LONGEST,
    )

    clearance: float = key(
        "a number from 0 to 1, in yarn radii",
        unit="yarn radii",
        standing="choice",
        source="of a case of verification",
        checked="0.01",
        ge=0,
        le=1,
    )

    support: Literal["ends", "back"] = key(
        "ends or back: what is held and driven of each yarn",
        standing="choice",
        source=(
            "of a case of verification: the halves turned away from each other are held, as bodies in"
            " theories of contact are"
        ),
        checked="back",
    )
