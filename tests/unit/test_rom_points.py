"""Points C and P of the three-dimensional reduced model, and contacts made of crossings."""

import numpy as np
import pytest

from knitstudy.errors import GeometryError
from knitstudy.models.joints import contact_normal_planes, joint_points


def test_contacts_of_crossings_lie_halfway_with_normals_across(knit, contacts):
    point = knit.crossings.point
    across = contacts["normal"].to_numpy() * knit.crossings.distance[:, None]
    np.testing.assert_allclose(contacts["centroid"] + 0.5 * across, point[:, 1], atol=1e-15)
    np.testing.assert_allclose(contacts["centroid"] - 0.5 * across, point[:, 0], atol=1e-15)


def test_closest_points_are_the_points_C_of_their_own_contacts(knit, contacts):
    """P halfway between closest points, with the normal across, puts both of them into the plane."""
    points = joint_points(knit, contacts)
    np.testing.assert_allclose(points.arc_length, knit.crossings.arc_length, atol=1e-11)
    np.testing.assert_allclose(points.point, knit.crossings.point, atol=1e-11)


def test_points_C_lie_in_the_plane_of_P_and_normal(knit, contacts):
    """Contacts as a simulation may find them: moved and tilted."""
    rng = np.random.default_rng(12)
    shift = 1e-4 * rng.normal(size=(36, 3))
    normal = contacts["normal"].to_numpy() + 0.1 * rng.normal(size=(36, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    moved = contacts.assign(centroid=contacts["centroid"] + shift, normal=(("crossing", "xyz"), normal))
    points = joint_points(knit, moved)
    plane = contact_normal_planes(moved)
    height = np.einsum("ksi,ki->ks", points.point - moved["centroid"].to_numpy()[:, None], plane)
    np.testing.assert_allclose(height, 0, atol=1e-11)
    np.testing.assert_allclose(np.einsum("ki,ki->k", plane, normal), 0, atol=1e-14)
    assert 1e-5 < np.abs(points.arc_length - knit.crossings.arc_length).max() < 1e-3


def test_contact_without_partner_is_refused(contacts):
    with pytest.raises(GeometryError, match="has zone 2 but not zone 0"):
        contact_normal_planes(contacts.isel(crossing=slice(1, None)))


def test_contact_far_from_its_yarns_is_refused(knit, contacts):
    with pytest.raises(GeometryError, match="row 0, column 0, zone 0 on yarn 0"):
        joint_points(knit, contacts.assign(centroid=contacts["centroid"] + [0, 5e-3, 0]))
