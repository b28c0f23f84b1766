"""Networks of beams: nodes, joints, segments and ends of both reduced models."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal

from knitstudy.knit.models.rom2d import build as network_2d
from knitstudy.knit.yarns.joints import joint_points
from knitstudy.knit.yarns.network import spatial_network


@pytest.fixture(scope="module")
def points(knit, contacts):
    return joint_points(knit, contacts)


def test_zones_free_corners_and_ends_are_its_nodes(knit, contacts):
    network = network_2d.planar_network(knit, contacts)
    zones, feet, heads, ends = 4 * 3 * 3, 4 * 3, 4 * 3, 2 * 4
    assert network.beam_nodes == len(network.nodes) == zones + feet + heads + ends
    np.testing.assert_allclose(network.nodes[:zones, :2], contacts["centroid"][:, :2])
    np.testing.assert_array_equal(network.nodes[:, 2], 0)


def test_only_segments_inside_interlocks_carry_two_yarns(knit, contacts):
    network = network_2d.planar_network(knit, contacts, doubled=True)
    zone = np.tile(contacts["zone"].to_numpy(), 2)
    shared = network.ends[network.yarns_side_by_side == 2]
    assert len(shared) == 2 * 3 * 3
    np.testing.assert_array_equal(np.sort(zone[shared] // 2, axis=1), np.tile([0, 1], (18, 1)))
    assert np.all(network_2d.planar_network(knit, contacts).yarns_side_by_side == 1)


def test_two_joints_at_one_point_are_refused(knit, points):
    arc_length = points.arc_length.copy()
    arc_length[2, 0] = arc_length[0, 0]
    twice = replace(points, arc_length=arc_length)
    with refusal("yarn 0 has two joints"):
        spatial_network(knit, twice, 1.0)
