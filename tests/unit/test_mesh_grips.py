"""Nodes that are held and driven in wale tension, and meshes for it."""

import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.knit.geometry.fabric import of_curves
from knitstudy.knit.geometry.specimens import head_arcs, sinker_arcs, yarn_pair
from knitstudy.knit.geometry.spline import CatmullRom, Centreline
from knitstudy.knit.mesh.mesher import grips, mesh_fabric

SIZE, GROWTH = 1.0, 2.0


@pytest.fixture(scope="module")
def plain(knit):
    return mesh_fabric(knit, SIZE, GROWTH, 2.0)


@pytest.fixture(scope="module")
def mesh(knit):
    return mesh_fabric(knit, SIZE, GROWTH, 2.0, "wale")


def test_sinkers_of_the_bottom_yarn_are_held_and_heads_of_the_top_yarn_driven(knit, mesh):
    ends = grips(mesh, knit, "wale")
    for nodes, yarn, arcs in (
        (ends.held, 0, sinker_arcs(knit)),
        (ends.driven, knit.cells[1], head_arcs(knit)),
    ):
        slices = np.unique(nodes // mesh.section.size)
        assert nodes.size == slices.size * mesh.section.size, "whole sections"
        assert set(mesh.yarn_of_slice[slices]) == {yarn}
        along = mesh.arc_length[slices]
        # From end to end of every arc, so that grips do not depend on the mesh.
        assert np.abs(along[:, None, None] - arcs).min(axis=0).max() < 1e-12
        # Below all crossings of the row above, or above all of the row below.
        sign, level = (-1, knit.crossings.point[knit.crossings.row == 0, 0, 1].min())
        if yarn:
            sign, level = (1, knit.crossings.point[knit.crossings.row == knit.cells[1] - 1, 1, 1].max())
        assert (sign * (mesh.centres[slices, 1] - level) > 0).all()


def test_a_mesh_without_slices_where_grips_end_is_refused(knit, plain):
    with pytest.raises(MeshError, match=r"mesh of yarn 0: no slice at s = .* where a grip ends"):
        grips(plain, knit, "wale")


def test_yarns_that_overlap():
    pair = yarn_pair(0.9e-3, 90.0, 8e-3)
    lower, upper = pair.centrelines
    nearer = Centreline(
        CatmullRom(upper.curve.control_points - [0, 0, 0.06 * pair.radius], upper.curve.advance), 1
    )
    with pytest.raises(MeshError, match="overlap"):
        mesh_fabric(of_curves([lower, nearer], pair.radius), 0.5, 1.0)
