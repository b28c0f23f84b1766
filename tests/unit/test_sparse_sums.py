"""A matrix of few blocks added to one of many."""

import numpy as np
import pytest
import scipy.sparse as sp

from knitstudy.mechanics import pattern_sum
from knitstudy.mechanics.model import eliminate
from knitstudy.mechanics.pattern_sum import PatternSum, lacking

NODES = 12


def matrix(seed, share):
    """Random blocks where a random pattern has them."""
    rng = np.random.default_rng(seed)
    pattern = sp.random_array((NODES, NODES), density=share, rng=rng, format="csr")
    pattern.sort_indices()
    data = rng.normal(size=(pattern.nnz, 3, 3))
    return sp.bsr_matrix((data, pattern.indices, pattern.indptr), shape=(3 * NODES, 3 * NODES))


@pytest.mark.parametrize("rows", [5, pattern_sum.ROWS])
@pytest.mark.parametrize(("large", "small"), [(0.5, 0.1), (0.2, 0.4), (0.3, 0.0), (0.0, 0.2), (1.0, 0.3)])
def test_sum_is_the_sum(large, small, rows, monkeypatch):
    """However many rows are looked at together."""
    monkeypatch.setattr(pattern_sum, "ROWS", rows)
    for seed in range(5):
        one, other = matrix(seed, large), matrix(seed + 10, small)
        expected = (one + other).toarray()
        total = PatternSum(one, other).add(one, other)
        np.testing.assert_allclose(total.toarray(), expected, rtol=1e-15)
        assert all(np.all(np.diff(total.indices[low:high]) > 0) for low, high in _rows(total))


def test_a_part_is_taken_off_for_a_while():
    whole, part = matrix(0, 1.0), matrix(1, 0.3)
    before, less = whole.toarray(), (whole - part).toarray()
    with lacking(whole, part):
        np.testing.assert_array_equal(whole.toarray(), less)
    np.testing.assert_allclose(whole.toarray(), before, rtol=0, atol=4 * np.finfo(float).eps)


def _rows(total):
    return zip(total.indptr[:-1], total.indptr[1:], strict=True)


# Two quadrilaterals side by side: 0 1 2 over 3 4 5.
@pytest.mark.parametrize("kind", ["bsr", "csr"])
def test_pinned_unknowns_leave_the_others_alone(kind):
    fixed = np.array([1, 6, 7])
    dense = np.random.default_rng(0).normal(size=(9, 9))
    before = dense @ dense.T + 9 * np.eye(9)
    before[:3, 6:] = before[6:, :3] = 0
    matrix = sp.bsr_matrix(before, blocksize=(3, 3)) if kind == "bsr" else sp.csr_matrix(before)
    eliminate(matrix, fixed)
    expected = before.copy()
    expected[fixed] = expected[:, fixed] = 0
    expected[fixed, fixed] = np.mean(np.abs(before.diagonal()))
    np.testing.assert_allclose(matrix.toarray(), expected, rtol=1e-15)


def test_rows_and_columns_are_left_out_of_any_matrix():
    """Of one that is not symmetric, without a diagonal, and without blocks in some rows."""
    dense = np.zeros((9, 9))
    dense[3:6, :] = np.random.default_rng(0).normal(size=(3, 9))
    matrix, fixed = sp.bsr_matrix(dense, blocksize=(3, 3)), np.array([1, 4, 8])
    eliminate(matrix, fixed, diagonal=0.0)
    dense[fixed] = dense[:, fixed] = 0
    np.testing.assert_array_equal(matrix.toarray(), dense)
