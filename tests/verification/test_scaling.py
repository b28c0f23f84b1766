"""A knit in other units of length and stress gives the same dimensionless answer in every model.

Powers of 2 scale without rounding: nothing but a hidden length, force or stiffness can show, and the last bits of sums,
whose order follows from where arrays lie in memory (3e-12 on one of several machines). Powers of 10 round inputs.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml

from knitstudy.run.configuration import load_scene
from knitstudy.run.simulations import simulate

CASES = yaml.safe_load(Path(__file__).with_name("scaling.yaml").read_text())
BINARY = {"mm": (2.0**-10, 2.0**20), "km": (2.0**10, 2.0**-20)}
DECIMAL = {"mm, 10": (1e-3, 1e6), "km, 10": (1e3, 1e-6)}


@cache
def curve(case, length=1.0, stiffness=1.0):
    """Return the force over E R^2 and the displacement over R of the centrelines."""
    name, changes = CASES[case]
    scene = load_scene(name).vary(changes).scaled(length=length, stiffness=stiffness)
    history = simulate(scene).history
    unit = scene.yarn.youngs_modulus * scene.yarn.radius**2
    return history["force"].to_numpy() / unit, history[
        "centreline_displacement"
    ].to_numpy() / scene.yarn.radius


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("units", [*BINARY, *DECIMAL])
def test_units_leave_the_dimensionless_answer_alone(case, units, skip_if_long, verify):
    skip_if_long(units != "mm")
    for message, here, there in zip(
        ("force", "motion"), curve(case, *(BINARY | DECIMAL)[units]), curve(case), strict=True
    ):
        error = np.abs(here - there).max() / np.abs(there).max()
        verify.at_most(f"units: {units}: {case}: {message}", error, 1e-10 if units in BINARY else 1e-9)
