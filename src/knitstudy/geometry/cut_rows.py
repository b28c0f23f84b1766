"""Cells cut out of a knit: the outer yarns end in the middles of their legs, so that all cells are alike.

A knit of m rows of interlocks has m + 1 whole yarns, of which the first is held by heads alone and the last by sinkers
alone. Of m rows of cells, the yarn below has nothing but heads, each on the halves of its two legs, and the yarn above
nothing but sinkers: each cell has as much yarn as one of an endless knit.
"""

from __future__ import annotations

import numpy as np

from knitstudy.geometry.crossing import ZONES
from knitstudy.geometry.pattern import Knit
from knitstudy.geometry.pieces import Arcs

LEFT, RIGHT = [0, 2], [1, 3]
"""Zones of a cell."""

ABOVE, BELOW = 0, 1
"""Side that a yarn has at its crossings with the row above and with the row below."""


def cut_rows(knit: Knit) -> Arcs:
    """Return what is left of a knit's yarns: arches of the first one, whole ones, sinkers of the last one."""
    legs, length = middles_of_legs(knit), knit.centrelines[0].length
    sinkers = np.column_stack([np.append(0.0, legs[:, 1]), np.append(legs[:, 0], length)])
    whole = np.tile([0.0, length], (knit.rows - 1, 1))
    counts = [len(legs), *[1] * (knit.rows - 1), len(sinkers)]
    return Arcs(
        crossing=np.arange(len(knit.crossings.row)),
        yarn=np.repeat(np.arange(knit.rows + 1), counts),
        arc=np.concatenate([legs, whole, sinkers]),
    )


def middles_of_legs(knit: Knit) -> np.ndarray:
    """Return the arc lengths (n, 2) of the middles of both legs of every loop of a yarn [m].

    A leg runs from the crossings with the row below to those with the row above; all yarns have one shape.
    """
    crossings = knit.crossings
    at = crossings.arc_length[crossings.row == 0].reshape(knit.loops, ZONES, 2)
    up = at[:, LEFT, BELOW].max(axis=1) + at[:, LEFT, ABOVE].min(axis=1)
    down = at[:, RIGHT, ABOVE].max(axis=1) + at[:, RIGHT, BELOW].min(axis=1)
    return 0.5 * np.column_stack([up, down])
