"""Yarns cut at their crossings, and the six segments of a cell that the pieces make (Figs. 4 and 14).

A piece runs from one crossing of its yarn to the next. Between the lower and the upper crossing of one side of an
interlock both yarns run along the same segment of the honeycomb; every other segment is one piece. Pieces beyond the
first and the last row, where a yarn meets no other, and those at cut ends belong to no segment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from knitstudy.knit.geometry.crossings import Crossings
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints

# Kinds of segments in the order of Table 4; which of its segments 1 and 6 is the head is not said.
KINDS = ("head", "interlock, left", "interlock, right", "leg, left", "leg, right", "sinker")

NO_SEGMENT = -1

BETWEEN = {
    # Zones at the two ends, how many rows and columns the second one lies further: kind, and sides that the yarn is of.
    (2, 3, 0, 0): (0, (0,)),
    (0, 2, 0, 0): (1, (0, 1)),
    (1, 3, 0, 0): (2, (0, 1)),
    (2, 0, 1, 0): (3, (1,)),
    (3, 1, 1, 0): (4, (1,)),
    (1, 0, 0, 1): (5, (1,)),
}


@dataclass(frozen=True, eq=False)
class Segments:
    """Pieces P of all yarns, in their order along them, and the segments Q that they belong to."""

    yarn: Ints  # (P,)
    arc_length: Floats  # (P, 2) where a piece begins and ends [m]
    of_piece: Ints  # (P,) its segment, or `NO_SEGMENT`
    kind: Ints  # (Q,) place in `KINDS`
    row: Ints  # (Q,) labels of the crossing at the lower or left end
    column: Ints  # (Q,)
    central: Bools  # (Q,) whether a segment begins or ends at the centre cell's crossings


def centre(place: Ints) -> int:
    """Return the row, or column, in the middle of those (k,) that count from 0.

    Examples
    --------
    >>> centre(np.array([0, 1, 2]))
    1
    """
    return (int(place.max()) + 1) // 2


def segments(crossings: Crossings, lengths: Floats) -> Segments:
    """Return the pieces of yarns of some lengths (Y,) [m] between their crossings, and their segments."""
    yarn, arc_length, ends = _pieces(crossings, lengths)
    named = np.full((len(yarn), 3), -1)  # kind, row and column of the segment
    inner = np.flatnonzero(ends.min(axis=1) >= 0)
    labels = np.column_stack([crossings.zone, crossings.row, crossings.column])
    for k, other in (ends[inner, ::-1].T, ends[inner].T):
        between = np.column_stack([labels[k, 0], labels[other, 0], labels[other, 1:] - labels[k, 1:]])
        side = (crossings.yarn[k] == yarn[inner, None]).argmax(axis=1)
        for wanted, (kind, sides) in BETWEEN.items():
            here = (between == wanted).all(axis=1) & np.isin(side, sides)
            named[inner[here]] = np.insert(labels[k[here], 1:], 0, kind, axis=1)
    some = np.flatnonzero(named[:, 0] >= 0)
    number, _ = pd.factorize(pd.MultiIndex.from_arrays(list(named[some].T)))
    of_piece = np.full(len(yarn), NO_SEGMENT)
    of_piece[some] = number
    first = some[np.unique(number, return_index=True)[1]]
    middle = centre(crossings.row), centre(crossings.column)
    central = (labels[ends[first], 1:] == middle).all(axis=-1).any(axis=1)
    kind, row, column = named[first].T
    return Segments(yarn, arc_length, of_piece, kind, row, column, central)


def _pieces(crossings: Crossings, lengths: Floats) -> tuple[Ints, Floats, Ints]:
    """Yarn (P,), arc lengths (P, 2) and crossings (P, 2) at the ends of all pieces, -1 at the ends of yarns."""
    every = np.arange(len(lengths))
    none = np.full(len(lengths), -1)
    yarn = np.concatenate([every, crossings.yarn.T.ravel(), every])
    s = np.concatenate([np.zeros(len(lengths)), crossings.arc_length.T.ravel(), lengths])
    number = np.concatenate([none, np.tile(np.arange(len(crossings)), 2), none])
    order = np.lexsort((s, yarn))
    ends = np.column_stack([order[:-1], order[1:]])
    ends = ends[yarn[ends[:, 0]] == yarn[ends[:, 1]]]
    return yarn[ends[:, 0]], s[ends], number[ends]
