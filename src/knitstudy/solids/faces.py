"""Faces of the elements on the surfaces of yarns: whose nodes they have, and what a place on one is of these."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from knitstudy.mesh.sweep import SweptMesh


@dataclass(frozen=True, eq=False)
class Faces:
    """Faces of all yarns, in the order of `SweptMesh.surface_quads`.

    Attributes
    ----------
    nodes : ndarray, shape (N, 3)
        Undeformed [m].
    of_yarn : tuple of ndarray of int, shape (f, c)
        Nodes of the faces of every yarn; the first four are its corners.
    weights : callable
        Weights (k, c) of the nodes at places, from their shares (k,) along the yarn and (k,) around it.
    """

    nodes: np.ndarray
    of_yarn: tuple[np.ndarray, ...]
    weights: Callable[[np.ndarray, np.ndarray], np.ndarray]


def linear_faces(mesh: SweptMesh) -> Faces:
    """Return the faces of linear hexahedra."""
    return Faces(mesh.nodes, tuple(mesh.surface_quads(yarn) for yarn in range(mesh.yarns)), bilinear)


def bilinear(along: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Return the weights (k, 4) of a face's corners."""
    return np.stack(
        [(1 - along) * (1 - around), (1 - along) * around, along * around, along * (1 - around)], axis=1
    )


def serendipity(along: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Return the weights (k, 8) of a face's corners, and of the middles of the edges that follow each of them."""
    corner = bilinear(along, around)
    middle = 4 * np.stack(
        [
            around * (1 - around) * (1 - along),
            along * (1 - along) * around,
            around * (1 - around) * along,
            along * (1 - along) * (1 - around),
        ],
        axis=1,
    )
    return np.concatenate([corner - 0.5 * (middle + np.roll(middle, 1, axis=1)), middle], axis=1)
