"""Springs from contacts: secants by hand, what counts as open or undefined, and models that follow the data."""

import numpy as np
import pytest
import synthetic

from knitstudy.errors import ConfigurationError
from knitstudy.models.joints import Joints, joint_points, spring_joints, springs
from knitstudy.models.simulate import build

STIFFNESS = np.array([80e3, 60e3, 900e3])  # of the contacts below along x, y and z [N/m]


@pytest.fixture
def touching(contacts):
    """Contacts in which all crossings of the middle row have the springs STIFFNESS."""
    return synthetic.contacts_with_springs(contacts, STIFFNESS)


@pytest.fixture(scope="session")
def scene(plain_scene):
    scene = plain_scene.replace("interaction", "isotropic").replace("mesh.beam_size", 3e-3)
    return scene.replace("rom.axes", "global")


def with_values(contacts, name, values):
    return contacts.assign({name: (contacts[name].dims, values)})


def test_secant_counts_from_first_contact(touching):
    found = springs(touching, "interface")
    inner = touching["row"].to_numpy() == 1
    np.testing.assert_allclose(found.stiffness[inner], np.tile(STIFFNESS, (12, 1)))
    assert np.isnan(found.stiffness[~inner]).all()
    np.testing.assert_allclose(found.averaged, STIFFNESS)
    # From the undeformed state on there would be twice the displacement.
    np.testing.assert_allclose(found.displacement[inner], 0.5 * touching["relative_displacement"][-1][inner])
    np.testing.assert_array_equal(found.used, 12)


def test_contact_askew_to_the_axes_has_springs_of_its_own(touching):
    """Stiff along the normal and soft across: along an axis it may move against the force."""
    normal = touching["normal"].to_numpy()
    displacement = touching["relative_displacement"].to_numpy()
    since = displacement - displacement[1]
    along = np.einsum("tki,ki->tk", since, normal)[..., None] * normal
    askew = with_values(touching, "force", 700e3 * along + 30e3 * (since - along))
    found = springs(askew, "interface", "contact")
    np.testing.assert_allclose(found.stiffness[12:24], np.tile([700e3, 30e3], (12, 1)))
    np.testing.assert_allclose(found.averaged, [700e3, 30e3])
    assert springs(askew, "interface").negative.sum() > 0
    joints = spring_joints(askew, "interface", "contact")
    force = np.einsum("kij,kj->ki", joints.stiffness[12:24], found.displacement[12:24])
    np.testing.assert_allclose(force, found.force[12:24])


def test_crossing_that_hardly_moves_has_no_weight_in_the_average(touching):
    """Its own secant is a thousandfold, and so is the mean of the ratios; the average stays where the others are."""
    displacement = touching["relative_displacement"].to_numpy().copy()
    displacement[2:, 12] = displacement[1, 12] + 1e-3 * (displacement[2:, 12] - displacement[1, 12])
    found = springs(with_values(touching, "relative_displacement", displacement), "interface")
    np.testing.assert_allclose(found.stiffness[12], 1e3 * STIFFNESS, rtol=1e-6)
    np.testing.assert_allclose(found.averaged, STIFFNESS, rtol=1e-2)


def test_crossing_open_at_the_end_has_no_spring(touching):
    zones = touching["zones"].to_numpy().copy()
    zones[:, 13], zones[-1, 14] = 0, 0
    found = springs(with_values(touching, "zones", zones), "interface")
    np.testing.assert_array_equal(np.flatnonzero(found.open), [13, 14])
    assert np.isnan(found.stiffness[13:15]).all()
    np.testing.assert_array_equal(found.undefined, 0)


def test_crossing_that_has_not_moved_has_no_secant(touching):
    displacement = touching["relative_displacement"].to_numpy().copy()
    displacement[:, 15, 2] = 0.0
    still = with_values(touching, "relative_displacement", displacement)
    found = springs(still, "interface")
    np.testing.assert_array_equal(found.undefined, [0, 0, 1])
    with pytest.raises(ConfigurationError, match="row 1, column 0, zone 3 has not moved along z"):
        spring_joints(still, "interface", each=True)
    np.testing.assert_allclose(spring_joints(still, "interface").stiffness[15], np.diag(found.averaged))


def test_negative_secants_are_reported_and_not_averaged_away(touching):
    force = touching["force"].to_numpy().copy()
    force[:, 12:17, 1] *= -1
    found = springs(with_values(touching, "force", force), "interface")
    np.testing.assert_array_equal(found.negative, [0, 5, 0])
    assert found.stiffness[12, 1] == pytest.approx(-STIFFNESS[1])
    weight = found.displacement[12:24, 1] ** 2
    share = weight[:5].sum() / weight.sum()
    assert found.averaged[1] == pytest.approx((1 - 2 * share) * STIFFNESS[1])
    force[:, 12:24, 1] = -np.abs(force[:, 12:24, 1])
    with pytest.raises(ConfigurationError, match=r"spring of the contacts along y is -6e\+04 N/m \(12 of 12"):
        spring_joints(with_values(touching, "force", force), "interface")


@pytest.mark.parametrize("joint", ["rigid", "printed"])
def test_springs_and_points_of_the_model_follow_the_contacts(scene, knit, touching, joint):
    """What moves in the contacts moves in the model, and nothing else does."""
    scene = scene.replace("rom.joint", joint).replace("rom.springs", "zones")
    before = build(scene, knit, contacts=touching).observer.network
    force = touching["force"].to_numpy().copy()
    force[-1, 14] *= [2.0, 3.0, 4.0]
    centroid = touching["centroid"].to_numpy().copy()
    centroid[14] += [5e-5, -3e-5, 4e-5]
    moved = with_values(with_values(touching, "force", force), "centroid", centroid)
    after = build(scene, knit, contacts=moved).observer.network

    number = int(np.flatnonzero(np.flatnonzero(before.joints.sprung) == 14)[0])
    ratio = np.divide(*(np.diagonal(model.springs.stiffness, axis1=1, axis2=2) for model in (after, before)))
    np.testing.assert_allclose(ratio[number], [2.0, 3.0, 4.0])
    np.testing.assert_allclose(np.delete(ratio, number, axis=0), 1.0)
    points = joint_points(knit, moved)
    nodes = after.nodes[after.springs.ends[number]]
    np.testing.assert_allclose(nodes, points.point[14], atol=1e-15)
    expected = np.tile(centroid[14], (2, 1)) if joint == "rigid" else points.point[14]
    np.testing.assert_allclose(nodes + after.springs.offsets[number], expected, atol=1e-15)
    away = np.linalg.norm(points.point - joint_points(knit, touching).point, axis=-1).max(axis=1)
    np.testing.assert_array_equal(np.flatnonzero(away > 1e-7), [14])


def test_axes_of_the_springs_are_those_of_the_scene(scene, knit, touching):
    stiffness = build(
        scene.replace("rom.axes", "contact"), knit, contacts=touching
    ).observer.network.springs.stiffness
    normal = touching["normal"].to_numpy()[12:24]
    along = np.einsum("kij,kj->ki", stiffness, normal)
    level = np.abs(stiffness).max()
    np.testing.assert_allclose(np.cross(along, normal), 0, atol=1e-12 * level)
    assert np.abs(stiffness[:, 0, 2]).min() > 1e-3 * level  # no axis of the contact is a global one


def test_pins_take_the_place_of_ties_alone():
    stiffness = np.full((3, 3, 3), np.nan)
    stiffness[1] = 2.0 * np.eye(3)
    joints = Joints(np.array([False, False, True]), stiffness)
    pinned = joints.pinned(5.0)
    assert not pinned.tied.any()
    np.testing.assert_array_equal(pinned.open, joints.open)
    np.testing.assert_array_equal(pinned.stiffness[0], 5.0 * np.eye(3))
    np.testing.assert_array_equal(pinned.stiffness[1:], stiffness[1:])
