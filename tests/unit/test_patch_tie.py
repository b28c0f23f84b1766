"""Ties of a physical size: nine equations a crossing, exact for rigid motions, whatever the yarns are divided into."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.geometry.specimens import yarn_pair
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.models.hexahedra import build as hexahedra
from knitstudy.knit.yarns.interactions import STIFFNESS, tie_crossings
from knitstudy.mechanics.contact.patch_compliance import moments, polar_rule
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


def test_resultants_pull_the_lower_yarn_after_the_upper_one(tie, parts, pair):
    displacement = (parts.yarn == 1)[:, None] * [0.0, 0.0, 1e-6]
    stiffness = STIFFNESS * MODULUS * pair.radius
    force = tie.resultants(displacement)
    np.testing.assert_allclose(force, [[0, 0, stiffness * 1e-6]], rtol=1e-9, atol=1e-9)
    # And so do the links.
    pull = -(tie.links @ displacement)[parts.yarn == 0].sum(axis=0)
    np.testing.assert_allclose(pull, force[0], rtol=1e-9, atol=1e-9)


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
    with refusal(r"tie.radius is .* radii apart: use less than half of that"):
        tie_crossings(parts, knit, np.ones(4, dtype=bool), 2.5, MODULUS)
