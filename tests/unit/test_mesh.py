"""Meshes of swept yarns: sections, slices, grading, quadratic elements, quality, places in elements."""

from dataclasses import replace

import numpy as np
import pytest
from curves import Arc, Helix, Straight
from refusals import refusal

from knitstudy.knit.mesh import quality
from knitstudy.knit.mesh.mesher import mesh_fabric
from knitstudy.knit.mesh.quadratic import quadratic_mesh
from knitstudy.knit.mesh.quality import check_folding
from knitstudy.knit.mesh.section import Grading, SectionMesh, Spacing, place_slices
from knitstudy.knit.mesh.sweep import Targets, roll_towards, rotation_minimising, sweep
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.solids.elements.hexahedron import (
    CORNERS,
    NATURAL,
    InverseMap,
    QuadraticHexahedron,
    natural_coordinates,
    quadratic_shape,
    shape,
)


def volumes(mesh):
    """Volumes of hexahedra as the Jacobian at the centre times 8."""
    corner = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]])
    corner = np.vstack([corner, corner * [1, 1, -1]]) / 8
    return 8 * np.linalg.det(np.einsum("eci,cj->eij", mesh.nodes[mesh.hexahedra], corner))


def test_volume_of_a_straight_yarn_is_the_cylinder_s():
    mesh = sweep([Straight(12.0)], SectionMesh.butterfly(4, 1), 0.9, Spacing(0.3))
    assert volumes(mesh).min() > 0
    assert volumes(mesh).sum() == pytest.approx(np.pi * 0.9**2 * 12, rel=1e-13)


def test_frames_turn_about_a_helix_by_its_total_torsion():
    helix = Helix(2.0, 1.0, 1.0)
    errors = []
    for count in (40, 80):
        s = np.linspace(0, helix.length, count + 1)
        d1 = rotation_minimising(helix.position(s), helix.tangent(s))[:, 0]
        t = s[-1] / helix.pace
        normal = -np.array([np.cos(t), np.sin(t), 0.0])
        binormal = np.cross(helix.tangent(s)[-1], normal)
        start = np.arctan2(d1[0] @ np.cross(helix.tangent(s)[0], [-1.0, 0, 0]), d1[0] @ [-1.0, 0, 0])
        end = np.arctan2(d1[-1] @ binormal, d1[-1] @ normal)
        torsion = helix.rise / helix.pace**2  # of the curve, rad/m; the frame falls behind the normal by it
        errors.append(abs(np.angle(np.exp(1j * (end - start + torsion * helix.length)))))
    assert errors[1] < 1e-5
    assert errors[0] / errors[1] > 2**3.5  # fourth order


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: place_slices(9.0, Spacing(1.0), centred=[4.0], ends=[4.2]), "-0.3 m between s = 4.5 m and"),
        (lambda: place_slices(9.0, Spacing(1.0), centred=[0.7, 4.5]), "between s = 0 m and s = 0.2 m"),
        (
            lambda: quality.check_bending([Arc(2.0, 1.0), Arc(0.89, 1.0)], radius=0.9),
            r"yarn 1 bends .* radius of 0\.89 m; .* use a smaller yarn.diameter",
        ),
        (
            lambda: quality.check_overlap([Arc(3.0, 2 * np.pi)], radius=0.9),
            "yarn 0 at .* yarn 0 at .* overlap",
        ),
        (
            lambda: GRADING.pull(np.zeros(3), np.array([0.0, 5.0]), np.zeros(2)),
            r"mesh.refinement: crossings 5 m apart .* too near for 3.*use 1",
        ),
    ],
)
def test_bad_input_is_refused(call, message):
    with refusal(message):
        call()


def test_a_yarn_may_bend_and_turn_as_tight_as_its_radius():
    quality.check_bending([Arc(0.91, 1.0)], radius=0.9)
    quality.check_overlap([Arc(0.905, np.pi)], radius=0.9)


def areas(section):
    p, q = (section.points[section.quads[:, i + 2]] - section.points[section.quads[:, i]] for i in (0, 1))
    return 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])


@pytest.mark.parametrize(("core", "rings"), [(3, 1), (4, 1), (6, 2)])
def test_polygon_has_the_area_of_the_disc(core, rings):
    section = SectionMesh.butterfly(core, rings)
    assert areas(section).sum() == pytest.approx(np.pi, rel=1e-14)
    np.testing.assert_allclose(np.diff(section.angles), 2 * np.pi / (4 * core), rtol=1e-13)
    radii = np.linalg.norm(section.points[section.ring], axis=1)
    assert np.ptp(radii) < 1e-14
    assert 1 < radii[0] < 1.025


def test_roll_is_the_smallest_that_brings_facets_under_the_targets():
    """Of a straight yarn along z: targets lie so many facets beyond a facet's middle."""
    angles = SectionMesh.butterfly(4, 1).angles
    step, where = 2 * np.pi / angles.size, np.array([3.1, 6.1, 9.1])
    bearing = angles[0] + step * (0.5 + np.array([0.3, 5.1, -3.4]))
    targets = Targets(where, np.stack([np.cos(bearing), np.sin(bearing), where], axis=-1))
    s = np.linspace(0.0, 12.0, 61)
    frames = np.broadcast_to(np.eye(3), (61, 3, 3))
    roll = roll_towards(targets, s, np.outer(s, [0, 0, 1]), frames, angles)
    np.testing.assert_allclose(np.interp(where, s, roll) / step, [0.3, 0.1, -0.4], atol=1e-12)
    # A cubic smooth step over the 14 layers between two targets is steepest in the middle, 1.5 times the mean slope.
    assert np.all(np.diff(roll) <= 0)
    assert np.abs(np.diff(roll)).max() / step == pytest.approx(0.5 * 1.5 / 14, rel=0.02)


def test_centred_arc_lengths_lie_in_the_middle_of_layers():
    spacing = Spacing(0.1, growth=2.0, stations=(2.03, 8.01), period=10.0, reach=0.5, ramp=1.0)
    s = place_slices(20.0, spacing, periods=2, centred=[2.03, 8.01, 12.03, 18.01])
    below = np.searchsorted(s, [2.03, 8.01, 12.03, 18.01]) - 1
    np.testing.assert_allclose(0.5 * (s[below] + s[below + 1]), [2.03, 8.01, 12.03, 18.01], rtol=1e-13)
    np.testing.assert_allclose(s[below + 1] - s[below], 0.1, rtol=1e-12)
    assert s[[0, -1]].tolist() == [0.0, 20.0]
    assert np.abs(s - 10.0).min() == 0.0
    ratio = np.diff(s) / spacing(0.5 * (s[1:] + s[:-1]))
    # The shortest part, 1.93 m beside a period's end, has some 14 elements: half of one to share out.
    assert np.abs(ratio - 1).max() < 0.5 / 13


def test_slices_stand_where_grips_end():
    s = place_slices(20.0, Spacing(0.3), periods=2, centred=[4.0], ends=[0.0, 1.23, 10.0, 17.7, 20.0])
    for end in (0.0, 1.23, 10.0, 17.7, 20.0):
        assert np.abs(s - end).min() == 0.0
    assert np.diff(s).min() > 0.5 * 0.3, "an end of a period that is one of a grip counts once"
    assert np.abs(0.5 * (s[1:] + s[:-1]) - 4.0).min() < 1e-12


CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float
)
ELEMENT = np.arange(8)[None]


def test_scaled_jacobian_of_simple_shapes():
    assert quality.scaled_jacobian(CUBE, ELEMENT)[0] == pytest.approx(1.0)
    assert quality.scaled_jacobian(CUBE * [3, 0.2, 1], ELEMENT)[0] == pytest.approx(1.0)
    shear = np.array([[1, 0, 1], [0, 1, 0], [0, 0, 1.0]])  # edges along z lean by 45 degrees
    assert quality.scaled_jacobian(CUBE @ shear.T, ELEMENT)[0] == pytest.approx(np.sqrt(0.5))
    assert quality.scaled_jacobian(CUBE * [1, 1, -1], ELEMENT)[0] == pytest.approx(-1.0)


def test_folded_element_is_refused_with_its_place():
    mesh = sweep([Arc(3.0, 2.0)], SectionMesh.butterfly(3, 1), 0.9, Spacing(0.5))
    layer = 5
    element = layer * mesh.section.quads.shape[0]
    nodes = mesh.nodes.copy()
    nodes[mesh.hexahedra[element, 0]] += 5 * mesh.frames[layer, 2]
    with refusal(rf"yarn 0 at s = {mesh.arc_length[layer]:.6g} m is folded"):
        quality.check_folding(replace(mesh, nodes=nodes))
    quality.check_folding(mesh)


@pytest.mark.parametrize(("gap", "overlap"), [(1.81, False), (1.79, False), (1.77, True)])
def test_overlap_of_two_yarns_beyond_the_tolerance(gap, overlap):
    curves = [Arc(5.0, 1.0), Arc(5.0, 1.0, y=gap)]
    if not overlap:
        quality.check_overlap(curves, radius=0.9, tolerance=0.01)
        return
    with refusal(
        r"yarn 0 at .* yarn 1 at .* overlap: their centrelines are 1\.77 m .* smaller yarn.diameter"
    ):
        quality.check_overlap(curves, radius=0.9, tolerance=0.01)


RADIUS, SIZE = 0.9e-3, 1 / 3
GRADING = Grading(3.0, reach=1.0, ramp=2.0)


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


def test_sizes_that_leave_no_room_between_crossings_are_refused(knit):
    with refusal(r"mesh size: .* use a smaller mesh\.size"):
        mesh_fabric(knit, 2.9)


RADIUS_QUADRATIC = 0.9
CURVES = (Helix(3.0, 0.5, 0.5), Straight(6.0, (0, 20.0, 0)))


@pytest.fixture(scope="module")
def swept():
    return sweep(CURVES, SectionMesh.butterfly(3, 1), RADIUS_QUADRATIC, Spacing(0.5))


@pytest.fixture(scope="module")
def mesh(swept):
    return quadratic_mesh(swept, CURVES)


def test_surface_nodes_lie_on_the_true_tube(mesh):
    for grid, curve in zip(mesh.grids, CURVES, strict=True):
        s = np.linspace(0, curve.length, len(grid)) if isinstance(curve, Straight) else None
        # Nodes of a station share the plane of its section, whose centre the mean of opposite nodes is.
        ring = mesh.nodes[grid[:, ::2]]
        centre = ring.mean(axis=1)
        on_station = mesh.nodes[grid]
        real = ~np.isin(grid, mesh.face_centres)
        away = np.linalg.norm(on_station - centre[:, None], axis=-1)
        np.testing.assert_allclose(away[real], RADIUS_QUADRATIC, rtol=1e-12)
        np.testing.assert_allclose(away, RADIUS_QUADRATIC, rtol=2e-3)
        if s is not None:
            np.testing.assert_allclose(centre[:, 0], s, atol=1e-12)


def test_the_volume_is_that_of_the_tube(mesh):
    elements = QuadraticHexahedron(mesh.nodes[mesh.elements], Hencky(1.0, 0.4))
    tube = np.pi * RADIUS_QUADRATIC**2 * sum(curve.length for curve in CURVES)
    assert elements.volume.sum() == pytest.approx(tube, rel=1e-3)


def test_folded_elements_are_refused(swept):
    with refusal(r"quadratic hexahedron \d+ of yarn 0 at s = .* folded"):
        quadratic_mesh(replace(swept, radius=4.0), CURVES)


KINDS = pytest.mark.parametrize("shape", [shape, quadratic_shape], ids=["linear", "quadratic"])


def bent(shape, count):
    """Elements that are no boxes."""
    natural = CORNERS if shape(np.zeros((1, 3))).shape[1] == 8 else NATURAL
    rng = np.random.default_rng(3)
    return natural + 0.15 * rng.normal(size=(count, len(natural), 3))


@KINDS
def test_the_inverse_of_the_map(shape):
    corners = bent(shape, 50)
    natural = np.random.default_rng(4).uniform(-1.1, 1.1, (50, 3))
    points = np.einsum("ka,kai->ki", shape(natural), corners)
    np.testing.assert_allclose(natural_coordinates(corners, points, shape), natural, atol=1e-9)


@pytest.fixture
def row():
    """Two yarns of three cubes each, one above the other."""
    x, y, z = np.meshgrid(np.arange(4.0), [0.0, 1.0], [0.0, 1.0], indexing="ij")
    nodes = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    first = np.array([0, 4, 6, 2, 1, 5, 7, 3]) + 4 * np.arange(3)[:, None]
    return InverseMap(
        np.concatenate([nodes, nodes + np.array([0, 0, 1.5])]),
        np.concatenate([first, first + 16]),
        np.repeat([0, 1], 16),
        shape,
    )


def test_points_in_and_beside_elements_are_sums_of_nodes(row):
    points = np.array([[0.2, 0.4, 0.5], [2.9, 0.1, 0.7], [1.5, 0.5, 1.25], [1.5, 0.5, 1.25]])
    nodes, weight = row.locate(points, np.array([0, 0, 0, 1]))
    np.testing.assert_allclose(np.einsum("ka,kai->ki", weight, row.nodes[nodes]), points, atol=1e-12)
    np.testing.assert_allclose(weight.sum(axis=1), 1)
    assert row.yarn[nodes].tolist() == [[0] * 8, [0] * 8, [0] * 8, [1] * 8]
    assert weight[:2].min() >= 0


def test_points_far_from_their_yarn_are_refused(row):
    with refusal(r"\(1, 0.5, 9\) is too far from yarn 0"):
        row.locate(np.array([[1.0, 0.5, 9.0]]), np.array([0]))
