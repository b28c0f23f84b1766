"""How the loop is optimised (section 2.1 of the paper)."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from knitstudy.study.keys import Section, key


class Geometry(Section):
    """Optimisation of the loop: weights of Eqs. (1) and (3), what may move, and samples a Bezier curve.

    `free` lists for every control point the components that may move: "", "z", "yz", "xyz" and so on.
    """

    alpha: float = key(
        "a number > 0 and <= 1e12, the weight of F_distance in Eq. (1)",
        standing="assumed",
        source="weight of Eq. (1), not printed",
        checked="times 0.1 and 10: angles within 0.5 degrees (docs/geometry.md)",
        gt=0,
        le=1e12,
    )

    beta: float = key(
        "a number from 0 to 1e12, the weight of F_bending in Eq. (1)",
        standing="assumed",
        source="weight of Eq. (1), not printed",
        checked="times 0.1 and 10: angles within 0.5 degrees (docs/geometry.md)",
        ge=0,
        le=1e12,
    )

    gamma: float = key(
        "a number from 0 to 1e12, the weight of F_length in Eq. (1)",
        standing="assumed",
        source="weight of Eq. (1), not printed",
        checked="times 0.1 and 10: angles within 0.5 degrees (docs/geometry.md)",
        ge=0,
        le=1e12,
    )

    beta_0: float = key(
        "a number from 0 to 1e12, the scalar of Eq. (3)",
        standing="assumed",
        source="scalar of Eq. (3), not printed",
        checked="times 0.1 and 10: angles within 0.5 degrees (docs/geometry.md)",
        ge=0,
        le=1e12,
    )

    free: tuple[Annotated[str, Field(pattern="^x?y?z?$")], ...] = key(
        ('a list of the components that may move, one text such as "", z or xyz for every control point'),
        standing="assumed",
        source="the paper says that a subset of points and components moves, not which",
        checked="one list",
    )

    samples: int = key(
        "a whole number from 4 to 10000 (samples a Bezier curve)",
        standing="stated",
        source="section 2.1: 100 points a Bezier curve; true closest points are refined from them here",
        checked="100",
        ge=4,
        le=10_000,
    )
