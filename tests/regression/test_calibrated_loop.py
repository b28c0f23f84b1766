"""The calibrated loop of config/ still optimises to the knit that it was made for, and is meshed as before."""

import numpy as np
import pytest
from calibrate import Candidate, read_problem, residuals, solve

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.mesh.quality import scaled_jacobian
from knitstudy.knit.mesh.section import GROWTH
from knitstudy.run.configuration import CONFIG, knits_of, load_scene, load_scenes


@pytest.fixture(scope="module")
def scene():
    return knits_of(load_scenes())["plain3x3"]


@pytest.fixture(scope="module")
def after(scene):
    return lay_out(scene)


def radii(dataset, name):
    return dataset[name] / dataset["radius"]


def test_loop_has_the_length_and_spacings_that_were_asked_for(after):
    """Bars of the study: 3 degrees, 2 %. The file was made with the weights of defaults.yaml, and meets them closer."""
    before, now = (after.sel(state=state) for state in ("before", "after"))
    assert float(now["interlock_angle"]) == pytest.approx(66.0, abs=0.01)
    assert float(now["leg_angle"]) == pytest.approx(80.0, abs=0.01)
    assert float(now["loop_length"]) == pytest.approx(55.5e-3, rel=1e-5)
    assert radii(before, "penetration") > 0.3
    assert now["penetration"] == 0


def test_search_finds_the_loop_again_from_near_by(after):
    problem, radius = read_problem(CONFIG)
    points = after["control_points"].values / radius
    points[:, 2] -= points[:, 2].mean()
    wale, course = float(after["wale_spacing"]) / radius, float(after["course_spacing"]) / radius
    weights = problem.settings
    opening = float(after["crossing_distance"][1, 0]) / radius - 2 - problem.clearance
    plane, z = points[1 : problem.quarter, :2].ravel(), points[: problem.quarter + 1, 2]
    force = 2 * weights.alpha / weights.beta * opening
    calibrated = np.concatenate([[wale, course, points[0, 1]], plane, z, [force]])
    disturbed = calibrated + 0.02 * np.random.default_rng(4).normal(size=calibrated.size)
    assert np.linalg.norm(residuals(disturbed, problem)) > 0.3
    actual = Candidate.from_unknowns(solve(disturbed, problem).x, problem.quarter)
    # The preference for little bending pulls by some hundredths: the last passes of the calibration take it away.
    assert actual.wale_spacing == pytest.approx(wale, abs=0.05)
    assert actual.course_spacing == pytest.approx(course, abs=0.05)


@pytest.mark.parametrize("weight", ["alpha", "beta"])
def test_angles_hardly_depend_on_the_weights(scene, after, weight):
    # Weights are assumed, so the bars of the study must hold with each ten times smaller and larger.
    for factor in (0.1, 10.0):
        own = f"geometry.{weight}"
        actual = lay_out(scene.replace(own, factor * scene.value(own)))
        state = actual.sel(state="after")
        assert abs(float(state["interlock_angle"]) - 66) < 3
        assert abs(float(state["leg_angle"]) - 80) < 3
        assert abs(float(state["loop_length"] / actual["loop_length"].sel(state="before")) - 1) < 0.02
        assert np.abs(radii(state, "crossing_distance") - 2 - actual["clearance"]).max() < 1e-3
        assert np.abs(actual["control_points"] - after["control_points"]).max() > 0


def test_elements_of_the_mesh_are_well_shaped():
    scene = load_scene("dns-tie-course")
    fine = mesh_fabric(fabric_of(lay_out(scene)), scene.mesh.size, GROWTH)
    # The section's corners allow 0.86; bending the yarn to 2.3 mm costs next to nothing.
    assert scaled_jacobian(fine.nodes, fine.hexahedra).min() > 0.84
    assert (fine.section.size, fine.section.ring.size) == (41, 16)
    steps = np.diff(fine.stations[0])
    assert steps.max() / steps.min() < 1.35
