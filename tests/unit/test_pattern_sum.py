"""A matrix of few blocks added to one of many."""

import numpy as np
import pytest
import scipy.sparse as sp

from knitstudy.mechanics.sparse_sums import PatternSum, block_entries, lacking

NODES = 12


def matrix(seed, share):
    """Random blocks where a random pattern has them."""
    rng = np.random.default_rng(seed)
    pattern = sp.random_array((NODES, NODES), density=share, rng=rng, format="csr")
    pattern.sort_indices()
    data = rng.normal(size=(pattern.nnz, 3, 3))
    return sp.bsr_matrix((data, pattern.indices, pattern.indptr), shape=(3 * NODES, 3 * NODES))


@pytest.mark.parametrize(("large", "small"), [(0.5, 0.1), (0.2, 0.4), (0.3, 0.0), (0.0, 0.2), (1.0, 0.3)])
def test_sum_is_the_sum(large, small):
    for seed in range(5):
        one, other = matrix(seed, large), matrix(seed + 10, small)
        expected = (one + other).toarray()
        total = PatternSum(one, other).add(one, other)
        np.testing.assert_allclose(total.toarray(), expected, rtol=1e-15)
        assert all(np.all(np.diff(total.indices[low:high]) > 0) for low, high in _rows(total))


@pytest.mark.parametrize("room", [3, 200])
def test_the_sum_takes_the_place_of_the_large_matrix_if_that_has_room(room):
    one, other = matrix(0, 0.4), matrix(1, 0.3)
    expected = (one + other).toarray()
    whole = np.zeros((one.nnz // 9 + room, 9))
    whole[: one.nnz // 9] = one.data.reshape(-1, 9)
    data = whole[: one.nnz // 9].reshape(-1, 3, 3)
    roomy = sp.bsr_matrix((data, one.indices, one.indptr), shape=one.shape)
    total = PatternSum(one, other).add(roomy, other)
    np.testing.assert_allclose(total.toarray(), expected, rtol=1e-15)
    assert np.shares_memory(total.data, whole) == (room == 200)


def test_a_part_is_taken_off_for_a_while():
    whole, part = matrix(0, 1.0), matrix(1, 0.3)
    before, less = whole.toarray(), (whole - part).toarray()
    with lacking(whole, part):
        np.testing.assert_array_equal(whole.toarray(), less)
    np.testing.assert_array_equal(whole.toarray(), before)


def _rows(total):
    return zip(total.indptr[:-1], total.indptr[1:], strict=True)


def test_the_pattern_serves_as_long_as_both_stay():
    one, other = matrix(0, 0.5), matrix(1, 0.1)
    found = PatternSum(one, other)
    assert found.fits(matrix(0, 0.5), matrix(1, 0.1))
    assert not found.fits(one, matrix(2, 0.1))
    assert not found.fits(matrix(2, 0.5), other)
    twice = sp.bsr_matrix((2 * other.data, other.indices, other.indptr), shape=other.shape)
    expected = (one + twice).toarray()
    np.testing.assert_allclose(found.add(one, twice).toarray(), expected, rtol=1e-15)


def test_entries_of_rows():
    one = matrix(3, 0.4)
    rows = np.array([2, 7, 11])
    found = block_entries(one, rows)
    np.testing.assert_array_equal(
        found, np.concatenate([np.arange(one.indptr[row], one.indptr[row + 1]) for row in rows])
    )
