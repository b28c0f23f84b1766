"""Krylov methods on matrices that friction has made unsymmetric, against LU."""

import numpy as np
import pytest
import scipy.sparse as sp
from refusals import refusal

from knitstudy.mechanics.linear import LU, System
from knitstudy.mechanics.linear.krylov import Krylov

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


class Identity:
    def update(self, system):
        pass

    def apply(self, residual):
        return residual.copy()
