"""Plain algebraic multigrid as a preconditioner."""

from __future__ import annotations

import numpy as np
import pyamg
import scipy.sparse as sp

from knitstudy.mechanics.linear.rows import Rows
from knitstudy.mechanics.linear.solver import NOWHERE
from knitstudy.mechanics.linear.structure import KnitStructure, rigid_modes


class AlgebraicMultigrid:
    """Plain pyamg: smoothed aggregation with the rigid modes and block smoothing (Vanek et al. 1996)."""

    def __init__(self, structure: KnitStructure) -> None:
        self._structure = structure

    def update(
        self,
        matrix: sp.bsr_matrix,
        unsymmetric: sp.bsr_matrix | None = None,
        touching: np.ndarray = NOWHERE,
        moved: np.ndarray | None = None,
    ) -> None:
        """Build the hierarchy of the symmetric part, wherever contact acts."""
        smoother = ("block_gauss_seidel", {"sweep": "symmetric", "blocksize": 3})
        self._cycle = pyamg.smoothed_aggregation_solver(
            matrix if unsymmetric is None else matrix.copy(),
            B=rigid_modes(self._structure.moved(moved)),
            presmoother=smoother,
            postsmoother=smoother,
            max_coarse=2000,
            coarse_solver="splu",
        ).aspreconditioner(cycle="V")

    def apply(self, matrix: Rows, residual: np.ndarray) -> np.ndarray:
        """Return one V-cycle's correction (size,)."""
        return self._cycle @ residual
