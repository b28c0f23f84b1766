"""Points C and P of the three-dimensional reduced model, and contacts made of crossings."""

import numpy as np
from refusals import refusal

from knitstudy.knit.yarns.joints import contact_normal_planes, joint_points


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
    with refusal("has zone 2 but not zone 0"):
        contact_normal_planes(contacts.isel(crossing=slice(1, None)))


def test_plane_that_misses_a_yarn_leaves_the_closest_point(knit, contacts):
    """Off by the height over the plane; a normal along P1 P2 spans no plane."""
    normal, centroid = contacts["normal"].to_numpy().copy(), contacts["centroid"].to_numpy()
    normal[0], normal[1] = centroid[2] - centroid[0], [0, 0, 1]
    normal[2] = np.cross(normal[0], [0, 0, 1])  # the plane is z = 0: yarns pass P2 above and below it
    points = joint_points(knit, contacts.assign(normal=(contacts["normal"].dims, normal)))
    for k in (0, 2):
        np.testing.assert_allclose(points.point[k], knit.crossings.point[k], atol=1e-15)
    assert np.isnan(points.off_plane[0]).all()
    height = np.abs(knit.crossings.point[2, :, 2] - centroid[2, 2])
    np.testing.assert_allclose(points.off_plane[2], height, rtol=1e-6)
    np.testing.assert_allclose(np.delete(points.off_plane, [0, 2], axis=0), 0, atol=1e-11)
