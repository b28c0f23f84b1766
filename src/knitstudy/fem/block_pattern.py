"""Sums the stiffness of small groups of nodes into one block sparse matrix of fixed pattern."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp


class BlockPattern:
    """The sparsity pattern of a mesh, found once, into which element matrices are summed again and again.

    Parameters
    ----------
    connectivity : ndarray of int, shape (E, a)
        The nodes of every element.
    nodes : int
        Number of nodes N.
    """

    def __init__(self, connectivity: np.ndarray, nodes: int) -> None:
        count = connectivity.shape[1]
        row = np.repeat(connectivity, count, axis=1).ravel().astype(np.int64)
        column = np.tile(connectivity, (1, count)).ravel()
        diagonal = np.arange(nodes, dtype=np.int64)  # nodes without an element keep a (zero) diagonal block
        key = np.concatenate([row * nodes + column, diagonal * (nodes + 1)])
        self._order = np.argsort(key, kind="stable")
        unique, self._first = np.unique(key[self._order], return_index=True)
        self._indices = (unique % nodes).astype(np.int32)
        self._indptr = np.searchsorted(unique, np.arange(nodes + 1) * nodes).astype(np.int32)
        self._nodes = nodes

    def assemble(self, matrices: np.ndarray, block: int) -> sp.bsr_matrix:
        """Return the sum (N block, N block) of element matrices (E, a block, a block)."""
        count = matrices.shape[1] // block
        blocks = matrices.reshape(-1, count, block, count, block).swapaxes(2, 3).reshape(-1, block, block)
        blocks = np.concatenate([blocks, np.zeros((self._nodes, block, block))])
        # Summed in sorted order: the same bits whatever the number of threads.
        data = np.add.reduceat(blocks[self._order], self._first, axis=0)
        size = self._nodes * block
        return sp.bsr_matrix((data, self._indices.copy(), self._indptr.copy()), shape=(size, size))
