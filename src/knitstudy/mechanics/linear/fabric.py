"""The scale of the fabric: rigid motions of every few stations, a beam network as coarse grid."""

from __future__ import annotations

import numpy as np
import pyamg
import scipy.sparse as sp

from knitstudy.mechanics.linear.rows import Rows
from knitstudy.mechanics.linear.structure import KnitStructure, rigid_motions, spins


class FabricScale:
    """Galerkin grid of rigid motions of groups of stations, carried by pyamg."""

    def __init__(self, structure: KnitStructure, stations: int = 2) -> None:
        group = _groups(structure, stations)
        blocks, centre, radius = rigid_motions(structure, group)
        shape = (3 * len(group), 6 * len(centre))
        self.prolongation = sp.bsr_matrix((blocks, group, np.arange(len(group) + 1)), shape=shape)
        self._restriction = self.prolongation.T.tobsr(blocksize=(6, 3))
        self._spread, self._collect = Rows(self.prolongation), Rows(self._restriction)
        self._nullspace = _global_modes(centre, radius)

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Form the grid's operator and its pyamg hierarchy."""
        effect = Rows(matrix).times(self.prolongation)  # K P
        self._effect = Rows(effect)
        coarse = self._collect.times(effect)
        coarse = _anchor(coarse)
        self.hierarchy = pyamg.smoothed_aggregation_solver(
            coarse,
            B=self._nullspace,
            smooth=("jacobi", {"omega": 4.0 / 3.0}),
            presmoother=("block_gauss_seidel", {"sweep": "symmetric"}),
            postsmoother=("block_gauss_seidel", {"sweep": "symmetric"}),
            max_coarse=20_000,
            coarse_solver="splu",
        )
        self._cycle = self.hierarchy.aspreconditioner(cycle="V")

    def correct(self, residual: np.ndarray, correction: np.ndarray) -> None:
        """Add the grid's correction and take its effect off the residual, both (size,) in place."""
        coarse = self._cycle @ (self._collect @ residual)
        correction += self._spread @ coarse
        residual -= self._effect @ coarse


def _groups(structure: KnitStructure, stations: int) -> np.ndarray:
    """Return the group (n,) of every node: `stations` neighbouring stations of one yarn."""
    first = np.searchsorted(structure.yarn, structure.yarn)
    within = (structure.station - structure.station[first]) // stations
    label = structure.yarn * (within.max() + 1) + within
    return np.unique(label, return_inverse=True)[1]


def _global_modes(centre: np.ndarray, radius: float) -> np.ndarray:
    """Return the coarse coordinates (6 groups, 6) of the rigid motions of the whole knit."""
    modes = np.zeros((len(centre), 6, 6))
    modes[:, [0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5]] = 1
    modes[:, :3, 3:] = spins((centre - centre.mean(axis=0)) / radius)
    return modes.reshape(-1, 6)


def _anchor(coarse: sp.bsr_matrix) -> sp.bsr_matrix:
    """Give motions that prescribed unknowns leave empty a diagonal entry, so that factors exist."""
    diagonal = coarse.diagonal()
    empty = np.where(diagonal > 1e-12 * diagonal.max(), 0.0, diagonal.max())
    if empty.any():
        coarse = sp.bsr_matrix(coarse + sp.diags(empty), blocksize=(6, 6))
    return coarse
