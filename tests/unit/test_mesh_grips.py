"""Nodes that are held and driven in wale tension."""

import numpy as np
import pytest

from knitstudy.geometry.arcs import head_arcs, sinker_arcs
from knitstudy.mesh.grips import grips
from knitstudy.mesh.knit import mesh_knit


@pytest.fixture(scope="module")
def mesh(knit):
    return mesh_knit(knit, 0.9e-3, 2.0)


def test_sinkers_of_the_bottom_yarn_are_held_and_heads_of_the_top_yarn_driven(plain_scene, knit, mesh):
    ends = grips(mesh, plain_scene.replace("load.direction", "wale"), knit)
    for nodes, yarn, arcs in ((ends.held, 0, sinker_arcs(knit)), (ends.driven, knit.rows, head_arcs(knit))):
        slices = np.unique(nodes // mesh.section.size)
        assert nodes.size == slices.size * mesh.section.size, "whole sections"
        assert set(mesh.yarn_of_slice[slices]) == {yarn}
        along = mesh.arc_length[slices]
        assert all(np.any((along > low) & (along < high)) for low, high in arcs), "every arc"
        # Below all crossings of the row above, or above all of the row below.
        sign, level = (-1, knit.crossings.point[knit.crossings.row == 0, 0, 1].min())
        if yarn:
            sign, level = (1, knit.crossings.point[knit.crossings.row == knit.rows - 1, 1, 1].max())
        assert (sign * (mesh.centres[slices, 1] - level) > 0).all()
