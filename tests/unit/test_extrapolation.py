"""Limits of sequences whose errors are known, and the uncertainty that several ways to one limit leave."""

import numpy as np
import pytest
from refusals import refusal

from knitstudy.measures.estimate import (
    UNKNOWN,
    Estimate,
    Limit,
    all_hold,
    common_limit,
    limit_of_degrees,
    limit_of_sizes,
)

SIZES = (0.45, 0.3, 0.2)


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0])
def test_errors_of_the_assumed_order_vanish(order):
    """Meshes may come in any order."""
    values = {size: 7.0 - 3 * size**order for size in SIZES}
    for sizes in (SIZES, SIZES[::-1], SIZES[:2]):
        limit = limit_of_sizes(sizes, [values[size] for size in sizes], order)
        assert limit.value == pytest.approx(7.0)
    assert limit_of_sizes(SIZES, list(values.values()), order).order == pytest.approx(order, abs=0.01)


def test_two_meshes_leave_half_of_the_correction_open():
    """4 h^2 at 0.2 and 0.1: the finer is 0.04 off."""
    limit = limit_of_sizes((0.2, 0.1), (1.16, 1.04))
    assert limit.value == pytest.approx(1.0)
    assert limit.uncertainty == pytest.approx(0.02)
    assert np.isnan(limit.order)


def test_another_order_than_the_assumed_is_uncertainty():
    """Errors of first order, taken for second: both extrapolations are off, and how they differ says so."""
    limit = limit_of_sizes((0.4, 0.2, 0.1), (1.4, 1.2, 1.1))
    assert limit.order == pytest.approx(1.0, abs=0.01)
    assert limit.value == pytest.approx(1.1 - 0.1 / 3)
    assert abs(limit.value - 1.0) <= limit.uncertainty == pytest.approx(1.2 - 0.2 / 3 - limit.value)


def test_geometric_errors_of_degrees_vanish():
    limit = limit_of_degrees((4, 2, 3), (1 + 2**-4, 1 + 2**-2, 1 + 2**-3))
    assert limit.value == pytest.approx(1.0)
    assert limit.uncertainty == pytest.approx(2**-5)


@pytest.mark.parametrize("values", [(1.0, 1.1, 1.3), (1.0, 1.1, 1.05), (1.0, 1.0, 1.2), (1.0, 1.2)])
def test_degrees_that_do_not_settle_leave_their_last_change_open(values):
    limit = limit_of_degrees(range(2, 2 + len(values)), values)
    assert limit.value == values[-1]
    assert limit.uncertainty == pytest.approx(abs(values[-1] - values[-2]))


def test_surer_ways_weigh_more_and_the_larger_origin_is_named():
    common = common_limit([Limit(1.0, 0.01, 2.0), Limit(1.03, 0.03, 2.0)])
    assert common.value == pytest.approx(1.003)
    assert common.extrapolation == pytest.approx(0.01 * np.sqrt(0.9))
    assert common.disagreement == common.uncertainty == pytest.approx(0.03)
    assert common.origin == "disagreement"
    near = common_limit([Limit(1.0, 0.01, 2.0), Limit(1.001, 0.01, 2.0)])
    assert near.origin == "extrapolation"
    assert near.uncertainty == near.extrapolation
    finest = [Limit(1.0, 0.01, 2.0, finest) for finest in (0.9, 1.05)]
    assert common_limit(finest).uncertainty == pytest.approx(0.15), "limits may agree by chance"
    assert limit_of_sizes((0.2, 0.1), (5.0, 5.0)).uncertainty > 0, "equal values are not certain"
    with refusal("there are 1 limits"):
        common_limit([Limit(1.0, 0.01, 2.0)])


def test_a_way_does_not_win_by_an_uncertainty_that_is_too_small():
    """0.1 apart with uncertainties of 0.001 and 0.01: variances grow by (0.1^2 - 0.001^2 - 0.01^2) / 2 = 0.0049495."""
    common = common_limit([Limit(1.0, 0.001, 2.0), Limit(1.1, 0.01, 2.0)])
    share = 0.0049505 / 0.01
    assert common.value == pytest.approx(1.0 + 0.1 * share)
    assert common.extrapolation == pytest.approx(np.hypot((1 - share) * 0.001, share * 0.01))
    assert common.disagreement == pytest.approx(0.1)
    for limit in (1.0, 1.1):
        assert abs(limit - common.value) < 1.02 * common.uncertainty


def test_less_than_the_uncertainty_decides_nothing():
    estimate = Estimate(1.0, 0.1)
    assert estimate.below(1.2) is True
    assert estimate.below(0.8) is False
    assert estimate.below(1.05) is estimate.below(0.95) is None
    assert estimate.above(0.8) is True
    assert estimate.above(1.2) is False
    assert estimate.above(1.05) is None
    assert UNKNOWN.below(1.0) is UNKNOWN.above(1.0) is None
    assert Estimate(1.0, 0.1).larger_than(Estimate(0.8, 0.05)) is True
    assert Estimate(1.0, 0.1).larger_than(Estimate(0.8, 0.15)) is None
    assert all_hold([True, None]) is None
    assert all_hold([None, False]) is False
    assert Estimate(2.0, 1.0).of(lambda value: 1 / value) == Estimate(0.5, 0.5)
