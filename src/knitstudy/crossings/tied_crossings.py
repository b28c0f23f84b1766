"""Which crossings of a specimen are tied, and which pieces of yarn hold them (Fig. 3 of the paper)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from knitstudy.geometry.pattern import Crossings
from knitstudy.mesh.sweep import SweptMesh
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


def tied_pieces(mesh: SweptMesh, crossings: Crossings, tied: np.ndarray) -> np.ndarray:
    """Return the interlock row (S,) that every slice is tied in, -1 where its nearest crossing is not tied.

    Two pieces of yarns of one interlock row that both hold ties are one there: they do not touch each other.

    Parameters
    ----------
    mesh : SweptMesh
    crossings : Crossings
    tied : ndarray of bool, shape (K,)
    """
    piece = np.full(mesh.slices, -1)
    for yarn in range(mesh.yarns):
        here, side = np.nonzero(crossings.yarn == yarn)
        slices = np.flatnonzero(mesh.yarn_of_slice == yarn)
        along = cKDTree(crossings.arc_length[here, side][:, None])
        nearest = here[along.query(mesh.arc_length[slices][:, None])[1]]
        piece[slices] = np.where(tied[nearest], crossings.row[nearest], -1)
    return piece
