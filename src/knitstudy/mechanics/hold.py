"""Springs that hold all unknowns of a model near a state: as viscous forces do, or around a first guess."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from knitstudy.mechanics.model import Model, Response


@dataclass(frozen=True, eq=False)
class Hold:
    """A spring on every unknown."""

    stiffness: np.ndarray  # (size,), force over displacement
    free: np.ndarray | float = 0.0  # (size,), change within the increment at which the springs carry nothing

    def added(self, response: Response, change: np.ndarray | float) -> Response:
        """Return the response of a model and of its springs, after a change (size,) within the increment.

        Examples
        --------
        >>> springs = Hold(np.array([2.0, 2.0]), free=np.array([0.0, 0.5]))
        >>> springs.added(Response(np.zeros(2), mean_force=1.0), np.array([0.5, 0.5])).force.tolist()
        [1.0, 0.0]
        """
        if response.stiffness is not None:
            add_diagonal(response.tangent, self.stiffness)
        return replace(response, force=response.force + self.stiffness * (change - self.free))


def typical_stiffness(model: Model, fixed: np.ndarray) -> np.ndarray:
    """Return the stiffness (size,) of a typical unknown at rest; the prescribed unknowns (k,) have none."""
    rest = model.respond(model.begin(model.start(), 1.0, 1.0), stiffness=True)
    unit = np.median(np.abs(rest.tangent.diagonal()) / model.scale**2) * model.scale**2
    unit[fixed] = 0.0
    return unit


def add_diagonal(matrix: Any, diagonal: np.ndarray) -> None:
    """Add a diagonal (size,) to a BSR or CSR matrix whose pattern has it, in place.

    Examples
    --------
    >>> from scipy.sparse import csr_matrix
    >>> matrix = csr_matrix([[1.0, 2.0], [2.0, 1.0]])
    >>> add_diagonal(matrix, np.array([3.0, 4.0]))
    >>> matrix.diagonal().tolist()
    [4.0, 5.0]
    """
    block = matrix.blocksize[0] if matrix.format == "bsr" else 1
    row = np.repeat(np.arange(len(matrix.indptr) - 1), np.diff(matrix.indptr))
    own, i = np.flatnonzero(row == matrix.indices), np.arange(block)
    matrix.data.reshape(-1, block, block)[own[:, None], i, i] += diagonal.reshape(-1, block)[row[own]]
