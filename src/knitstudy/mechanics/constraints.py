"""Constraints by elimination: prescribed unknowns in the matrix, and linear ties between nodes."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp


class DirichletElimination:
    """Removes prescribed unknowns from matrices of one sparsity pattern, in place.

    Their rows and columns become zero and their diagonal entries the mean stiffness, so that the matrix keeps
    its pattern, its symmetry and its conditioning, and a zero right-hand side gives a zero step.

    Parameters
    ----------
    matrix : bsr or csr matrix, shape (size, size)
        Any matrix with the pattern; the pattern has to be structurally symmetric.
    fixed : ndarray of int, shape (k,)
        The prescribed unknowns.
    """

    def __init__(self, matrix: sp.bsr_matrix | sp.csr_matrix, fixed: np.ndarray) -> None:
        block = matrix.blocksize[0] if matrix.format == "bsr" else 1
        keep = np.ones(matrix.shape[0], dtype=bool)
        keep[fixed] = False
        keep = keep.reshape(-1, block)
        touched = ~keep.all(axis=1)
        rows = np.repeat(np.arange(len(touched), dtype=np.int32), np.diff(matrix.indptr))
        entries = np.flatnonzero(touched[rows] | touched[matrix.indices])
        row, column = rows[entries], matrix.indices[entries]
        self._entries = entries
        self._mask = keep[row][:, :, None] & keep[column][:, None, :]  # (touched entries, block, block)
        on_diagonal = row == column
        self._diagonal = entries[on_diagonal]
        self._fixed = ~keep[row[on_diagonal]]
        self._block = block
        self._indices = matrix.indices

    def fits(self, matrix: sp.bsr_matrix | sp.csr_matrix) -> bool:
        """Return whether a matrix has the pattern that this was made for."""
        return matrix.indices is self._indices or np.array_equal(matrix.indices, self._indices)

    def apply(self, matrix: sp.bsr_matrix | sp.csr_matrix) -> None:
        """Pin the prescribed unknowns of `matrix`."""
        data = matrix.data.reshape(-1, self._block, self._block)
        level = float(np.mean(np.abs(matrix.diagonal())))
        data[self._entries] *= self._mask
        i = np.arange(self._block)
        blocks = data[self._diagonal]
        blocks[:, i, i] = np.where(self._fixed, level, blocks[:, i, i])
        data[self._diagonal] = blocks


def transformation(dependence: sp.sparray | sp.spmatrix) -> tuple[sp.csr_matrix, np.ndarray]:
    """Return T (N, n), every node as a weighted sum of the retained ones, and these (n,), ascending.

    Parameters
    ----------
    dependence : sparse matrix, shape (N, N)
        Rows of the identity for retained nodes, weights of retained nodes for all others.
    """
    dependence = sp.csr_matrix(dependence)
    retained = np.unique(dependence.indices[dependence.data != 0])
    return sp.csr_matrix(dependence[:, retained]), retained


def without(matrix: sp.bsr_matrix, fixed: np.ndarray) -> sp.bsr_matrix:
    """Return a matrix (size, size) with zeros in the rows and columns `fixed` (k,)."""
    keep = np.ones(matrix.shape[0])
    keep[fixed] = 0
    row = np.repeat(np.arange(len(matrix.indptr) - 1), np.diff(matrix.indptr))
    block = matrix.blocksize[0]
    keep = keep.reshape(-1, block)
    data = matrix.data * keep[row][:, :, None] * keep[matrix.indices][:, None, :]
    return sp.bsr_matrix((data, matrix.indices, matrix.indptr), shape=matrix.shape)
