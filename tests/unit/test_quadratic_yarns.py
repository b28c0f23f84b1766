"""Yarns of quadratic hexahedra: their ties, contact and grips."""

import numpy as np
import pytest

from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.models.hexahedra.build import divide
from knitstudy.mechanics.rotation import exp

RADIUS, SIZE = 0.9e-3, 0.5


@pytest.fixture(scope="module")
def swept(pair):
    return mesh_fabric(pair, SIZE, 1.2)


@pytest.fixture(scope="module")
def scene(plain_scene):
    """Two yarns that touch."""
    return plain_scene.vary(
        {
            "specimen": "pair",
            "fidelity": "hexahedra",
            "pair.support": "ends",
            "interaction": "rough",
            "load.path": [[0.0, 0.0, -1e-5]],
            "mesh.size": SIZE,
            "mesh.element": "quadratic",
        }
    )


@pytest.fixture(scope="module")
def parts(scene, swept, pair):
    return divide(scene, swept, pair)


def moved(nodes, unity=1.0):
    return nodes @ exp(np.array([0.5, -0.3, 1.0])).T + unity * np.array([1e-3, 2e-3, -3e-3])


def test_centres_of_faces_depend_on_nodes_that_do_not(parts):
    assert np.abs(parts.dependence @ parts.nodes - parts.nodes).max() < 1e-12 * RADIUS
    assert np.abs(parts.dependence @ parts.dependence - parts.dependence).max() < 1e-15
    alone = np.setdiff1d(np.arange(len(parts.nodes)), parts.connectivity)
    np.testing.assert_array_equal(np.flatnonzero(np.diff(parts.dependence.indptr) > 1), alone)


def test_places_are_sums_of_nodes_that_move_with_the_yarn(parts):
    rng = np.random.default_rng(0)
    angle, s = rng.uniform(0, 2 * np.pi, 40), rng.uniform(0.1e-3, 5.9e-3, 40)
    radius = RADIUS * np.sqrt(rng.uniform(0, 1.05, 40))  # some just outside
    lower = parts.nodes[parts.yarn == 0]
    axis = lower[:, 1:].mean(axis=0)
    points = np.column_stack(
        [lower[:, 0].min() + s, axis[0] + radius * np.cos(angle), axis[1] + radius * np.sin(angle)]
    )
    nodes, weights = parts.locate(points, np.zeros(40, dtype=int))
    assert (parts.yarn[nodes] == 0).all()
    placed = np.einsum("ka,kai->ki", weights, moved(parts.nodes)[nodes])
    np.testing.assert_allclose(placed, moved(points), atol=1e-9 * RADIUS)
