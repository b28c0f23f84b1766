"""The law of the local indentation that a space does not show, and Hertz's theory that it rests on."""

import numpy as np
import pytest

from knitstudy.mechanics.contact.compliance import ALONG, NORMAL, half_space_compliance
from knitstudy.mechanics.contact.indentation import Crossing, indentation

POISSON, MODULUS, RADIUS = 0.4, 1300.0, 0.5


@pytest.fixture(scope="module")
def law():
    return indentation(3, 0.9, 3, modulus=MODULUS, poisson=POISSON, radius=RADIUS, friction=0.3)


def test_crossing_at_right_angles_is_a_sphere_on_a_plane():
    hertz = Crossing.at(np.pi / 2)
    assert (hertz.ratio, hertz.radius) == pytest.approx((1.0, 1.0))
    assert hertz.semiaxis == pytest.approx(0.75 ** (1 / 3), rel=1e-9)
    assert hertz.approach == pytest.approx(0.75 ** (2 / 3), rel=1e-9)


def test_ellipse_of_a_skew_crossing_meets_the_gap():
    """The pressure of Hertz's ellipse displaces half spaces by delta - A x^2 - B y^2: its ratio is tabulated."""
    hertz = Crossing.at(np.radians(60))
    # Johnson (1985), fig. 4.4 and eq. (4.28): b / a is about (A / B)^(2/3) where it is not small.
    assert hertz.ratio == pytest.approx((1 / 3) ** (2 / 3), rel=0.03)
    assert hertz.radius == pytest.approx(1 / np.sin(np.radians(60)))
    assert hertz.approach < Crossing.at(np.pi / 2).approach


def test_half_space_gives_way_more_along_its_surface():
    assert half_space_compliance(0.2, 0.0, ALONG) == half_space_compliance(0.2, 0.0, NORMAL)
    assert half_space_compliance(0.2, 0.5, ALONG) == pytest.approx(
        1.5 * half_space_compliance(0.2, 0.5, NORMAL)
    )


def test_law_begins_as_hertz(law):
    """Small patches are local altogether: P = 4/3 E* sqrt(R_e) depth^1.5, p = P' / (2 pi R_e)."""
    depth = np.array([1e-3])
    pressure = law.pressure(-depth * RADIUS, 0.0, np.array([np.pi / 2]))
    elastic = 0.5 * MODULUS / (1 - POISSON**2)
    assert pressure[0] == pytest.approx(elastic / np.pi * np.sqrt(depth[0]), rel=0.12)
    assert pressure[0] > elastic / np.pi * np.sqrt(depth[0])


def test_pressure_and_stiffness_are_derivatives_of_the_energy(law):
    depth = np.concatenate([np.geomspace(1e-6, 0.05, 40), [0.2]]) * RADIUS
    angle = np.linspace(0.2, np.pi / 2, len(depth))
    step = 1e-5 * depth

    def slope(value):
        return (value(-depth - step, angle) - value(-depth + step, angle)) / (2 * step)

    pressure = law.pressure(-depth, 0.0, angle)
    np.testing.assert_allclose(slope(lambda g, a: law.stored(g, None, a)), pressure, rtol=1e-6)
    stiffness = law.at(-depth, angle)
    np.testing.assert_allclose(slope(lambda g, a: law.pressure(g, 0.0, a)), stiffness.normal, rtol=1e-4)
    assert np.all(stiffness.normal > 0)
    stick = slope(lambda g, a: law.at(g, a).tangential)
    np.testing.assert_allclose(stick, -stiffness.slope, rtol=2e-3, atol=1e-6 * np.abs(stick).max())


def test_pressure_goes_on_with_its_last_slope_beyond_the_table(law):
    """The slope is that at the end, and then constant but for the smooth beginning, a hundredth of this depth."""
    angle = np.full(4, np.pi / 2)
    stiffness = law.at(-law.end * np.array([1 - 1e-6, 1 + 1e-6, 1.5, 2.0]), angle).normal
    assert stiffness[1] == pytest.approx(stiffness[0], rel=1e-4)
    np.testing.assert_allclose(stiffness[2:], stiffness[0], rtol=0.01)


def test_a_small_patch_sticks_as_mindlins_and_a_large_one_gives_way_less_in_the_law(law):
    """The indentation of a large patch that the space shows is in series with the law, whose share grows."""
    depth, angle = np.array([0.0, 0.01, 0.03]) * RADIUS, np.full(3, np.pi / 2)
    assert depth[-1] < law.end
    stiffness = law.at(-depth, angle)
    share = stiffness.tangential / stiffness.normal
    assert share[0] == pytest.approx(2 * (1 - POISSON) / (2 - POISSON))
    assert share[0] == pytest.approx(law.attributes()["stick_over_normal"])
    assert np.all(np.diff(share) > 0.02)


def test_nothing_presses_across_an_open_gap(law):
    gap, angle = np.array([1e-3, 0.0, np.inf]), np.full(3, 1.0)
    assert not law.pressure(gap, 0.0, angle).any()
    assert not law.stored(gap, None, angle).any()
    assert np.all(law.at(gap, angle).tangential > 0)
