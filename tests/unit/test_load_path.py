"""How grips move: legs, corners, and places at which an increment has to end."""

import numpy as np
import pytest

from knitstudy.geometry.fabric import yarn_pair
from knitstudy.loading.load_path import Motion, load_path, place
from knitstudy.mechanics.increment import PrescribedDisplacement
from knitstudy.study.problem_sections import Path

CORNERS = np.array([[0, 0, -1e-5], [3e-5, 0, -1e-5], [3e-5, 6e-5, -1e-5], [0, 0, 0]])
QUARTERS = (0.25, 0.5, 0.75, 1.0)


def test_a_motion_is_straight_between_its_corners():
    motion = Motion(CORNERS, QUARTERS, (), axis=2, length=1.0)
    np.testing.assert_array_equal(motion.at(0.0), 0)
    np.testing.assert_allclose(motion.at(0.125), 0.5 * CORNERS[0])
    np.testing.assert_allclose(motion.at(0.5), CORNERS[1])
    np.testing.assert_allclose(motion.at(0.65), 0.4 * CORNERS[1] + 0.6 * CORNERS[2])
    np.testing.assert_allclose(motion.at(1.0), CORNERS[3], atol=1e-20)


def test_a_drive_goes_where_its_motion_does():
    motion = Motion(CORNERS, QUARTERS, (), axis=2, length=1.0)
    drive = PrescribedDisplacement(np.arange(3), CORNERS, QUARTERS)
    for load in np.linspace(0, 1, 41):
        np.testing.assert_allclose(drive.at(load), motion.at(load), atol=1e-18)


def test_a_drive_of_one_leg_is_proportional():
    drive = PrescribedDisplacement(np.array([4, 7]), np.array([2.0, -1.0]))
    np.testing.assert_allclose(drive.at(0.3), [0.6, -0.3])
    assert drive.next_stop(0.3) == 1.0


def test_increments_end_at_corners_and_stops():
    drive = PrescribedDisplacement(np.arange(3), CORNERS[:2], (0.5, 1.0), (0.1, 0.7))
    places, load = [], 0.0
    while load < 1:
        load = drive.next_stop(load)
        places.append(load)
    assert places == [0.1, 0.5, 0.7, 1.0]
    # A load factor that rounding has brought just below a stop is that stop.
    assert drive.next_stop(0.1 - 1e-15) == 0.5


def test_only_corners_turn():
    drive = PrescribedDisplacement(np.arange(3), CORNERS[:2], (0.5, 1.0), (0.1,))
    assert drive.turns(0.5)
    assert drive.turns(0.5 + 1e-15)
    assert not drive.turns(0.1)
    assert not drive.turns(0.0)


def test_a_knit_is_pulled_along_the_course(plain_scene, knit):
    scene = plain_scene.replace("load.stops", [0.01, 0.02])
    motion = load_path(scene, knit)
    np.testing.assert_allclose(motion.at(0.5), [0.025 * knit.width, 0, 0])
    assert motion.stops == pytest.approx((0.2, 0.4))
    assert (motion.axis, motion.length) == (0, knit.width)


def test_a_pair_follows_its_path(plain_scene):
    pair = plain_scene.vary({"specimen": "pair", "fidelity": "dns", "load.path": CORNERS.tolist()})
    motion = load_path(pair, yarn_pair(0.9e-3, 90.0, 5e-3, 0.01))
    assert motion.corners == QUARTERS
    np.testing.assert_array_equal(motion.displacement, CORNERS)
    assert (motion.axis, motion.length) == (2, 1.8e-3)


def test_a_knit_is_pulled_along_the_wale(plain_scene, knit):
    motion = load_path(plain_scene.replace("load.direction", "wale"), knit)
    np.testing.assert_allclose(motion.at(0.5), [0, 0.025 * knit.height, 0])
    assert (motion.axis, motion.length) == (1, 3 * knit.cell[1])


@pytest.mark.parametrize(("factor", "leg"), [(0.0, 1), (0.25, 1), (0.26, 2), (0.75 + 1e-15, 3), (1.0, 4)])
def test_a_place_on_a_path_is_a_leg(factor, leg):
    assert place(Path(path=tuple(map(tuple, CORNERS.tolist()))), factor) == f"leg {leg} of 4"


def test_a_place_on_the_way_to_a_strain(plain_scene):
    assert place(plain_scene.load, 0.5) == "strain 2.50%"
