"""What contact knows of the surfaces of solids: places and their derivatives as weighted sums, and where to search.

Contact never asks what a surface is made of. The sums run over *carriers*: nodes of a grid (`grids`), or functions of
the angle times splines along a yarn (`cylinders`). What moves the carriers and what collects their forces is the
surfaces' own affair.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

ALONG, AROUND = [0, 1, 0, 2, 1, 0], [0, 0, 1, 0, 1, 2]
"""Orders of the derivatives whose weights a stencil has."""


@dataclass(frozen=True, eq=False)
class Stencil:
    """The carriers that places on surfaces depend on, and their weights.

    Attributes
    ----------
    nodes : ndarray of int, shape (k, c)
        Carriers.
    weights : ndarray, shape (k, 6, c)
        Of the place, its derivatives along and around, and its second ones: along, mixed, around.
    key : ndarray of int, shape (k,)
        Places with the same key have the same carriers.
    """

    nodes: np.ndarray
    weights: np.ndarray
    key: np.ndarray

    @property
    def value(self) -> np.ndarray:
        """Weights (k, c) of the places."""
        return self.weights[:, 0]

    @property
    def first(self) -> np.ndarray:
        """Weights (k, 2, c) of the derivatives along and around."""
        return self.weights[:, 1:3]

    @property
    def second(self) -> np.ndarray:
        """Weights (k, 3, c) of the second derivatives along, mixed and around."""
        return self.weights[:, 3:]

    def places(self, carriers: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return places (k, 3), derivatives (k, 2, 3) and second ones (k, 3, 3) for carriers (M, 3)."""
        all_six = self.weights @ carriers[self.nodes]
        return all_six[:, 0], all_six[:, 1:3], all_six[:, 3:]


class Surfaces(Protocol):
    """All smooth surfaces of a model.

    A place is a surface and two parameters xi = (along, around). Surfaces are divided into cells, which carry the
    Gauss points; rings, the edges of cells across a surface, are where the search begins.

    Attributes
    ----------
    cells : ndarray of int, shape (G, 2)
        Cells of every surface, along and around.
    closed : ndarray of bool, shape (G,)
        Whether it closes around.
    offset : ndarray, shape (G,)
        How far inside of the interpolated surface the contact surface lies [m].
    block : int
        Carriers come in runs of so many; a run is in a stencil as a whole.
    overshoot : float
        How many times as far as the farthest of the control points that it depends on a place may move.
    """

    cells: np.ndarray
    closed: np.ndarray
    offset: np.ndarray
    block: int
    overshoot: float

    def edges(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the parameters of one surface's edges of cells, along (m + 1,) and around (n + 1,)."""

    def stencil(self, surface: np.ndarray, xi: np.ndarray) -> Stencil:
        """Return the stencils of places xi (k, 2) on surfaces (k,)."""

    def places(
        self, surface: np.ndarray, xi: np.ndarray, carriers: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what `Stencil.places` gives at places xi (k, 2) on surfaces (k,), for carriers (M, 3)."""

    def positions(self, surface: np.ndarray, xi: np.ndarray, carriers: np.ndarray) -> np.ndarray:
        """Return places (k, 3) alone [m]."""

    def clamp(self, surface: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """Return xi (k, 2) moved to the nearest place within the surfaces' edges."""

    def carry(self, nodes: np.ndarray) -> np.ndarray:
        """Return the carriers (M, 3) for the model's nodes (N, 3)."""

    def collect(self, force: np.ndarray) -> np.ndarray:
        """Return forces (N, 3) on the model's nodes from those on carriers (M, 3)."""

    def matrix(self, indptr: np.ndarray, indices: np.ndarray, data: np.ndarray) -> sp.bsr_matrix:
        """Return the matrix (3 N, 3 N) over the model's nodes, in blocks of 3, of one over carriers.

        Parameters
        ----------
        indptr, indices : ndarray of int
            Its pattern over runs of carriers, as of a CSR matrix.
        data : ndarray, shape (nnz, b b, 9)
            Blocks (3, 3) of pairs of carriers of two runs.
        """

    def centres(self, carriers: np.ndarray) -> np.ndarray:
        """Return the middles (R, 3) of all rings, surface by surface."""

    def ring(self, number: int, row: np.ndarray, carriers: np.ndarray) -> np.ndarray:
        """Return places (k, n, 3) on rings (k,) of one surface, at the edges of cells around."""

    def controls(self, carriers: np.ndarray) -> np.ndarray:
        """Return control points (S, a, 3): an affine map of all of them is one of the surfaces."""

    def influence(self, carriers: np.ndarray) -> float:
        """Return how far control points are from rings beside which places depend on them [m]."""


def interpolate(weight: np.ndarray, nodes: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return weighted sums (k, ..., 3) of values (M, 3): weights (k, ..., c) at carriers (k, c)."""
    return weight @ values[nodes] if weight.ndim > 2 else (weight[:, None] @ values[nodes])[:, 0]
