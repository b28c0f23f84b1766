"""Loops optimised anew at other course spacings and of other yarns: what is held stays, and yarns do not touch."""

import numpy as np
import pytest

from knitstudy.geometry.lay_out import LENGTH_TOLERANCE, initial_loop, lay_out
from knitstudy.study.configuration import load_scene


@pytest.fixture(scope="module")
def scene():
    return load_scene("sweep-wale-tie-course")


@pytest.fixture(scope="module")
def drawn(scene):
    return initial_loop(scene)


@pytest.mark.parametrize(("ratio", "diameter"), [(0.7, 1.8e-3), (1.3, 1.8e-3), (1.0, 1.2e-3), (1.0, 2.2e-3)])
def test_wale_spacing_stays_and_the_loop_is_found(scene, drawn, ratio, diameter, verify):
    geometry = lay_out(scene.vary({"pattern.course_ratio": ratio, "yarn.diameter": diameter}))
    assert float(geometry["wale_spacing"]) == drawn.wale_spacing
    assert float(geometry["course_spacing"]) == pytest.approx(ratio * drawn.course_spacing, rel=1e-15)
    after, radius = geometry.sel(state="after"), diameter / 2
    error = np.abs(after["crossing_distance"] - (2 + drawn.clearance) * radius).max().item() / radius
    name = f"loop at {ratio:g} of the course spacing, {1e3 * diameter:g} mm thick"
    verify.at_most(f"{name}: |D - 2R - c0| over R", error, 1e-3)
    verify.at_most(f"{name}: R over radius of curvature", radius / float(after["radius_of_curvature"]), 1.0)
    verify.at_least(f"{name}: gap of all other pieces over R", float(after["other_gap"]) / radius, 0.0, "0")


@pytest.mark.parametrize(("ratio", "diameter"), [(0.8, 1.8e-3), (1.0, 2.2e-3)])
def test_length_stays_and_wale_spacing_follows(scene, drawn, ratio, diameter, verify):
    changes = {"pattern.keep": "length", "pattern.course_ratio": ratio, "yarn.diameter": diameter}
    geometry = lay_out(scene.vary(changes))
    length = float(geometry["loop_length"].sel(state="after"))
    name = f"loop at {ratio:g} of the course spacing, {1e3 * diameter:g} mm thick, length held"
    verify.within(f"{name}: yarn [m]", length, drawn.length, LENGTH_TOLERANCE)
    wider = float(geometry["wale_spacing"]) / drawn.wale_spacing - 1
    assert np.sign(wider) == (1 if ratio < 1 else -1)
