"""The scale of the fabric: rigid motions of every few cross-sections, a beam network as coarse grid."""

from __future__ import annotations

import numpy as np
import pyamg
import scipy.sparse as sp

from knitstudy.mechanics.linear.rows import Rows
from knitstudy.mechanics.linear.structure import KnitStructure, spins


class FabricScale:
    """Galerkin grid of rigid motions of groups of cross-sections, carried by pyamg."""

    def __init__(self, structure: KnitStructure, slices: int = 2) -> None:
        group = _groups(structure, slices)
        self.prolongation = rigid_motions(structure, group)
        self._restriction = self.prolongation.T.tobsr(blocksize=(6, 3))
        self._spread, self._collect = Rows(self.prolongation), Rows(self._restriction)
        self._nullspace = _global_modes(structure, group)

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Form the grid's operator and its pyamg hierarchy."""
        effect = sp.bsr_matrix(matrix @ self.prolongation, blocksize=(3, 6))  # K P
        self._effect = Rows(effect)
        coarse = sp.bsr_matrix(self._restriction @ effect, blocksize=(6, 6))
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


def _groups(structure: KnitStructure, slices: int) -> np.ndarray:
    """Return the group (n,) of every node: `slices` neighbouring slices of one yarn."""
    first = np.searchsorted(structure.yarn, structure.yarn)
    within = (structure.slice - structure.slice[first]) // slices
    label = structure.yarn * (within.max() + 1) + within
    return np.unique(label, return_inverse=True)[1]


def rigid_motions(structure: KnitStructure, group: np.ndarray) -> sp.bsr_matrix:
    """Return P (size, 6 groups): three translations and three rotations about each group's centre.

    Rotations are scaled by the groups' radius of gyration; rows of prescribed unknowns are zero.
    """
    centre, radius = _centres(structure, group)
    arm = (structure.position - centre[group]) / radius
    blocks = np.zeros((len(group), 3, 6))
    blocks[:, [0, 1, 2], [0, 1, 2]] = 1
    blocks[:, :, 3:] = spins(arm)
    blocks.reshape(-1, 6)[structure.fixed] = 0
    indptr = np.arange(len(group) + 1)
    return sp.bsr_matrix((blocks, group, indptr), shape=(3 * len(group), 6 * len(centre)))


def _global_modes(structure: KnitStructure, group: np.ndarray) -> np.ndarray:
    """Return the coarse coordinates (6 groups, 6) of the rigid motions of the whole knit."""
    centre, radius = _centres(structure, group)
    modes = np.zeros((len(centre), 6, 6))
    modes[:, [0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5]] = 1
    modes[:, :3, 3:] = spins((centre - centre.mean(axis=0)) / radius)
    return modes.reshape(-1, 6)


def _centres(structure: KnitStructure, group: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the centres (groups, 3) of all groups and the radius of gyration of a group [m]."""
    count = np.bincount(group)
    centre = np.stack([np.bincount(group, structure.position[:, i]) / count for i in range(3)], axis=1)
    arm = structure.position - centre[group]
    return centre, float(np.sqrt(np.mean(np.sum(arm**2, axis=1))))


def _anchor(coarse: sp.bsr_matrix) -> sp.bsr_matrix:
    """Give motions that prescribed unknowns leave empty a diagonal entry, so that factors exist."""
    diagonal = coarse.diagonal()
    empty = np.where(diagonal > 1e-12 * diagonal.max(), 0.0, diagonal.max())
    if empty.any():
        coarse = sp.bsr_matrix(coarse + sp.diags(empty), blocksize=(6, 6))
    return coarse
