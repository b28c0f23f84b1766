"""The scale of the fabric: rigid motions of every few stations, a beam network as coarse grid."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.linear.lu import factorise
from knitstudy.mechanics.linear.rows import Rows
from knitstudy.mechanics.linear.structure import KnitStructure, rigid_motions


class FabricScale:
    """Galerkin grid of rigid motions of groups of stations, solved by sparse LU.

    Chains that meet at crossings fill little in. A V-cycle of pyamg on the same grid is quicker to set up, but of a
    knit of 30 x 30 loops it makes 24 iterations of 9.
    """

    def __init__(self, structure: KnitStructure, stations: int = 2) -> None:
        self._structure = structure
        self._group = _groups(structure, stations)
        self._factors = None

    def update(self, matrix: sp.bsr_matrix, moved: np.ndarray | None = None) -> None:
        """Form the grid's operator and its factors, for nodes that have moved (n, 3) [m].

        About undeformed arms rigid motions would stretch what has turned.
        """
        self._factors = None  # not beside the new ones
        prolongation = self.prolongation(moved)
        self._spread, self._collect = Rows(prolongation), Rows(prolongation.T.tobsr(blocksize=(6, 3)))
        effect = Rows(matrix).times(prolongation)  # K P
        self._effect = Rows(effect)
        self._factors = factorise(_anchor(self._collect.times(effect)))

    def prolongation(self, moved: np.ndarray | None = None) -> sp.bsr_matrix:
        """Return the motions of all nodes by those of their groups."""
        group = self._group
        blocks, centre, _ = rigid_motions(self._structure.moved(moved), group)
        shape = (3 * len(group), 6 * len(centre))
        return sp.bsr_matrix((blocks, group, np.arange(len(group) + 1)), shape=shape)

    def correct(self, residual: np.ndarray, correction: np.ndarray) -> None:
        """Add the grid's correction and take its effect off the residual, both (size,) in place."""
        coarse = self._factors.solve(self._collect @ residual)
        correction += self._spread @ coarse
        residual -= self._effect @ coarse


def _groups(structure: KnitStructure, stations: int) -> np.ndarray:
    """Return the group (n,) of every node: `stations` neighbouring stations of one yarn."""
    first = np.searchsorted(structure.yarn, structure.yarn)
    within = (structure.station - structure.station[first]) // stations
    label = structure.yarn * (within.max() + 1) + within
    return np.unique(label, return_inverse=True)[1]


def _anchor(coarse: sp.bsr_matrix) -> sp.bsr_matrix:
    """Give motions that prescribed unknowns leave empty a diagonal entry, so that factors exist."""
    diagonal = coarse.diagonal()
    empty = np.where(diagonal > 1e-12 * diagonal.max(), 0.0, diagonal.max())
    if empty.any():
        coarse = sp.bsr_matrix(coarse + sp.diags(empty), blocksize=(6, 6))
    return coarse
