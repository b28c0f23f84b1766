"""Direct simulation of knits, tied and sliding: energy balance, Newton's method, stabilisation, discs of ties."""

import numpy as np
import pytest

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.loading.run import IN_MEMORY
from knitstudy.knit.mesh.mesher import mesh_scene, sampled_sections
from knitstudy.knit.simulate import build, solve
from knitstudy.measures.response import energy_gap
from knitstudy.mechanics.core.batches import VARIABLE
from knitstudy.mechanics.core.increment import Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.run.configuration import load_scene


def knit_and_mesh(scene):
    """Knit and mesh of a scene."""
    knit = fabric_of(lay_out(scene))
    return knit, mesh_scene(scene, knit)


def pull(scene, run=IN_MEMORY):
    """History of a scene."""
    knit, mesh = knit_and_mesh(scene)
    return solve(scene, knit, run, mesh=mesh)


CELL = {"pattern.loops": 1, "pattern.rows": 1}


@pytest.fixture(scope="module")
def scene(full):
    """The fine 3 x 3 knit of the paper, or one coarse cell."""
    if full:
        return load_scene("dns-tie-course")
    return load_scene("dns-tie-course-coarse").vary(CELL | {"load.strain": 0.05})


@pytest.fixture(scope="module")
def cell(scene):
    """One cell of it, for cases that run several times."""
    return scene.vary(CELL | {"mesh.size": max(scene.mesh.size, 0.5)})


def test_energy_balance(scene, full, verify):
    count = 12 if full else 4
    gap, finer = (energy_gap(pull(scene.replace("solver.increments", n))) for n in (count, 2 * count))
    verify.at_most("tied knit: ledger of energies over external work", gap, 0.01)
    verify.at_most("tied knit: the same with twice the increments, ratio", finer / gap, 0.5, "1/4")


def test_newton_converges_quadratically(cell, verify):
    """With exact tangents and exact solves the number of digits doubles, up to rounding."""
    knit, mesh = knit_and_mesh(cell)
    problem = build(cell, knit, mesh=mesh)
    settings = Settings(increments=1, residual_tolerance=1e-9, correction_tolerance=1e-6, exact=True)
    *_, end = trace(problem.model, problem.prescribed, settings, LU())
    # Residuals at rounding say nothing about the method. Digits, not steps, are compared: a step that leaves an error
    # along bending after one along stretch has another constant, which digits outgrow.
    digits = np.log([r for r in end.residuals if r > 5e-10])  # rounding leaves 1e-10
    verify.at_least(
        "Newton on the tied cell, 5% in one increment: exponent", digits[-1] / digits[-2], 1.8, "2"
    )


WHOLE = {"specimen": "knit", "interaction": "isotropic", "load.stops": []}
"""Whole yarns: pieces of a cut cell that nothing ties come apart without a force."""

UNTIED = WHOLE | {
    "contact.tied_edges": "none",
    "pattern.loops": 1,
    "pattern.rows": 1,
    "mesh.size": 2 / 3,
    "load.strain": 0.015,
    "solver.increments": 6,
}
"""One coarse cell, none of it tied, in which friction takes an eighth of the work."""


@pytest.fixture(scope="module")
def sliding(full):
    """The coarse 3 x 3 knit, or a cell."""
    whole = WHOLE | {"load.strain": 0.02, "solver.increments": 8}
    return load_scene("dns-tie-course-coarse").vary(whole if full else UNTIED)


@pytest.fixture(scope="module")
def history(sliding):
    """Pulled in one go by one thread."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, "1")
        return pull(sliding)


def test_energy_balance_of_sliding_yarns(history, sliding, verify):
    assert history["contact_slip"].max() > 1e-2 * sliding.metres("mesh.size"), (
        "the cases here are about sliding"
    )
    verify.at_most("sliding knit: ledger of energies over external work", energy_gap(history), 0.01)
    end = history["energy"].isel(increment=-1)
    assert end.sel(form="friction") > 0.05 * end.sel(form="external")


@pytest.fixture(scope="module")
def stabilised(sliding):
    """The same knit held by viscous forces, and by a tenth of them."""
    return [pull(sliding.replace("solver.stabilisation", share)) for share in (1e-9, 1e-10)]


def test_work_of_stabilisation_is_booked(stabilised, verify):
    """It takes something of every increment but the one that ends at full load."""
    strong, weak = (run["energy"].sel(form="stabilisation").to_numpy() for run in stabilised)
    assert (np.diff(strong)[:-1] > 0).all()
    assert strong[-1] == strong[-2]
    verify.within("stabilisation: its work over that of a tenth of it", strong[-1] / weak[-1], 10, 0.05)
    verify.at_most("stabilised knit: ledger of energies over external work", energy_gap(stabilised[0]), 0.01)


SMALL = {"pattern.loops": 1, "pattern.rows": 1, "load.strain": 5e-4, "solver.increments": 1}
"""A cell, and a strain at which its force is linear."""


@pytest.fixture(scope="module")
def on_discs():
    return load_scene("dns-tie-course").vary(SMALL)


def force_of_solid_yarns(on_discs, **degrees):
    chosen = on_discs.vary(
        {"fidelity": "spline_yarns"} | {f"mesh.{key}": value for key, value in degrees.items()}
    )
    knit = fabric_of(lay_out(chosen))
    return float(solve(chosen, knit, mesh=sampled_sections(knit))["force"][-1])


def force_of_hexahedra(on_discs, size, **changes):
    chosen = on_discs.vary({"mesh.size": size, "gates.elements_across": 2} | changes)
    knit, mesh = knit_and_mesh(chosen)
    return float(solve(chosen, knit, mesh=mesh)["force"][-1])


@pytest.fixture(scope="module")
def rich(on_discs):
    return force_of_solid_yarns(on_discs, degree=3, crossing_degree=6, crossing_span=0.4)


@pytest.mark.parametrize(("degree", "near", "bound"), [(2, 3, 0.01), (3, 4, 0.005)], ids=["p2-3", "p3-4"])
def test_low_degrees_meet_rich_ones(on_discs, rich, degree, near, bound, verify):
    force = force_of_solid_yarns(on_discs, degree=degree, crossing_degree=near)
    name = f"tied cell on discs, solid yarns p = {degree}, {near} at crossings against 6: force"
    verify.at_most(name, abs(force / rich - 1), bound)


@pytest.mark.full
def test_quadratic_hexahedra_tend_to_the_same(on_discs, rich, verify):
    """Errors of the patch fall with the square of the size."""
    sizes = np.array([1 / 2, 1 / 3])
    force = [force_of_hexahedra(on_discs, size, **{"mesh.element": "quadratic"}) for size in sizes]
    limit = (sizes[0] ** 2 * force[1] - sizes[1] ** 2 * force[0]) / (sizes[0] ** 2 - sizes[1] ** 2)
    assert force[0] > force[1] > limit
    verify.at_most(
        "tied cell on discs, limit of quadratic hexahedra against solid yarns", abs(limit / rich - 1), 0.01
    )
