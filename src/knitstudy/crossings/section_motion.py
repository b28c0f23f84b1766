"""How the cross-sections of solid yarns move and deform where yarns cross (Fig. 10 of the paper).

Linear hexahedra have no rotations. That of a section is the rotation in the affine map that comes closest to the
displacements of all nodes around it; what the map leaves out, such as the dent that a contact makes, averages out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knitstudy.geometry.pattern import Crossings
from knitstudy.mesh.sweep import SweptMesh

LAYERS = 3
"""Layers of elements that a section is: the one that the crossing lies in, and its neighbours on either side.

Where the mesh is refined there are as many more, and nodes count by the area that they stand for.
"""


@dataclass(frozen=True)
class SectionMotion:
    """Affine maps of the sections at K crossings, on both sides.

    Attributes
    ----------
    gradient : ndarray, shape (K, 2, 3, 3)
        Deformation gradient: the last axis is of the undeformed section.
    displacement : ndarray, shape (K, 2, 3)
        Of the centreline's point at the crossing [m].
    """

    gradient: np.ndarray
    displacement: np.ndarray


def section_motion(
    crossings: Crossings, mesh: SweptMesh, nodes: np.ndarray, displacement: np.ndarray
) -> SectionMotion:
    """Fit the affine maps of the sections at all crossings, by least squares.

    Exact for a rigid motion and for a homogeneous deformation.

    Parameters
    ----------
    crossings : Crossings
    mesh : SweptMesh
    nodes : ndarray, shape (N, 3)
        Undeformed positions: those of the mesh, or where ties have put them [m].
    displacement : ndarray, shape (N, 3)
        Of the nodes [m].
    """
    around = nodes_around(crossings, mesh)
    weight = mesh.shrinkage.ravel()[around] ** 2
    weight /= weight.sum(axis=2, keepdims=True)
    place, moved = nodes[around], displacement[around]
    middle, mean = (np.einsum("ksn,ksni->ksi", weight, values) for values in (place, moved))
    place, moved = place - middle[:, :, None], moved - mean[:, :, None]
    weighted = weight[..., None] * place
    spread = np.einsum("ksni,ksnj->ksij", weighted, place)
    slope = np.linalg.solve(spread, np.einsum("ksni,ksnj->ksij", weighted, moved)).swapaxes(-1, -2)
    offset = np.einsum("ksij,ksj->ksi", slope, crossings.point - middle)
    return SectionMotion(np.eye(3) + slope, mean + offset)


def nodes_around(crossings: Crossings, mesh: SweptMesh) -> np.ndarray:
    """Return the nodes (K, 2, n) of the slices around every crossing; no slices lie beyond the end of a yarn."""
    pull = np.linalg.norm(mesh.pull, axis=1).max()
    layers = LAYERS + 2 * round(0.5 * LAYERS * ((1 + pull) / (1 - pull) - 1))
    first = np.empty((len(crossings.row), 2), dtype=np.int64)
    for yarn in range(mesh.yarns):
        begin, end = mesh.first_slice[yarn : yarn + 2]
        here = crossings.yarn == yarn
        layer = np.searchsorted(mesh.arc_length[begin:end], crossings.arc_length[here], side="right") - 1
        first[here] = begin + np.clip(layer - layers // 2, 0, end - begin - layers - 1)
    nodes = mesh.slice_nodes(first[..., None] + np.arange(layers + 1))
    return nodes.reshape(*first.shape, -1)
