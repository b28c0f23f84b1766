"""Small patches on yarns: their compliance, ties on discs, and the law of local indentation."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.geometry.specimens import yarn_pair
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.mesh.section import GROWTH
from knitstudy.knit.models.hexahedra import build as hexahedra
from knitstudy.knit.yarns.interactions import STIFFNESS, tie_crossings
from knitstudy.mechanics.contact.indentation import indentation
from knitstudy.mechanics.core.cylinder import moments, polar_rule, surface_compliance
from knitstudy.run.configuration import load_scene

MODULUS = 1.3e9


@pytest.fixture(scope="module")
def scene():
    return load_scene("pair-tied-90").vary({"mesh.size": 0.5, "gates.elements_across": 2})


@pytest.fixture(scope="module")
def pair(scene):
    return yarn_pair(0.5 * scene.yarn.diameter, scene.pair.angle, scene.pair.length, scene.pair.clearance)


@pytest.fixture(scope="module")
def parts(scene, pair):
    return hexahedra.discretise(scene, pair, mesh_fabric(pair, scene.mesh.size, GROWTH))


@pytest.mark.parametrize("rings", [1, 3, 5])
def test_rule_of_the_disc_is_exact(rings):
    points, weight = polar_rule(rings)
    x, y = points.T
    assert weight.sum() == pytest.approx(1)
    # The mean of x^2p over the unit disc is (2p - 1)!! / ((2p)!! (p + 1)).
    assert weight @ x**2 == pytest.approx(1 / 4)
    if rings > 1:
        assert weight @ x**4 == pytest.approx(1 / 8)
        assert weight @ (x**2 * y**2) == pytest.approx(1 / 24)
    np.testing.assert_allclose(moments(points) * weight @ moments(points).T, np.eye(3), atol=1e-14)


def test_compliance_that_the_yarns_do_not_show_softens_the_tie(parts, pair):
    own = 1 / (STIFFNESS * MODULUS * pair.radius)
    soft = replace(
        parts, missing_compliance=lambda yarn, place, radius: np.tile([2 * own, 5 * own], (len(yarn), 1))
    )
    tie = tie_crossings(soft, pair, np.ones(1, dtype=bool), 0.183, MODULUS)
    np.testing.assert_allclose(1 / tie.stiffness, [[5 * own, 11 * own, 11 * own]])


def test_discs_that_overlap_are_refused(knit_of, plain_scene):
    coarse = {"fidelity": "hexahedra", "pattern.loops": 1, "pattern.rows": 1, "mesh.size": 2 / 3}
    scene = plain_scene.vary({**coarse, "gates.elements_across": 2})
    knit = knit_of(scene)
    parts = hexahedra.discretise(scene, knit, mesh_fabric(knit, scene.mesh.size, 1.0))
    with refusal(r"tie.radius is .* radii apart: use less than half of that"):
        tie_crossings(parts, knit, np.ones(4, dtype=bool), 2.5, MODULUS)


NU = 0.42


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


POISSON, MODULUS_LAW, RADIUS = 0.4, 1300.0, 0.5


@pytest.fixture(scope="module")
def law():
    return indentation(3, 0.9, 3, modulus=MODULUS_LAW, poisson=POISSON, radius=RADIUS, friction=0.3)


def test_pressure_goes_on_with_its_last_slope_beyond_the_table(law):
    """The slope is that at the end, and then constant but for the smooth beginning, a hundredth of this depth."""
    angle = np.full(4, np.pi / 2)
    stiffness = law.at(-law.end * np.array([1 - 1e-6, 1 + 1e-6, 1.5, 2.0]), angle).normal
    assert stiffness[1] == pytest.approx(stiffness[0], rel=1e-4)
    np.testing.assert_allclose(stiffness[2:], stiffness[0], rtol=0.01)


def test_nothing_presses_across_an_open_gap(law):
    gap, angle = np.array([1e-3, 0.0, np.inf]), np.full(3, 1.0)
    assert not law.pressure(gap, 0.0, angle).any()
    assert not law.stored(gap, None, angle).any()
    assert np.all(law.at(gap, angle).tangential > 0)
