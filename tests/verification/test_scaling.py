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
def test_units_leave_the_dimensionless_answer_alone(case, units, full, verify):
    if not full and units != "mm":
        pytest.skip("takes --full")
    for message, here, there in zip(
        ("force", "motion"), curve(case, *(BINARY | DECIMAL)[units]), curve(case), strict=True
    ):
        error = np.abs(here - there).max() / np.abs(there).max()
        verify.at_most(f"units: {units}: {case}: {message}", error, 1e-10 if units in BINARY else 1e-9)


OF_NEWTON = {"residual", "correction"}  # rounding


@pytest.mark.parametrize("case", CASES)
def test_a_kept_history_is_scaled_as_a_run_would_be(case, full, tmp_path):
    """Every variable and attribute, for a factor that rounds: what has no unit, or a wrong one, would show."""
    if not full and "network" not in case and case != "endless cell, ties":
        pytest.skip("takes --full")
    name, changes = CASES[case]
    scene = load_scene(name).vary({**changes, "name": "one"})
    other = scene.scaled(stiffness=1.7).labelled({"name": "other"})
    simulate(scene, tmp_path)
    scaled, run = simulate(other, tmp_path).history, simulate(other).history
    assert scaled.attrs["scaled_by"] == pytest.approx(1.7)
    costs = {"wall_seconds", "processor_seconds", "memory_growth", "memory_peak"}
    numbers = {
        key: value for key, value in run.attrs.items() if isinstance(value, float) and key not in costs
    }
    assert {key: scaled.attrs[key] for key in numbers} == pytest.approx(numbers, rel=1e-9, nan_ok=True)
    for key, variable in run.variables.items():
        if variable.dtype.kind == "f" and variable.attrs["units"] != "s" and key not in OF_NEWTON:
            # Couples that vanish by symmetry are rounding of some 1e-19 N m.
            near = max(1e-8 * np.abs(np.nan_to_num(variable)).max(initial=0.0), 1e-18)
            assert scaled[key].to_numpy() == pytest.approx(variable.to_numpy(), abs=near, nan_ok=True), key
