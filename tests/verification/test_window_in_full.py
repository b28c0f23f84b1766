"""A window of solid yarns in a knit of beams against the same knit of solid yarns in full."""

import numpy as np
import pytest

from knitstudy.loading.solve import solve_load_path
from knitstudy.mechanics.newton import trace
from knitstudy.mesh.mesher import sampled_sections
from knitstudy.models.simulate import build, solve

STRAIN = 0.01


@pytest.fixture(scope="module")
def pulled(plain_scene):
    """Scene of tied yarns that are pulled in one increment."""
    return plain_scene.vary({"fidelity": "window", "load.strain": STRAIN, "solver.increments": 1})


def forces(history, crossings):
    return history["crossing_force"].to_numpy()[-1][crossings]


def test_centre_cell_of_nine(pulled, knit, verify):
    """Forces of the ties in the centre cell are those of the full simulation, and so is the force of the grips."""
    full = solve(pulled.replace("fidelity", "spline_yarns"), knit, mesh=sampled_sections(knit))
    window = solve_load_path(build(pulled, knit))
    chosen = np.flatnonzero(window["window_crossing"])
    ours, theirs = forces(window, chosen), forces(full, chosen)
    error = np.linalg.norm(ours - theirs, axis=1) / np.linalg.norm(theirs, axis=1)
    verify.at_most("window, centre of 3 x 3 tied cells: forces of ties over those in full", error.max(), 0.05)
    verify.within(
        "window, centre of 3 x 3 tied cells: force of the grips",
        float(window["force"][-1]),
        float(full["force"][-1]),
        0.05,
    )


def test_tangent_where_solids_and_beams_touch(pulled, knit, verify):
    """Along random ways the tangent is the derivative of the forces, with contact on both sides of the seams."""
    scene = pulled.vary({"interaction": "isotropic", "mesh.beam_size": 5 / 3, "contact.points": 3})
    set_up = build(scene, knit)
    *_, last = trace(set_up.model, set_up.prescribed, set_up.settings, set_up.solver)
    model = set_up.model
    # On the way again: where an increment starts, what slips is between sticking and slipping.
    state = model.begin(model.advance(last.state, 0.1 * last.rates[0].step), 1.0, 0.1)
    tangent = model.respond(state, True).stiffness
    rng, errors = np.random.default_rng(2), []
    for _ in range(3):
        way = rng.normal(size=model.size) / model.scale
        t = 1e-9
        plus, minus = (model.respond(model.advance(state, sign * t * way), False).force for sign in (1, -1))
        foreseen = tangent @ way
        errors.append(
            np.linalg.norm(((plus - minus) / (2 * t) - foreseen) / model.scale)
            / np.linalg.norm(foreseen / model.scale)
        )
    verify.at_most("tangent, solids and beams in contact", max(errors), 1e-4, "central differences")
