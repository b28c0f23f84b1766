"""Preconditioner with one part for each scale of a knit: yarn, crossing and fabric.

- **yarn**: numbered along itself a yarn is a narrow band; a banded Cholesky factor of it costs next to nothing.
- **crossing**: a small sparse LU over the unknowns around each tied or touching patch, both yarns together.
- **fabric**: a Galerkin grid whose unknowns are the rigid motions of every few stations of the yarns, a beam network,
  solved by sparse LU.

They are combined multiplicatively: symmetrically (fabric, crossing, yarn, crossing, fabric) for conjugate gradients,
and once each (crossing, yarn, fabric) where friction has made the matrix unsymmetric. Minimal residuals need no
symmetry; on a knit in contact the shorter way takes 7 iterations for 12.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.linear.crossing import CrossingScale
from knitstudy.mechanics.linear.fabric import FabricScale
from knitstudy.mechanics.linear.rows import Rows
from knitstudy.mechanics.linear.solver import NOWHERE
from knitstudy.mechanics.linear.structure import KnitStructure
from knitstudy.mechanics.linear.yarn import YarnScale

Scale = FabricScale | CrossingScale | YarnScale


class ThreeScale:
    """The combined preconditioner: of a symmetric matrix symmetric, and positive definite where that is."""

    def __init__(self, structure: KnitStructure, stations: int = 2, dtype: type = np.float32) -> None:
        self.fabric = FabricScale(structure, stations)
        self.crossing = CrossingScale(structure) if structure.patch is not None else None
        self.yarn = YarnScale(structure, dtype)
        self._order = self._present(self.fabric, self.crossing, self.yarn, self.crossing, self.fabric)

    def update(
        self,
        matrix: sp.bsr_matrix,
        unsymmetric: sp.bsr_matrix | None = None,
        touching: np.ndarray = NOWHERE,
        moved: np.ndarray | None = None,
    ) -> None:
        """Make all factors anew; only those of the crossings know what friction adds."""
        if unsymmetric is not None:
            self._order = self._present(self.crossing, self.yarn, self.fabric)
        self.fabric.release()  # room for what the others need on the way
        self.yarn.update(matrix)
        if self.crossing is not None:
            self.crossing.update(matrix, unsymmetric, touching)
        self.fabric.update(matrix, moved)

    def apply(self, matrix: Rows, residual: np.ndarray) -> np.ndarray:
        """Return the correction (size,) for a residual; `matrix` is the one of the system being solved."""
        residual = residual.copy()
        correction = np.zeros_like(residual)
        for scale in self._order:
            scale.correct(residual, correction)
        return correction

    @staticmethod
    def _present(*scales: Scale | None) -> tuple[Scale, ...]:
        return tuple(scale for scale in scales if scale is not None)
