"""Measures of two histories against hand-computed values."""

import numpy as np
import pytest
import synthetic

from knitstudy.measures.response import (
    distance_of_curves,
    largest_out_of_plane,
    out_of_plane_correlation,
    secant_stiffness,
)


def test_secant_stiffness_is_force_over_displacement():
    """10 N at 5 % of 10 mm."""
    assert secant_stiffness(synthetic.history()) == pytest.approx(10 / 0.5e-3)


def test_largest_out_of_plane_is_that_of_full_load():
    assert largest_out_of_plane(synthetic.history(lift=1e-4, yarns=3)) == pytest.approx(3e-4)


def test_distance_of_a_hat_by_hand():
    """A hat of height 3 over [0, 2], against a line of slope 1: 6 over 8/3 under the roots."""
    distance = distance_of_curves(np.arange(3.0), np.array([0.0, 4, 2]), np.array([0.0, 1, 2]))
    assert distance == pytest.approx(np.sqrt(6 / (8 / 3)))


def test_the_shape_out_of_the_plane_correlates_whatever_the_stations():
    """Straight bulges sampled differently; 201 stations interpolate a sine within 1e-4."""
    bulge = synthetic.history(lift=1e-4, stations=201)
    assert out_of_plane_correlation(synthetic.history(lift=0.5e-4, stations=7), bulge) == pytest.approx(
        1, abs=1e-4
    )
    assert out_of_plane_correlation(synthetic.history(lift=-1e-4), bulge) == pytest.approx(-1, abs=1e-4)
    assert np.isnan(out_of_plane_correlation(synthetic.history(), bulge))
