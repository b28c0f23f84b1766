"""Swept yarns: sections, frames, places of slices, and the quality of hexahedra."""

from dataclasses import replace

import numpy as np
import pytest
from curves import Arc, Helix, Straight

from knitstudy.errors import MeshError
from knitstudy.knit.mesh import quality
from knitstudy.knit.mesh.section import Section, Spacing, place_slices
from knitstudy.knit.mesh.sweep import Targets, roll_towards, rotation_minimising, sweep


def volumes(mesh):
    """Volumes of hexahedra as the Jacobian at the centre times 8."""
    corner = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]])
    corner = np.vstack([corner, corner * [1, 1, -1]]) / 8
    return 8 * np.linalg.det(np.einsum("eci,cj->eij", mesh.nodes[mesh.hexahedra], corner))


@pytest.fixture
def two_yarns():
    return sweep([Straight(12.0), Straight(12.0, (0, 3.0, 0))], Section.butterfly(3, 1), 0.9, Spacing(0.5))


def test_numbering_follows_the_contract(two_yarns):
    mesh = two_yarns
    q = mesh.section.size
    assert mesh.first_slice.tolist() == [0, 25, 50]
    assert mesh.nodes.shape == (50 * q, 3)
    assert mesh.hexahedra.shape == (48 * mesh.section.quads.shape[0], 8)
    assert mesh.hexahedra.dtype == np.int32
    assert mesh.yarn_of_slice.tolist() == [0] * 25 + [1] * 25
    k, i, yarn = 7, 3, 1
    node = mesh.nodes[(mesh.first_slice[yarn] + i) * q + k]
    slice_ = mesh.first_slice[yarn] + i
    expected = mesh.centres[slice_] + 0.9 * mesh.section.points[k] @ mesh.frames[slice_, :2]
    np.testing.assert_allclose(node, expected, atol=1e-14)
    assert np.ptp(mesh.hexahedra, axis=1).max() == q + mesh.section.bandwidth


def test_ends_and_surface(two_yarns):
    mesh = two_yarns
    np.testing.assert_array_equal(mesh.nodes[mesh.slice_nodes(mesh.first_slice[:-1]).ravel(), 0], 0.0)
    np.testing.assert_array_equal(mesh.nodes[mesh.slice_nodes(mesh.first_slice[1:] - 1).ravel(), 0], 12.0)
    surface = mesh.nodes[mesh.surface_nodes(1)]
    assert surface.shape == (25, 12, 3)
    radius = np.linalg.norm(surface - mesh.centres[25:, None], axis=-1)
    np.testing.assert_allclose(radius, radius[0, 0], rtol=1e-14)
    quads = mesh.nodes[mesh.surface_quads(1)]
    normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    outward = quads.mean(axis=1) - [0, 3, 0]
    assert (np.einsum("fi,fi->f", normal, outward * [0, 1, 1]) > 0).all()


def test_volume_of_a_straight_yarn_is_the_cylinder_s():
    mesh = sweep([Straight(12.0)], Section.butterfly(4, 1), 0.9, Spacing(0.3))
    assert volumes(mesh).min() > 0
    assert volumes(mesh).sum() == pytest.approx(np.pi * 0.9**2 * 12, rel=1e-13)


def test_volume_of_a_bent_yarn_converges_to_that_of_a_tube():
    curve = Arc(2.5, 1.92)  # 12 and 24 elements
    exact = np.pi * 0.9**2 * curve.length  # Pappus
    meshes = [sweep([curve], Section.butterfly(4, 1), 0.9, Spacing(h)) for h in (0.4, 0.2)]
    errors = [abs(volumes(mesh).sum() / exact - 1) for mesh in meshes]
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)  # chords of slices: second order


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
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(MeshError, match=message):
        call()


def corner_sines(section):
    corners = section.points[section.quads]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cross = ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0]
    return cross / np.linalg.norm(ahead, axis=-1) / np.linalg.norm(behind, axis=-1)


def areas(section):
    p, q = (section.points[section.quads[:, i + 2]] - section.points[section.quads[:, i]] for i in (0, 1))
    return 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])


@pytest.mark.parametrize(("core", "rings"), [(3, 1), (4, 1), (4, 2), (5, 1), (6, 2), (8, 2)])
def test_elements_are_well_shaped(core, rings):
    section = Section.butterfly(core, rings)
    assert corner_sines(section).min() > np.sin(np.radians(54))  # interior angles between 54 and 126 degrees
    assert areas(section).max() < 1.6 * areas(section).min()


@pytest.mark.parametrize(("core", "rings"), [(3, 1), (4, 1), (6, 2)])
def test_polygon_has_the_area_of_the_disc(core, rings):
    section = Section.butterfly(core, rings)
    assert areas(section).sum() == pytest.approx(np.pi, rel=1e-14)
    np.testing.assert_allclose(np.diff(section.angles), 2 * np.pi / (4 * core), rtol=1e-13)
    radii = np.linalg.norm(section.points[section.ring], axis=1)
    assert np.ptp(radii) < 1e-14
    assert 1 < radii[0] < 1.025


def test_roll_is_the_smallest_that_brings_facets_under_the_targets():
    """Of a straight yarn along z: targets lie so many facets beyond a facet's middle."""
    angles = Section.butterfly(4, 1).angles
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
CORNERS = np.arange(8)[None]


def test_scaled_jacobian_of_simple_shapes():
    assert quality.scaled_jacobian(CUBE, CORNERS)[0] == pytest.approx(1.0)
    assert quality.scaled_jacobian(CUBE * [3, 0.2, 1], CORNERS)[0] == pytest.approx(1.0)
    shear = np.array([[1, 0, 1], [0, 1, 0], [0, 0, 1.0]])  # edges along z lean by 45 degrees
    assert quality.scaled_jacobian(CUBE @ shear.T, CORNERS)[0] == pytest.approx(np.sqrt(0.5))
    assert quality.scaled_jacobian(CUBE * [1, 1, -1], CORNERS)[0] == pytest.approx(-1.0)


def test_folded_element_is_refused_with_its_place():
    mesh = sweep([Arc(3.0, 2.0)], Section.butterfly(3, 1), 0.9, Spacing(0.5))
    layer = 5
    element = layer * mesh.section.quads.shape[0]
    nodes = mesh.nodes.copy()
    nodes[mesh.hexahedra[element, 0]] += 5 * mesh.frames[layer, 2]
    with pytest.raises(MeshError, match=rf"yarn 0 at s = {mesh.arc_length[layer]:.6g} m is folded"):
        quality.check_folding(replace(mesh, nodes=nodes))
    quality.check_folding(mesh)


def test_tight_bends_are_refused():
    quality.check_bending([Arc(0.91, 1.0)], radius=0.9)
    with pytest.raises(MeshError, match=r"yarn 1 bends .* radius of 0\.89 m; .* use a smaller yarn.diameter"):
        quality.check_bending([Arc(2.0, 1.0), Arc(0.89, 1.0)], radius=0.9)


@pytest.mark.parametrize(("gap", "overlap"), [(1.81, False), (1.79, False), (1.77, True)])
def test_overlap_of_two_yarns_beyond_the_tolerance(gap, overlap):
    curves = [Arc(5.0, 1.0), Arc(5.0, 1.0, y=gap)]
    if not overlap:
        quality.check_overlap(curves, radius=0.9, tolerance=0.01)
        return
    with pytest.raises(
        MeshError,
        match=r"yarn 0 at .* yarn 1 at .* overlap: their centrelines are 1\.77 m .* smaller yarn.diameter",
    ):
        quality.check_overlap(curves, radius=0.9, tolerance=0.01)


def test_a_yarn_may_not_meet_itself_but_may_turn_as_tight_as_its_radius():
    quality.check_overlap([Arc(0.905, np.pi)], radius=0.9)
    with pytest.raises(MeshError, match=r"yarn 0 at .* yarn 0 at .* overlap"):
        quality.check_overlap([Arc(3.0, 2 * np.pi)], radius=0.9)
