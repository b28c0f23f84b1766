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
    knit of 30 x 30 loops it makes 24 iterations of 9. What takes residuals to the grid and corrections back is held in
    single precision, as the yarns' factors are; the grid's operator is not.
    """

    def __init__(self, structure: KnitStructure, stations: int = 2) -> None:
        self._structure = structure
        self._group = _groups(structure, stations)

    def update(self, matrix: sp.bsr_matrix, moved: np.ndarray | None = None) -> None:
        """Form the grid's operator and its factors, for nodes that have moved (n, 3) [m].

        About undeformed arms rigid motions would stretch what has turned.
        """
        self.release()
        prolongation = self.prolongation(moved)
        self._effect, coarse = Rows.of(matrix).galerkin(prolongation, np.float32)  # K P, P^T K P
        prolongation = prolongation.astype(np.float32)
        self._spread, self._collect = (
            Rows.of(prolongation),
            Rows.of(prolongation.T.tobsr(blocksize=(6, 3))),
        )
        self._factors = factorise(_anchor(coarse))

    def release(self) -> None:
        """Forget the factors, so that their memory can serve for new ones."""
        self._factors = self._spread = self._collect = self._effect = None

    def prolongation(self, moved: np.ndarray | None = None) -> sp.bsr_matrix:
        """Return the motions of all nodes by those of their groups."""
        group = self._group
        blocks, centre, _ = rigid_motions(self._structure.moved(moved), group)
        shape = (3 * len(group), 6 * len(centre))
        return sp.bsr_matrix((blocks, group, np.arange(len(group) + 1)), shape=shape)

    def correct(self, residual: np.ndarray, correction: np.ndarray) -> None:
        """Add the grid's correction and take its effect off the residual, both (size,) in place."""
        given = self._collect @ residual.astype(np.float32)
        coarse = self._factors.solve(given.astype(float)).astype(np.float32)
        correction += self._spread @ coarse
        residual -= self._effect @ coarse


def _groups(structure: KnitStructure, stations: int) -> np.ndarray:
    """Return the group (n,) of every node: `stations` neighbouring stations of one yarn."""
    first = np.searchsorted(structure.yarn, structure.yarn)
    within = (structure.station - structure.station[first]) // stations
    label = structure.yarn * (within.max() + 1) + within
    return np.unique(label, return_inverse=True)[1]


def _anchor(coarse: sp.csr_matrix) -> sp.csr_matrix:
    """Give motions that prescribed unknowns leave empty a diagonal entry, so that factors exist."""
    diagonal = coarse.diagonal()
    empty = np.where(diagonal > 1e-12 * diagonal.max(), 0.0, diagonal.max())
    return sp.csr_matrix(coarse + sp.diags(empty)) if empty.any() else coarse
