import numpy as np
import pytest
import scipy.sparse as sp

from knitstudy.mechanics.model import DirichletElimination, without


def stiffness(kind, seed=0):
    dense = np.random.default_rng(seed).normal(size=(9, 9))
    dense = dense @ dense.T + 9 * np.eye(9)
    dense[:3, 6:] = dense[6:, :3] = 0
    return sp.bsr_matrix(dense, blocksize=(3, 3)) if kind == "bsr" else sp.csr_matrix(dense)


@pytest.mark.parametrize("kind", ["bsr", "csr"])
def test_pinned_unknowns_leave_the_others_alone(kind):
    fixed = np.array([1, 6, 7])
    matrix = stiffness(kind)
    before = matrix.toarray()
    level = np.mean(np.abs(before.diagonal()))
    DirichletElimination(matrix, fixed).apply(matrix)
    after = matrix.toarray()
    free = np.setdiff1d(np.arange(9), fixed)
    np.testing.assert_array_equal(after[np.ix_(free, free)], before[np.ix_(free, free)])
    np.testing.assert_array_equal(after[np.ix_(fixed, free)], 0)
    np.testing.assert_array_equal(after[np.ix_(free, fixed)], 0)
    np.testing.assert_allclose(after[np.ix_(fixed, fixed)], level * np.eye(3))


def test_one_pattern_serves_many_matrices():
    first, second = stiffness("bsr", 1), stiffness("bsr", 2)
    elimination = DirichletElimination(first, np.array([0]))
    elimination.apply(second)
    assert not second.toarray()[0, 1:].any()


def test_fits_only_its_own_pattern():
    first, same = stiffness("bsr", 1), stiffness("bsr", 2)
    elimination = DirichletElimination(first, np.array([0]))
    assert elimination.fits(same)
    dense = same.toarray()
    dense[:3, 6:] = dense[6:, :3] = 1.0
    assert not elimination.fits(sp.bsr_matrix(dense, blocksize=(3, 3)))
    dense[:3, 3:] = dense[3:, :3] = 0.0
    assert not elimination.fits(sp.bsr_matrix(dense, blocksize=(3, 3)))


def test_rows_and_columns_are_left_out_of_any_matrix():
    """Of one that is not symmetric, without a diagonal, and without blocks in some rows."""
    dense = np.zeros((9, 9))
    dense[3:6, :] = np.random.default_rng(0).normal(size=(3, 9))
    matrix, fixed = sp.bsr_matrix(dense, blocksize=(3, 3)), np.array([1, 4, 8])
    left = without(matrix, fixed).toarray()
    np.testing.assert_array_equal(matrix.toarray(), dense)
    dense[fixed] = dense[:, fixed] = 0
    np.testing.assert_array_equal(left, dense)
