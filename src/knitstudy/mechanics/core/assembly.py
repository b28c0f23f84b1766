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
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.lib.stride_tricks import as_strided

from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.batches import Reserve

# Pairs of nodes a batch. Threads wait for the interpreter between the steps of small ones; large ones leave the cache.
FEW, MANY = 32_768, 131_072
BATCHES = 8  # at least, for threads to share, where they have more than a few pairs


@dataclass(frozen=True)
class Batch:
    """Elements that are evaluated together: `part` of the elements of `group`."""

    group: int
    part: slice

    @property
    def count(self) -> int:
        """Number of elements."""
        return self.part.stop - self.part.start


def _are_spans(nodes: np.ndarray) -> bool:
    """Whether elements (E, a) have consecutive nodes, and rise."""
    return bool(np.all(np.diff(nodes, axis=1) == 1) and np.all(np.diff(nodes[:, 0]) > 0))


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
        pairs: int = 0,  # pairs of nodes a batch; by default between `FEW` and `MANY`
    ) -> None:
        self.block = block
        every = sum(nodes.size * nodes.shape[1] for nodes in groups)
        pairs = pairs or min(max(every // BATCHES, FEW), MANY)
        self.batches = [
            batch for number, nodes in enumerate(groups) for batch in _batches(number, nodes, pairs)
        ]
        spans = transformation is None and all(map(_are_spans, groups))
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
        # Of every group (E a, n): the nodes of its elements on retained nodes.
        local = [sp.csr_matrix(transformation)[connectivity.ravel()] for connectivity in groups]
        self.indptr, self.indices = _pattern(local, self._width, linked)
        self._sums: list[PairSum] | list[SpanSum]
        if spans:
            self._sums = [SpanSum(groups[b.group][b.part], self.indptr, self.indices) for b in self.batches]
        else:
            self._sums = self._pair_sums(local)
        self._links = None if linked is None else self._linked(linked)

    def _pair_sums(self, local: Sequence[sp.csr_matrix]) -> list[PairSum]:
        """Return the sums of batches, which know the entries that no other batch adds to."""
        pairs = [self._pairs(local[batch.group], batch) for batch in self.batches]
        batches = np.bincount(np.concatenate([touched for touched, _ in pairs]), minlength=self.entries)
        return [PairSum(touched, weights, batches[touched] == 1) for touched, weights in pairs]

    @property
    def entries(self) -> int:
        """Number of blocks in the pattern."""
        return len(self.indices)

    def node_forces(self, forces: Sequence[np.ndarray]) -> Floats:
        """Return the sum of element forces (E, a, block) of every group at all nodes, shape (N, block)."""
        flat = [force.reshape(-1, self.block) for force in forces]
        return self._to_nodes @ (flat[0] if len(flat) == 1 else np.concatenate(flat))

    def sum_forces(self, forces: Sequence[np.ndarray]) -> Floats:
        """Return T^T sum of element forces (E, a, block) of every group, shape (n block,)."""
        return self.collect(self.node_forces(forces))

    def collect(self, node_force: Floats) -> Floats:
        """Return T^T of forces at all nodes (N, block), shape (n block,)."""
        return (self._to_kept @ node_force).ravel()

    def begin_stiffness(self, room: int = 0, reserve: Reserve | None = None) -> StiffnessSum:
        """Return an empty sum of stiffness blocks, in an array with room for so many more."""
        (data,) = (reserve or Reserve()).arrays((self.entries + room, self.block**2))
        return StiffnessSum(data[: self.entries], self._sums)

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

    def _linked(self, linked: sp.csr_matrix) -> tuple[Ints, Floats]:
        """Return the pattern's entries (k,) that are links, and their stiffness for every component [N/m]."""
        row = np.repeat(np.arange(self.retained), np.diff(linked.indptr))
        if not len(row):
            return np.empty(0, dtype=np.int64), np.empty(0)
        return _entries_at(self.indptr, self.indices, row, linked.indices), linked.data

    def _pairs(self, local: sp.csr_matrix, batch: Batch) -> tuple[Ints, sp.csr_matrix]:
        """Return the entries that a batch of any elements touches, and the weights that take its blocks there."""
        a = self._width[batch.group]
        count = batch.count
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
        position = _entries_at(self.indptr, self.indices, part.indices[p], part.indices[q])
        touched, row = np.unique(position, return_inverse=True)
        weights = part.data[p] * part.data[q]
        if np.all(weights == 1):  # of most batches: an eighth of the memory
            weights = weights.astype(np.int8)
        return touched, sp.csr_matrix((weights, (row, pair)), shape=(len(touched), len(first)))


class StiffnessSum:
    """Stiffness blocks on their way into the matrix, batch by batch in any order and by any thread.

    Entries that one batch alone touches may be written at once; all else is added in the order of the batches, so that
    rounding does not depend on which came first: a batch that comes early waits for its turn. `data` (entries, block^2)
    is the sum once all batches are there.
    """

    def __init__(self, data: Floats, sums: Sequence[PairSum | SpanSum]) -> None:
        data[:] = 0
        self.data = data
        self._sums = sums
        self._waiting: dict[int, np.ndarray] = {}
        self._next = 0
        self._turn = threading.Lock()

    def put(self, number: int, blocks: Floats) -> None:
        """Take over the stiffness blocks (e, a^2, block^2) of batch `number`, each batch once."""
        total = self._sums[number].put(self.data, blocks.reshape(-1, self.data.shape[1]))
        with self._turn:
            self._waiting[number] = total
            while self._next in self._waiting:
                self._sums[self._next].add(self.data, self._waiting.pop(self._next))
                self._next += 1


class PairSum:
    """The sum of one batch of any elements, by the weights that take every pair of nodes to its entries."""

    def __init__(
        self,
        entries: Ints,  # (k,), entries of the pattern that the batch touches, ascending
        weights: sp.csr_matrix,  # (k, e a^2)
        alone: Bools,  # (k,), entries that no other batch touches
    ) -> None:
        self._own = entries[alone]
        self._joint = entries[~alone]
        self._to_own = weights[alone]
        self._to_joint = weights[~alone]

    def put(self, data: Floats, blocks: Floats) -> Floats:
        """Write entries of its own into `data` (entries, b); return blocks (e a^2, b) of entries that it shares."""
        data[self._own] = self._to_own @ blocks
        return self._to_joint @ blocks

    def add(self, data: Floats, total: Floats) -> None:
        """Add what `put` has returned."""
        data[self._joint] += total


class SpanSum:
    """The sum of one batch of elements whose nodes have consecutive numbers.

    In a row of the pattern the columns of such an element stand one after the other: it needs a numbers to find its a^2
    places.
    """

    def __init__(
        self,
        nodes: np.ndarray,  # int (e, a), of the elements, which rise
        indptr: np.ndarray,  # of the pattern, which has all pairs of nodes of an element, columns sorted
        indices: np.ndarray,  # likewise
    ) -> None:
        rows, local = np.unique(nodes, return_inverse=True)
        local = local.reshape(nodes.shape)
        count = np.diff(indptr)[rows]
        start = np.concatenate([[0], np.cumsum(count)])  # of the rows, among the entries of the batch
        within = _entries_at(indptr, indices, nodes, nodes[:, :1]) - indptr[nodes]
        self._place = (start[local] + within).astype(np.int32)
        self._size = int(start[-1])
        self._rounds = _rounds(nodes[:, 0], nodes.shape[1])
        ends = np.flatnonzero(np.diff(rows) != 1) + 1
        # Runs of rows, among the entries of the batch and in the pattern.
        self._runs = [
            (slice(start[low], start[high]), slice(indptr[rows[low]], indptr[rows[high - 1] + 1]))
            for low, high in pairwise([0, *ends, len(rows)])
        ]

    def put(self, data: Floats, blocks: Floats) -> Floats:
        """Return the sums (k, b) of blocks (e a^2, b) at all entries of the batch: none of `data` is its own."""
        total = np.zeros((self._size, blocks.shape[1]))
        run = self._place.shape[1] * blocks.shape[1]  # of a row of an element
        rows = as_strided(total, (self._size - self._place.shape[1] + 1, run), total.strides)
        blocks = blocks.reshape(*self._place.shape, run)
        for number in range(self._rounds):  # of elements that share no node
            chosen = slice(number, None, self._rounds)
            rows[self._place[chosen]] += blocks[chosen]
        return total

    def add(self, data: Floats, total: Floats) -> None:
        """Add what `put` has returned."""
        for here, there in self._runs:
            data[there] += total[here]


def _batches(group: int, connectivity: np.ndarray, pairs: int) -> list[Batch]:
    elements, width = connectivity.shape
    chunk = max(1, pairs // width**2)
    return [Batch(group, slice(i, min(i + chunk, elements))) for i in range(0, elements, chunk)]


def _pattern(
    local: Sequence[sp.csr_matrix], width: Sequence[int], linked: sp.csr_matrix | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return row pointers and sorted columns (int32) of all pairs of retained nodes that share an element or a link."""
    has = [  # which retained nodes every element has (E, n)
        sp.csr_matrix(
            (np.ones(part.nnz, dtype=bool), part.indices, part.indptr[::a]),
            shape=(part.shape[0] // a, part.shape[1]),
        )
        for part, a in zip(local, width, strict=True)
    ]
    incidence = sp.vstack(has, format="csr")
    pattern = sp.csr_matrix(incidence.T @ incidence)
    if linked is not None:
        pattern = sp.csr_matrix(pattern + (linked != 0))
    pattern.sort_indices()
    return pattern.indptr.astype(np.int32), pattern.indices.astype(np.int32)


def _entries_at(indptr: np.ndarray, indices: np.ndarray, row: np.ndarray, column: np.ndarray) -> Ints:
    """Return the positions of pairs (row, column) in a pattern with sorted columns that has all of them."""
    low = int(row.min())
    high = int(row.max()) + 1
    start, stop = indptr[low], indptr[high]
    rows = np.repeat(np.arange(low, high, dtype=np.int64), np.diff(indptr[low : high + 1]))
    size = np.int64(len(indptr))
    keys = rows * size + indices[start:stop]
    return start + np.searchsorted(keys, row.astype(np.int64) * size + column)


def _rounds(first: np.ndarray, width: int) -> int:
    """Return the least number such that elements that stand so far apart share no node."""
    for apart in range(1, len(first)):
        if np.all(first[apart:] >= first[:-apart] + width):
            return apart
    return max(len(first), 1)
