"""A straight elastic cylinder in closed form, and the part of a patch's compliance that spaces do not show."""

import numpy as np
import pytest

from knitstudy.mechanics.contact.compliance import (
    missing_compliance,
    missing_tie_compliance,
    surface_compliance,
)
from knitstudy.mechanics.spline_yarn.space import Space, yarn_space

NU = 0.42
PATCH = 0.183


def test_short_waves_see_a_half_space():
    """A pressure wave of number q moves it by 2 (1 - nu^2) / (E q), shear across the wave by 2 (1 + nu) / (E q)."""
    g = surface_compliance(np.array([0, 600]), np.array([800.0, 1e-3]), NU)
    np.testing.assert_allclose(g[0, 0, 0] * 800, 2 * (1 - NU**2), rtol=2e-3)
    np.testing.assert_allclose(g[0, 1, 1] * 800, 2 * (1 + NU), rtol=2e-3)
    np.testing.assert_allclose(g[1, 2, 2] * 600, 2 * (1 + NU), rtol=2e-3)


def test_long_waves_see_a_rod():
    """Of waves of length 1 / k: traction along is a load 2 pi t on E A k^2, torsion 2 pi t on G J k^2."""
    k = 1e-3
    axial = surface_compliance(np.array([0]), np.array([k]), NU)[0]
    np.testing.assert_allclose(axial[2, 2].real, 2 * np.pi / (np.pi * k**2), rtol=1e-4)
    torsion = 2 * np.pi / (np.pi / 2 / (2 * (1 + NU)) * k**2)
    np.testing.assert_allclose(axial[1, 1].real, torsion, rtol=1e-4)
    # A transverse load, cos(theta) e_r - sin(theta) e_theta, is 2 pi on E I k^4.
    load = np.array([1, 1j, 0]) / 2  # m = 1
    bent = surface_compliance(np.array([1]), np.array([0.01]), NU)[0]
    np.testing.assert_allclose(
        (load.conj() @ bent @ load).real / (load.conj() @ load).real,
        2 * np.pi / (np.pi / 4 * 0.01**4),
        rtol=1e-2,
    )


@pytest.mark.parametrize("degree", [2, 3, 4, 6])
def test_a_space_shows_less_than_there_is_and_more_the_richer_it_is(degree):
    every = [missing_compliance(p, 3, 0.5, 0.3, PATCH, NU) for p in (degree, degree + 1)]
    for full in (*every, every[0] - every[1]):
        assert np.linalg.eigvalsh(full).min() > -1e-9
    coarse = missing_compliance(degree, 3, 1.0, 0.3, PATCH, NU)
    assert np.trace(coarse) > np.trace(every[0])


def test_patches_of_yarns_miss_as_much_as_their_spans():
    radius, modulus = 0.9e-3, 1.3e9
    own = yarn_space(radius * 0.5 * np.arange(13), np.array([3] * 6 + [4] * 6))
    place = radius * np.array([0.5, 1.5, 5.25, 4.8])
    actual = missing_tie_compliance(
        Space((own,)), radius, modulus, NU, np.zeros(4, dtype=int), place, PATCH * radius
    )
    for (p, share), each in zip([(3, 0.0), (3, 0.0), (4, 0.5), (4, 0.6)], actual, strict=True):
        full = np.diag(missing_compliance(p, 3, 0.5, share, PATCH, NU)) / (modulus * radius)
        np.testing.assert_allclose(each, [full[:3].mean(), full[3:].mean()], rtol=6e-3)
