"""Direct simulation of a tied knit: its ledger, Newton's method."""

import numpy as np
import pytest
from pull import knit_and_mesh, pull

from knitstudy.knit.simulate import build
from knitstudy.measures.response import ledger_gap
from knitstudy.mechanics.increment import Settings
from knitstudy.mechanics.load_path import trace
from knitstudy.run.configuration import load_scene

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


def test_ledger_of_energies(scene, full, verify):
    count = 12 if full else 4
    gap, finer = (ledger_gap(pull(scene.replace("solver.increments", n))) for n in (count, 2 * count))
    verify.at_most("tied knit: ledger of energies over external work", gap, 0.01)
    verify.at_most("tied knit: the same with twice the increments, ratio", finer / gap, 0.5, "1/4")


def test_newton_converges_quadratically(cell, verify):
    """With exact tangents and exact solves the number of digits doubles, up to rounding."""
    knit, mesh = knit_and_mesh(cell)
    problem = build(cell.replace("solver.linear", "lu"), knit, mesh=mesh)
    settings = Settings(increments=1, residual_tolerance=1e-9, correction_tolerance=1e-6, exact=True)
    *_, end = trace(problem.model, problem.prescribed, settings, problem.solver)
    # Residuals at rounding say nothing about the method. Digits, not steps, are compared: a step that leaves an error
    # along bending after one along stretch has another constant, which digits outgrow.
    digits = np.log([r for r in end.residuals if r > 5e-10])  # rounding leaves 1e-10
    verify.at_least(
        "Newton on the tied cell, 5% in one increment: exponent", digits[-1] / digits[-2], 1.8, "2"
    )
