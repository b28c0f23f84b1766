"""Ties of a physical size: nine equations a crossing, exact for rigid motions, whatever the yarns are divided into."""

from dataclasses import replace

import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.knit.geometry.specimens import yarn_pair
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.models.hexahedra import build as hexahedra
from knitstudy.knit.yarns.interactions import STIFFNESS, Discs, tie_crossings
from knitstudy.mechanics.contact.compliance import moments, polar_rule
from knitstudy.mechanics.rotation import exp
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
    return hexahedra.discretise(scene, pair, mesh_fabric(pair, scene.mesh.size, scene.mesh.growth))


@pytest.fixture(scope="module")
def tie(scene, parts, pair):
    return tie_crossings(parts, pair, np.ones(1, dtype=bool), 0.183, MODULUS)


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


def test_a_disc_lies_between_the_yarns_in_their_common_tangent_plane(pair):
    discs = Discs.of(pair, np.array([0]), 1e-4)
    np.testing.assert_allclose(discs.centre, [[0, 0, pair.crossings.point[0, :, 2].mean()]], atol=1e-18)
    np.testing.assert_allclose(discs.axes @ [0, 0, 1], 0, atol=1e-15)
    assert abs(discs.axes[0, 0] @ [1, 0, 0]) == pytest.approx(1)
    points = discs.points(polar_rule(2)[0])
    assert np.linalg.norm(points - discs.centre[:, None], axis=2).max() < 1e-4


def test_rigid_and_affine_motions_of_both_yarns_leave_it_at_rest(tie, parts):
    gradient = np.random.default_rng(0).normal(size=(3, 3))
    moved = parts.nodes @ gradient.T + parts.unity[:, None] * [0.1, -0.2, 0.3]
    assert np.abs(tie.moments @ moved).max() < 1e-12 * np.abs(moved).max()


def test_energy_does_not_notice_a_rotation(tie, parts):
    displacement = 1e-4 * np.random.default_rng(1).normal(size=parts.nodes.shape)
    turn = exp(np.array([0.3, -1.1, 0.7]))
    turned = (parts.nodes + displacement) @ turn.T - parts.nodes
    energy, same = (float(np.vdot(u, tie.links @ u)) for u in (displacement, turned))
    assert same == pytest.approx(energy, rel=1e-10)


def test_moments_are_those_of_the_relative_displacement(tie, parts):
    """The upper yarn stretched along x about the disc's centre: no mean, one linear moment of half the radius."""
    upper = parts.yarn == 1
    displacement = np.zeros_like(parts.nodes)
    displacement[upper, 2] = parts.nodes[upper, 0]
    expected = np.zeros((3, 3))
    expected[1, 2] = 0.5 * tie.discs.radius * np.sign(tie.discs.axes[0, 0, 0])
    np.testing.assert_allclose(tie.moments @ displacement, expected, atol=1e-12 * tie.discs.radius)


def test_resultants_pull_the_lower_yarn_after_the_upper_one(tie, parts, pair):
    displacement = (parts.yarn == 1)[:, None] * [0.0, 0.0, 1e-6]
    stiffness = STIFFNESS * MODULUS * pair.radius
    force = tie.resultants(displacement)
    np.testing.assert_allclose(force, [[0, 0, stiffness * 1e-6]], rtol=1e-9, atol=1e-9)
    # And so do the links.
    pull = -(tie.links @ displacement)[parts.yarn == 0].sum(axis=0)
    np.testing.assert_allclose(pull, force[0], rtol=1e-9, atol=1e-9)


def test_equations_hold_the_same_moments(tie, parts):
    fixed = tie.joined[:3]
    slave, master, weight = tie.equations(fixed)
    assert len(slave) == 3
    assert not np.isin(slave, fixed).any()
    assert not np.isin(slave, master[weight != 0]).any()
    displacement = np.random.default_rng(2).normal(size=parts.nodes.shape)
    displacement[slave] = np.einsum("sc,sci->si", weight, displacement[master])
    assert np.abs(tie.moments @ displacement).max() < 1e-12
    np.testing.assert_allclose(weight.sum(axis=1), 1, atol=1e-10)


def test_compliance_that_the_yarns_do_not_show_softens_the_tie(parts, pair):
    own = 1 / (STIFFNESS * MODULUS * pair.radius)
    soft = replace(
        parts, missing_compliance=lambda yarn, place, radius: np.tile([2 * own, 5 * own], (len(yarn), 1))
    )
    tie = tie_crossings(soft, pair, np.ones(1, dtype=bool), 0.183, MODULUS)
    np.testing.assert_allclose(1 / tie.stiffness, [[5 * own, 11 * own, 11 * own]])


def test_discs_that_overlap_are_refused(knit_of, plain_scene):
    from knitstudy.knit.mesh.mesher import mesh_fabric

    coarse = {"fidelity": "hexahedra", "pattern.loops": 1, "pattern.rows": 1, "mesh.size": 2 / 3}
    scene = plain_scene.vary({**coarse, "gates.elements_across": 2})
    knit = knit_of(scene)
    parts = hexahedra.discretise(scene, knit, mesh_fabric(knit, scene.mesh.size, 1.0))
    with pytest.raises(MeshError, match=r"tie.radius is .* radii apart: use less than half of that"):
        tie_crossings(parts, knit, np.ones(4, dtype=bool), 2.5, MODULUS)
