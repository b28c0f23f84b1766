"""Which crossings of a specimen are tied, and which pieces of yarn hold them (Fig. 3 of the paper)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.geometry.pattern import Crossings
from knitstudy.study.scene import Scene


def tied_crossings(scene: Scene, crossings: Crossings) -> np.ndarray:
    """Return which crossings (K,) of a scene's specimen are tied.

    With interaction "tie" all are. Where yarns touch, those along the free edges of a knit are, for what would slide
    off there: of the first and last interlock row in course tension, of the first and last column of loops in wale
    tension.
    """
    if not scene.kind.interaction.touches:
        return np.ones(len(crossings.row), dtype=bool)
    if scene.specimen == "pair" or scene.contact.tied_edges == "none":
        return np.zeros(len(crossings.row), dtype=bool)
    along = crossings.row if scene.load.direction == "course" else crossings.column
    return (along == along.min()) | (along == along.max())


def tied_pieces(stations: Sequence[np.ndarray], crossings: Crossings, tied: np.ndarray) -> np.ndarray:
    """Return the interlock row (S,) that every station is tied in, -1 where its nearest crossing is not tied.

    Two pieces of yarns of one interlock row that both hold ties are one there: they do not touch each other.

    Parameters
    ----------
    stations : sequence of ndarray
        Arc lengths on every yarn [m]; S in all.
    crossings : Crossings
    tied : ndarray of bool, shape (K,)
    """
    pieces = []
    for yarn, arc_length in enumerate(stations):
        here, side = np.nonzero(crossings.yarn == yarn)
        along = cKDTree(crossings.arc_length[here, side][:, None])
        nearest = here[along.query(arc_length[:, None])[1]]
        pieces.append(np.where(tied[nearest], crossings.row[nearest], -1))
    return np.concatenate(pieces)
