"""The iterative solvers on the tangent of a tied cell, against sparse LU."""

import numpy as np
import pytest
import scipy.sparse as sp

from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.simulate import build
from knitstudy.knit.yarns.solids import linear_solver
from knitstudy.mechanics.core.linear import LU, NodeFactors, System, factorise
from knitstudy.mechanics.core.linear.krylov import Krylov
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.model import eliminate


@pytest.fixture(scope="module")
def cell(plain_scene, knit_of):
    scene = plain_scene.vary(
        {"fidelity": "hexahedra", "pattern.loops": 1, "pattern.rows": 1, "mesh.size": 2 / 3}
    )
    knit = knit_of(scene)
    problem = build(scene, knit, mesh=mesh_fabric(knit, scene.mesh.size))
    return problem.observer, problem


def tangent(problem):
    """Pinned tangent, and the pull of the driven ends through it."""
    state = problem.model.start()
    matrix = problem.model.respond(state, stiffness=True).stiffness
    guess = np.zeros(problem.model.size)
    guess[problem.prescribed.fixed] = problem.prescribed.value
    rhs = -(matrix @ guess)
    rhs[problem.prescribed.fixed] = 0
    eliminate(matrix, problem.prescribed.fixed)
    return matrix, rhs


def solution(solver, matrix, rhs, tolerance=1e-10):
    solver.use(System(matrix))
    return solver.solve(rhs, tolerance)


@pytest.mark.parametrize("name", ["three_scale", "amg"])
def test_agrees_with_lu(cell, name, verify):
    yarns, problem = cell
    matrix, rhs = tangent(problem)
    exact = solution(LU(), matrix, rhs).x
    actual = solution(linear_solver(name, yarns, problem.prescribed), matrix, rhs)
    residual = np.linalg.norm(rhs - matrix @ actual.x) / np.linalg.norm(rhs)
    verify.at_most(f"{name}: true relative residual, 1e-10 asked for", residual, 1.01e-10)
    error = np.abs(actual.x - exact).max() / np.abs(exact).max()
    verify.at_most(f"{name}: solution against LU", error, 1e-6, "LU")


def test_lu_is_refined_also_where_forces_are_small(verify):
    """Factors without pivoting lose eight digits of this unsymmetric matrix."""
    matrix = sp.csr_matrix([[1e-8, 1.0, 2.0], [-1.0, 1e-8, 3.0], [1.0, 2.0, 1e-8]])
    rhs = 1e-6 * np.array([1.0, 3.0, 2.0])
    assert np.linalg.norm(rhs - matrix @ factorise(matrix).solve(rhs)) > 1e-9 * np.linalg.norm(rhs)
    actual = solution(LU(), matrix, rhs).x
    residual = np.linalg.norm(rhs - matrix @ actual) / np.linalg.norm(rhs)
    verify.at_most("LU: true relative residual, small pivot", residual, 1e-10)


def test_factors_of_blocks_solve_the_system(verify):
    """Unsymmetric blocks on a symmetric pattern, in another order than the nodes have."""
    rng = np.random.default_rng(3)
    pattern = sp.random_array((40, 40), density=0.05, rng=rng)
    pattern = sp.csr_matrix(pattern + pattern.T + sp.eye_array(40))
    blocks = rng.normal(size=(pattern.nnz, 6, 6)) + 40 * np.eye(6) * (pattern.data >= 1)[:, None, None]
    matrix = sp.bsr_matrix((blocks, pattern.indices, pattern.indptr))
    rhs = rng.normal(size=240)
    factors = NodeFactors(matrix)
    assert not np.array_equal(np.argsort(factors.order), np.arange(240))
    expected = np.linalg.solve(matrix.toarray(), rhs)
    error = np.abs(factors.solve(rhs) - expected).max() / np.abs(expected).max()
    verify.at_most("factors of 40 nodes of six unknowns: solution", error, 1e-12, "NumPy")


def test_three_scales_need_few_iterations(cell, verify):
    yarns, problem = cell
    matrix, rhs = tangent(problem)
    solver = linear_solver("three_scale", yarns, problem.prescribed)
    verify.at_most("three scales: iterations to 1e-10", solution(solver, matrix, rhs).iterations, 30, "few")


def test_the_preconditioner_is_symmetric(cell):
    yarns, problem = cell
    matrix, _ = tangent(problem)
    preconditioner = linear_solver("three_scale", yarns, problem.prescribed).preconditioner
    preconditioner.update(System(matrix))
    a, b = np.random.default_rng(1).normal(size=(2, problem.model.size))
    a[problem.prescribed.fixed] = b[problem.prescribed.fixed] = 0
    left, right = b @ preconditioner.apply(a), a @ preconditioner.apply(b)
    # Single precision factors of yarns a thousand times stiffer in stretch than in bending.
    assert left == pytest.approx(right, rel=1e-3)


def test_systems_of_sliding_yarns_take_few_iterations(plain_scene, knit_of, verify):
    """Loops that hang loose slide over long ways, where friction is no small part of the system."""
    loose = {"contact.tied_edges": "none", "pattern.loops": 2, "pattern.rows": 2, "load.strain": 0.1}
    scene = plain_scene.vary({"fidelity": "spline_yarns", "interaction": "isotropic", **loose})
    problem, counts = build(scene, knit_of(scene)), []

    class Counted(Krylov):
        """Solves every system with a new preconditioner first, and counts the iterations of that."""

        def use(self, system):
            self.system = system
            super().use(system)

        def solve(self, rhs, tolerance):
            again = Krylov(self.preconditioner)
            again.use(self.system)
            counts.append(again.solve(rhs, 1e-3).iterations)
            return super().solve(rhs, tolerance)

    solver = Counted(problem.solver.preconditioner)
    path = trace(problem.model, problem.prescribed, problem.settings, solver)
    next(increment for increment in path if increment.index == 2)
    verify.at_most("three scales, yarns that slide: iterations to 1e-3", max(counts), 6, "few")
