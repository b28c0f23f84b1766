import numpy as np
import pytest

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
