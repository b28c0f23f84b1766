"""Mesh of two crossing yarns: facets face each other at the crossing; and where specimens are gripped."""

import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.geometry.fabric import of_curves, yarn_pair
from knitstudy.geometry.spline import Centreline
from knitstudy.mesh.mesher import grips, mesh_fabric

RADIUS, LENGTH, CLEARANCE, SIZE = 0.9e-3, 8e-3, 0.02, 0.45e-3


@pytest.fixture(scope="module", params=[90.0, 30.0])
def pair(request):
    return yarn_pair(RADIUS, request.param, LENGTH, CLEARANCE)


@pytest.fixture(scope="module")
def mesh(pair):
    return mesh_fabric(pair, SIZE, 1.2)


@pytest.fixture
def scene(plain_scene):
    return plain_scene.vary({"specimen": "pair", "fidelity": "hexahedra", "load.path": [[0, 0, -1e-5]]})


def test_middles_of_two_facets_face_each_other(mesh):
    """The distance of two facets' middles is that of the surfaces, and of the sagittas of both polygons."""
    lower, upper = (mesh.nodes[mesh.surface_quads(yarn)].mean(axis=1) for yarn in range(2))
    apart = np.linalg.norm(lower[:, None] - upper, axis=-1)
    nearest = np.unravel_index(apart.argmin(), apart.shape)
    outer = np.linalg.norm(mesh.section.points[mesh.section.ring[0]])
    sagitta = 1 - outer * np.cos(np.pi / mesh.section.ring.size)
    assert apart.min() == pytest.approx((CLEARANCE + 2 * sagitta) * RADIUS, rel=1e-9)
    np.testing.assert_allclose([lower[nearest[0], :2], upper[nearest[1], :2]], 0, atol=1e-12)


def test_layers_are_short_at_the_crossing_and_grow(mesh):
    for yarn in range(2):
        s = mesh.arc_length[mesh.yarn_of_slice == yarn]
        layer = np.searchsorted(s, LENGTH / 2)
        np.testing.assert_allclose(
            s[[layer - 1, layer]], LENGTH / 2 + SIZE * np.array([-0.5, 0.5]), rtol=1e-9
        )
        assert np.diff(s)[0] > 1.1 * SIZE
        np.testing.assert_allclose(s, (LENGTH - s)[::-1], atol=1e-9 * LENGTH)


def test_yarns_that_overlap():
    pair = yarn_pair(RADIUS, 90.0, LENGTH)
    lower, upper = pair.centrelines
    nearer = Centreline(upper.curve.shifted([0, 0, -0.06 * RADIUS]), 1)
    with pytest.raises(MeshError, match="overlap"):
        mesh_fabric(of_curves([lower, nearer], RADIUS), SIZE, 1.0)


def test_back_is_the_half_that_cannot_touch(pair, mesh, scene):
    held_and_driven = grips(mesh, scene, pair)
    for yarn, nodes, away in ((0, held_and_driven.held, -1), (1, held_and_driven.driven, 1)):
        surface = mesh.surface_nodes(yarn)
        assert nodes.size == surface.size // 2
        assert np.isin(nodes, surface).all()
        height = mesh.nodes[nodes, 2] - pair.crossings.point[0, yarn, 2]
        assert (away * height > 0).all()


def test_ends_are_whole_sections(pair, mesh, scene):
    held_and_driven = grips(mesh, scene.replace("pair.support", "ends"), pair)
    for yarn, nodes in ((0, held_and_driven.held), (1, held_and_driven.driven)):
        assert nodes.size == 2 * mesh.section.size
        slices = nodes[:: mesh.section.size] // mesh.section.size
        assert (mesh.yarn_of_slice[slices] == yarn).all()
        np.testing.assert_array_equal(mesh.arc_length[slices], [0, LENGTH])
