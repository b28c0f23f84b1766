"""The solid arcs of a window, all tied or all in contact, and the sections at their ends that beams carry."""

from __future__ import annotations

import numpy as np

from knitstudy.geometry.pieces import Pieces
from knitstudy.mechanics.polynomial_yarn.space import Space
from knitstudy.mesh.grips import Grips
from knitstudy.solids.discretisation import Discretisation
from knitstudy.solids.solid_yarns import SolidYarns
from knitstudy.solids.yarn_pieces import assemble, divided
from knitstudy.study.scene import Scene


def solid_pieces(scene: Scene, pieces: Pieces) -> SolidYarns:
    """Return the solid yarns of a window: all crossings are tied, or all in contact.

    Raises
    ------
    MeshError
        If the yarn bends tighter than its radius, crossings cannot be tied, or yarns overlap.
    """
    tied = np.full(len(pieces.crossings.row), not scene.kind.interaction.touches)
    return assemble(scene, divided(scene, pieces, _ends), pieces, tied)


def end_sections(parts: Discretisation) -> np.ndarray:
    """Return the nodes (P, 2, 3) that the mean and the linear moments of both end sections of all pieces are."""
    ends = np.stack([parts.ends.held, parts.ends.driven]).reshape(2, -1, 3)
    return ends.swapaxes(0, 1)


def _ends(space: Space) -> Grips:
    return Grips(*(_carried(space, last) for last in (0, -1)))


def _carried(space: Space, last: int) -> np.ndarray:
    """Return the three nodes of the first (0) or last (-1) section of every piece that a beam's node carries."""
    first = [own.first_node[:-1][last] for own in space.yarns]
    return ((space.first_node[:-1] + first)[:, None] + np.arange(3)).ravel()
