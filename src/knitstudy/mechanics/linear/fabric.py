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
        group = _groups(structure, stations)
        blocks, centre, _ = rigid_motions(structure, group)
        shape = (3 * len(group), 6 * len(centre))
        self.prolongation = sp.bsr_matrix((blocks, group, np.arange(len(group) + 1)), shape=shape)
        self._restriction = self.prolongation.T.tobsr(blocksize=(6, 3))
        self._spread, self._collect = Rows(self.prolongation), Rows(self._restriction)
        self._factors = None

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Form the grid's operator and its factors."""
        self._factors = None  # not beside the new ones
        effect = Rows(matrix).times(self.prolongation)  # K P
        self._effect = Rows(effect)
        self._factors = factorise(_anchor(self._collect.times(effect)))

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
