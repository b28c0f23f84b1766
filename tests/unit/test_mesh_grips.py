"""Nodes that are held and driven in wale tension, and meshes for it."""

import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.geometry.fabric import head_arcs, of_curves, sinker_arcs, yarn_pair
from knitstudy.geometry.spline import Centreline
from knitstudy.mesh.mesher import grips, mesh_fabric

SIZE, GROWTH = 1.0, 2.0


@pytest.fixture(scope="module")
def plain(knit):
    return mesh_fabric(knit, SIZE, GROWTH, 2.0)


@pytest.fixture(scope="module")
def mesh(knit):
    return mesh_fabric(knit, SIZE, GROWTH, 2.0, "wale")


@pytest.fixture
def scene(plain_scene):
    return plain_scene.replace("load.direction", "wale")


def test_sinkers_of_the_bottom_yarn_are_held_and_heads_of_the_top_yarn_driven(scene, knit, mesh):
    ends = grips(mesh, scene, knit)
    for nodes, yarn, arcs in (
        (ends.held, 0, sinker_arcs(knit)),
        (ends.driven, knit.cells[1], head_arcs(knit)),
    ):
        slices = np.unique(nodes // mesh.section.size)
        assert nodes.size == slices.size * mesh.section.size, "whole sections"
        assert set(mesh.yarn_of_slice[slices]) == {yarn}
        along = mesh.arc_length[slices]
        # From end to end of every arc, so that what is gripped does not depend on the mesh.
        assert np.abs(along[:, None, None] - arcs).min(axis=0).max() < 1e-12
        # Below all crossings of the row above, or above all of the row below.
        sign, level = (-1, knit.crossings.point[knit.crossings.row == 0, 0, 1].min())
        if yarn:
            sign, level = (1, knit.crossings.point[knit.crossings.row == knit.cells[1] - 1, 1, 1].max())
        assert (sign * (mesh.centres[slices, 1] - level) > 0).all()


def test_a_mesh_without_slices_where_grips_end_is_refused(scene, knit, plain):
    with pytest.raises(MeshError, match=r"mesh of yarn 0: no slice at s = .* where a grip ends"):
        grips(plain, scene, knit)


RADIUS, LENGTH, CLEARANCE, PAIR_SIZE = 0.9e-3, 8e-3, 0.02, 0.5


@pytest.fixture(scope="module", params=[90.0, 30.0])
def pair(request):
    return yarn_pair(RADIUS, request.param, LENGTH, CLEARANCE)


@pytest.fixture(scope="module")
def pair_mesh(pair):
    return mesh_fabric(pair, PAIR_SIZE, 1.2)


def test_middles_of_two_facets_face_each_other(pair_mesh):
    """The distance of two facets' middles is that of the surfaces, and of the sagittas of both polygons."""
    lower, upper = (pair_mesh.nodes[pair_mesh.surface_quads(yarn)].mean(axis=1) for yarn in range(2))
    apart = np.linalg.norm(lower[:, None] - upper, axis=-1)
    nearest = np.unravel_index(apart.argmin(), apart.shape)
    outer = np.linalg.norm(pair_mesh.section.points[pair_mesh.section.ring[0]])
    sagitta = 1 - outer * np.cos(np.pi / pair_mesh.section.ring.size)
    assert apart.min() == pytest.approx((CLEARANCE + 2 * sagitta) * RADIUS, rel=1e-9)
    np.testing.assert_allclose([lower[nearest[0], :2], upper[nearest[1], :2]], 0, atol=1e-12)


def test_yarns_that_overlap():
    pair = yarn_pair(RADIUS, 90.0, LENGTH)
    lower, upper = pair.centrelines
    nearer = Centreline(upper.curve.shifted([0, 0, -0.06 * RADIUS]), 1)
    with pytest.raises(MeshError, match="overlap"):
        mesh_fabric(of_curves([lower, nearer], RADIUS), PAIR_SIZE, 1.0)
