"""Catmull-Rom curves and arc-length centrelines."""

import numpy as np
import pytest

from knitstudy.errors import GeometryError
from knitstudy.geometry.spline import CatmullRom, Centreline

EPS = 1e-12  # rounding of a few dozen operations on numbers of order ten


@pytest.fixture
def curve():
    points = 0.3 * np.random.default_rng(0).normal(size=(7, 3)) + np.outer(np.arange(7), [1, 0, 0])
    return CatmullRom(points, [7.0, 0.5, 0.0])


@pytest.fixture
def u():
    return np.linspace(-8, 15, 301)


def test_passes_its_control_points_in_every_period(curve):
    k = np.arange(-7, 14)
    turns = k // 7
    np.testing.assert_allclose(
        curve.value(k), curve.control_points[k % 7] + turns[:, None] * curve.advance, atol=EPS
    )


def test_first_derivative_is_continuous_and_second_is_not(curve):
    joints, gap = np.arange(7.0), 1e-9
    np.testing.assert_allclose(curve.d1(joints - gap), curve.d1(joints), atol=1e-7)  # |C''| times the gap
    assert np.abs(curve.d2(joints - gap) - curve.d2(joints)).max() > 0.1


@pytest.mark.parametrize("order", [0, 1])
def test_derivatives_are_those_of_the_curve(curve, u, order):
    function, derivative = ((curve.value, curve.d1), (curve.d1, curve.d2))[order]
    step = 1e-6
    inside = np.abs(u - np.round(u)) > 2 * step  # C'' jumps at the joints
    difference = (function(u[inside] + step) - function(u[inside] - step)) / (2 * step)
    np.testing.assert_allclose(derivative(u[inside]), difference, atol=1e-8)  # rounding / step


@pytest.mark.parametrize("order", [0, 1, 2])
def test_operator_is_the_curve_as_a_linear_map_of_its_points(curve, u, order):
    matrix, offset = curve.operator(u, order)
    expected = (curve.value, curve.d1, curve.d2)[order](u)
    np.testing.assert_allclose(matrix @ curve.control_points + offset, expected, atol=EPS)


def test_curvature_of_a_parabola(curve):
    # Points of (k, k^2, 0): a Catmull-Rom curve reproduces a parabola, whose curvature is 2/(1 + 4x^2)^1.5.
    k = np.arange(-3.0, 4.0)
    parabola = CatmullRom(np.column_stack([k, k**2, 0 * k]), [7.0, 0.0, 0.0])
    x = np.linspace(-1, 1, 9)
    np.testing.assert_allclose(parabola.curvature(x + 3), 2 / (1 + 4 * x**2) ** 1.5, rtol=EPS)


def test_straight_centreline_is_its_arc_length():
    line = Centreline(CatmullRom(np.outer(np.arange(5), [0.6, 0.8, 0.0]), [3.0, 4.0, 0.0]), loops=2)
    s = np.linspace(0, 10, 21)
    assert line.length == pytest.approx(10, rel=EPS)
    np.testing.assert_allclose(line.position(s), np.outer(s, [0.6, 0.8, 0]), atol=1e-11)
    np.testing.assert_allclose(line.tangent(s), [[0.6, 0.8, 0]] * 21, atol=EPS)
    np.testing.assert_allclose(line.curvature(s), 0, atol=EPS)


def test_parameter_and_arc_length_are_inverse(curve):
    yarn = Centreline(curve, loops=3)
    s = np.linspace(0, yarn.length, 500)
    np.testing.assert_allclose(yarn.arc_length(yarn.parameter(s)), s, atol=1e-12 * yarn.length)


def test_moves_at_unit_speed(curve):
    yarn = Centreline(curve, loops=2)
    s, step = np.linspace(0.01, yarn.length - 0.01, 200), 1e-5
    speed = np.linalg.norm(yarn.position(s + step) - yarn.position(s - step), axis=1) / (2 * step)
    np.testing.assert_allclose(speed, 1, atol=1e-7)  # rounding of the points over the step, and the chord


@pytest.mark.parametrize("s", [-0.1, 1.01])
def test_outside_the_yarn_there_is_nothing(curve, s):
    yarn = Centreline(curve, loops=1)
    with pytest.raises(GeometryError, match="arc length"):
        yarn.position(np.array([s * yarn.length]))


@pytest.mark.parametrize(
    "points",
    [np.zeros((3, 3)), np.zeros((5, 2)), np.zeros(12), np.full((5, 3), np.nan)],
    ids=["too few", "plane", "flat list", "not finite"],
)
def test_unusable_control_points_are_refused(points):
    with pytest.raises(GeometryError, match="control points"):
        CatmullRom(points, [1, 0, 0])
