"""A cell of a tied knit: one answer whatever cell is taken and however it lies, and tangents that are derivatives."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.lay_out import lay_out
from knitstudy.loading.solve import solve_load_path
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.newton import trace
from knitstudy.mechanics.periodic import PeriodicModel, seam
from knitstudy.mechanics.solid import SolidModel
from knitstudy.models.endless import FIXED, Cell, WrappedYarn, assemble, periodic_map, wrapped_shape
from knitstudy.models.simulate import build
from knitstudy.models.spline_yarns import discretise
from knitstudy.study.configuration import load_scene

PLAIN, STILL = np.eye(3), np.zeros(3)

PULLED = {"load.strain": 0.05, "solver.increments": 4}


@pytest.fixture(scope="module")
def scene():
    return load_scene("cell-course").vary(PULLED)


@pytest.fixture(scope="module")
def knit(scene):
    return Fabric.from_dataset(lay_out(scene))


@pytest.fixture(scope="module")
def cell(scene, knit):
    return assemble(scene, knit, discretise(scene, knit))


@pytest.fixture(scope="module")
def at_rest(cell):
    return cell.stiffness()


@pytest.fixture(scope="module")
def pulled(scene, knit):
    return solve_load_path(build(scene, knit))


def stretched(cell, strains, increments=2):
    """Return the state of a cell at strains (3,) in the plane, and the forces per width there."""
    model, lengths = cell.model, cell.lattice.lengths
    fixed = np.concatenate([FIXED, model.lattice])
    value = np.concatenate([np.zeros(len(FIXED)), strains * lengths])
    settings = Settings(increments=increments, residual_tolerance=1e-9, exact=True)
    *_, last = trace(model, PrescribedDisplacement(fixed, value), settings, LU())
    return last.state, cell.resultants(last.response.force)


def moved(cell, scene, knit, turn=PLAIN, shift=STILL):
    """Return the cell after its yarns and its lattice have been turned and shifted in the plane."""
    yarns, parts = cell.yarns, cell.yarns.parts
    lattice = replace(cell.lattice, vectors=cell.lattice.vectors @ turn.T)
    space = parts.space
    around = seam(space.yarns[0])
    start = wrapped_shape(space.yarns[0], around, knit.centrelines[0], knit.radius, cell.lattice.vectors[0])
    start = start @ turn.T + np.multiply.outer(around.unity, shift)
    rows = [WrappedYarn(around, start)] * (len(space.yarns) - 1)
    spread, jumps = periodic_map(space, rows, lattice)
    nodes = parts.nodes @ turn.T + np.multiply.outer(parts.unity, shift)
    every = sp.identity(len(nodes), format="csr")
    solids = SolidModel(nodes, parts.groups(nodes), parts.size, every, links=yarns.ties.links)
    unknowns = sp.csr_matrix(sp.hstack([spread, jumps[:, :3] / lattice.lengths]))
    return Cell(replace(yarns, model=solids), PeriodicModel(solids, unknowns), spread, jumps, lattice)


def turn_by(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def test_the_stiffness_is_symmetric_and_positive(at_rest):
    np.testing.assert_array_equal(at_rest, at_rest.T)
    scale = np.sqrt(np.diag(at_rest))
    assert np.linalg.eigvalsh(at_rest / np.outer(scale, scale)).min() > 0.01


def test_a_turned_cell_answers_finite_strains_with_the_turned_forces(cell, scene, knit):
    strain = np.array([[0.05, 0.02], [0.02, -0.01]])
    _, plain = stretched(cell, in_rows(strain))
    turn = turn_by(0.4)
    _, found = stretched(moved(cell, scene, knit, turn), in_rows(turn[:2, :2] @ strain @ turn[:2, :2].T))
    force = np.array([[plain[0], plain[2]], [plain[2], plain[1]]])
    expected = turn[:2, :2] @ force @ turn[:2, :2].T
    np.testing.assert_allclose(found, [expected[0, 0], expected[1, 1], expected[0, 1]], rtol=1e-6)


def in_rows(strain):
    return np.array([strain[0, 0], strain[1, 1], 2 * strain[0, 1]])


def test_the_tangent_is_the_derivative_of_the_forces(cell):
    at, small = np.array([0.03, 0.01, 0.02]), 1e-4
    state, _ = stretched(cell, at)
    differences = [
        (stretched(cell, at + small * unit)[1] - stretched(cell, at - small * unit)[1]) / (2 * small)
        for unit in np.eye(3)
    ]
    tangent = cell.tangent(state)
    # Central differences: an error of second order in 1e-4, of moduli that change by half over 5 %.
    np.testing.assert_allclose(np.transpose(differences), tangent, atol=1e-4 * tangent.max())


def test_the_model_is_the_derivative_of_its_energy(cell):
    model = cell.model
    rng = np.random.default_rng(3)
    state = model.advance(model.start(), 1e-5 * rng.standard_normal(model.size))
    answer = model.respond(replace(state, step=None), stiffness=True)
    way, small = rng.standard_normal(model.size), 1e-8

    def beside(sign):
        return model.respond(model.advance(state, sign * small * way), stiffness=False)

    ahead, behind = beside(1), beside(-1)
    energy = [sum(each.energy.values()) for each in (ahead, behind)]
    assert np.isclose((energy[0] - energy[1]) / (2 * small), answer.force @ way, rtol=1e-6)
    change = (ahead.force - behind.force) / (2 * small)
    np.testing.assert_allclose(answer.stiffness @ way, change, atol=1e-6 * np.abs(change).max())


def test_what_is_free_carries_nothing_and_work_is_stored(pulled):
    force, strain = pulled["force_per_width"].to_numpy()[-1], pulled["cell_strain"].to_numpy()[-1]
    assert strain[0] == pytest.approx(0.05, rel=1e-12)
    assert np.abs(force[1:]).max() <= 1e-5 * force[0]
    assert strain[1] < -0.005  # it contracts
    energy = pulled["energy"].isel(increment=-1)
    stored = float(energy.sel(form="internal") + energy.sel(form="penalty"))
    # The work is summed up by the trapezoidal rule over 4 increments.
    assert float(energy.sel(form="external")) == pytest.approx(stored, rel=2e-3)
