import numpy as np
import pytest

from knitstudy.mechanics.model import transformation
from knitstudy.mesh.mesher import mesh_fabric
from knitstudy.models.discretisation import distance_to_tube, project_on_tube
from knitstudy.models.facet_tie import facet_size, tie_crossings


@pytest.fixture(scope="module")
def knit(plain_scene, knit_of):
    return knit_of(plain_scene.replace("pattern.loops", 1).replace("pattern.rows", 2))


@pytest.fixture(scope="module")
def mesh(knit):
    return mesh_fabric(knit, 0.6e-3)


@pytest.fixture(scope="module")
def tie(knit, mesh):
    return tie_crossings(mesh, knit, 0.05)


def test_every_crossing_is_tied_once(tie, knit):
    assert set(tie.crossing) == set(range(len(knit.crossings.row)))
    assert len(np.unique(tie.slave)) == len(tie.slave)
    assert not np.isin(tie.master, tie.slave).any()


def test_slaves_lie_where_their_masters_put_them(tie):
    np.testing.assert_allclose(tie.weight.sum(axis=1), 1, atol=1e-14)
    assert tie.weight.min() >= -1e-12
    placed = np.einsum("sm,smi->si", tie.weight, tie.nodes[tie.master])
    np.testing.assert_allclose(placed, tie.nodes[tie.slave], atol=1e-15)


def test_only_slaves_move_and_by_less_than_a_facet(tie, mesh):
    moved = np.linalg.norm(tie.nodes - mesh.nodes, axis=1)
    np.testing.assert_array_equal(np.flatnonzero(moved), np.sort(tie.slave))
    np.testing.assert_allclose(moved[tie.slave], tie.adjustment)
    assert tie.adjustment.max() < 0.5 * facet_size(mesh)


def test_slave_is_the_upper_rows_yarn(tie, knit, mesh):
    yarn = mesh.yarn_of_slice[tie.slave // mesh.section.size]
    np.testing.assert_array_equal(yarn, knit.crossings.yarn[tie.crossing, 1])


def test_dependence_carries_rigid_and_affine_motions(tie):
    gradient = np.random.default_rng(0).normal(size=(3, 3))
    everywhere = tie.nodes @ gradient.T
    spread, retained = transformation(tie.dependence)
    np.testing.assert_array_equal(retained, np.setdiff1d(np.arange(len(tie.nodes)), tie.slave))
    np.testing.assert_allclose(spread @ everywhere[retained], everywhere, atol=1e-15)


def test_tied_area_and_centroid(tie, knit, mesh):
    facets = tie.area / facet_size(mesh) ** 2
    assert ((facets > 0.5) & (facets < 4)).all()
    middle = knit.crossings.point.mean(axis=1)
    # One facet, whose middle lies under the contact point; what remains is the sag of its flat face.
    assert np.linalg.norm(tie.centroid - middle, axis=1).max() < 0.1 * facet_size(mesh)


def test_a_larger_tolerance_ties_more(tie, knit, mesh):
    # The nearest facet is under the contact; the next ones have corners one and a half facets away from it.
    wider = tie_crossings(mesh, knit, 1.0)
    assert set(tie.slave) < set(wider.slave)
    assert (wider.area >= tie.area).all()


def test_only_the_crossings_asked_for_are_tied(tie, knit, mesh):
    upper = knit.crossings.row == 1
    some, none = (tie_crossings(mesh, knit, 0.05, tied) for tied in (upper, np.zeros_like(upper)))
    assert set(some.crossing) == set(np.flatnonzero(upper))
    np.testing.assert_array_equal(np.isfinite(some.area), upper)
    np.testing.assert_array_equal(np.isfinite(some.centroid).all(axis=1), upper)
    np.testing.assert_array_equal(some.area[upper], tie.area[upper])
    assert not some.resultants(np.ones_like(some.nodes), some.nodes)[~upper].any()
    assert not len(none.slave)
    np.testing.assert_array_equal(none.nodes, mesh.nodes)
    assert none.dependence is None


def test_resultants_act_on_the_lower_yarn(tie):
    force = np.zeros_like(tie.nodes)
    force[tie.slave] = [0, 0, 1.0]
    count = np.bincount(tie.crossing)
    np.testing.assert_allclose(tie.resultants(force, tie.nodes)[:, 2], -count)


def test_mirrored_crossings_are_tied_alike(tie, knit):
    """The loop is symmetric about its middle: so are the areas of zones 0 and 1, and of 2 and 3."""
    area = tie.area.reshape(-1, 4)
    np.testing.assert_allclose(area[:, 0], area[:, 1], rtol=1e-3)
    np.testing.assert_allclose(area[:, 2], area[:, 3], rtol=1e-3)


def test_projection_finds_the_nearest_point(knit):
    line = knit.centrelines[0]
    u = np.linspace(0.5, 11.5, 23)
    along = line.curve.d1(u)
    normal = np.cross(along, [0.3, -0.2, 0.9])
    normal *= 0.4e-3 / np.linalg.norm(normal, axis=1, keepdims=True)
    points = line.curve.value(u) + normal
    np.testing.assert_allclose(project_on_tube(line, points, u + 0.2), u, atol=1e-9)
    np.testing.assert_allclose(distance_to_tube(line, points, u - 0.2), 0.4e-3, rtol=1e-12)
