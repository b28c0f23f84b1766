import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.geometry.specimens import yarn_pair
from knitstudy.knit.mesh.mesher import sampled_sections
from knitstudy.knit.models.spline_yarns.build import discretise


@pytest.fixture(scope="module")
def scene(plain_scene):
    return plain_scene.vary(
        {"fidelity": "spline_yarns", "mesh.degree": 3, "mesh.crossing_degree": 4, "mesh.crossing_span": 0.6}
    )


@pytest.fixture(scope="module")
def mesh(knit):
    return sampled_sections(knit)


@pytest.fixture(scope="module")
def yarns(scene, mesh, knit):
    return discretise(scene, knit, mesh)


@pytest.fixture(scope="module")
def pair():
    return yarn_pair(radius=0.9e-3, angle=60.0, length=10e-3, clearance=0.02)


def test_grips_in_wale_tension_are_the_arcs(scene, knit, mesh):
    yarns = discretise(scene.replace("load.direction", "wale"), knit, mesh)
    u = np.random.default_rng(0).normal(size=yarns.nodes.shape)
    u[yarns.ends.held] = 0
    u[yarns.ends.driven] = yarns.unity[yarns.ends.driven, None] * [0.0, 1.0, 0.0]
    moved = yarns.sampled(u).reshape(mesh.slices, -1, 3)
    for yarn, grip, way in zip((0, 3), knit.grips["wale"], (0.0, 1.0), strict=True):
        own = mesh.yarn_of_slice == yarn
        gripped = grip.holds(mesh.yarn_of_slice, mesh.arc_length)
        np.testing.assert_allclose(
            moved[gripped], np.broadcast_to([0, way, 0], moved[gripped].shape), atol=1e-13
        )
        assert np.abs(moved[own & ~gripped] - [0, way, 0]).max(axis=(1, 2)).min() > 1e-3


def test_yarns_are_where_their_centrelines_are(yarns, knit, mesh):
    apart = np.linalg.norm(yarns.sampled(yarns.nodes) - mesh.nodes, axis=1)
    assert apart.max() < 0.02 * mesh.radius  # the curvature of the centreline jumps at control points
    volume = yarns.volume(yarns.groups(yarns.nodes))
    length = sum(curve.length for curve in knit.centrelines)
    assert volume @ yarns.unity == pytest.approx(np.pi * mesh.radius**2 * length, rel=1e-3)
    points = mesh.nodes[mesh.slice_nodes(np.array([7, 60]))].reshape(-1, 3)
    nodes, weights = yarns.locate(points, np.repeat(mesh.yarn_of_slice[[7, 60]], mesh.section.size))
    np.testing.assert_allclose(np.einsum("ka,kai->ki", weights, yarns.nodes[nodes]), points, atol=1e-12)
    np.testing.assert_allclose((weights * yarns.unity[nodes]).sum(axis=1), 1.0, atol=1e-12)


def test_a_pair_is_held_at_its_ends(scene, pair):
    held = scene.vary({"specimen": "pair", "pair.support": "ends", "load.path": [[0.0, 0.0, -1e-5]]})
    mesh = sampled_sections(pair)
    yarns = discretise(held, pair, mesh)
    assert set(yarns.yarn[yarns.ends.held]) == {0}
    assert set(yarns.yarn[yarns.ends.driven]) == {1}
    with refusal("must be ends where fidelity is spline_yarns"):
        discretise(held.replace("pair.support", "back"), pair, mesh)
