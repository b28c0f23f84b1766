"""Preconditioner with one part for each scale of a knit: yarn, crossing and fabric.

- **yarn**: numbered along itself a yarn is a narrow band; a banded Cholesky factor of it costs next to nothing.
- **crossing**: a small sparse LU over the unknowns around each tied or touching patch, both yarns together.
- **fabric**: a Galerkin grid whose unknowns are the rigid motions of every few cross-sections, a beam network,
  solved by pyamg with the rigid modes of the whole knit as near-nullspace.

They are combined multiplicatively and symmetrically: fabric, crossing, yarn, crossing, fabric.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import pyamg
import scipy.sparse as sp
from scipy.linalg import lapack

from knitstudy.errors import ConvergenceError
from knitstudy.fem.linear import factorise
from knitstudy.fem.parallel import threads


@dataclass(frozen=True)
class KnitStructure:
    """Where the unknowns of a solid knit lie; nodes are numbered yarn by yarn, slice by slice.

    Attributes
    ----------
    position : ndarray, shape (n, 3)
        Nodes [m].
    yarn : ndarray of int, shape (n,)
        Yarn of every node, ascending.
    slice : ndarray of int, shape (n,)
        Slice of every node, ascending.
    bandwidth : int
        Largest difference of node numbers within an element of one yarn.
    patch : ndarray of int, shape (p,)
        Nodes where yarns act on each other.
    fixed : ndarray of int, shape (k,)
        Prescribed unknowns.
    """

    position: np.ndarray
    yarn: np.ndarray
    slice: np.ndarray
    bandwidth: int
    patch: np.ndarray
    fixed: np.ndarray


class YarnScale:
    """Banded Cholesky factors of every yarn's diagonal block.

    Single precision halves memory and time and costs no iteration: the factors only precondition. Entries outside
    of the band, which only ties bring in, are left out, and their magnitude is added to the
    diagonal, so that the block stays positive definite (Ajiz and Jennings 1984).
    """

    def __init__(self, structure: KnitStructure, dtype: type = np.float32) -> None:
        counts = np.bincount(structure.yarn)
        self._bounds = 3 * np.concatenate([[0], np.cumsum(counts)])
        self._nodes = self._bounds // 3
        self._bandwidth = structure.bandwidth
        self._dtype = dtype
        self._factors: list[np.ndarray] = []

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Factorise the yarns of a matrix; raises ConvergenceError if one is not positive definite."""
        self._factors = []
        with ThreadPoolExecutor(threads()) as pool:
            self._factors = list(pool.map(lambda y: self._factor(matrix, y), range(len(self._nodes) - 1)))

    def _factor(self, matrix: sp.bsr_matrix, yarn: int) -> np.ndarray:
        band = self._band(matrix, *self._nodes[yarn : yarn + 2])
        factorise_band = lapack.spbtrf if self._dtype == np.float32 else lapack.dpbtrf
        factor, info = factorise_band(band, lower=1, overwrite_ab=1)
        if info != 0:
            raise ConvergenceError(f"the stiffness of yarn {yarn} is not positive definite (minor {info})")
        return factor

    def _band(self, matrix: sp.bsr_matrix, first: int, last: int) -> np.ndarray:
        """Return the lower band (bandwidth + 1, unknowns) of nodes first .. last in LAPACK's order."""
        width = 3 * (self._bandwidth + 1)
        band = np.zeros((last - first) * 3 * width, dtype=self._dtype)
        for low in range(first, last, 2048):  # bounds the index arrays
            high = min(low + 2048, last)
            entries = slice(matrix.indptr[low], matrix.indptr[high])
            row = np.repeat(np.arange(low, high), np.diff(matrix.indptr[low : high + 1]))
            column, data = matrix.indices[entries], matrix.data[entries]
            apart = row - column
            inside = (apart > 0) & (apart <= self._bandwidth) & (column >= first)
            self._put(band, row[inside] - first, column[inside] - first, data[inside], width)
            diagonal = data[apart == 0]
            dropped = (np.abs(apart) > self._bandwidth) & (column >= first) & (column < last)
            if dropped.any():
                lump = np.abs(data[dropped]).sum(axis=2)  # (entries, 3)
                diagonal = diagonal.copy()
                i = np.arange(3)
                for axis in i:
                    extra = np.bincount(row[dropped] - low, lump[:, axis], high - low)
                    diagonal[:, axis, axis] += extra
            node = np.arange(low, high) - first
            for i in range(3):
                for k in range(i + 1):
                    band[(3 * node + k) * width + i - k] = diagonal[:, i, k]
        return band.reshape((width, (last - first) * 3), order="F")

    @staticmethod
    def _put(band: np.ndarray, row: np.ndarray, column: np.ndarray, data: np.ndarray, width: int) -> None:
        for k in range(3):
            start = (3 * column + k) * width + 3 * (row - column) - k
            for i in range(3):
                band[start + i] = data[:, i, k]

    def solve(self, residual: np.ndarray) -> np.ndarray:
        """Return the correction of all yarns for a residual (size,)."""
        result = np.empty_like(residual)
        solve_band = lapack.spbtrs if self._dtype == np.float32 else lapack.dpbtrs
        for yarn, factor in enumerate(self._factors):
            part = slice(*self._bounds[yarn : yarn + 2])
            result[part] = solve_band(factor, residual[part].astype(self._dtype), lower=1)[0]
        return result


class CrossingScale:
    """Sparse LU over the unknowns around all crossings; they fall apart into patches by themselves."""

    def __init__(self, structure: KnitStructure) -> None:
        self.unknowns = (3 * structure.patch[:, None] + np.arange(3)).ravel()

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Factorise the patches of a matrix."""
        self._columns = None
        if not len(self.unknowns):
            return
        rows = _block_rows(matrix, self.unknowns[::3] // 3)
        self._rows = rows  # (patch, size): by symmetry also the columns
        self._factors = factorise(rows.tocsc()[:, self.unknowns])

    def correct(self, residual: np.ndarray, correction: np.ndarray) -> None:
        """Add the patches' correction and take its effect off the residual, both (size,) in place."""
        if not len(self.unknowns):
            return
        local = self._factors.solve(residual[self.unknowns])
        correction[self.unknowns] += local
        residual -= self._rows.T @ local


def _block_rows(matrix: sp.bsr_matrix, nodes: np.ndarray) -> sp.csr_matrix:
    """Return the rows of all unknowns of some nodes as CSR."""
    count = np.diff(matrix.indptr)[nodes]
    start = np.repeat(matrix.indptr[nodes] - np.concatenate([[0], np.cumsum(count)[:-1]]), count)
    entries = start + np.arange(count.sum())
    indptr = np.concatenate([[0], np.cumsum(count)])
    part = sp.bsr_matrix(
        (matrix.data[entries], matrix.indices[entries], indptr), shape=(3 * len(nodes), matrix.shape[1])
    )
    return part.tocsr()


class FabricScale:
    """Galerkin grid of rigid motions of groups of cross-sections, carried by pyamg."""

    def __init__(self, structure: KnitStructure, slices: int = 2) -> None:
        group = _groups(structure, slices)
        self.prolongation = rigid_motions(structure, group)
        self._nullspace = _global_modes(structure, group)

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Form the grid's operator and its pyamg hierarchy."""
        self.effect = sp.bsr_matrix(matrix @ self.prolongation, blocksize=(3, 6))  # K P
        coarse = sp.bsr_matrix(self.prolongation.T @ self.effect, blocksize=(6, 6))
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
        coarse = self._cycle @ (self.prolongation.T @ residual)
        correction += self.prolongation @ coarse
        residual -= self.effect @ coarse


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
    blocks[:, :, 3:] = _spins(arm)
    blocks.reshape(-1, 6)[structure.fixed] = 0
    indptr = np.arange(len(group) + 1)
    return sp.bsr_matrix((blocks, group, indptr), shape=(3 * len(group), 6 * len(centre)))


def _spins(arm: np.ndarray) -> np.ndarray:
    """Return the matrices (n, 3, 3) whose columns are e_k x arm."""
    x, y, z = arm.T
    zero = np.zeros_like(x)
    return np.stack(
        [np.stack([zero, z, -y], -1), np.stack([-z, zero, x], -1), np.stack([y, -x, zero], -1)], axis=1
    )


def _global_modes(structure: KnitStructure, group: np.ndarray) -> np.ndarray:
    """Return the coarse coordinates (6 groups, 6) of the rigid motions of the whole knit."""
    centre, radius = _centres(structure, group)
    modes = np.zeros((len(centre), 6, 6))
    modes[:, [0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5]] = 1
    modes[:, :3, 3:] = _spins((centre - centre.mean(axis=0)) / radius)
    return modes.reshape(-1, 6)


def rigid_modes(structure: KnitStructure) -> np.ndarray:
    """Return the six rigid motions (size, 6) of the nodes, zero at prescribed unknowns."""
    arm = structure.position - structure.position.mean(axis=0)
    modes = np.zeros((len(arm), 3, 6))
    modes[:, [0, 1, 2], [0, 1, 2]] = 1
    modes[:, :, 3:] = _spins(arm / np.abs(arm).max())
    modes = modes.reshape(-1, 6)
    modes[structure.fixed] = 0
    return modes


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


class ThreeScale:
    """The combined preconditioner: symmetric, and positive definite where the matrix is."""

    def __init__(self, structure: KnitStructure, slices: int = 2, dtype: type = np.float32) -> None:
        self.fabric = FabricScale(structure, slices)
        self.crossing = CrossingScale(structure)
        self.yarn = YarnScale(structure, dtype)
        self._matrix: sp.bsr_matrix | None = None

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Make all factors anew."""
        self.yarn.update(matrix)
        self.crossing.update(matrix)
        self.fabric.update(matrix)

    def apply(self, matrix: sp.bsr_matrix, residual: np.ndarray) -> np.ndarray:
        """Return the correction (size,) for a residual; `matrix` is the one of the system being solved."""
        residual = residual.copy()
        correction = np.zeros_like(residual)
        self.fabric.correct(residual, correction)
        self.crossing.correct(residual, correction)
        along = self.yarn.solve(residual)
        correction += along
        residual -= matrix @ along
        self.crossing.correct(residual, correction)
        self.fabric.correct(residual, correction)
        return correction
