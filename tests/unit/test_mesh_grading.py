"""Sections drawn towards the yarns that touch them."""

import numpy as np
import pytest

from knitstudy.errors import MeshError
from knitstudy.knit.contacts.kinematics import section_motion
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.mesh.quality import check_folding
from knitstudy.knit.mesh.section import Grading, drawn

RADIUS, SIZE = 0.9e-3, 1 / 3
GRADING = Grading(3.0, reach=1.0, ramp=2.0)


def test_a_section_is_finer_by_the_refinement_where_it_is_drawn_to_and_keeps_its_angles():
    """Images of a small cross: its arms keep their right angle and are a third, and three times as long."""
    towards = 0.7
    pull = GRADING.pull(np.zeros(1), np.zeros(1), np.array([towards]))
    rim, step = np.array([np.cos(towards), np.sin(towards)]), 1e-6
    normal = np.array([-rim[1], rim[0]])
    for side, scale in ((1, 1 / 3), (-1, 3)):
        cross = side * rim + step * np.array([0 * rim, -side * rim, normal])
        image = drawn(np.vstack([cross, -side * rim]), pull)[0, :3]  # the last: the circle it is drawn in
        arms = np.diff(image, axis=0, prepend=image[:1])[1:]
        arms[1] = image[2] - image[0]
        np.testing.assert_allclose(np.linalg.norm(arms, axis=1), scale * step, rtol=1e-4)
        assert abs(arms[0] @ arms[1]) < 1e-4 * (scale * step) ** 2


def test_elements_at_the_crossing_are_smaller_along_and_across(pair):
    coarse, fine = (mesh_fabric(pair, SIZE, 1.0, refinement) for refinement in (1.0, 3.0))
    check_folding(fine)
    for yarn in range(2):
        sizes = []
        for mesh in (coarse, fine):
            stations = mesh.arc_length[mesh.yarn_of_slice == yarn]
            here = mesh.first_slice[yarn] + np.searchsorted(stations, pair.crossings.arc_length[0, yarn])
            ring = mesh.nodes[mesh.slice_nodes(here)[mesh.section.ring]]
            apart = np.linalg.norm(ring - pair.crossings.point[0].mean(axis=0), axis=1)
            first, second = np.argsort(apart)[:2]
            assert apart[second] == pytest.approx(apart[first], rel=1e-6), (
                "a facet's middle faces the other yarn"
            )
            along = mesh.arc_length[here] - mesh.arc_length[here - 1]
            sizes.append((np.linalg.norm(ring[second] - ring[first]), along))
        np.testing.assert_allclose(np.divide(*sizes), 3.0, rtol=0.05)


def test_crossings_that_are_too_near_are_refused():
    near = np.array([0.0, 5.0])
    with pytest.raises(MeshError, match=r"mesh.refinement: crossings 5 m apart .* too near for 3.*use 1"):
        GRADING.pull(np.zeros(3), near, np.zeros(2))


def test_motion_of_a_drawn_section_is_that_of_the_yarn(pair):
    """Sections bend in a parabola about the crossing: its slope there is 0, whichever side has more nodes."""
    actual = []
    for refinement in (1.0, 3.0):
        mesh = mesh_fabric(pair, SIZE, 1.0, refinement)
        moved = np.zeros_like(mesh.nodes)
        moved[:, 2] = 10 * (mesh.nodes[:, 0] ** 2 + mesh.nodes[:, 1] ** 2)
        actual.append(section_motion(pair.crossings, mesh, mesh.nodes, moved).gradient)
    np.testing.assert_allclose(actual[0], actual[1], atol=2e-4)
