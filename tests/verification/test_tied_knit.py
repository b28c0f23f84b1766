"""Direct simulation of a tied knit: energies, convergence of Newton's method, repeatability, units."""

import numpy as np
import pytest
from pull import knit_and_mesh, pull

from knitstudy.measures.history_checks import hourglass_share, ledger_gap
from knitstudy.mechanics.increment import Settings
from knitstudy.mechanics.newton import trace
from knitstudy.models.simulate import build
from knitstudy.study.configuration import load_scene


def changed(scene, **changes):
    return scene.vary({key.replace("__", "."): value for key, value in changes.items()})


@pytest.fixture(scope="module")
def scene(full):
    """The fine 3 x 3 knit of the paper, or one coarse cell."""
    if full:
        return load_scene("dns-tie-course")
    return changed(load_scene("dns-tie-course-coarse"), pattern__loops=1, pattern__rows=1, load__strain=0.05)


@pytest.fixture(scope="module")
def cell(scene):
    """One cell of it, for cases that run several times."""
    return changed(scene, pattern__loops=1, pattern__rows=1, mesh__size=max(scene.mesh.size, 0.5))


@pytest.fixture(scope="module")
def history(scene, full):
    """A full loading in few increments: nothing that it relies on may change on the way."""
    return pull(changed(scene, solver__increments=12 if full else 4))


def test_every_increment_converges(history, verify):
    verify.at_most(
        "tied knit to 5%: residual over mean internal force", float(history["residual"].max()), 1e-6
    )
    verify.at_most("tied knit to 5%: last correction over h", float(history["correction"].max()), 1e-6)
    assert history["strain"][-1] == pytest.approx(0.05)


def test_ledger_of_energies(history, scene, verify):
    finer = pull(changed(scene, solver__increments=2 * (history.sizes["increment"] - 1)))
    gap = ledger_gap(history)
    verify.at_most("tied knit: ledger of energies over external work", gap, 0.01)
    verify.at_most(
        "tied knit: the same with twice the increments, ratio", ledger_gap(finer) / gap, 0.5, "1/4"
    )


def test_hourglass_energy(history, verify):
    verify.at_most("tied knit: hourglass over internal energy", hourglass_share(history), 0.05)


def test_newton_converges_quadratically(cell, verify):
    """With exact tangents and exact solves the number of digits doubles, up to rounding."""
    knit, mesh = knit_and_mesh(cell)
    problem = build(changed(cell, solver__linear="lu"), knit, mesh=mesh)
    settings = Settings(increments=1, residual_tolerance=1e-9, correction_tolerance=1e-6, exact=True)
    *_, end = trace(problem.model, problem.prescribed, settings, problem.solver)
    # Residuals at rounding say nothing about the method. Digits, not steps, are compared: a step that leaves an error
    # along bending after one along stretch has another constant, which digits outgrow.
    digits = np.log([r for r in end.residuals if r > 1e-10])
    verify.at_least(
        "Newton on the tied cell, 5% in one increment: exponent", digits[-1] / digits[-2], 1.8, "2"
    )


def test_tie_follows_rigid_rotations(cell, verify):
    """Rotating a tied knit as a whole gives no force: slaves lie where their masters put them."""
    from knitstudy.mechanics.rotation import exp
    from knitstudy.mechanics.solid import SolidState

    knit, mesh = knit_and_mesh(cell)
    yarns = build(cell, knit, mesh=mesh).observer.yarns
    rotation = exp(np.array([0.4, -1.2, 0.9]))
    nodes = yarns.parts.nodes[yarns.retained]
    force = yarns.model.respond(SolidState(nodes @ rotation.T - nodes), stiffness=False).force
    level = cell.yarn.youngs_modulus * cell.metres("mesh.size") ** 2
    verify.at_most("rigid rotation of a tied cell: force over E h^2", np.abs(force).max() / level, 1e-10)
