"""Catmull-Rom curves and arc-length centrelines."""

import numpy as np
import pytest
from scipy.optimize import minimize

from knitstudy.knit.geometry.crossings import refine
from knitstudy.knit.geometry.spline import CatmullRom, Centreline

EPS = 1e-12  # rounding of a few dozen operations on numbers of order ten


@pytest.fixture
def curve():
    points = 0.3 * np.random.default_rng(0).normal(size=(7, 3)) + np.outer(np.arange(7), [1, 0, 0])
    return CatmullRom(points, [7.0, 0.5, 0.0])


@pytest.fixture
def u():
    return np.linspace(-8, 15, 301)


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


WALE, COURSE = 12.0, 20.0


def test_closest_points_in_windows_are_those_of_a_bounded_minimisation():
    """Of two lines at 29 degrees; in most windows the closest points lie on the bounds."""
    number = np.arange(8.0)[:, None]
    along, across = np.array([1.0, 0.0, 0.0]), np.array([0.9, 0.5, 0.0])
    lines = [
        CatmullRom(number * along, 8 * along),
        CatmullRom([0.0, -2.0, 0.5] + number * across, 8 * across),
    ]
    random = np.random.default_rng(1)
    low = random.uniform(1, 5, (40, 2))
    windows = np.stack([low, low + 1], axis=-1)
    actual = refine(*lines, low + random.uniform(0, 1, (40, 2)), windows)
    assert 0 < actual.interior.sum() < 20

    def square(u):
        return float(np.sum((lines[0].value(u[:1]) - lines[1].value(u[1:])) ** 2))

    least = [minimize(square, each.mean(axis=1), bounds=each, tol=1e-14).fun for each in windows]
    np.testing.assert_allclose(actual.distance**2, least, rtol=1e-6)
