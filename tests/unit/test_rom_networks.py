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


def test_both_points_C_hang_on_a_node_at_P(knit, points):
    network = spatial_network(knit, points, size=2.2)
    carried = network.nodes[network.station_node] + network.station_offset
    np.testing.assert_allclose(carried, network.stations.position, atol=1e-17)
    joints = np.flatnonzero(np.bincount(network.station_node) == 2)
    assert len(joints) == 36
    apart = np.linalg.norm(network.nodes[joints][:, None] - points.centroid, axis=-1)
    assert apart.min(axis=0).max() == 0
    for joint in joints:
        pair = network.stations.yarn[network.station_node == joint]
        assert abs(pair[0] - pair[1]) == 1


def test_curvature_is_that_of_the_centrelines(knit, points):
    network = spatial_network(knit, points, size=0.28)
    stations, centreline = network.stations, knit.centrelines[1]
    first = np.flatnonzero(stations.yarn[1:] == stations.yarn[:-1])
    mine = stations.yarn[first] == 1
    s, ahead = stations.arc_length[first][mine], stations.arc_length[first + 1][mine]
    middle, curvature = 0.5 * (s + ahead), network.curvature[mine]
    size = np.linalg.norm(curvature, axis=1)
    # Curvature jumps where the pieces of the curve meet: the mean over an element is between both values.
    assert np.mean(size) == pytest.approx(np.mean(centreline.curvature(middle)), rel=5e-3)
    assert np.median(np.abs(size / centreline.curvature(middle) - 1)) < 0.02
    # The arc bulges away from the side that the curvature turns to.
    chord = centreline.position(ahead) - centreline.position(s)
    bulge = centreline.position(middle) - 0.5 * (centreline.position(ahead) + centreline.position(s))
    bent = size > 0.2 * size.max()
    towards = np.cross(curvature, chord)
    assert np.all(np.einsum("ei,ei->e", towards, bulge)[bent] < 0)


def test_two_joints_at_one_point_are_refused(knit, points):
    arc_length = points.arc_length.copy()
    arc_length[2, 0] = arc_length[0, 0]
    twice = replace(points, arc_length=arc_length)
    with refusal("yarn 0 has two joints"):
        spatial_network(knit, twice, 1.0)
