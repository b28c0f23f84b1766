"""Gaps between pieces of yarn, against distances that symmetry gives in closed form."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from knitstudy.geometry.loop import Loop
from knitstudy.geometry.spline import CatmullRom
from knitstudy.geometry.survey import approaches, smallest_radius_of_curvature

WALE, COURSE = 12.0, 20.0


@pytest.fixture(scope="module")
def omega():
    """Omega-shaped plane loop, in rows too far apart to meet."""
    t = 2 * np.pi * np.arange(16) / 16
    points = np.column_stack([WALE * t / (2 * np.pi) + 2.5 * np.sin(2 * t), -7 * np.cos(t), 0 * t])
    return Loop(points, WALE, COURSE, radius=0.2)


def extreme_x(loop, sign):
    """Largest or smallest x of the left half of the loop."""
    found = minimize_scalar(
        lambda u: -sign * loop.curve.value(np.array([u]))[0, 0],
        bounds=(1, 4) if sign > 0 else (4, 7),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return -sign * found.fun


def test_feet_and_heads_face_their_mirror_images(omega):
    in_one_yarn = approaches(omega, reach=100)
    distance = np.sort(in_one_yarn.distance[in_one_yarn.row == 0])
    feet = WALE - 2 * extreme_x(omega, +1)  # the two legs of a loop at its neck
    heads = 2 * extreme_x(omega, -1)  # a loop and its neighbour
    assert distance[0] == pytest.approx(min(feet, heads), rel=1e-9)
    assert np.abs(distance - max(feet, heads)).min() < 1e-9


def test_head_and_the_sinkers_of_the_second_row_above(omega):
    # Rows that do not reach each other: the head's top stands below the foot arcs of the next row.
    above = approaches(omega, reach=100)
    found = above.distance[above.row == 1].min()
    u = np.linspace(0, 16, 4001)
    x = omega.curve.value(u)
    y = np.vstack([omega.curve.shifted([j * WALE, COURSE, 0]).value(u) for j in (-1, 0, 1)])
    brute = np.sqrt(((x[:, None, :2] - y[None, ::3, :2]) ** 2).sum(axis=-1)).min()
    assert found == pytest.approx(brute, rel=1e-4)  # samples stand 0.01 apart
    assert found <= brute


def test_gap_does_not_depend_on_the_unit_of_length(omega):
    small = omega.scaled(1e-3)
    np.testing.assert_allclose(1e3 * approaches(small).distance, approaches(omega).distance, rtol=1e-9)


def test_radius_of_curvature_of_a_circle():
    t = 2 * np.pi * np.arange(64) / 64
    circle = CatmullRom(3 * np.column_stack([np.cos(t), np.sin(t), 0 * t]), [0, 0, 0])
    # Catmull-Rom tangents are chords: its curvature is too large by some (2 pi/64)^2.
    assert smallest_radius_of_curvature(circle) == pytest.approx(3, rel=0.01)
