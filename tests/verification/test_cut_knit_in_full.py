"""Cells cut out of a knit against whole yarns gripped up to the cuts: what a grip holds might as well be missing."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import READ

from knitstudy.knit.geometry.fabric import Grip
from knitstudy.knit.geometry.specimens import cut_cells
from knitstudy.knit.mesh.mesher import mesh_scene, sampled_sections
from knitstudy.knit.simulate import solve


@pytest.fixture
def gripped_to_the_cuts(knit_of):
    """Return the function that returns whole yarns which are gripped wherever a cut knit has none."""

    def make(scene):
        knit = knit_of(scene)
        arcs, rows = cut_cells(knit.loop, *knit.cells).arcs, knit.cells[1]
        held, driven = (
            Grip(np.full(len(arc), yarn), arc)
            for yarn, arc in ((0, arcs.arc[arcs.yarn == rows]), (rows, arcs.arc[arcs.yarn == 0]))
        )
        return replace(knit, grips={"wale": (held, driven)})

    return make


def solved(scene, fabric):
    """Return the history of a scene; hexahedra are meshed for its grips."""
    mesh = {"hexahedra": mesh_scene, "spline_yarns": lambda scene, fabric: sampled_sections(fabric)}
    swept = mesh[scene.fidelity](scene, fabric) if scene.fidelity in mesh else None
    return solve(scene, fabric, mesh=swept)


@pytest.mark.parametrize(("fidelity", "interaction"), READ["cut knits"])
def test_wale_tension_of_a_row(plain_scene, knit_of, gripped_to_the_cuts, verify, fidelity, interaction):
    """One row of three loops: arches and sinkers; with friction the outer columns are tied and the middle one slides.

    Elements are not the same: those of whole yarns end where grips do, with sharp breaks.
    """
    scene = plain_scene.vary(
        {
            "fidelity": fidelity,
            "interaction": interaction,
            "load.direction": "wale",
            "load.strain": 0.03,
            "pattern.rows": 1,
        }
    )
    whole = solved(scene, gripped_to_the_cuts(scene))
    cut = scene.replace("specimen", "cut_knit")
    pieces = solved(cut, cut_cells(knit_of(cut).loop, *knit_of(cut).cells))
    name = f"cells cut out of a knit, wale tension, {interaction}"
    name = name if fidelity == "spline_yarns" else f"{name}, {fidelity}"
    verify.within(
        f"{name}: force over that of yarns gripped to the cuts",
        float(pieces["force"][-1]),
        float(whole["force"][-1]),
        0.01,
    )
    if "crossing_force" in whole:
        ours, theirs = (each["crossing_force"].to_numpy()[-1] for each in (pieces, whole))
        worst = np.linalg.norm(ours - theirs, axis=1).max() / np.linalg.norm(theirs, axis=1).max()
        verify.at_most(f"{name}: forces at the crossings", worst, 0.02)
