"""Linear systems: Krylov methods, scales of yarns, sums and eliminations."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from refusals import refusal

from knitstudy.mechanics.core import pattern_sum
from knitstudy.mechanics.core.linear import LU, System
from knitstudy.mechanics.core.linear.krylov import Krylov
from knitstudy.mechanics.core.linear.three_scale import FabricScale, KnitStructure
from knitstudy.mechanics.core.model import eliminate
from knitstudy.mechanics.core.pattern_sum import PatternSum

COUNT = 60


class Jacobi:
    """The diagonal of the symmetric part as preconditioner; it keeps a list of calls."""

    def __init__(self):
        self.calls = []

    def update(self, system):
        self.calls.append("update")
        with system.symmetric():
            self._diagonal = system.matrix.diagonal()

    def release(self):
        self.calls.append("release")

    def apply(self, residual):
        return residual / self._diagonal


def parts(strength=1.0, seed=0):
    """A symmetric positive matrix, and an unsymmetric part: a few strong blocks beside the diagonal."""
    rng = np.random.default_rng(seed)
    dense = rng.normal(size=(COUNT, COUNT))
    positive = sp.bsr_matrix(dense @ dense.T / COUNT + 2 * np.eye(COUNT), blocksize=(3, 3))
    lopsided = np.zeros((COUNT, COUNT))
    lopsided[6:12, 30:36] = strength * rng.normal(size=(6, 6))
    return positive, sp.bsr_matrix(lopsided, blocksize=(3, 3))


def test_agrees_with_lu():
    positive, lopsided = parts()
    matrix, rhs = sp.bsr_matrix(positive + lopsided), np.random.default_rng(1).normal(size=COUNT)
    solver, direct = Krylov(Jacobi()), LU()
    solver.use(System(matrix, lopsided))
    direct.use(System(matrix))
    actual = solver.solve(rhs, 1e-12)
    assert np.linalg.norm(rhs - matrix @ actual.x) <= 1.01e-12 * np.linalg.norm(rhs)
    np.testing.assert_allclose(actual.x, direct.solve(rhs, 1e-12).x, atol=1e-10)


def test_a_system_is_symmetric_for_a_while():
    positive, lopsided = parts()
    system = System(sp.bsr_matrix(positive + lopsided), lopsided)
    with system.symmetric():
        np.testing.assert_allclose(system.matrix.toarray(), positive.toarray(), atol=1e-14)
    np.testing.assert_allclose(system.matrix.toarray(), (positive + lopsided).toarray(), atol=1e-14)


def test_an_increment_begins_without_the_preconditioner_of_the_one_before():
    solver = Krylov(Jacobi())
    for _ in range(2):
        solver.forget()
        solver.use(System(parts()[0]))
        solver.solve(np.ones(COUNT), 1e-6)
    assert solver.preconditioner.calls == ["release", "update"] * 2


def test_a_preconditioner_that_costs_too_much_makes_room_for_the_next_matrix():
    solver, rhs = Krylov(Jacobi()), np.ones(COUNT)
    positive, _ = parts()
    solver.use(System(positive))
    solver.solve(rhs, 1e-6)
    solver.release()
    assert solver.preconditioner.calls == ["update"]  # it serves on
    scale = sp.diags(np.repeat(np.geomspace(1, 3, COUNT // 3), 3))
    for _ in range(4):  # a few iterations more every time
        solver.use(System(sp.bsr_matrix(scale @ positive @ scale, blocksize=(3, 3))))
        solver.solve(rhs, 1e-6)
        solver.release()
    assert solver.preconditioner.calls == ["update", "release", "update"]


def test_a_singular_matrix_is_an_error():
    positive, _ = parts()
    solver = Krylov(Jacobi())
    # Its last unknown is coupled to nothing, and pulled at.
    lost = positive.toarray()
    lost[-1], lost[:, -1] = 0, 0
    away = sp.bsr_matrix(lost - positive.toarray(), blocksize=(3, 3))
    solver.use(System(sp.bsr_matrix(lost, blocksize=(3, 3)), away))
    with refusal(r"the linear solver failed: .* iterations reached"):
        solver.solve(np.ones(COUNT), 1e-8)


def test_a_direct_solver_names_what_nothing_resists():
    lost = parts()[0].toarray()
    lost[4], lost[:, 4] = 0, 0
    solver = LU()
    solver.use(System(sp.bsr_matrix(lost, blocksize=(3, 3))))
    with refusal(r"nothing resists a motion of unknown 4") as refused:
        solver.solve(np.ones(COUNT), 1e-8)
    assert refused.value.unknown == 4


@pytest.mark.parametrize(("factor", "direct"), [(1.0, False), (-1.0, True)])
def test_lu_solves_where_iterations_do_not(factor, direct):
    matrix = factor * parts()[0]
    solver, rhs = Krylov(Jacobi(), direct=LU()), np.random.default_rng(1).normal(size=COUNT)
    solver.use(System(matrix))
    actual = solver.solve(rhs, 1e-10)
    assert (actual.iterations == 0) == direct
    assert np.linalg.norm(rhs - matrix @ actual.x) <= 1.01e-10 * np.linalg.norm(rhs)


@pytest.fixture
def indefinite():
    matrix = parts()[0].tolil()
    matrix[7, 7] = -20.0
    return sp.bsr_matrix(matrix, blocksize=(3, 3)), np.random.default_rng(1).normal(size=COUNT)


def test_an_indefinite_matrix_gives_a_step_that_lowers_the_energy(indefinite):
    matrix, rhs = indefinite
    solver = Krylov(Identity())
    solver.use(System(matrix))
    step = solver.solve(rhs, 1e-10).x
    assert rhs @ step > 0
    assert 0.5 * step @ (matrix @ step) < rhs @ step


def test_solvers_count_negative_eigenvalues_as_far_as_they_can(indefinite):
    matrix, rhs = indefinite
    positive, lopsided = parts()

    def counted(solver, *system):
        solver.use(System(*system))
        solver.solve(rhs, 1e-10)
        return solver.negative_eigenvalues()

    assert LU().negative_eigenvalues() is None
    assert counted(LU(), matrix) == np.count_nonzero(np.linalg.eigvalsh(matrix.toarray()) < 0) == 1
    assert counted(LU(), -positive) == COUNT
    assert counted(Krylov(Jacobi()), positive) == 0
    assert counted(Krylov(Identity()), matrix) == 1
    assert counted(Krylov(Identity(), LU()), -positive) == COUNT
    assert counted(Krylov(Jacobi()), sp.bsr_matrix(positive + lopsided), lopsided) is None


def test_two_negative_pivots_of_an_unsymmetric_matrix_are_no_negative_eigenvalue():
    """Eigenvalues 0.5 +- 2i, whose determinant is positive; beside them one that is negative, and two of a saddle."""
    turning, saddle = np.array([[-0.5, 2.0], [-2.5, 1.5]]), np.array([[-2.0, 1.0], [1.0, -3.0]])
    for blocks, expected in (([turning], 0), ([turning, [[-1.0]]], 1), ([saddle], 2)):
        solver = LU()
        solver.use(System(sp.csr_matrix(sp.block_diag(blocks))))
        solver.solve(np.ones(solver._matrix.shape[0]), 1e-10)
        values = np.linalg.eigvals(sp.block_diag(blocks).toarray())
        assert np.count_nonzero((values.imag == 0) & (values.real < 0)) == expected
        assert solver.negative_eigenvalues() == expected


def test_exchanged_rows_leave_no_inertia():
    solver = LU()
    solver.use(System(sp.csr_matrix([[0.0, 1.0], [1.0, 0.0]])))
    assert solver.solve(np.array([2.0, 3.0]), 1e-10).x.tolist() == [3.0, 2.0]
    assert solver.negative_eigenvalues() is None


class Identity:
    def update(self, system):
        pass

    def apply(self, residual):
        return residual.copy()


STATIONS, FUNCTIONS = 7, 3
NODES = 2 * STATIONS * FUNCTIONS


def structure(fixed=()):
    """Two yarns whose stations have one coefficient of the constant and two of other functions."""
    station = np.repeat(np.arange(2 * STATIONS), FUNCTIONS)
    return KnitStructure(
        position=np.random.default_rng(0).normal(size=(NODES, 3)),
        unity=np.tile([1.0, 0.0, 0.0], 2 * STATIONS),
        yarn=station // STATIONS,
        station=station,
        bandwidth=2 * FUNCTIONS - 1,
        patch=np.empty(0, dtype=np.int64),
        fixed=np.array(fixed, dtype=np.int64),
    )


def rigid(structure, weights):
    """Rigid motions (6, k, 3) of points that are weighted sums (k, n) of the nodes."""
    points = weights @ structure.position
    turns = np.cross(np.eye(3)[:, None], points)
    return np.concatenate([np.broadcast_to(np.eye(3)[:, None], turns.shape), turns])


def assert_rigid(basis, knit):
    """All rigid motions of points, sums of nodes whose weights of the constant sum to 1, are sums of columns."""
    weights = np.random.default_rng(1).normal(size=(40, NODES))
    weights /= (weights @ knit.unity)[:, None]
    expected, moved = rigid(knit, weights).reshape(6, -1).T, np.kron(weights, np.eye(3)) @ basis
    share = np.linalg.lstsq(moved, expected)[0]
    np.testing.assert_allclose(moved @ share, expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("modes", ["whole", "groups"])
def test_rigid_motions_of_points_are_sums_of_modes(modes):
    knit = structure()
    whole = knit.rigid_motions(np.zeros(NODES, dtype=int), None).reshape(-1, 6)
    assert_rigid(whole if modes == "whole" else FabricScale(knit).prolongation().toarray(), knit)


def test_grid_turns_yarns_about_where_they_have_moved_to():
    knit = structure()
    moved = np.random.default_rng(2).normal(size=(NODES, 3))
    basis = FabricScale(knit).prolongation(moved).toarray()
    assert_rigid(basis, replace(knit, position=knit.position + moved))


NODES_SUMS = 12


def matrix(seed, share):
    """Random blocks where a random pattern has them."""
    rng = np.random.default_rng(seed)
    pattern = sp.random_array((NODES_SUMS, NODES_SUMS), density=share, rng=rng, format="csr")
    pattern.sort_indices()
    data = rng.normal(size=(pattern.nnz, 3, 3))
    return sp.bsr_matrix((data, pattern.indices, pattern.indptr), shape=(3 * NODES_SUMS, 3 * NODES_SUMS))


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


def _rows(total):
    return zip(total.indptr[:-1], total.indptr[1:], strict=True)


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
