"""Measures of two histories against hand-computed values."""

import numpy as np
import pytest
import synthetic

from knitstudy.errors import DataFileError
from knitstudy.measures.response import (
    force_distance,
    largest_out_of_plane,
    out_of_plane_agreement,
    secant_stiffness,
)


def test_secant_stiffness_is_force_over_displacement():
    """10 N at 5 % of 10 mm."""
    assert secant_stiffness(synthetic.history()) == pytest.approx(10 / 0.5e-3)


def test_distance_of_proportional_curves_is_their_factor_less_one():
    assert force_distance(synthetic.history(force=(0, 6.5, 13)), synthetic.history()) == pytest.approx(0.3)


def test_distance_does_not_depend_on_the_increments():
    """Both lie on straight lines, whatever their increments."""
    fine = synthetic.history(strain=np.linspace(0, 0.05, 8), force=np.linspace(0, 20, 8))
    assert force_distance(fine, synthetic.history()) == pytest.approx(1.0)


def test_distance_is_compared_up_to_the_smaller_strain():
    longer = synthetic.history(strain=(0, 0.05, 0.1), force=(0, 15, 500))
    assert force_distance(longer, synthetic.history()) == pytest.approx(0.5)


def test_distance_of_a_hat_by_hand():
    """A hat of height 3 over [0, 2], against a line of slope 1: 6 over 8/3 under the roots."""
    hat = synthetic.history(strain=(0, 1, 2), force=(0, 1 + 3, 2))
    line = synthetic.history(strain=(0, 2), force=(0, 2))
    assert force_distance(hat, line) == pytest.approx(np.sqrt(6 / (8 / 3)))


def test_history_without_load_is_refused():
    with pytest.raises(DataFileError, match="'dns-a': has no loaded increment"):
        force_distance(synthetic.history(strain=(0,), force=(0,), scene="dns-a"), synthetic.history())


def test_largest_out_of_plane_is_that_of_full_load():
    assert largest_out_of_plane(synthetic.history(lift=1e-4, yarns=3)) == pytest.approx(3e-4)


def test_same_shape_at_other_stations_correlates():
    """Straight bulges sampled differently; 201 stations interpolate a sine within 1e-4."""
    reference = synthetic.history(lift=1e-4, stations=201)
    agreement = out_of_plane_agreement(synthetic.history(lift=0.5e-4, stations=7), reference)
    assert agreement.correlation == pytest.approx(1, abs=1e-4)
    assert agreement.amplitude == pytest.approx(0.5, rel=1e-3)


def test_opposite_bulge_correlates_with_minus_one():
    agreement = out_of_plane_agreement(synthetic.history(lift=-1e-4), synthetic.history(lift=1e-4))
    assert agreement.correlation == pytest.approx(-1)
    assert agreement.amplitude == pytest.approx(1)


def test_flat_model_has_no_correlation():
    agreement = out_of_plane_agreement(synthetic.history(), synthetic.history(lift=1e-4))
    assert np.isnan(agreement.correlation)
    assert agreement.amplitude == 0
