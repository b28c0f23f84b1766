"""Networks of beams: nodes, points C and P, runs, the honeycomb along the stress, springs of contacts."""

from dataclasses import replace

import numpy as np
import pytest
import synthetic
from refusals import refusal

from knitstudy.knit.models.rom2d import build as network_2d
from knitstudy.knit.models.rom2d.build import heights_by_stress, moved
from knitstudy.knit.models.rom3d.build import spring_joints
from knitstudy.knit.simulate import build, solve
from knitstudy.knit.yarns.joints import (
    contact_normal_planes,
    contact_normals,
    joint_points,
    spring_axes,
    springs,
)
from knitstudy.knit.yarns.network import spatial_network
from knitstudy.measures.centre_cell import angle_to_x, angles_to_axes, central, honeycomb_segments


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


def with_area(contacts, scene, radius):
    """Return tied contacts on discs of a radius over the yarn's."""
    area = np.pi * (radius * scene.yarn.radius) ** 2
    return contacts.assign(area=contacts["area"] * 0 + area, tied=contacts["area"] * 0 + 1)


@pytest.mark.parametrize("joint", ["rigid", "patch"])
def test_ties_need_no_simulation(plain_scene, knit, contacts, joint):
    """Tied crossings of a simulation are those of the geometry and the radius of ties."""
    keys = {"rom.joint": joint, "mesh.beam_size": 1.2, "solver.increments": 1, "load.strain": 0.002}
    scene = plain_scene.vary(keys | {"tie.radius": 0.3, "rom.contacts_from": None})
    measured = with_area(contacts, scene, 0.3)
    assert float(solve(scene, knit)["force"][-1]) == float(solve(scene, knit, contacts=measured)["force"][-1])


@pytest.mark.parametrize("size", [0.0, 0.05, 0.7])
def test_joints_that_yield_need_ties_of_a_size(plain_scene, knit, contacts, size):
    tied = with_area(contacts, plain_scene, size)
    with refusal(r"ties have a radius .* but rom\.joint 'patch' needs"):
        solve(plain_scene.replace("rom.joint", "patch"), knit, contacts=tied)


def test_contacts_of_another_knit_are_refused(plain_scene, knit, contacts):
    with refusal("35 crossings that are not the 36"):
        solve(plain_scene, knit, contacts=contacts.isel(crossing=slice(35)))


def test_contact_without_centroid_is_refused(plain_scene, knit, contacts):
    centroid = contacts["centroid"].copy()
    centroid[5] = np.nan
    with refusal("row 0, column 1, zone 1 has no centroid"):
        solve(plain_scene, knit, contacts=contacts.assign(centroid=centroid))


INTERLOCK, LEG = 40.0, 55.0


def test_segments_have_the_angles_of_the_stress(knit, contacts):
    stresses = synthetic.stresses(knit, "course", INTERLOCK, LEG)
    joints = moved(knit, contacts, heights_by_stress(knit, contacts, stresses))
    expected = {"head": 0, "sinker": 0, "interlock": INTERLOCK, "leg": LEG}
    for kind, vectors in honeycomb_segments(joints).items():
        angle = angles_to_axes(vectors)[:, 0]
        np.testing.assert_allclose(angle, expected[kind.split(",")[0]], atol=1e-6, err_msg=kind)


@pytest.mark.parametrize(("spread", "other"), [(4.0, 55.5), (1.0, 58.0)])
def test_angles_of_a_stress_are_as_sure_as_equivalent_segments_and_discretisations(knit, spread, other):
    """Half the range over equivalent segments, or the difference to another discretisation if that is larger."""
    first, second = (synthetic.stresses(knit, "course", INTERLOCK, leg) for leg in (LEG, other))
    here = central(first, "leg, left")
    assert len(here) > 1, "equivalent segments"
    turned = np.radians(-(LEG - spread))
    axis = first["segment_axis"].copy(deep=True)
    axis[here[0], :, 0, :2] = [np.cos(turned), np.sin(turned)]
    first = first.assign(segment_axis=axis)
    actual = angle_to_x([first, second], "leg, left")
    mean = LEG - spread / len(here)
    assert actual.value == pytest.approx(mean)
    assert actual.uncertainty == pytest.approx(max(spread / 2, other - mean))


@pytest.mark.parametrize("angles", [(0.0, LEG), (INTERLOCK, 89.9)])
def test_directions_without_a_height_are_refused(knit, contacts, angles):
    with refusal(r"of the centre cell is at .* degrees to x: only"):
        heights_by_stress(knit, contacts, synthetic.stresses(knit, "wale", *angles))


def test_strain_refers_to_the_height_of_the_honeycomb(knit, contacts, plain_scene):
    stresses = synthetic.stresses(knit, "course", INTERLOCK, LEG)
    keys = {"rom.honeycomb": "principal_stress", "rom.stress_from": "dns-a", "rom.contacts_from": "dns-a"}
    scene = plain_scene.vary({"fidelity": "rom2d", "load.direction": "wale"} | keys)
    history = solve(scene.vary({"solver.increments": 1}), knit, contacts=contacts, stresses=stresses)
    height = 3 * heights_by_stress(knit, contacts, stresses).course
    assert float(history["displacement"][-1]) == pytest.approx(scene.load.strain * height, rel=1e-9)
    assert float(history["strain"][-1]) == pytest.approx(scene.load.strain, rel=1e-9)


def test_stresses_are_given_where_the_scene_names_them_and_only_there(knit, contacts, plain_scene):
    scene = plain_scene.vary({"fidelity": "rom2d", "rom.contacts_from": "dns-a"})
    with refusal(r"rom\.stress_from of scene .* is empty, and stresses are"):
        build(scene, knit, contacts=contacts, stresses=synthetic.stresses(knit, "course", INTERLOCK, LEG))


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
    with refusal(r"no resultant_direction: rom\.normal resultant needs"):
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
    with refusal(r"spring of the contacts along y is -6e\+04 N/m \(12 of 12"):
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
