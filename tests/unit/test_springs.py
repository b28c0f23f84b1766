"""Springs from contacts: secants by hand, open and undefined contacts, and models that follow the data."""

import numpy as np
import pytest
import synthetic

from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.knit.models.rom3d.build import spring_joints
from knitstudy.knit.simulate import build
from knitstudy.knit.yarns.joints import Joints, contact_normals, joint_points, spring_axes, springs

STIFFNESS = np.array([80e3, 60e3, 900e3])  # of the contacts below along x, y and z [N/m]


@pytest.fixture
def touching(contacts):
    """Contacts in which all crossings of the middle row have the springs STIFFNESS."""
    return synthetic.contacts_with_springs(contacts, STIFFNESS)


@pytest.fixture(scope="session")
def scene(plain_scene):
    scene = plain_scene.replace("interaction", "isotropic").replace("mesh.beam_size", 1.2)
    return scene.replace("rom.axes", "global")


def with_values(contacts, name, values):
    return contacts.assign({name: (contacts[name].dims, values)})


def test_secant_counts_from_first_contact(touching):
    actual = springs(touching, "interface", "global")
    inner = touching["row"].to_numpy() == 1
    np.testing.assert_allclose(actual.stiffness[inner], np.tile(STIFFNESS, (12, 1)))
    assert np.isnan(actual.stiffness[~inner]).all()
    np.testing.assert_allclose(actual.averaged, STIFFNESS)
    # From the undeformed state on there would be twice the displacement.
    np.testing.assert_allclose(actual.displacement[inner], 0.5 * touching["relative_displacement"][-1][inner])
    np.testing.assert_array_equal(actual.used, 12)


def test_contact_askew_to_the_axes_has_springs_of_its_own(scene, touching):
    """Stiff along the normal and soft across: along an axis of the knit it may move against the force."""
    axes = spring_axes(touching["normal"].to_numpy(), "local")
    stiffness = np.einsum("kai,a,kaj->kij", axes, [20e3, 40e3, 700e3], axes)
    displacement = touching["relative_displacement"].to_numpy()
    since = displacement - displacement[1]
    askew = with_values(touching, "force", np.einsum("kij,tkj->tki", stiffness, since))
    actual = springs(askew, "interface")
    np.testing.assert_allclose(actual.stiffness[12:24], np.tile([20e3, 40e3, 700e3], (12, 1)))
    np.testing.assert_allclose(actual.averaged, [20e3, 40e3, 700e3])
    assert springs(askew, "interface", "global").negative.sum() > 0
    joints = spring_joints(askew, scene.replace("rom.axes", "local").rom)
    np.testing.assert_allclose(joints.stiffness[12:24], stiffness[12:24], rtol=1e-9, atol=1e-3)
    turned = springs(askew, "interface", "local, turned 90")
    np.testing.assert_allclose(turned.averaged, [40e3, 20e3, 700e3])
    assert turned.tangential == pytest.approx(actual.tangential)
    assert 20e3 < actual.tangential < 40e3


def test_normals_follow_the_forces(touching):
    """The pressure along a, the force along b; P1 and P2 may share their mean; open contacts keep their line."""
    line = touching["normal"].to_numpy()
    rng = np.random.default_rng(5)
    a, b = (line + 0.3 * rng.normal(size=(3, *line.shape)) for _ in range(2))
    a, b = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (a, b))
    a[-1, 3] = np.nan
    dims = ("increment", *touching["normal"].dims)
    given = touching.assign(contact_normal=(dims, a), resultant_direction=(dims, b))
    last = np.where(np.isnan(a[-1]), line, a[-1])
    np.testing.assert_allclose(contact_normals(given), last)
    np.testing.assert_allclose(contact_normals(given, "resultant"), b[-1])
    np.testing.assert_allclose(contact_normals(given, "closest_points"), line)
    shared, sum_of_both = contact_normals(given, "mean_resultant"), b[-1, 0] + b[-1, 2]  # zones 0 and 2
    np.testing.assert_allclose(shared[[0, 2]], 2 * [sum_of_both / np.linalg.norm(sum_of_both)])
    np.testing.assert_allclose(contact_normals(touching), line)
    with pytest.raises(DataFileError, match=r"no resultant_direction: rom\.normal resultant needs"):
        contact_normals(touching.drop_vars("resultant_direction"), "resultant")


def test_axes_where_the_normal_lies_along_the_course():
    normal = np.array([[1.0, 0, 0], [0, 0, 1], [0, 0, -1]])
    axes = spring_axes(normal, "local")
    np.testing.assert_allclose(axes[:, 0], [[0, 1, 0], [1, 0, 0], [1, 0, 0]])
    np.testing.assert_allclose(axes[:, 1], [[0, 0, 1], [0, 1, 0], [0, -1, 0]])
    np.testing.assert_allclose(np.linalg.det(axes), 1)


def test_crossing_that_hardly_moves_has_no_weight_in_the_average(touching):
    """Its own secant is a thousandfold, and so is the mean of the ratios; the average stays where the others are."""
    displacement = touching["relative_displacement"].to_numpy().copy()
    displacement[2:, 12] = displacement[1, 12] + 1e-3 * (displacement[2:, 12] - displacement[1, 12])
    actual = springs(with_values(touching, "relative_displacement", displacement), "interface", "global")
    np.testing.assert_allclose(actual.stiffness[12], 1e3 * STIFFNESS, rtol=1e-6)
    np.testing.assert_allclose(actual.averaged, STIFFNESS, rtol=1e-2)


def test_crossing_open_at_the_end_has_no_spring(touching):
    zones = touching["zones"].to_numpy().copy()
    zones[:, 13], zones[-1, 14] = 0, 0
    actual = springs(with_values(touching, "zones", zones), "interface", "global")
    np.testing.assert_array_equal(np.flatnonzero(actual.open), [13, 14])
    assert np.isnan(actual.stiffness[13:15]).all()
    np.testing.assert_array_equal(actual.undefined, 0)


def test_crossing_that_has_not_moved_has_no_secant(scene, touching):
    displacement = touching["relative_displacement"].to_numpy().copy()
    displacement[:, 15, 2] = 0.0
    still = with_values(touching, "relative_displacement", displacement)
    actual = springs(still, "interface", "global")
    np.testing.assert_array_equal(actual.undefined, [0, 0, 1])
    np.testing.assert_allclose(spring_joints(still, scene.rom).stiffness[15], np.diag(actual.averaged))


def test_negative_secants_are_reported_and_not_averaged_away(scene, touching):
    force = touching["force"].to_numpy().copy()
    force[:, 12:17, 1] *= -1
    actual = springs(with_values(touching, "force", force), "interface", "global")
    np.testing.assert_array_equal(actual.negative, [0, 5, 0])
    assert actual.stiffness[12, 1] == pytest.approx(-STIFFNESS[1])
    weight = actual.displacement[12:24, 1] ** 2
    share = weight[:5].sum() / weight.sum()
    assert actual.averaged[1] == pytest.approx((1 - 2 * share) * STIFFNESS[1])
    force[:, 12:24, 1] = -np.abs(force[:, 12:24, 1])
    with pytest.raises(ConfigurationError, match=r"spring of the contacts along y is -6e\+04 N/m \(12 of 12"):
        spring_joints(with_values(touching, "force", force), scene.rom)


@pytest.mark.parametrize("joint", ["rigid", "printed"])
def test_springs_and_points_of_the_model_follow_the_contacts(scene, knit, touching, joint):
    """A contact that moves takes its points along and no others; forces change the springs of all."""
    scene = scene.replace("rom.joint", joint)
    before = build(scene, knit, contacts=touching).observer.network
    force = touching["force"].to_numpy() * [2.0, 3.0, 4.0]
    centroid = touching["centroid"].to_numpy().copy()
    centroid[14] += [5e-5, -3e-5, 4e-5]
    moved = with_values(with_values(touching, "force", force), "centroid", centroid)
    after = build(scene, knit, contacts=moved).observer.network

    number = int(np.flatnonzero(np.flatnonzero(before.joints.sprung) == 14)[0])
    ratio = np.divide(*(np.diagonal(model.springs.stiffness, axis1=1, axis2=2) for model in (after, before)))
    np.testing.assert_allclose(ratio, np.tile([2.0, 3.0, 4.0], (12, 1)))
    points = joint_points(knit, moved)
    nodes = after.nodes[after.springs.ends[number]]
    np.testing.assert_allclose(nodes, points.point[14], atol=1e-15)
    expected = np.tile(centroid[14], (2, 1)) if joint == "rigid" else points.point[14]
    np.testing.assert_allclose(nodes + after.springs.offsets[number], expected, atol=1e-15)
    away = np.linalg.norm(points.point - joint_points(knit, touching).point, axis=-1).max(axis=1)
    np.testing.assert_array_equal(np.flatnonzero(away > 1e-7), [14])


def test_axes_of_the_springs_are_those_of_the_scene(scene, knit, touching):
    local = scene.vary({"rom.axes": "local", "rom.stiffness": [1e3, 2e3, 3e3]})
    stiffness = build(local, knit, contacts=touching).observer.network.springs.stiffness
    axes = spring_axes(touching["normal"].to_numpy()[12:24], "local")
    force = np.einsum("kij,kaj->kai", stiffness, axes)
    np.testing.assert_allclose(force, axes * [[1e3], [2e3], [3e3]], atol=1e-9)
    assert np.abs(stiffness[:, 0, 2]).min() > 1  # no axis of the contact is one of the knit


def test_pins_take_the_place_of_ties_alone():
    stiffness = np.full((3, 3, 3), np.nan)
    stiffness[1] = 2.0 * np.eye(3)
    joints = Joints(np.array([False, False, True]), stiffness)
    pinned = joints.pinned(5.0)
    assert not pinned.tied.any()
    np.testing.assert_array_equal(pinned.open, joints.open)
    np.testing.assert_array_equal(pinned.stiffness[0], 5.0 * np.eye(3))
    np.testing.assert_array_equal(pinned.stiffness[1:], stiffness[1:])
