"""Yarns cut at their crossings, and the six segments of a cell that the pieces make (Figs. 4 and 14).

Along a yarn a loop is: sinker, lower and upper crossing with the row below, leg, lower and upper crossing with the row
above, head, and back again. A piece runs from one crossing of its yarn to the next, so that pieces make up all of the
yarn. Between the lower and the upper crossing of one side of an interlock both yarns run along the same segment of the
honeycomb; every other segment is one piece.

Pieces beyond the first and the last row, where a yarn meets no other, and those at cut ends belong to no segment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.geometry.crossings import Crossings

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

    yarn: np.ndarray  # (P,)
    arc_length: np.ndarray  # (P, 2) where a piece begins and ends [m]
    of_piece: np.ndarray  # (P,) its segment, or `NO_SEGMENT`
    kind: np.ndarray  # (Q,) place in `KINDS`
    row: np.ndarray  # (Q,) labels of the crossing at the lower or left end
    column: np.ndarray  # (Q,)
    central: np.ndarray  # (Q,) whether a segment begins or ends at the centre cell's crossings


def centre(place: np.ndarray) -> int:
    """Return the row, or column, in the middle of those (k,) that count from 0."""
    return (int(place.max()) + 1) // 2


def segments(crossings: Crossings, lengths: np.ndarray) -> Segments:
    """Return the pieces of yarns of some lengths (Y,) [m] between their crossings, and their segments."""
    yarn, arc_length, ends = _pieces(crossings, lengths)
    found: dict[tuple[int, int, int], int] = {}  # numbers of segments, by kind, row and column
    of_piece = np.full(len(yarn), NO_SEGMENT)
    cells = np.column_stack([crossings.row, crossings.column])
    in_centre = (cells == [centre(crossings.row), centre(crossings.column)]).all(axis=1)
    central: list[bool] = []
    for piece in np.flatnonzero(ends.min(axis=1) >= 0):
        named = _segment(crossings, ends[piece], yarn[piece])
        if named is None:
            continue
        if named not in found:
            found[named] = len(found)
            central.append(bool(in_centre[ends[piece]].any()))
        of_piece[piece] = found[named]
    kind, row, column = np.array(list(found), dtype=int).reshape(-1, 3).T
    return Segments(yarn, arc_length, of_piece, kind, row, column, np.array(central, dtype=bool))


def _pieces(crossings: Crossings, lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return yarn (P,), arc lengths (P, 2) and crossings (P, 2) at the ends of all pieces, -1 at the ends of yarns."""
    yarn, s = crossings.yarn.T.ravel(), crossings.arc_length.T.ravel()
    number = np.tile(np.arange(len(crossings.row)), 2)
    every = np.arange(len(lengths))
    yarn = np.concatenate([every, yarn, every])
    s = np.concatenate([np.zeros(len(lengths)), s, lengths])
    number = np.concatenate([0 * every - 1, number, 0 * every - 1])
    order = np.lexsort((s, yarn))
    yarn, s, number = yarn[order], s[order], number[order]
    begin = np.flatnonzero(yarn[1:] == yarn[:-1])
    pairs = np.column_stack([begin, begin + 1])
    return yarn[begin], s[pairs], number[pairs]


def _segment(crossings: Crossings, ends: np.ndarray, yarn: int) -> tuple[int, int, int] | None:
    """Kind, row and column of the segment that a piece of a yarn between two crossings belongs to, if any."""
    for k, other in (ends, ends[::-1]):
        row, column = int(crossings.row[k]), int(crossings.column[k])
        up, right = int(crossings.row[other]) - row, int(crossings.column[other]) - column
        zones = int(crossings.zone[k]), int(crossings.zone[other])
        kind, sides = BETWEEN.get((*zones, up, right), (None, ()))
        if kind is not None and any(crossings.yarn[k, side] == yarn for side in sides):
            return kind, row, column
    return None
