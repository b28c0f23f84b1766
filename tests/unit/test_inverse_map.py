"""Which point of an element lies at a place."""

import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.mechanics.elements.hexahedron import (
    CORNERS,
    NATURAL,
    InverseMap,
    natural_coordinates,
    quadratic_shape,
    shape,
)

KINDS = pytest.mark.parametrize("shape", [shape, quadratic_shape], ids=["linear", "quadratic"])


def bent(shape, count):
    """Elements that are no boxes."""
    natural = CORNERS if shape(np.zeros((1, 3))).shape[1] == 8 else NATURAL
    rng = np.random.default_rng(3)
    return natural + 0.15 * rng.normal(size=(count, len(natural), 3))


@KINDS
def test_the_inverse_of_the_map(shape):
    corners = bent(shape, 50)
    natural = np.random.default_rng(4).uniform(-1.1, 1.1, (50, 3))
    points = np.einsum("ka,kai->ki", shape(natural), corners)
    np.testing.assert_allclose(natural_coordinates(corners, points, shape), natural, atol=1e-9)


@pytest.fixture
def row():
    """Two yarns of three cubes each, one above the other."""
    x, y, z = np.meshgrid(np.arange(4.0), [0.0, 1.0], [0.0, 1.0], indexing="ij")
    nodes = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    first = np.array([0, 4, 6, 2, 1, 5, 7, 3]) + 4 * np.arange(3)[:, None]
    return InverseMap(
        np.concatenate([nodes, nodes + np.array([0, 0, 1.5])]),
        np.concatenate([first, first + 16]),
        np.repeat([0, 1], 16),
        shape,
    )


def test_points_in_and_beside_elements_are_sums_of_nodes(row):
    points = np.array([[0.2, 0.4, 0.5], [2.9, 0.1, 0.7], [1.5, 0.5, 1.25], [1.5, 0.5, 1.25]])
    nodes, weight = row.locate(points, np.array([0, 0, 0, 1]))
    np.testing.assert_allclose(np.einsum("ka,kai->ki", weight, row.nodes[nodes]), points, atol=1e-12)
    np.testing.assert_allclose(weight.sum(axis=1), 1)
    assert row.yarn[nodes].tolist() == [[0] * 8, [0] * 8, [0] * 8, [1] * 8]
    assert weight[:2].min() >= 0


def test_points_far_from_their_yarn_are_refused(row):
    with pytest.raises(MeshError, match=r"\(1, 0.5, 9\) is too far from yarn 0"):
        row.locate(np.array([[1.0, 0.5, 9.0]]), np.array([0]))
