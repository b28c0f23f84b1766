"""Cells cut out of a knit against whole yarns gripped up to the cuts: what a grip holds might as well be missing."""

from dataclasses import replace

import numpy as np
import pytest

from knitstudy.geometry.fabric import Grip, cut_cells
from knitstudy.loading.solve import solve_load_path
from knitstudy.mesh.mesher import sampled_sections
from knitstudy.models.simulate import build, solve


@pytest.fixture
def gripped_to_the_cuts(knit_of):
    """Return the function that simulates whole yarns which are gripped wherever a cut knit has none."""

    def simulate(scene):
        knit = knit_of(scene)
        arcs, rows = cut_cells(knit.loop, *knit.cells).arcs, knit.cells[1]
        held, driven = (
            Grip(np.full(len(arc), yarn), arc)
            for yarn, arc in ((0, arcs.arc[arcs.yarn == rows]), (rows, arcs.arc[arcs.yarn == 0]))
        )
        gripped = replace(knit, grips={"wale": (held, driven)})
        return solve(scene, gripped, mesh=sampled_sections(knit))

    return simulate


@pytest.mark.parametrize("interaction", ["tie", "isotropic"])
def test_wale_tension_of_a_row(plain_scene, knit_of, gripped_to_the_cuts, verify, interaction):
    """One row of three loops: arches and sinkers; with friction the outer columns are tied and the middle one slides.

    Spans are not the same: those of whole yarns end where grips do, with sharp breaks.
    """
    scene = plain_scene.vary(
        {
            "fidelity": "spline_yarns",
            "interaction": interaction,
            "load.direction": "wale",
            "load.strain": 0.03,
            "pattern.rows": 1,
        }
    )
    whole = gripped_to_the_cuts(scene)
    cut = scene.replace("specimen", "cut_knit")
    pieces = solve_load_path(build(cut, cut_cells(knit_of(cut).loop, *knit_of(cut).cells)))
    name = f"cells cut out of a knit, wale tension, {interaction}"
    verify.within(
        f"{name}: force over that of yarns gripped to the cuts",
        float(pieces["force"][-1]),
        float(whole["force"][-1]),
        0.01,
    )
    ours, theirs = (each["crossing_force"].to_numpy()[-1] for each in (pieces, whole))
    worst = np.linalg.norm(ours - theirs, axis=1).max() / np.linalg.norm(theirs, axis=1).max()
    verify.at_most(f"{name}: forces at the crossings", worst, 0.02)
