"""Friction and modulus of a curve of finer beams with 2 % noise, found with coarser ones."""

from functools import cache

import numpy as np

from knitstudy.run.configuration import load_scene
from knitstudy.run.simulations import simulate
from knitstudy.use.curve_fit import SIMULATED, fit
from knitstudy.use.measured_curve import at, simulated_curve

KEYS = {"pattern.loops": 1, "load.strain": 0.03, "load.stops": [], "solver.increments": 10, "outputs": []}
STRAIN = np.linspace(0.001, 0.03, 30)


@cache
def forces(friction, size=1.0):
    changes = KEYS | {"contact.friction": friction, "mesh.beam_size": size}
    results = simulate(load_scene("beam-isotropic-course").vary(changes))
    return at(simulated_curve(results.history, results.geometry), STRAIN)


def test_fit_finds_friction_and_modulus_of_another_resolution():
    noise = 1 + 0.02 * np.random.default_rng(0).standard_normal(len(STRAIN))
    measured = 0.8 * forces(0.3, size=0.6) * noise
    actual = fit(
        measured,
        {each: forces(each) for each in np.linspace(0.05, 1.0, SIMULATED)},
        lambda frictions: {each: forces(each, size=0.6) for each in frictions},
    )
    assert actual.factor[1] <= 0.8 <= actual.factor[2]
    assert actual.friction[1] <= 0.3 <= actual.friction[2]
    assert actual.friction[2] - actual.friction[1] < 0.4
    (remark,) = actual.remarks()
    assert remark.startswith("forces are corrected by ")
