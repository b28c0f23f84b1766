"""Preconditioners of solid knits: three scales, and plain algebraic multigrid.

Yarns are narrow bands along themselves, factorised by Cholesky's method; crossings are patches of both yarns together,
by sparse LU; the fabric is a Galerkin grid of rigid motions of every few stations, a beam network, by sparse LU.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyamg
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU

from knitstudy.errors import ConvergenceError
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.batches import share
from knitstudy.mechanics.core.linear import System, factorise, factorise_band, solve_band
from knitstudy.mechanics.core.linear.krylov import RowRanges
from knitstudy.mechanics.core.model import rigid_motions
from knitstudy.mechanics.core.pattern_sum import block_entries

# Where the unknowns of a solid knit lie, and how it moves as a rigid body


@dataclass(frozen=True)
class KnitStructure:
    """Where the unknowns of a solid knit lie; nodes are numbered yarn by yarn, station by station.

    A node is a node of a mesh or a coefficient: every point of a yarn is a weighted sum of them, undeformed and
    displaced alike.
    """

    position: Floats  # (n, 3), nodes [m]
    unity: Floats  # (n,), the nodes' values in the sum that is 1 everywhere: 1 for nodes of a mesh
    yarn: Ints  # (n,), yarn of every node, ascending
    # (n,), place along the yarn, ascending: nodes of one cross-section, or of one spline, have it in common
    station: Ints
    bandwidth: int  # largest difference of node numbers within an element of one yarn
    # (p,), nodes where yarns are tied to each other; None if crossings are no scale of their own, touching
    # ones neither
    patch: Ints | None
    fixed: Ints  # (k,), prescribed unknowns

    def rigid_motions(self, group: Ints, moved: Floats | None) -> Floats:
        """Return the rigid motions (n, 3, 6) of groups (n,) of nodes that have moved (n, 3) [m]; none where fixed."""
        position = self.position if moved is None else self.position + moved
        motions = rigid_motions(position, self.unity, group)
        motions.reshape(-1, 6)[self.fixed] = 0
        return motions


# The scale of a yarn: numbered along itself it is a narrow band, whose Cholesky factor costs next to nothing

# Most that a band may be widened by: factors cost its square. Of solid yarns, a tie reaches one station further.
WIDER = 1.5
CHUNK = 2048  # nodes at a time; bounds the index arrays
AXES = np.arange(3)


class YarnScale:
    """Banded Cholesky factors of every yarn's diagonal block.

    Single precision halves memory and time and costs no iteration; what lies outside of the bands has it too. The part
    that ties and contact add outside of the elements' band is held by a band at most `WIDER` times as wide; otherwise
    it is left out, and its magnitude is added to the diagonal, so that the block stays positive definite (Ajiz and
    Jennings 1984).
    """

    def __init__(self, structure: KnitStructure) -> None:
        self._nodes = np.concatenate([[0], np.cumsum(np.bincount(structure.yarn))])
        self._bandwidth = structure.bandwidth
        self.release()

    def release(self) -> None:
        """Forget the factors, so that their memory can serve for new ones."""
        self._factors: list[np.ndarray] = []
        self._outside = None

    def update(self, matrix: sp.bsr_matrix) -> None:
        """Factorise the yarns of a matrix; raises ConvergenceError if one is not positive definite."""

        def make(yarn: int) -> tuple[np.ndarray, Floats]:
            for dtype in (np.float32, np.float64):
                # In single precision a yarn that hardly anything holds cannot be told from one that nothing holds.
                band, lumps = self._band(matrix, yarn, dtype)
                minor = factorise_band(band)
                if minor == 0:
                    return band, lumps
            raise ConvergenceError(f"the stiffness of yarn {yarn} is not positive definite (minor {minor})")

        self._factors, lumps = map(list, zip(*share(make, len(self._nodes) - 1), strict=True))
        bandwidths = [len(factor) // 3 - 1 for factor in self._factors]
        self._outside = _outside(matrix, self._nodes, bandwidths, np.concatenate(lumps))

    def _band(self, matrix: sp.bsr_matrix, yarn: int, dtype: type) -> tuple[np.ndarray, Floats]:
        """Return the lower band (bandwidth + 1, unknowns) of a yarn in LAPACK's order.

        And the addition to the diagonal of every node (nodes, 3) for entries outside of it.
        """
        first, last = self._nodes[yarn : yarn + 2]
        bandwidth = self._reach(matrix, first, last)
        width = 3 * (bandwidth + 1)
        band = np.zeros((last - first) * 3 * width, dtype=dtype)
        lumps = np.zeros((last - first, 3))
        for low, high, row, column, data in _chunks(matrix, first, last):
            apart = row - column
            dropped = (np.abs(apart) > bandwidth) & (column >= first) & (column < last)
            lump = np.abs(data[dropped]).sum(axis=2)  # (entries, 3)
            added = np.stack([np.bincount(row[dropped] - low, part, high - low) for part in lump.T], axis=1)
            lumps[low - first : high - first] = added
            inside = np.flatnonzero((apart >= 0) & (apart <= bandwidth) & (column >= first))
            apart = apart[inside]
            column = column[inside] - first
            data = data[inside]
            below = np.flatnonzero(apart)
            data[np.flatnonzero(apart == 0)[:, None], AXES, AXES] += added
            for k in range(3):
                start = (3 * column + k) * width + 3 * apart - k
                for i in range(3):
                    some = slice(None) if i >= k else below
                    band[start[some] + i] = data[some, i, k]
        return band.reshape((width, (last - first) * 3), order="F"), lumps

    def _reach(self, matrix: sp.bsr_matrix, first: int, last: int) -> int:
        """Return the bandwidth of nodes first .. last: of their coupling, or of the elements."""
        reach = self._bandwidth
        for _, _, row, column, _ in _chunks(matrix, first, last):
            reach = max(reach, int((row - column).max(where=column >= first, initial=0)))
        return reach if reach <= WIDER * self._bandwidth else self._bandwidth

    def correct(self, residual: Floats, correction: Floats) -> None:
        """Add the correction of all yarns and take its effect off the residual, both (size,) in place.

        The new residual is the effect of the entries that the factors leave out: no product with the whole matrix.
        """

        def solve(yarn: int) -> np.ndarray:
            factor = self._factors[yarn]
            local = residual[slice(*3 * self._nodes[yarn : yarn + 2])].astype(factor.dtype)
            solve_band(factor, local)
            return local

        along = np.concatenate(share(solve, len(self._factors)))
        correction += along
        np.negative(self._outside @ along, out=residual)


def _chunks(matrix: sp.bsr_matrix, first: int, last: int) -> Iterator[tuple[Any, ...]]:
    """Yield ranges low, high of the nodes first .. last, with the rows, columns and values of their blocks."""
    for low in range(first, last, CHUNK):
        high = min(low + CHUNK, last)
        entries = slice(matrix.indptr[low], matrix.indptr[high])
        row = np.repeat(np.arange(low, high), np.diff(matrix.indptr[low : high + 1]))
        yield low, high, row, matrix.indices[entries], matrix.data[entries]


def _outside(matrix: sp.bsr_matrix, nodes: Ints, bandwidth: list[int], lumps: Floats) -> sp.csr_matrix:
    """Return a matrix without the bands of its yarns and the additions to them, in single precision."""
    rows = sp.vstack(list(_rows_outside(matrix, nodes, bandwidth)), format="csr")
    return rows - sp.diags(lumps.ravel().astype(np.float32), format="csr")


def _rows_outside(matrix: sp.bsr_matrix, nodes: Ints, bandwidth: list[int]) -> Iterator[sp.csr_matrix]:
    """Yield ranges of rows without the bands of yarns."""
    for first, last, reach in zip(nodes[:-1], nodes[1:], bandwidth, strict=True):
        for low, high, row, column, data in _chunks(matrix, first, last):
            out = np.flatnonzero((np.abs(row - column) > reach) | (column < first) | (column >= last))
            indptr = np.concatenate([[0], np.cumsum(np.bincount(row[out] - low, minlength=high - low))])
            part = sp.bsr_matrix(
                (data[out].astype(np.float32), column[out], indptr),
                shape=(3 * (high - low), matrix.shape[1]),
            ).tocsr()
            part.eliminate_zeros()  # of links, blocks are diagonal
            yield part


# The scale of a crossing: coupling between yarns, solved for both of them together

GROUPS = 8  # parts that threads share: patches that do not act on each other, of about as many unknowns each


class CrossingScale:
    """Sparse LU over the unknowns around all crossings, which fall apart into patches."""

    def __init__(self, structure: KnitStructure) -> None:
        self._tied = structure.patch
        self.unknowns = np.empty(0, dtype=np.int64)
        self._columns: RowRanges | None = None  # of the unknowns

    def update(self, system: System) -> None:
        """Factorise the patches of a matrix: around ties, and around the nodes where contact acts.

        The entries of friction lie within the patches, whose factors need no symmetry.
        """
        matrix, unsymmetric = system.matrix, system.unsymmetric
        # Nodes that share an element or a contact
        around = matrix.indices[block_entries(matrix, system.touching)]
        patch = np.unique(np.concatenate([self._tied, system.touching, around]))
        self.unknowns = (3 * patch[:, None] + np.arange(3)).ravel()
        if not len(self.unknowns):
            return
        columns = _block_rows(matrix, patch).T.tobsr(blocksize=(3, 3))  # (size, patch): by symmetry the rows
        if unsymmetric is not None and unsymmetric.nnz:
            columns = columns + unsymmetric.tocsr()[:, self.unknowns].tobsr(blocksize=(3, 3))
        own = _block_rows(columns, patch).tocsr()
        self._columns = RowRanges.of(columns)
        self._groups = _groups(own)

        def make(number: int) -> SuperLU:
            group = self._groups[number]
            return factorise(own[group][:, group])

        self._factors = share(make, len(self._groups))

    def release(self) -> None:
        """Forget the factors, so that their memory can serve for new ones."""
        self._columns = None
        self._factors = []

    def correct(self, residual: Floats, correction: Floats) -> None:
        """Add the patches' correction and take its effect off the residual, both (size,) in place."""
        if not len(self.unknowns):
            return
        given = residual[self.unknowns]
        local = np.empty_like(given)

        def solve(number: int) -> None:
            group = self._groups[number]
            local[group] = self._factors[number].solve(given[group])

        share(solve, len(self._groups))
        assert self._columns is not None, "the factors were released"
        correction[self.unknowns] += local
        residual -= self._columns @ local


def _groups(matrix: sp.csr_matrix) -> list[np.ndarray]:
    """Return the unknowns of at most `GROUPS` groups of patches; no entry of the matrix joins two of them."""
    count, patch = connected_components(matrix, directed=False)
    size = np.bincount(patch, minlength=count)
    group = (np.cumsum(size) - size) * GROUPS // len(patch)
    return [np.flatnonzero(group[patch] == number) for number in np.unique(group)]


def _block_rows(matrix: sp.bsr_matrix, nodes: Ints) -> sp.bsr_matrix:
    """Return the rows of all unknowns of some nodes."""
    entries = block_entries(matrix, nodes)
    indptr = np.concatenate([[0], np.cumsum(np.diff(matrix.indptr)[nodes])])
    return sp.bsr_matrix(
        (matrix.data[entries], matrix.indices[entries], indptr), shape=(3 * len(nodes), matrix.shape[1])
    )


# The scale of the fabric: rigid motions of every few stations, a beam network as coarse grid


STATIONS = 2  # neighbouring stations of a yarn that make a group


class FabricScale:
    """Galerkin grid of rigid motions of groups of stations, solved by sparse LU.

    Chains that meet at crossings fill little in. A V-cycle of pyamg on the same grid is quicker to set up, but of a
    knit of 30 x 30 loops it makes 24 iterations of 9. What takes residuals to the grid and corrections back is held in
    single precision, as the yarns' factors are; the grid's operator is not.
    """

    def __init__(self, structure: KnitStructure) -> None:
        self._structure = structure
        self._grid: tuple[SuperLU, RowRanges, RowRanges, RowRanges] | None = None
        first = np.searchsorted(structure.yarn, structure.yarn)
        within = (structure.station - structure.station[first]) // STATIONS
        label = structure.yarn * (within.max() + 1) + within
        self._group = np.unique(label, return_inverse=True)[1]

    def update(self, matrix: sp.bsr_matrix, moved: Floats | None = None) -> None:
        """Form the grid's operator and its factors, for nodes that have moved (n, 3) [m].

        About undeformed arms, rigid motions would stretch parts that have turned.
        """
        prolongation = self.prolongation(moved)
        effect, coarse = RowRanges.of(matrix).galerkin(prolongation, np.float32)  # K P, P^T K P
        prolongation = prolongation.astype(np.float32)
        spread = RowRanges.of(prolongation)
        collect = RowRanges.of(prolongation.T.tobsr(blocksize=(6, 3)))
        self._grid = factorise(_anchor(coarse)), spread, collect, effect

    def release(self) -> None:
        """Forget the factors, so that their memory can serve for new ones."""
        self._grid = None

    def prolongation(self, moved: Floats | None = None) -> sp.bsr_matrix:
        """Return the motions of all nodes by the motions of their groups."""
        group = self._group
        blocks = self._structure.rigid_motions(group, moved)
        shape = (3 * len(group), 6 * (int(group.max()) + 1))
        return sp.bsr_matrix((blocks, group, np.arange(len(group) + 1)), shape=shape)

    def correct(self, residual: Floats, correction: Floats) -> None:
        """Add the grid's correction and take its effect off the residual, both (size,) in place."""
        assert self._grid is not None, "the factors were released"
        factors, spread, collect, effect = self._grid
        given = collect @ residual.astype(np.float32)
        coarse = factors.solve(given.astype(float)).astype(np.float32)
        correction += spread @ coarse
        residual -= effect @ coarse


def _anchor(coarse: sp.csr_matrix) -> sp.csr_matrix:
    """Give motions that prescribed unknowns leave empty a diagonal entry, so that factors exist."""
    diagonal = coarse.diagonal()
    empty = np.where(diagonal > 1e-12 * diagonal.max(), 0.0, diagonal.max())
    return sp.csr_matrix(coarse + sp.diags(empty)) if empty.any() else coarse


class ThreeScale:
    """The three scales one after the other: fabric, yarn, crossing, yarn, fabric for conjugate gradients.

    Minimal residuals need no symmetry: fabric, crossing, yarn for them. Friction makes the matrix unsymmetric. The
    fabric's and the crossings' factors are of the unsymmetric matrix, without which loops that slide far take ten times
    as many iterations. The yarns' factors are of the symmetric part, and so is the residual that they leave: yarns come
    last.
    """

    def __init__(self, structure: KnitStructure) -> None:
        self.fabric, self.yarn = FabricScale(structure), YarnScale(structure)
        self.crossing = CrossingScale(structure) if structure.patch is not None else None

    def update(self, system: System) -> None:
        """Make all factors again."""
        self.release()
        with system.symmetric():
            self.yarn.update(system.matrix)
            if self.crossing is not None:
                self.crossing.update(system)
        self.fabric.update(system.matrix, system.moved)
        crossing = [] if self.crossing is None else [self.crossing]
        self._order: list[FabricScale | YarnScale | CrossingScale]
        if system.unsymmetric is not None:
            self._order = [self.fabric, *crossing, self.yarn]
        elif crossing:
            self._order = [self.fabric, self.yarn, *crossing, self.yarn, self.fabric]
        else:
            self._order = [self.fabric, self.yarn, self.fabric]

    def release(self) -> None:
        """Forget all factors."""
        for scale in (self.fabric, self.crossing, self.yarn):
            if scale is not None:
                scale.release()

    def apply(self, residual: Floats) -> Floats:
        """Return the correction (size,) for a residual."""
        residual = residual.copy()
        correction = np.zeros_like(residual)
        for scale in self._order:
            scale.correct(residual, correction)
        return correction


# Plain algebraic multigrid as a preconditioner


class AlgebraicMultigrid:
    """Plain pyamg: smoothed aggregation with the rigid modes and block smoothing (Vanek et al. 1996)."""

    def __init__(self, structure: KnitStructure) -> None:
        self._structure = structure

    def update(self, system: System) -> None:
        """Build the hierarchy of the symmetric part, wherever contact acts."""
        whole = np.zeros(len(self._structure.yarn), dtype=np.int64)
        smoother = ("block_gauss_seidel", {"sweep": "symmetric", "blocksize": 3})
        with system.symmetric():
            matrix = system.matrix if system.unsymmetric is None else system.matrix.copy()
        self._cycle = pyamg.smoothed_aggregation_solver(
            matrix,
            B=self._structure.rigid_motions(whole, system.moved).reshape(-1, 6),
            presmoother=smoother,
            postsmoother=smoother,
            max_coarse=2000,
            coarse_solver="splu",
        ).aspreconditioner(cycle="V")

    def release(self) -> None:
        """Forget the hierarchy."""
        self._cycle = None

    def apply(self, residual: Floats) -> Floats:
        """Return one V-cycle's correction (size,)."""
        return self._cycle @ residual
