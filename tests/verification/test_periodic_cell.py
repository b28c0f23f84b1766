"""A cell of a tied knit: tangents are derivatives, and work is stored."""

from dataclasses import replace

import numpy as np
import pytest

from knitstudy.geometry.fabric_file import fabric_of
from knitstudy.geometry.lay_out import lay_out
from knitstudy.loading.solve import solve_load_path
from knitstudy.mechanics.increment import PrescribedDisplacement, Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.load_path import trace
from knitstudy.models.endless import FIXED, assemble
from knitstudy.models.simulate import build, simulate
from knitstudy.models.spline_yarns import discretise
from knitstudy.study.configuration import load_scene

PULLED = {"load.strain": 0.05, "solver.increments": 4}


@pytest.fixture(scope="module")
def scene():
    return load_scene("cell-course").vary(PULLED)


@pytest.fixture(scope="module")
def knit(scene):
    return fabric_of(lay_out(scene))


@pytest.fixture(scope="module")
def cell(scene, knit):
    return assemble(scene, knit, discretise(scene, knit))


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
    return last.state, cell.record(last)[0]["force_per_width"]


def test_the_tangent_is_the_derivative_of_the_forces(cell):
    at, small = np.array([0.03, 0.01, 0.02]), 1e-4
    state, _ = stretched(cell, at)
    differences = [
        (stretched(cell, at + small * unit)[1] - stretched(cell, at - small * unit)[1]) / (2 * small)
        for unit in np.eye(3)
    ]
    tangent = cell.stiffness(replace(state, step=None), slice(3))
    # Central differences: an error of second order in 1e-4, of moduli that change by half over 5 %.
    np.testing.assert_allclose(np.transpose(differences), tangent, atol=1e-4 * tangent.max())


def test_increments_of_a_tied_cell_do_not_matter(cell):
    """Tied elastic yarns have no history: so `config/trade.yaml` takes two increments for each of their solids."""
    few, more = (stretched(cell, np.array([0.05, -0.01, 0.02]), count)[1] for count in (2, 5))
    np.testing.assert_allclose(few, more, rtol=1e-7)


def test_what_is_free_carries_nothing_and_work_is_stored(pulled):
    force, strain = pulled["force_per_width"].to_numpy()[-1], pulled["cell_strain"].to_numpy()[-1]
    assert strain[0] == pytest.approx(0.05, rel=1e-12)
    assert np.abs(force[1:]).max() <= 1e-5 * force[0]
    assert strain[1] < -0.005  # it contracts
    energy = pulled["energy"].isel(increment=-1)
    stored = float(energy.sel(form="internal") + energy.sel(form="penalty"))
    # The work is summed up by the trapezoidal rule over 4 increments.
    assert float(energy.sel(form="external")) == pytest.approx(stored, rel=2e-3)


@pytest.mark.parametrize("friction", [0.1, pytest.param(0.76, marks=pytest.mark.full)])
def test_friction_in_a_free_cell_is_that_of_beams(friction, verify):
    """Nothing but contact holds a cell that is free across: its drag may carry no load."""
    scene = load_scene("cell-wale-isotropic").vary({"contact.friction": friction})
    beams = {"fidelity": "beam", "interaction": "isotropic", "beam.section": "hertz"}
    forces = []
    for one in (scene, scene.vary(beams)):
        history = simulate(one, lay_out(one))
        strain, force = history["cell_strain"][:, 1], history["force_per_width"][:, 1]
        forces.append(np.interp([0.025, 0.05], strain, force))
        energy = history["energy"].isel(increment=-1)
        drag = float(energy.sel(form="stabilisation") / energy.sel(form="external"))
        verify.at_most(
            f"free cell, friction {friction:g}, {one.fidelity}: work of the drag over all", drag, 1e-4
        )
    for half, solid, beam in zip(("half of the strain", "the end"), *forces, strict=True):
        verify.within(f"free cell of solid yarns, friction {friction:g}, at {half}: beams", solid, beam, 0.08)
