"""Sums element forces and stiffness blocks into the unknowns, through one sparsity pattern computed once.

Linear ties between nodes are part of the summation: with u = T v (T scalar, nodes x retained nodes) an entry of an
element goes to every retained node that its node depends on, times the weights. So K = T^T (sum of elements) T is
formed directly, without the untied matrix. Links between nodes, scalars that act on all three components alike,
are part of the same pattern.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from knitstudy.mechanics.sparse_sums import SpanSum, consecutive, entries_at, span_pattern

PAIRS = 32_768  # pairs of nodes a batch, 512 hexahedra of eight nodes; bounds the memory of a batch


@dataclass(frozen=True)
class Batch:
    """Elements that are evaluated together: `part` of the elements of `group`."""

    group: int
    part: slice

    @property
    def count(self) -> int:
        """Number of elements."""
        return self.part.stop - self.part.start


class Assembly:
    """Summation over elements of groups that have as many nodes each."""

    def __init__(
        self,
        groups: Sequence[np.ndarray],  # int (E, a), nodes of the elements of every group
        nodes: int,  # N; number of nodes
        # (N, n), T: every node as a weighted sum of retained nodes. The identity if omitted
        transformation: sp.csr_matrix | None = None,
        block: int = 3,  # unknowns a node
        # (N, N), symmetric; a constant stiffness between nodes, the same for every component [N/m]
        links: sp.csr_matrix | None = None,
        pairs: int = PAIRS,  # pairs of nodes a batch; bounds the memory of a batch
    ) -> None:
        self.block = block
        self.batches = [
            batch for number, each in enumerate(groups) for batch in _batches(number, each, pairs)
        ]
        spans = transformation is None and all(consecutive(each) for each in groups)
        if transformation is None:
            transformation = sp.identity(nodes, format="csr")
        self.retained = transformation.shape[1]
        self._width = [connectivity.shape[1] for connectivity in groups]
        end = np.concatenate([connectivity.ravel() for connectivity in groups])
        self._to_nodes = sp.csr_matrix(
            (np.ones(end.size), (end, np.arange(end.size))), shape=(nodes, end.size)
        )
        self._to_kept = sp.csr_matrix(transformation.T)
        linked = None if links is None else sp.csr_matrix(self._to_kept @ links @ transformation)
        if spans:
            self.indptr, self.indices = _with_links(*span_pattern(groups, nodes), linked)
            self._sums = [
                SpanSum(groups[batch.group][batch.part], self.indptr, self.indices) for batch in self.batches
            ]
        else:
            # Of every group (E a, n): the nodes of its elements on retained nodes.
            local = [sp.csr_matrix(transformation)[connectivity.ravel()] for connectivity in groups]
            self.indptr, self.indices = _with_links(*_pattern(local, self._width), linked)
            self._sums = [self._pair_sum(local[batch.group], batch) for batch in self.batches]
        self._links = None if linked is None else self._linked(linked)

    @property
    def entries(self) -> int:
        """Number of blocks in the pattern."""
        return len(self.indices)

    def node_forces(self, forces: Sequence[np.ndarray]) -> np.ndarray:
        """Return the sum of element forces (E, a, block) of every group at all nodes, shape (N, block)."""
        flat = [force.reshape(-1, self.block) for force in forces]
        return self._to_nodes @ (flat[0] if len(flat) == 1 else np.concatenate(flat))

    def sum_forces(self, forces: Sequence[np.ndarray]) -> np.ndarray:
        """Return T^T sum of element forces (E, a, block) of every group, shape (n block,)."""
        return self.collect(self.node_forces(forces))

    def collect(self, node_force: np.ndarray) -> np.ndarray:
        """Return T^T of forces at all nodes (N, block), shape (n block,)."""
        return (self._to_kept @ node_force).ravel()

    def begin_stiffness(self, room: int = 0) -> StiffnessSum:
        """Return an empty sum of stiffness blocks, in an array with room for so many more."""
        return StiffnessSum(self.entries, self.block, self._sums, room)

    def connection(self) -> sp.csr_matrix:
        """Return which retained nodes (n, n) share an element or a link, as ones."""
        return sp.csr_matrix(
            (np.ones(self.entries, dtype=np.int8), self.indices, self.indptr),
            shape=(self.retained, self.retained),
        )

    def matrix(self, total: StiffnessSum) -> sp.bsr_matrix:
        """Return the sum of all batches, and of the links, as a BSR matrix (size, size)."""
        size = self.retained * self.block
        blocks = total.data.reshape(-1, self.block, self.block)
        if self._links is not None:
            entries, values = self._links
            for i in range(self.block):
                blocks[entries, i, i] += values
        return sp.bsr_matrix((blocks, self.indices, self.indptr), shape=(size, size))

    def _linked(self, linked: sp.csr_matrix) -> tuple[np.ndarray, np.ndarray]:
        """Return the pattern's entries (k,) that are links, and what they add to every component [N/m]."""
        row = np.repeat(np.arange(self.retained), np.diff(linked.indptr))
        if not len(row):
            return np.empty(0, dtype=np.int64), np.empty(0)
        return entries_at(self.indptr, self.indices, row, linked.indices), linked.data

    def _pair_sum(self, local: sp.csr_matrix, batch: Batch) -> PairSum:
        """Return the sum of a batch of any elements, from the retained nodes of its group's (E a, n)."""
        a, count = self._width[batch.group], batch.count
        part = local[batch.part.start * a : batch.part.stop * a]
        element = np.repeat(np.arange(count), a * a)
        first = element * a + np.tile(np.repeat(np.arange(a), a), count)  # corner of the row, per pair
        second = element * a + np.tile(np.arange(a), a * count)
        degree = np.diff(part.indptr)
        many = degree[first] * degree[second]
        pair = np.repeat(np.arange(len(first)), many)
        within = np.arange(len(pair)) - np.repeat(np.cumsum(many) - many, many)
        p = part.indptr[first[pair]] + within // degree[second[pair]]
        q = part.indptr[second[pair]] + within % degree[second[pair]]
        position = entries_at(self.indptr, self.indices, part.indices[p], part.indices[q])
        touched, row = np.unique(position, return_inverse=True)
        weights = part.data[p] * part.data[q]
        if np.all(weights == 1):  # of most batches: an eighth of the memory
            weights = weights.astype(np.int8)
        return PairSum(touched, sp.csr_matrix((weights, (row, pair)), shape=(len(touched), len(first))))


class StiffnessSum:
    """Stiffness blocks on their way into the matrix, batch by batch in any order and by any thread.

    Batches are added in their order, so that rounding does not depend on who came first: what comes early waits for its
    turn. `data` (entries, block^2) is the sum once all batches are there.
    """

    def __init__(self, entries: int, block: int, sums: Sequence[PairSum | SpanSum], room: int) -> None:
        self.data = np.zeros((entries + room, block**2))[:entries]
        self._sums = sums
        self._waiting: dict[int, np.ndarray] = {}
        self._next = 0
        self._turn = threading.Lock()

    def put(self, number: int, blocks: np.ndarray) -> None:
        """Take over the stiffness blocks (e, a^2, block^2) of batch `number`, each batch once."""
        total = self._sums[number].of(blocks.reshape(-1, self.data.shape[1]))
        with self._turn:
            self._waiting[number] = total
            while self._next in self._waiting:
                self._sums[self._next].add(self.data, self._waiting.pop(self._next))
                self._next += 1


@dataclass(frozen=True, eq=False)
class PairSum:
    """The sum of one batch of any elements, by the weights that take every pair of nodes to its entries."""

    entries: np.ndarray  # int (k,), entries of the pattern that the batch touches, ascending
    weights: sp.csr_matrix  # (k, e a^2)

    def of(self, blocks: np.ndarray) -> np.ndarray:
        """Return the sums (k, b) of blocks (e a^2, b)."""
        return self.weights @ blocks

    def add(self, data: np.ndarray, total: np.ndarray) -> None:
        """Add what `of` has returned to all entries (entries, b)."""
        data[self.entries] += total


def _batches(group: int, connectivity: np.ndarray, pairs: int) -> list[Batch]:
    elements, width = connectivity.shape
    chunk = max(1, pairs // width**2)
    return [Batch(group, slice(i, min(i + chunk, elements))) for i in range(0, elements, chunk)]


def _pattern(local: Sequence[sp.csr_matrix], width: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return row pointers and columns of all pairs of retained nodes that share an element."""
    incidence = sp.vstack([_incidence(part, a) for part, a in zip(local, width, strict=True)], format="csr")
    pattern = sp.csr_matrix(incidence.T @ incidence)
    pattern.sort_indices()
    return pattern.indptr, pattern.indices


def _with_links(
    indptr: np.ndarray, indices: np.ndarray, linked: sp.csr_matrix | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return row pointers and sorted columns (int32) of a pattern and of links."""
    if linked is not None:
        pattern = sp.csr_matrix((np.ones(len(indices), dtype=bool), indices, indptr), shape=linked.shape)
        pattern = sp.csr_matrix(pattern + (linked != 0))
        pattern.sort_indices()
        indptr, indices = pattern.indptr, pattern.indices
    return indptr.astype(np.int32), indices.astype(np.int32)


def _incidence(local: sp.csr_matrix, width: int) -> sp.csr_matrix:
    """Return which retained nodes every element has (E, n)."""
    shape = local.shape[0] // width, local.shape[1]
    return sp.csr_matrix((np.ones(local.nnz, dtype=bool), local.indices, local.indptr[::width]), shape=shape)
