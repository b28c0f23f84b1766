"""Reduced models with ties remember nothing: what they reach does not depend on the way there."""

import numpy as np

from knitstudy.models.simulate import solve


def test_force_does_not_depend_on_the_number_of_increments(plain_scene, knit, contacts, verify):
    """Every increment ends in equilibrium, to far less than the residual that is allowed."""
    scene = plain_scene.replace("fidelity", "rom3d").replace("load.strain", 0.05)
    force = [
        float(solve(scene.replace("solver.increments", count), knit, contacts=contacts)["force"][-1])
        for count in (1, 3, 12)
    ]
    verify.at_most("3D reduced model: force at 5% in 1, 3, 12 increments", np.ptp(force) / max(force), 1e-8)
