"""T^T K T of matrices of few blocks."""

import numpy as np
import pytest
import scipy.sparse as sp

from knitstudy.mechanics.sparse_sums import TiedBlocks

NODES = 9
KEPT = [0, 2, 3, 4, 6, 7, 8]


def ties():
    """Two of nine nodes depend on two and three others."""
    dense = np.zeros((NODES, len(KEPT)))
    dense[KEPT, np.arange(len(KEPT))] = 1
    dense[1, [0, 4]] = 0.3, 0.7
    dense[5, [1, 2, 6]] = 0.2, 0.5, 0.3
    return sp.csr_matrix(dense)


@pytest.mark.parametrize("nodes", [[2, 3, 8], [1, 3], [1, 5, 6], [0, 1, 5, 8], []])
def test_blocks_go_where_their_nodes_depend_on(nodes):
    dense = np.zeros((3 * NODES, 3 * NODES))
    unknowns = (3 * np.array(nodes, dtype=int)[:, None] + np.arange(3)).ravel()
    dense[np.ix_(unknowns, unknowns)] = np.random.default_rng(0).normal(size=(len(unknowns),) * 2)
    matrix = sp.bsr_matrix(dense, blocksize=(3, 3))
    spread = np.kron(ties().toarray(), np.eye(3))
    found = TiedBlocks(ties()).collect(matrix)
    np.testing.assert_allclose(found.toarray(), spread.T @ dense @ spread, atol=1e-14)
    for low, high in zip(found.indptr[:-1], found.indptr[1:], strict=True):
        assert np.all(np.diff(found.indices[low:high]) > 0)


def test_untied_blocks_are_not_copied():
    matrix = sp.bsr_matrix((np.ones((1, 3, 3)), [8], np.repeat([0, 1], [9, 1])), shape=(27, 27))
    assert np.shares_memory(TiedBlocks(ties()).collect(matrix).data, matrix.data)
