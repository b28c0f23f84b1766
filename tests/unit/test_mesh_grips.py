"""Nodes that are held and driven in wale tension, and meshes for it."""

import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.geometry.fabric import head_arcs, sinker_arcs
from knitstudy.mesh.mesher import grips, mesh_fabric

SIZE, GROWTH = 0.9e-3, 2.0


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


def test_ends_are_held_left_and_driven_right_in_course_tension(plain_scene, knit, plain):
    ends = grips(plain, plain_scene, knit)
    np.testing.assert_array_equal(ends.held, plain.end_nodes("left"))
    np.testing.assert_array_equal(ends.driven, plain.end_nodes("right"))


def test_a_mesh_without_slices_where_grips_end_is_refused(scene, knit, plain):
    with pytest.raises(MeshError, match=r"mesh of yarn 0: no slice at s = .* where a grip ends"):
        grips(plain, scene, knit)


def nodes_of(mesh, yarn):
    """Nodes (s, q, 3) of the slices of a yarn."""
    return mesh.nodes[mesh.slice_nodes(np.flatnonzero(mesh.yarn_of_slice == yarn))]


def test_yarns_that_are_not_gripped_along_arcs_are_those_of_course_tension(knit, plain, mesh):
    for yarn in range(1, knit.cells[1]):
        np.testing.assert_array_equal(nodes_of(mesh, yarn), nodes_of(plain, yarn))
    course = mesh_fabric(knit, SIZE, GROWTH, 2.0, "course")
    np.testing.assert_array_equal(course.nodes, plain.nodes)


def test_gripped_yarns_are_crossed_in_the_middle_of_a_layer_all_the_same(knit, mesh):
    for yarn, side in ((0, 0), (knit.cells[1], 1)):
        along, s = mesh.stations[yarn], knit.crossings.arc_length[knit.crossings.yarn[:, side] == yarn, side]
        below = np.searchsorted(along, s) - 1
        np.testing.assert_allclose(0.5 * (along[below] + along[below + 1]), s, rtol=1e-9)
        np.testing.assert_allclose(along[below + 1] - along[below], SIZE / 2, rtol=1e-6)


def test_loops_of_gripped_yarns_are_alike(knit, mesh):
    for yarn in knit.grip_ends("wale"):
        nodes = nodes_of(mesh, yarn)
        loop = (len(nodes) - 1) // knit.cells[0]
        moved = nodes[:-loop] + np.array([knit.cell[0], 0, 0])
        # The integral of the spacing is summed in steps that loops do not share.
        np.testing.assert_allclose(moved, nodes[loop:], rtol=0, atol=1e-4 * SIZE)
